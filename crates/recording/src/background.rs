//! Writing a bag on a thread of its own, behind a queue with a limit.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::error::RecordingError;
use crate::writer::{BagWriter, TopicId};

/// What a process that dies may lose: messages that came within this time and do not fill a chunk.
const FLUSH_PERIOD: Duration = Duration::from_secs(1);

/// Below everything that takes part in a capture.
const NICENESS: i32 = 10;

/// A bag that is written in the background.
///
/// Whoever has messages holds an [`Inlet`] and is never blocked by the disk: a message that does not fit into the queue
/// any more is dropped and counted. Messages may be handed in as they are and are serialised on the writing thread,
/// which has a low priority.
///
/// Messages reach the file at the latest a second after they were taken from the queue. When the disk refuses, the bag
/// ends there, readable, [`Inlet::failure`] says why, and what still comes counts as dropped.
pub struct BackgroundWriter {
    inlet: Inlet,
    thread: JoinHandle<Result<(), RecordingError>>,
}

/// Where messages go in. Clones feed the same bag.
#[derive(Clone)]
pub struct Inlet {
    commands: Sender<Command>,
    shared: Arc<Shared>,
}

/// How far a bag is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Progress {
    /// Messages that were written; a failure of the disk may take the last of them away again.
    pub written: u64,
    /// Their serialised size in bytes.
    pub written_bytes: u64,
    /// Messages that will not be in the bag: the queue was full, or the bag has ended.
    pub dropped: u64,
    /// Messages that could not be serialised.
    pub refused: u64,
    /// Bytes that wait in the queue.
    pub queued_bytes: usize,
    /// Messages that are in the file for good.
    pub safe_messages: u64,
    /// Size of the file in bytes, without its index.
    pub file_bytes: u64,
}

enum Command {
    Write(Queued),
    Finish,
}

struct Queued {
    topic: TopicId,
    log_time: u64,
    bytes: usize,
    serialise: Box<dyn FnOnce() -> Option<Vec<u8>> + Send>,
}

struct Shared {
    max_queued_bytes: usize,
    queued_bytes: AtomicUsize,
    written: AtomicU64,
    written_bytes: AtomicU64,
    dropped: AtomicU64,
    refused: AtomicU64,
    safe_messages: AtomicU64,
    file_bytes: AtomicU64,
    failure: OnceLock<String>,
}

impl BackgroundWriter {
    /// Starts the thread. Topics are added to the writer before. `on_failure` is called on that thread when the disk
    /// refuses.
    pub fn start(
        mut writer: BagWriter,
        max_queued_bytes: usize,
        on_failure: impl FnOnce() + Send + 'static,
    ) -> Result<Self, RecordingError> {
        // Topics without a message are in the file, too, and a first chunk that is damaged does not take all of them.
        writer.flush()?;
        let (commands, receiver) = mpsc::channel();
        let shared = Arc::new(Shared::new(max_queued_bytes));
        let folder = writer.folder().to_owned();
        let worker = Worker {
            writer,
            shared: Arc::clone(&shared),
            flush_at: None,
        };
        let thread = std::thread::Builder::new()
            .name("bag writer".to_owned())
            .spawn(move || worker.run(&receiver, on_failure))
            .map_err(|source| RecordingError::Io { path: folder, source })?;
        let inlet = Inlet { commands, shared };
        Ok(Self { inlet, thread })
    }

    /// A place to hand messages in.
    pub fn inlet(&self) -> Inlet {
        self.inlet.clone()
    }

    /// Writes what is queued and ends the bag. Blocks until the disk has it.
    pub fn finish(self) -> Result<Progress, RecordingError> {
        // The thread is gone only when it has ended by itself.
        let _ = self.inlet.commands.send(Command::Finish);
        let outcome = self.thread.join();
        let progress = self.inlet.progress();
        match outcome {
            Ok(outcome) => outcome.map(|()| progress),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    }
}

impl Inlet {
    /// Hands in a message of about `bytes` bytes that `serialise` gives when its turn comes; `None` is counted as
    /// refused. False when the message was dropped.
    pub fn offer(
        &self,
        topic: TopicId,
        log_time: u64,
        bytes: usize,
        serialise: impl FnOnce() -> Option<Vec<u8>> + Send + 'static,
    ) -> bool {
        let queued = Queued {
            topic,
            log_time,
            bytes,
            serialise: Box::new(serialise),
        };
        let taken = self.shared.reserve(bytes) && self.commands.send(Command::Write(queued)).is_ok();
        if !taken {
            self.shared.dropped.fetch_add(1, Ordering::Relaxed);
        }
        taken
    }

