//! The driver's task: opens the port, greets the firmware, serves it, and begins again when it is lost.

use std::sync::Arc;
use std::time::Duration;

use devices::LightError;
use futures::future::Either;
use tokio::sync::mpsc::UnboundedReceiver;

use crate::config::LightSerialConfig;
use crate::error::LinkError;
use crate::greeting::greet;
use crate::job::Job;
use crate::line::Line;
use crate::session::{End, Session};
use crate::shared::Shared;

const FIRST_PAUSE: Duration = Duration::from_millis(100);
const LONGEST_PAUSE: Duration = Duration::from_secs(2);
/// A firmware that does not fit stays so until somebody uploads another.
const PAUSE_AFTER_OTHER_FIRMWARE: Duration = Duration::from_secs(5);

/// Nobody holds the controller any more.
struct Closed;

/// Runs until the controller is dropped.
pub(crate) async fn serve(config: LightSerialConfig, mut jobs: UnboundedReceiver<Job>, shared: Arc<Shared>) {
    let mut pause = FIRST_PAUSE;
    let mut told = String::new();
    loop {
        let Err(error) = connect_and_serve(&config, &mut jobs, &shared, &mut pause).await else {
            return;
        };
        let reason = error.to_string();
        report(&shared, &reason, &told);
        told.clone_from(&reason);
        let wait = match error {
            LinkError::OtherFirmware { .. } => PAUSE_AFTER_OTHER_FIRMWARE,
            _ => pause,
        };
        if let Err(Closed) = refuse_jobs_during(tokio::time::sleep(wait), &mut jobs, &reason).await {
            return;
        }
        pause = (pause * 2).min(LONGEST_PAUSE);
    }
}

/// A failure is told once, however often it is met.
fn report(shared: &Shared, reason: &str, told: &str) {
    if reason == told {
        tracing::debug!(reason, "still no light controller");
    } else {
        tracing::warn!(reason, "no light controller; trying again");
    }
    shared.fault(reason.to_owned());
    shared.tell_disconnected(reason.to_owned());
}

/// Returns without an error when the controller is closed.
async fn connect_and_serve(
    config: &LightSerialConfig,
    jobs: &mut UnboundedReceiver<Job>,
    shared: &Arc<Shared>,
    pause: &mut Duration,
) -> Result<(), LinkError> {
    let mut line = Line::open(&config.port, Arc::clone(shared))?;
    let mut reason = format!("the controller at port {} is being greeted", line.port());
    loop {
        let greeted = match refuse_jobs_during(greet(&mut line), jobs, &reason).await {
            Ok(greeted) => greeted?,
            Err(Closed) => return Ok(()),
        };
        *pause = FIRST_PAUSE;
        match Session::new(&mut line, greeted, shared).run(jobs).await {
            Ok(End::Closed) => return Ok(()),
            Ok(End::Reset { cause }) => {
                let error = LinkError::Reset {
                    port: line.port().to_owned(),
                    cause,
                };
                reason = error.to_string();
                tracing::warn!(reason, "greeting it again");
                shared.count(|statistics| statistics.firmware_resets += 1);
                shared.fault(reason.clone());
                shared.tell_disconnected(reason.clone());
            }
            Err(error) => return Err(error),
        }
    }
}

/// Whoever asks for something meanwhile is told at once that there is no controller, and why.
async fn refuse_jobs_during<T>(
    work: impl Future<Output = T>,
    jobs: &mut UnboundedReceiver<Job>,
    reason: &str,
) -> Result<T, Closed> {
    let mut work = std::pin::pin!(work);
    loop {
        let job = std::pin::pin!(jobs.recv());
        match futures::future::select(work.as_mut(), job).await {
            Either::Left((done, _)) => return Ok(done),
            Either::Right((Some(job), _)) => job.fail(LightError::Disconnected { reason: reason.into() }),
            Either::Right((None, _)) => return Err(Closed),
        }
    }
}
