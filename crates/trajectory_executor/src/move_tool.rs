//! The action `move_tool`: the tool through poses.

use std::sync::Arc;
use std::time::{Duration, Instant};

use devices::JointValues;
use interfaces::builtin_interfaces::msg::Duration as DurationMessage;
use interfaces::rakelight_msgs::action::{MoveTool as Action, MoveToolFeedback, MoveToolGoal, MoveToolResult};
use ros::{ActionServer, ActiveGoal, Node};
use trajectory::Trajectory;

use crate::error::{Error, MotionError};
use crate::executor::{Motion, Running};
use crate::goals;
use crate::held::{held_with_pump_on, until_held};
use crate::request::Request;
use crate::route::Router;
use crate::services::{Desk, unplanned};
use crate::servo::StopCause;

pub(crate) struct MoveTool {
    server: ActionServer<Action>,
    desk: Arc<Desk>,
}

impl MoveTool {
    pub(crate) fn new(node: &Node, desk: Arc<Desk>) -> Result<Self, Error> {
        Ok(Self {
            server: node.action_server("move_tool")?,
            desk,
        })
    }

    pub(crate) async fn serve(self) {
        let mover = Arc::new(Mover(self.desk));
        goals::serve(self.server, |goal| {
            let mover = Arc::clone(&mover);
            async move { mover.run(goal).await }
        })
        .await;
    }
}

struct Mover(Arc<Desk>);

impl Mover {
    async fn run(&self, goal: ActiveGoal<Action>) {
        let motion = match self.plan(goal.goal().clone()).await {
            Ok(motion) => motion,
            Err(error) => return tell(goal, Err(error), MoveToolResult::default()),
        };
        let mut result = MoveToolResult {
            joints: motion.trajectory.end().map(|state| state.position).to_vec(),
            duration: message(motion.trajectory.duration()),
            ..MoveToolResult::default()
        };
        let ending = if goal.goal().dry_run {
            let model = self.0.executor.model();
            model.require_free(&motion.trajectory, &motion.handling)
        } else if goal.goal().until_held {
            let began = Instant::now();
            let ending = self.execute_until_held(&goal, motion).await;
            let end = self.0.executor.remote().commanded();
            result.held = ending.as_ref().is_ok_and(|held| *held);
            result.joints = end.map_or(result.joints, |end| end.map(|state| state.position).to_vec());
            result.duration = message(began.elapsed().as_secs_f64());
            ending.map(drop)
        } else {
            self.execute(&goal, motion).await
        };
        tell(goal, ending, result);
    }

    /// On a thread that may take its time.
    async fn plan(&self, goal: MoveToolGoal) -> Result<Motion, MotionError> {
        let desk = Arc::clone(&self.0);
        let planning = tokio::task::spawn_blocking(move || plan(&desk, &goal));
        planning.await.unwrap_or_else(|error| Err(unplanned(&error)))
    }

    async fn execute(&self, goal: &ActiveGoal<Action>, motion: Motion) -> Result<(), MotionError> {
        let running = self.begin(motion)?;
        self.follow(goal, running).await
    }

    fn begin(&self, motion: Motion) -> Result<Running, MotionError> {
        self.0.executor.begin(motion, self.0.parameters.start_tolerance.get())
    }

    async fn follow(&self, goal: &ActiveGoal<Action>, running: Running) -> Result<(), MotionError> {
        goals::follow(&self.0.executor, goal, running, |running| {
            // Feedback that is lost is followed by the next.
            let _ = goal.feedback(MoveToolFeedback {
                progress: running.progress() as f32,
            });
        })
        .await
    }

    /// To the end, or until the cup holds something; whether it does.
    async fn execute_until_held(&self, goal: &ActiveGoal<Action>, motion: Motion) -> Result<bool, MotionError> {
        if held_with_pump_on(self.0.suction.as_ref()).await? {
            return Ok(true);
        }
        let running = self.begin(motion)?;
        let mut held = std::pin::pin!(until_held(self.0.suction.as_ref()));
        let mut moved = std::pin::pin!(self.follow(goal, running));
        let seen = tokio::select! {
            seen = &mut held => seen,
            ending = &mut moved => {
                ending?;
                let settled = Duration::from_secs_f64(self.0.parameters.hold_settle.get());
                // The seal of a cup that has just come down takes a moment.
                return tokio::time::timeout(settled, held).await.map_or(Ok(false), |seen| seen.map(|()| true));
            }
        };
        self.0.executor.cancel();
        let ending = moved.await;
        seen?;
        match ending {
            Err(MotionError::Stopped(StopCause::Requested)) if !goal.is_cancel_requested() => {}
            ending => ending?,
        }
        // Somebody else may have stopped it at the same time, to stay stopped.
        self.0.executor.standing().borrow().require_ready()?;
        Ok(true)
    }
}

fn tell(goal: ActiveGoal<Action>, ending: Result<(), MotionError>, result: MoveToolResult) {
    let result = MoveToolResult {
        success: ending.is_ok(),
        reason: ending.as_ref().err().map(ToString::to_string).unwrap_or_default(),
        ..result
    };
    let told = match ending {
        Ok(()) => goal.succeed(result),
        Err(_) if goal.is_cancel_requested() => goal.canceled(result),
        Err(error) => {
            tracing::warn!(%error, "the tool was not moved");
            goal.abort(result)
        }
    };
    if let Err(error) = told {
        tracing::warn!(%error, "a result is lost");
    }
}

fn plan(desk: &Desk, goal: &MoveToolGoal) -> Result<Motion, MotionError> {
    let model = desk.executor.model();
    let request = Request::of(goal, desk.parameters.tool_speed.get(), &model.chain)?;
    let at = match request.start {
        Some(start) => start,
        None if goal.dry_run => desk.executor.measured_or_held()?,
        None => desk.executor.held_at()?,
    };
    let planner = model.planner(request.speed)?;
    let router = Router {
        model: &model,
        planner: &planner,
        handling: request.handling,
    };
    Ok(Motion {
        trajectory: if request.straight {
            planner.lines(&at, &request.poses, request.blend)?.trajectory
        } else {
            through(&router, &request, &at)?
        },
        speed: request.speed,
        handling: request.handling,
    })
}

/// Each by its own motion of the joints, from rest to rest.
fn through(router: &Router<'_>, request: &Request, at: &JointValues) -> Result<Trajectory<7>, MotionError> {
    let (mut at, mut parts) = (*at, Vec::with_capacity(request.poses.len()));
    for pose in &request.poses {
        let part = router.to_pose(&at, pose)?;
        at = part.end().map(|state| state.position);
        parts.push(part);
    }
    Ok(Trajectory::concatenate(parts)?)
}

fn message(seconds: f64) -> DurationMessage {
    DurationMessage::try_from(Duration::from_secs_f64(seconds)).unwrap_or_default()
}
