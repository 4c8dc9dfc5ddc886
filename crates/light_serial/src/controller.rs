//! The handle that the rest of the cell holds.

use std::sync::Arc;
use std::time::Duration;

use devices::{LightBank, LightBankState, LightError, LightSequence, PanelSet, SequenceReport};
use futures::FutureExt;
use futures::future::BoxFuture;
use tokio::sync::{mpsc, oneshot, watch};
use tokio::task::JoinHandle;

use crate::config::LightSerialConfig;
use crate::connection;
use crate::convert;
use crate::job::Job;
use crate::shared::Shared;
use crate::statistics::LinkStatistics;

/// The light controller at a serial port, whether it is there or not. Dropping it turns the lights off and closes the
/// port, as [`Self::close`] does; the latter also waits for it. Where the runtime ends before that, the firmware's watchdog
/// turns them off within half a second.
#[derive(Debug)]
pub struct LightController {
    jobs: mpsc::UnboundedSender<Job>,
    shared: Arc<Shared>,
    task: JoinHandle<()>,
}

impl LightController {
    /// Starts the driver on the current tokio runtime. It keeps trying to reach the controller; see
    /// [`LightBank::state`].
    ///
    /// # Panics
    ///
    /// Outside a tokio runtime.
    pub fn open(config: LightSerialConfig) -> Self {
        let shared = Arc::new(Shared::new(format!("port {} is being opened", config.port.display())));
        let (sender, jobs) = mpsc::unbounded_channel();
        let task = tokio::spawn(connection::serve(config, jobs, Arc::clone(&shared)));
        Self {
            jobs: sender,
            shared,
            task,
        }
    }

    /// What happened at the port so far.
    pub fn statistics(&self) -> LinkStatistics {
        self.shared.statistics()
    }

    /// Turns the lights off, closes the port, and waits until that is done, or has failed after a fraction of a second.
    pub async fn close(self) {
        let Self { jobs, task, .. } = self;
        drop(jobs);
        if let Err(error) = task.await {
            tracing::error!(%error, "the driver of the light controller did not end well");
        }
    }

    /// Asks the driver's task. Nothing is asked before the future is polled.
    fn ask<T: Send + 'static>(
        &self,
        job: impl FnOnce(oneshot::Sender<Result<T, LightError>>) -> Job + Send + 'static,
    ) -> BoxFuture<'_, Result<T, LightError>> {
        async move {
            let (reply, answer) = oneshot::channel();
            let gone = || LightError::Disconnected {
                reason: "the driver has ended".into(),
            };
            self.jobs.send(job(reply)).map_err(|_| gone())?;
            answer.await.unwrap_or_else(|_| Err(gone()))
        }
        .boxed()
    }
}

impl LightBank for LightController {
    fn run_sequence(&self, sequence: LightSequence) -> BoxFuture<'_, Result<SequenceReport, LightError>> {
        match convert::sequence(&sequence) {
            Ok(sequence) => self.ask(move |reply| Job::Run {
                sequence: Box::new(sequence),
                reply,
            }),
            Err(error) => futures::future::ready(Err(error)).boxed(),
        }
    }

    fn set(&self, panels: PanelSet, duration: Duration) -> BoxFuture<'_, Result<(), LightError>> {
        match convert::set(convert::panels(panels), duration) {
            Ok(_) if panels.is_none() => self.off(),
            Ok(light) => self.ask(move |reply| Job::Set { light, reply }),
            Err(error) => futures::future::ready(Err(error)).boxed(),
        }
    }

    fn off(&self) -> BoxFuture<'_, Result<(), LightError>> {
        self.ask(|reply| Job::Off { reply })
    }

    fn state(&self) -> watch::Receiver<LightBankState> {
        self.shared.subscribe()
    }
}
