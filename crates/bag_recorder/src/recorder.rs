//! One bag at a time, and what the services answer.

use std::path::PathBuf;
use std::time::Duration;

use interfaces::rakelight_msgs::srv::{StartRecordingRequest, StartRecordingResponse};
use interfaces::std_srvs::srv::TriggerResponse;
use ros::Node;

use crate::error::Error;
use crate::parameters::Parameters;
use crate::path;
use crate::report::{Shown, summary};
use crate::session::{End, Ended, Session};
use crate::topics::wanted;

pub(crate) struct Recorder {
    node: Node,
    parameters: Parameters,
    session: Option<Session>,
    /// A bag that ended by itself, until `record/stop` has told of it.
    untold: Option<Ended>,
    shown: Shown,
}

impl Recorder {
    pub(crate) fn new(node: Node, parameters: Parameters) -> Self {
        let shown = Shown::default();
        let reported = shown.clone();
        node.diagnostics().register("recording", "", move || reported.status());
        Self {
            node,
            parameters,
            session: None,
            untold: None,
            shown,
        }
    }

    /// Answers `record/start`.
    pub(crate) async fn start(&mut self, request: &StartRecordingRequest) -> StartRecordingResponse {
        match self.try_start(request).await {
            Ok(path) => {
                let path = path.display().to_string();
                tracing::info!(path, "recording");
                StartRecordingResponse {
                    success: true,
                    path,
                    ..StartRecordingResponse::default()
                }
            }
            Err(error) => {
                tracing::warn!(%error, "no recording");
                StartRecordingResponse {
                    message: error.to_string(),
                    ..StartRecordingResponse::default()
                }
            }
        }
    }

    async fn try_start(&mut self, request: &StartRecordingRequest) -> Result<PathBuf, Error> {
        if let Some(session) = &self.session {
            let path = session.path().to_owned();
            return Err(Error::AlreadyRecording { path });
        }
        let max_duration = max_duration(request)?;
        let wanted = wanted(&self.node, &self.parameters.cameras.get(), request)?;
        let folder = PathBuf::from(self.parameters.folder.get());
        let max_queue_bytes = self.parameters.max_queue_bytes.get() as usize;
        let create = || path::create(&folder, &request.path);
        let session = Session::start(&self.node, &wanted, create, max_queue_bytes, max_duration).await?;
        let path = session.path().to_owned();
        self.shown.recording(path.clone(), session.feed().clone());
        self.session = Some(session);
        self.untold = None;
        Ok(path)
    }

    /// Answers `record/stop`.
    pub(crate) async fn stop(&mut self) -> TriggerResponse {
        if let Some(session) = &self.session {
            session.drain().await;
        }
        let ended = match self.finish().await {
            Some(ended) => Some(ended),
            None => self.untold.take(),
        };
        let Some(ended) = ended else {
            return TriggerResponse {
                success: false,
                message: Error::NotRecording.to_string(),
            };
        };
        TriggerResponse {
            success: ended.failure.is_none(),
            message: summary(&ended),
        }
    }

    /// Waits until the bag ends by itself; for ever while there is none. Cancel safe.
    pub(crate) async fn end_of_session(&self) -> End {
        match &self.session {
            Some(session) => session.end().await,
            None => std::future::pending().await,
        }
    }

    /// Ends a bag that has come to its end by itself.
    pub(crate) async fn end(&mut self, end: End) {
        if let (End::Duration, Some(session)) = (end, &self.session) {
            session.drain().await;
        }
        self.untold = self.finish().await;
    }

    /// Ends the bag, if there is one, because the node ends.
    pub(crate) async fn shut_down(mut self) {
        self.node.diagnostics().unregister("recording");
        self.finish().await;
    }

    async fn finish(&mut self) -> Option<Ended> {
        let ended = self.session.take()?.finish().await;
        self.shown.ended(&ended);
        let summary = summary(&ended);
        if ended.failure.is_none() {
            tracing::info!("{summary}");
        } else {
            tracing::error!("{summary}");
        }
        Some(ended)
    }
}

fn max_duration(request: &StartRecordingRequest) -> Result<Option<Duration>, Error> {
    let requested = request.max_duration;
    let refused = |_| Error::MaxDuration {
        found_s: requested.to_nanos() as f64 * 1e-9,
    };
    let duration = Duration::try_from(requested).map_err(refused)?;
    Ok((!duration.is_zero()).then_some(duration))
}
