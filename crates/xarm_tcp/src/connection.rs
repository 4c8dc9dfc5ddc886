//! The driver's task: connects, greets the controller, serves it, and begins again when it is lost.

use std::sync::Arc;
use std::time::Duration;

use devices::ArmError;
use futures::future::Either;
use tokio::sync::mpsc::UnboundedReceiver;

use crate::config::XArmConfig;
use crate::error::LinkError;
use crate::greeting::greet;
use crate::job::Job;
use crate::session::Session;
use crate::shared::Shared;

const FIRST_PAUSE: Duration = Duration::from_millis(100);
const LONGEST_PAUSE: Duration = Duration::from_millis(500);
/// An arm that does not fit stays so until somebody changes it.
const PAUSE_AFTER_OTHER_ARM: Duration = Duration::from_secs(5);

/// Nobody holds the arm any more.
struct Closed;

/// Runs until the arm is dropped.
pub(crate) async fn serve(config: XArmConfig, mut jobs: UnboundedReceiver<Job>, shared: Arc<Shared>) {
    let mut pause = FIRST_PAUSE;
    let mut told = String::new();
    loop {
        let Err(error) = connect_and_serve(&config, &mut jobs, &shared, &mut pause).await else {
            shared.disconnect("the driver was closed".to_owned());
            return;
        };
        let reason = error.to_string();
        report(&shared, &reason, &told);
        told.clone_from(&reason);
        let wait = if error.is_lasting() {
            PAUSE_AFTER_OTHER_ARM
        } else {
            pause
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
        tracing::debug!(reason, "still no arm");
    } else {
        tracing::warn!(reason, "no arm; trying again");
    }
    shared.disconnect(reason.to_owned());
}

/// Returns without an error when the arm is closed.
async fn connect_and_serve(
    config: &XArmConfig,
    jobs: &mut UnboundedReceiver<Job>,
    shared: &Arc<Shared>,
    pause: &mut Duration,
) -> Result<(), LinkError> {
    let reason = format!("{}:{} is being connected", config.host, config.control_port);
    let (link, task) = match refuse_jobs_during(greet(config), jobs, &reason).await {
        Ok(greeted) => greeted?,
        Err(Closed) => return Ok(()),
    };
    *pause = FIRST_PAUSE;
    Session::new(config, link, task, shared).run(jobs).await
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
            Either::Right((Some(job), _)) => job.fail(ArmError::Disconnected { reason: reason.into() }),
            Either::Right((None, _)) => return Err(Closed),
        }
    }
}
