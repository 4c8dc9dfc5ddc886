//! When a process of the cell is to end: Ctrl-C, a signal, or the end of its standard input.

use std::io::Read;
use std::process;
use std::thread;
use std::time::Duration;

use rustix::process::{Signal, set_parent_process_death_signal};
use tokio::signal::unix::{self, SignalKind};
use tokio::sync::oneshot;

/// A process that was asked to end and has not ended by itself after this long is stopped the hard way. A bag that is
/// finished on a busy machine has its time.
const PATIENCE: Duration = Duration::from_secs(10);

/// Signals that ask a process to end in good order.
pub(crate) struct Signals {
    interrupt: unix::Signal,
    terminate: unix::Signal,
    hang_up: unix::Signal,
}

impl Signals {
    /// From now on these signals no longer kill the process.
    pub(crate) fn listen() -> std::io::Result<Self> {
        Ok(Self {
            interrupt: unix::signal(SignalKind::interrupt())?,
            terminate: unix::signal(SignalKind::terminate())?,
            hang_up: unix::signal(SignalKind::hangup())?,
        })
    }

    /// Waits for the next one. Cancel safe.
    pub(crate) async fn next(&mut self) {
        tokio::select! {
            _ = self.interrupt.recv() => {}
            _ = self.terminate.recv() => {}
            _ = self.hang_up.recv() => {}
        }
    }
}

/// Waits until this process is asked to end, and then sees to it that it does within [`PATIENCE`].
///
/// With `with_stdin` the end of standard input asks too: a pipe from the parent closes when the parent dies, in
/// whatever way.
pub(crate) async fn asked_to_end(with_stdin: bool) -> std::io::Result<()> {
    let mut signals = Signals::listen()?;
    if with_stdin {
        // For a child that cannot read its input any more; a dying parent's pipe says the same in good order.
        set_parent_process_death_signal(Some(Signal::TERM))?;
        tokio::select! {
            () = signals.next() => {}
            () = end_of_input() => {}
        }
    } else {
        signals.next().await;
    }
    stop_hard_after(PATIENCE);
    Ok(())
}

/// Waits for the end of standard input, on a thread of its own: tokio's would keep the runtime from ending.
pub(crate) async fn end_of_input() {
    let (ended, end) = oneshot::channel::<()>();
    thread::spawn(move || {
        let mut input = std::io::stdin().lock();
        let mut passed_over = [0; 256];
        while matches!(input.read(&mut passed_over), Ok(read) if read > 0) {}
        drop(ended);
    });
    // An error means that the thread is gone, which is the end as well.
    let _ = end.await;
}

fn stop_hard_after(patience: Duration) {
    thread::spawn(move || {
        thread::sleep(patience);
        eprintln!("rakelight: did not end within {patience:?}; stopped the hard way");
        process::exit(1);
    });
}
