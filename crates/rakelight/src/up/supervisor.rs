//! Keeps the processes of a cell alive, and takes them down in order.

use std::io;
use std::process::ExitStatus;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::anyhow;
use futures::StreamExt;
use futures::future::{FutureExt, LocalBoxFuture};
use futures::stream::FuturesUnordered;
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;

use super::backoff::Backoff;
use super::console::{Console, Event};
use super::process::{Job, Process, describe};
use crate::failure::Failure;

/// Bad usage or configuration: starting it again changes nothing.
const USAGE: i32 = 2;

/// Processes are taken down stage by stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Stage {
    /// Whatever makes or uses data.
    Nodes,
    /// What writes it down.
    Recorder,
    /// What the drivers are connected to.
    Simulator,
}

impl Stage {
    const ALL: [Self; 3] = [Self::Nodes, Self::Recorder, Self::Simulator];

    /// How long a process may take to end after it was asked.
    fn patience(self) -> Duration {
        match self {
            Self::Nodes | Self::Simulator => Duration::from_secs(6),
            // A long bag's index is written at the end.
            Self::Recorder => Duration::from_secs(12),
        }
    }
}

/// A process that is to be kept alive.
#[derive(Debug, Clone)]
pub(super) struct Member {
    pub(super) job: Job,
    pub(super) nodes: Vec<String>,
    pub(super) stage: Stage,
}

/// How a member ended for good.
#[derive(Debug)]
enum End {
    /// It was asked to.
    Stopped,
    /// Its nodes have nothing left to do.
    Finished,
    /// It cannot run.
    Failed(Failure),
}

struct Running {
    member: Member,
    stop: CancellationToken,
    ended: bool,
}

/// The processes of a cell. They end when this is dropped.
pub(super) struct Supervisor {
    console: Arc<Console>,
    running: Vec<Running>,
    /// Polled by the caller's own task alone: the kernel ties a child to the thread that started it.
    lives: FuturesUnordered<LocalBoxFuture<'static, (usize, End)>>,
    kill: CancellationToken,
    /// Counts starts, so that others can ask again who is there.
    starts: watch::Sender<u64>,
}

impl Supervisor {
    pub(super) fn new(console: Arc<Console>) -> Self {
        Self {
            console,
            running: Vec::new(),
            lives: FuturesUnordered::new(),
            kill: CancellationToken::new(),
            starts: watch::Sender::new(0),
        }
    }

    /// Adds a process; it runs while [`Self::next_end`] is polled. What is given back says whether it is ready, if it ever
    /// tells.
    pub(super) fn start(&mut self, member: Member) -> watch::Receiver<bool> {
        let (ready, is_ready) = watch::channel(false);
        let stop = CancellationToken::new();
        let life = Life {
            member: member.clone(),
            console: Arc::clone(&self.console),
            stop: stop.clone(),
            kill: self.kill.clone(),
            ready,
            starts: self.starts.clone(),
            has_run: false,
        };
        let index = self.running.len();
        self.lives.push(life.run().map(move |end| (index, end)).boxed_local());
        self.running.push(Running {
            member,
            stop,
            ended: false,
        });
        is_ready
    }

    /// Changes with every start of a process.
    pub(super) fn starts(&self) -> watch::Receiver<u64> {
        self.starts.subscribe()
    }

    /// Keeps the processes alive until one cannot be, or all have finished. Cancel safe.
    pub(super) async fn next_end(&mut self) -> Result<(), Failure> {
        while let Some((index, end)) = self.lives.next().await {
            self.running[index].ended = true;
            if let End::Failed(failure) = end {
                return Err(failure);
            }
            let simulator = |running: &Running| running.member.stage == Stage::Simulator;
            if self.running.iter().all(|running| running.ended || simulator(running)) {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Takes everything down, stage by stage; bounded in time.
    pub(super) async fn stop(&mut self) {
        for stage in Stage::ALL {
            let of_stage = |running: &Running| running.member.stage == stage;
            self.running
                .iter()
                .filter(|r| of_stage(r))
                .for_each(|running| running.stop.cancel());
            while self.running.iter().any(|running| of_stage(running) && !running.ended) {
                match self.lives.next().await {
                    Some((index, _)) => self.running[index].ended = true,
                    None => return,
                }
            }
        }
    }

    /// Makes [`Self::stop`] end at once.
    pub(super) fn killer(&self) -> CancellationToken {
        self.kill.clone()
    }
}

/// A process again and again.
struct Life {
    member: Member,
    console: Arc<Console>,
    stop: CancellationToken,
    kill: CancellationToken,
    ready: watch::Sender<bool>,
    starts: watch::Sender<u64>,
    /// It was ready once.
    has_run: bool,
}

impl Life {
    async fn run(mut self) -> End {
        let mut backoff = Backoff::new();
        loop {
            let born = Instant::now();
            let how = match self.once().await {
                Ok(how) => how,
                Err(end) => return end,
            };
            let pause = backoff.after(born.elapsed());
            self.console.tell(&Event::Died {
                process: &self.member.job.name,
                how,
                restart_in_seconds: pause.as_secs_f64(),
            });
            tokio::select! {
                () = tokio::time::sleep(pause) => {}
                () = self.stop.cancelled() => return End::Stopped,
            }
        }
    }

    /// One life. Gives how it died if it is to be started again.
    async fn once(&mut self) -> Result<String, End> {
        self.has_run |= self.ready.send_replace(false);
        let name = &self.member.job.name;
        let cannot_start = |error: io::Error| End::Failed(Failure::from(anyhow!("cannot start {name}: {error}")));
        let mut process = Process::start(&self.member.job, &self.console, &self.ready).map_err(cannot_start)?;
        self.console.tell(&Event::Started {
            process: name,
            pid: process.pid(),
            nodes: &self.member.nodes,
        });
        self.starts.send_modify(|count| *count += 1);
        tokio::select! {
            biased;
            () = self.stop.cancelled() => {}
            status = process.wait() => return self.verdict(status, &process.last_error()),
        }
        if !process.end(self.member.stage.patience(), &self.kill).await {
            self.console.tell(&Event::Killed { process: name });
        }
        Err(End::Stopped)
    }

    fn verdict(&self, status: io::Result<ExitStatus>, last_error: &str) -> Result<String, End> {
        let name = &self.member.job.name;
        let said = last_error.strip_prefix("rakelight: ").unwrap_or(last_error);
        let status = status.map_err(|error| End::Failed(Failure::from(anyhow!("{name}: {error}"))))?;
        match status.code() {
            Some(0) if self.member.stage != Stage::Simulator => {
                self.console.tell(&Event::Finished { process: name });
                Err(End::Finished)
            }
            Some(USAGE) => Err(End::Failed(Failure::usage(anyhow!("{name}: {said}")))),
            // Nothing is connected to a simulator that never ran: this is about its start.
            Some(_) if self.member.stage == Stage::Simulator && !self.has_run && !*self.ready.borrow() => Err(
                End::Failed(Failure::from(anyhow!("the simulator cannot start: {said}"))),
            ),
            _ => Ok(describe(status)),
        }
    }
}