    /// How far the bag is.
    pub fn progress(&self) -> Progress {
        let shared = &self.shared;
        Progress {
            written: shared.written.load(Ordering::Relaxed),
            written_bytes: shared.written_bytes.load(Ordering::Relaxed),
            dropped: shared.dropped.load(Ordering::Relaxed),
            refused: shared.refused.load(Ordering::Relaxed),
            queued_bytes: shared.queued_bytes.load(Ordering::Relaxed),
            safe_messages: shared.safe_messages.load(Ordering::Relaxed),
            file_bytes: shared.file_bytes.load(Ordering::Relaxed),
        }
    }

    /// Why the bag ended before its time, if it did.
    pub fn failure(&self) -> Option<&str> {
        self.shared.failure.get().map(String::as_str)
    }
}

impl Shared {
    fn new(max_queued_bytes: usize) -> Self {
        Self {
            max_queued_bytes,
            queued_bytes: AtomicUsize::new(0),
            written: AtomicU64::new(0),
            written_bytes: AtomicU64::new(0),
            dropped: AtomicU64::new(0),
            refused: AtomicU64::new(0),
            safe_messages: AtomicU64::new(0),
            file_bytes: AtomicU64::new(0),
            failure: OnceLock::new(),
        }
    }

    /// Takes room in the queue. A message larger than all of it fits when nothing else is there.
    fn reserve(&self, bytes: usize) -> bool {
        let add = |queued: usize| {
            let fits = queued == 0 || queued.saturating_add(bytes) <= self.max_queued_bytes;
            fits.then_some(queued.saturating_add(bytes))
        };
        self.failure.get().is_none()
            && self
                .queued_bytes
                .fetch_update(Ordering::Relaxed, Ordering::Relaxed, add)
                .is_ok()
    }
}

struct Worker {
    writer: BagWriter,
    shared: Arc<Shared>,
    /// When what no chunk in the file holds yet goes there.
    flush_at: Option<Instant>,
}

impl Worker {
    fn run(mut self, commands: &Receiver<Command>, on_failure: impl FnOnce()) -> Result<(), RecordingError> {
        // Not allowed to be nicer? Then it works as before, only with more of the processor.
        let _ = rustix::process::nice(NICENESS);
        // Flushed first, so that the counts hold whatever becomes of the rest.
        let served = self.serve(commands).and_then(|()| self.flush());
        let outcome = served.and_then(|()| self.writer.finish());
        if let Err(error) = &outcome {
            let _ = self.shared.failure.set(error.to_string());
            on_failure();
            // What is queued now comes too late; what is offered from now on is not taken.
            let late = commands
                .try_iter()
                .filter(|command| matches!(command, Command::Write(_)));
            self.shared.dropped.fetch_add(late.count() as u64, Ordering::Relaxed);
            self.shared.queued_bytes.store(0, Ordering::Relaxed);
        }
        outcome
    }

    /// Writes until it is told to finish or nobody is left to tell it.
    fn serve(&mut self, commands: &Receiver<Command>) -> Result<(), RecordingError> {
        loop {
            let now = Instant::now();
            if self.flush_at.is_some_and(|at| at <= now) {
                self.flush()?;
            }
            let command = match self.flush_at {
                Some(at) => commands.recv_timeout(at - now),
                None => commands.recv().map_err(|_| RecvTimeoutError::Disconnected),
            };
            match command {
                Ok(Command::Write(queued)) => self.write(queued)?,
                Err(RecvTimeoutError::Timeout) => {}
                Ok(Command::Finish) | Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
        }
    }

    fn write(&mut self, queued: Queued) -> Result<(), RecordingError> {
        let cdr = (queued.serialise)();
        let written = match &cdr {
            Some(cdr) => self.writer.write(queued.topic, queued.log_time, cdr),
            None => Ok(()),
        };
        self.shared.queued_bytes.fetch_sub(queued.bytes, Ordering::Relaxed);
        self.count(cdr.as_deref());
        written?;
        let flush_at = self.flush_at.unwrap_or_else(|| Instant::now() + FLUSH_PERIOD);
        self.flush_at = self.writer.is_pending().then_some(flush_at);
        Ok(())
    }

    fn flush(&mut self) -> Result<(), RecordingError> {
        self.flush_at = None;
        let flushed = self.writer.flush();
        self.count_safe();
        flushed
    }

    fn count(&self, cdr: Option<&[u8]>) {
        match cdr {
            Some(cdr) => {
                self.shared.written.fetch_add(1, Ordering::Relaxed);
                self.shared.written_bytes.fetch_add(cdr.len() as u64, Ordering::Relaxed);
            }
            None => drop(self.shared.refused.fetch_add(1, Ordering::Relaxed)),
        }
        self.count_safe();
    }

    fn count_safe(&self) {
        self.shared
            .safe_messages
            .store(self.writer.safe_messages(), Ordering::Relaxed);
        self.shared
            .file_bytes
            .store(self.writer.safe_bytes(), Ordering::Relaxed);
    }
}
