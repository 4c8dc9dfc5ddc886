//! The action `move_tool`: the tool through poses.

use std::sync::Arc;
use std::time::Duration;

use devices::JointValues;
use geometry::RigidTransform;
use interfaces::builtin_interfaces::msg::Duration as DurationMessage;
use interfaces::rakelight_msgs::action::{MoveTool as Action, MoveToolFeedback, MoveToolGoal, MoveToolResult};
use kinematics::IkOptions;
use nalgebra::SVector;
use ros::{ActionServer, ActiveGoal, Node};
use trajectory::{Planner, Trajectory};

use crate::convert::pose;
use crate::error::{Error, MotionError};
use crate::goals;
use crate::services::Desk;

/// More poses than anybody needs are refused: planning them would take seconds.
const MOST_POSES: usize = 1000;

pub(crate) struct MoveTool {
    server: ActionServer<Action>,
    desk: Arc<Desk>,
}

/// A way, and the speed that it was planned with.
struct Plan {
    trajectory: Trajectory<7>,
    speed: f64,
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
        let plan = match self.plan(goal.goal().clone()).await {
            Ok(plan) => plan,
            Err(error) => return tell(goal, Err(error), MoveToolResult::default()),
        };
        let result = MoveToolResult {
            joints: plan.trajectory.end().map(|state| state.position).to_vec(),
            duration: message(plan.trajectory.duration()),
            ..MoveToolResult::default()
        };
        let ending = if goal.goal().dry_run {
            self.0.executor.model().require_free(&plan.trajectory)
        } else {
            self.execute(&goal, plan).await
        };
        tell(goal, ending, result);
    }

    /// On a thread that may take its time.
    async fn plan(&self, goal: MoveToolGoal) -> Result<Plan, MotionError> {
        let desk = Arc::clone(&self.0);
        let at = if goal.dry_run {
            desk.executor.measured_or_held()?
        } else {
            desk.executor.held_at()?
        };
        let planning = tokio::task::spawn_blocking(move || plan(&desk, &goal, &at));
        planning
            .await
            .unwrap_or_else(|error| Err(MotionError::Request(format!("planning failed: {error}"))))
    }

    async fn execute(&self, goal: &ActiveGoal<Action>, plan: Plan) -> Result<(), MotionError> {
        let tolerance = self.0.parameters.start_tolerance.get();
        let running = self.0.executor.begin(plan.trajectory, plan.speed, tolerance)?;
        goals::follow(&self.0.executor, goal, running, |running| {
            // Feedback that is lost is followed by the next.
            let _ = goal.feedback(MoveToolFeedback {
                progress: running.progress() as f32,
            });
        })
        .await
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

fn plan(desk: &Desk, goal: &MoveToolGoal, at: &JointValues) -> Result<Plan, MotionError> {
    let speed = speed(goal.speed, desk.parameters.tool_speed.get())?;
    let poses = poses(goal)?;
    let planner = desk.executor.model().planner(speed)?;
    let trajectory = if goal.straight {
        planner.lines(at, &poses, goal.blend)?.trajectory
    } else {
        through(&planner, &poses, at)?
    };
    Ok(Plan { trajectory, speed })
}

fn speed(asked: f64, most: f64) -> Result<f64, MotionError> {
    if asked == 0.0 {
        return Ok(most);
    }
    if asked > 0.0 && asked <= most {
        return Ok(asked);
    }
    Err(MotionError::Request(format!(
        "speed is {asked} m/s, allowed are 0 for the parameter's and more up to {most} (parameter tool_speed)"
    )))
}

fn poses(goal: &MoveToolGoal) -> Result<Vec<RigidTransform>, MotionError> {
    let found = goal.poses.len();
    if !(1..=MOST_POSES).contains(&found) {
        return Err(MotionError::Request(format!(
            "{found} poses, allowed are 1 to {MOST_POSES}"
        )));
    }
    let poses = goal.poses.iter().enumerate();
    poses
        .map(|(index, message)| pose(&format!("pose {}", index + 1), message))
        .collect()
}

/// Each by its own motion of the joints, from rest to rest.
fn through(planner: &Planner<7>, poses: &[RigidTransform], at: &JointValues) -> Result<Trajectory<7>, MotionError> {
    let (mut at, mut parts) = (*at, Vec::with_capacity(poses.len()));
    for pose in poses {
        let found = planner.chain().solve(pose, &SVector::from(at), &IkOptions::default())?;
        let next = JointValues::from(found.angles);
        parts.push(planner.joint_motion(&at, &next)?);
        at = next;
    }
    Ok(Trajectory::concatenate(parts)?)
}

fn message(seconds: f64) -> DurationMessage {
    DurationMessage::try_from(Duration::from_secs_f64(seconds)).unwrap_or_default()
}
