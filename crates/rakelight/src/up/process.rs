//! One process of the cell, from its start to its end.

use std::ffi::OsString;
use std::io;
use std::os::unix::process::ExitStatusExt;
use std::process::{ExitStatus, Stdio};
use std::sync::Arc;
use std::time::Duration;

use parking_lot::Mutex;
use tokio::io::{AsyncBufReadExt, AsyncRead, BufReader};
use tokio::process::{Child, ChildStdin, Command};
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

use super::console::Console;

/// Output that a dead process's own children may still hold open is not waited for longer than this.
const LAST_WORDS: Duration = Duration::from_millis(500);

/// What a process is started with.
#[derive(Debug, Clone)]
pub(super) struct Job {
    pub(super) name: String,
    /// Position among the processes, for its colour.
    pub(super) index: usize,
    /// Of the rakelight command line.
    pub(super) arguments: Vec<OsString>,
}

/// A running process. It ends when this is dropped.
pub(super) struct Process {
    child: Child,
    /// Closing it asks the process to end.
    stdin: Option<ChildStdin>,
    readers: [JoinHandle<()>; 2],
    last_error: Arc<Mutex<String>>,
}

impl Process {
    /// Starts it. `ready` is what it says on its standard output: "ready", or "rendering" when it is no longer.
    pub(super) fn start(job: &Job, console: &Arc<Console>, ready: &watch::Sender<bool>) -> io::Result<Self> {
        let mut child = Command::new(std::env::current_exe()?)
            .args(&job.arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            // Ctrl-C on the terminal goes to the supervisor alone: it takes the processes down in order.
            .process_group(0)
            .kill_on_drop(true)
            .spawn()?;
        let last_error = Arc::<Mutex<String>>::default();
        let (output, errors) = (child.stdout.take(), child.stderr.take());
        let (ready, kept) = (ready.clone(), Arc::clone(&last_error));
        let out = read_lines(output, job, console, move |line| {
            if line == "ready" || line == "rendering" {
                ready.send_replace(line == "ready");
            }
        });
        let err = read_lines(errors, job, console, move |line| line.clone_into(&mut kept.lock()));
        Ok(Self {
            stdin: child.stdin.take(),
            child,
            readers: [out, err],
            last_error,
        })
    }

    pub(super) fn pid(&self) -> u32 {
        self.child.id().unwrap_or(0)
    }

    /// Waits until it ends by itself. Cancel safe.
    pub(super) async fn wait(&mut self) -> io::Result<ExitStatus> {
        let status = self.child.wait().await?;
        for reader in &mut self.readers {
            // Cut short when somebody else holds the pipe.
            let _ = tokio::time::timeout(LAST_WORDS, reader).await;
        }
        Ok(status)
    }

    /// The last line that it wrote to its standard error.
    pub(super) fn last_error(&self) -> String {
        self.last_error.lock().clone()
    }

    /// Asks it to end and waits; after `patience`, or at once when `kill` is cancelled, kills it. Gives whether it ended
    /// by itself.
    pub(super) async fn end(mut self, patience: Duration, kill: &CancellationToken) -> bool {
        self.stdin = None;
        tokio::select! {
            ended = tokio::time::timeout(patience, self.wait()) => {
                if ended.is_ok() {
                    return true;
                }
            }
            () = kill.cancelled() => {}
        }
        // An error means that it has ended just now.
        let _ = self.child.kill().await;
        false
    }
}

/// How a process ended, for people.
pub(super) fn describe(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("exit code {code}"),
        (None, Some(signal)) => format!("signal {signal}"),
        (None, None) => status.to_string(),
    }
}

fn read_lines(
    pipe: Option<impl AsyncRead + Unpin + Send + 'static>,
    job: &Job,
    console: &Arc<Console>,
    mut heard: impl FnMut(&str) + Send + 'static,
) -> JoinHandle<()> {
    let (name, index, console) = (job.name.clone(), job.index, Arc::clone(console));
    tokio::spawn(async move {
        let Some(pipe) = pipe else { return };
        let mut pipe = BufReader::new(pipe);
        let mut line = Vec::new();
        // Bytes rather than text: a child may say anything, and its pipe must never fill up.
        while matches!(pipe.read_until(b'\n', &mut line).await, Ok(read) if read > 0) {
            let text = String::from_utf8_lossy(&line);
            let text = text.trim_end();
            heard(text);
            console.relay(index, &name, text);
            line.clear();
        }
    })
}
