//! What others may ask of the node.

use std::sync::Arc;
use std::time::Instant;

use interfaces::builtin_interfaces::msg::Duration;
use interfaces::rakelight_msgs::msg::{CellState, GraspArray, StageTiming};
use interfaces::rakelight_msgs::srv::{self, PlanGraspRequest, PlanGraspResponse};
use ros::{Clock, ServiceServer};

use crate::captures::Captures;
use crate::error::Refusal;
use crate::messages;
use crate::parameters::Parameters;
use crate::planning::Planned;
use crate::publish::Publishers;
use crate::reach::Reach;
use crate::request::Ask;

/// What `plan_grasp` works on.
pub(crate) struct Desk {
    pub(crate) captures: Captures,
    pub(crate) parameters: Parameters,
    pub(crate) reach: Arc<Reach>,
    pub(crate) publishers: Publishers,
    pub(crate) clock: Clock,
}

impl Desk {
    /// Answers one call after the other until the node is shut down.
    pub(crate) async fn serve(self, mut server: ServiceServer<srv::PlanGrasp>) {
        let desk = Arc::new(self);
        while let Some(call) = server.next().await {
            let (response, planned) = desk.answer(call.request()).await;
            if let Err(error) = call.respond(response).await {
                tracing::warn!(%error, "an answer is lost");
            }
            if let Some(planned) = planned {
                let desk = Arc::clone(&desk);
                let drawing = tokio::task::spawn_blocking(move || desk.publishers.previews(&planned));
                drawing.await.expect("drawing does not panic");
            }
        }
    }

    async fn answer(&self, request: &PlanGraspRequest) -> (PlanGraspResponse, Option<Planned>) {
        let (started, started_at) = (Instant::now(), self.clock.now());
        let planned = self.plan(request).await;
        let took = started.elapsed();
        let (success, message, grasps) = match &planned {
            Ok(planned) => self.told(planned),
            Err(refusal) => (false, refusal.to_string(), GraspArray::default()),
        };
        let (capture_id, count, took_ms) = (&grasps.capture_id, grasps.grasps.len(), took.as_millis());
        if success {
            tracing::info!(capture_id, grasps = count, took_ms, message, "planned");
        } else {
            tracing::warn!(capture_id, grasps = count, took_ms, message, "nothing to grasp");
        }
        for refused in planned.iter().flat_map(|planned| &planned.plan.refused) {
            tracing::debug!(capture_id, %refused, "a candidate");
        }
        let timing = StageTiming {
            stage: CellState::PLAN,
            succeeded: success,
            started_at,
            duration: Duration::try_from(took).unwrap_or_default(),
        };
        let response = PlanGraspResponse {
            success,
            message,
            grasps,
            timing,
        };
        (response, planned.ok())
    }

    async fn plan(&self, request: &PlanGraspRequest) -> Result<Planned, Refusal> {
        let mut settings = self.parameters.settings()?;
        let ask = Ask::read(request, settings.options.search.cone)?;
        if let Some(direction) = ask.direction {
            settings.options.directions = vec![-direction];
        }
        let (cameras, patience) = (&self.parameters.cameras, self.parameters.result_timeout());
        let capture = self.captures.wait(&ask.capture_id, cameras, patience).await?;
        let (mode, reach) = (ask.mode, Arc::clone(&self.reach));
        let planning = tokio::task::spawn_blocking(move || Planned::new(capture, mode, settings, &reach));
        Ok(planning.await.expect("planning does not panic")?)
    }

    /// Publishes a plan; whether there is a grasp, what to say, and the grasps.
    fn told(&self, planned: &Planned) -> (bool, String, GraspArray) {
        let base = self.parameters.base_frame_id.get();
        let grasps = messages::array(planned, &base);
        let published = self
            .publishers
            .grasps(grasps.clone(), messages::best_pose(planned, &base));
        if let Err(error) = published {
            tracing::warn!(%error, "the grasps are not published");
        }
        let message: Vec<String> = planned.reason().into_iter().chain(planned.note()).collect();
        (planned.best().is_some(), message.join("; "), grasps)
    }
}
