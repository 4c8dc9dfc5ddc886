//! The handle that the rest of the cell holds.

use std::sync::Arc;

use devices::{Arm, ArmError, ArmState, SetPointStream, Suction, SuctionState};
use futures::FutureExt;
use futures::future::BoxFuture;
use kinematics::ModifiedDh;
use tokio::sync::{mpsc, oneshot, watch};
use tokio::task::JoinHandle;
use xarm_protocol::{Request, Status};

use crate::calibration;
use crate::config::XArmConfig;
use crate::connection;
use crate::job::{Job, Reply};
use crate::shared::Shared;
use crate::statistics::ArmStatistics;
use crate::suction::Gripper;

/// The arm at a controller, whether it is there or not, and the vacuum gripper on it. Dropping it stops the arm if it
/// follows set-points and closes the connections, as [`Self::close`] does; the latter also waits for it.
#[derive(Debug)]
pub struct XArm {
    config: XArmConfig,
    jobs: mpsc::UnboundedSender<Job>,
    shared: Arc<Shared>,
    task: JoinHandle<()>,
}

impl XArm {
    /// Starts the driver on the current tokio runtime. It keeps trying to reach the controller; see [`Arm::state`].
    ///
    /// # Panics
    ///
    /// Outside a tokio runtime.
    pub fn open(config: XArmConfig) -> Self {
        let first = format!("{}:{} is being connected", config.host, config.control_port);
        let shared = Arc::new(Shared::new(first));
        let (sender, jobs) = mpsc::unbounded_channel();
        let task = tokio::spawn(connection::serve(config.clone(), jobs, Arc::clone(&shared)));
        Self {
            config,
            jobs: sender,
            shared,
            task,
        }
    }

    /// What happened so far.
    pub fn statistics(&self) -> ArmStatistics {
        self.shared.statistics()
    }

    /// The dimensions that the maker measured of this very arm, for
    /// [`Chain::with_modified_dh`](kinematics::Chain::with_modified_dh); asked of the controller now (register 67).
    ///
    /// # Errors
    /// No controller, a controller that knows none, or dimensions that are further from the nominal arm's than 20 mm or
    /// 0.05 rad.
    pub async fn calibrated_kinematics(&self) -> Result<[ModifiedDh; 7], ArmError> {
        let link = self.shared.link()?;
        let asked = link.control.ask(
            "your calibrated dimensions",
            Request::GetCalibratedDh,
            self.config.timeouts.reply,
        );
        let reply = asked.await?;
        let refused = |reason: String| ArmError::Refused { reason };
        if reply.status.has(Status::INVALID) {
            return Err(refused(
                "the controller does not know its calibrated dimensions".to_owned(),
            ));
        }
        let numbers = reply
            .read_floats()
            .map_err(|error| refused(format!("the calibrated dimensions are not understood: {error}")))?;
        calibration::modified_dh(&numbers)
    }

    /// Stops the arm if it follows set-points, closes the connections, and waits until that is done, or has failed after
    /// a fraction of a second.
    pub async fn close(self) {
        let Self { jobs, task, .. } = self;
        drop(jobs);
        if let Err(error) = task.await {
            tracing::error!(%error, "the driver of the arm did not end well");
        }
    }

    /// Asks the driver's task. Nothing is asked before the future is polled.
    fn ask<T: Send + 'static>(
        &self,
        job: impl FnOnce(Reply<T>) -> Job + Send + 'static,
    ) -> BoxFuture<'_, Result<T, ArmError>> {
        async move {
            let (reply, answer) = oneshot::channel();
            let gone = || ArmError::Disconnected {
                reason: "the driver has ended".into(),
            };
            self.jobs.send(job(reply)).map_err(|_| gone())?;
            answer.await.unwrap_or_else(|_| Err(gone()))
        }
        .boxed()
    }

    fn gripper(&self) -> Result<Gripper, ArmError> {
        Ok(Gripper {
            link: self.shared.link()?,
            hardware: self.config.vacuum,
            timeouts: self.config.timeouts,
        })
    }
}

impl Arm for XArm {
    fn state(&self) -> watch::Receiver<ArmState> {
        self.shared.subscribe()
    }

    fn arm(&self) -> BoxFuture<'_, Result<Box<dyn SetPointStream>, ArmError>> {
        self.ask(|reply| Job::Arm { reply })
    }

    fn stop(&self) -> BoxFuture<'_, Result<(), ArmError>> {
        self.ask(|reply| Job::Stop { reply })
    }

    fn recover(&self, looked: bool) -> BoxFuture<'_, Result<(), ArmError>> {
        self.ask(move |reply| Job::Recover { looked, reply })
    }
}

impl Suction for XArm {
    fn set(&self, on: bool) -> BoxFuture<'_, Result<(), ArmError>> {
        async move { self.gripper()?.set(on).await }.boxed()
    }

    fn read(&self) -> BoxFuture<'_, Result<SuctionState, ArmError>> {
        async move { self.gripper()?.read().await }.boxed()
    }
}
