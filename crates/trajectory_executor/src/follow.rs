//! The action `follow_joint_trajectory`, as `MoveIt` and others use it.

use std::sync::Arc;

use devices::JointValues;
use interfaces::control_msgs::action::{
    FollowJointTrajectory, FollowJointTrajectoryFeedback, FollowJointTrajectoryGoal, FollowJointTrajectoryResult,
};
use interfaces::control_msgs::msg::JointTolerance;
use interfaces::trajectory_msgs::msg::JointTrajectoryPoint;
use ros::{ActionServer, ActiveGoal, Node};
use trajectory::{TimedPoint, Trajectory};

use crate::convert::duration_seconds;
use crate::error::{Error, MotionError};
use crate::executor::{Motion, Running};
use crate::goals;
use crate::handling::Handling;
use crate::services::Desk;

pub(crate) struct Follow {
    server: ActionServer<FollowJointTrajectory>,
    desk: Arc<Desk>,
    /// "joint1" and so on.
    names: Vec<String>,
}

impl Follow {
    pub(crate) fn new(node: &Node, desk: Arc<Desk>) -> Result<Self, Error> {
        let names = desk
            .executor
            .model()
            .chain
            .joints()
            .iter()
            .map(|joint| joint.name.clone())
            .collect();
        Ok(Self {
            server: node.action_server("follow_joint_trajectory")?,
            desk,
            names,
        })
    }

    pub(crate) async fn serve(self) {
        let follower = Arc::new(Follower {
            desk: self.desk,
            names: self.names,
        });
        goals::serve(self.server, |goal| {
            let follower = Arc::clone(&follower);
            async move { follower.run(goal).await }
        })
        .await;
    }
}

struct Follower {
    desk: Arc<Desk>,
    names: Vec<String>,
}

impl Follower {
    async fn run(&self, goal: ActiveGoal<FollowJointTrajectory>) {
        let ending = match self.begin(goal.goal()) {
            Ok(running) => goals::follow(&self.desk.executor, &goal, running, |_| self.feed_back(&goal)).await,
            Err(error) => Err(error),
        };
        let cancelled = goal.is_cancel_requested();
        let told = match ending {
            Ok(()) => match self.missed_goal(goal.goal()) {
                None => goal.succeed(result(FollowJointTrajectoryResult::SUCCESSFUL, String::new())),
                Some(missed) => goal.abort(result(FollowJointTrajectoryResult::GOAL_TOLERANCE_VIOLATED, missed)),
            },
            Err(error) if cancelled => {
                goal.canceled(result(FollowJointTrajectoryResult::SUCCESSFUL, error.to_string()))
            }
            Err(error) => {
                tracing::warn!(%error, "a trajectory was not followed");
                goal.abort(result(code(&error), error.to_string()))
            }
        };
        if let Err(error) = told {
            tracing::warn!(%error, "a result is lost");
        }
    }

    fn begin(&self, goal: &FollowJointTrajectoryGoal) -> Result<Running, MotionError> {
        let motion = Motion {
            trajectory: self.trajectory(goal)?,
            speed: self.desk.parameters.tool_speed.get(),
            handling: Handling::default(),
        };
        let tolerance = self.desk.parameters.start_tolerance.get();
        self.desk.executor.begin(motion, tolerance)
    }

    /// From where the arm is held: a first point that lies in the future is led to.
    fn trajectory(&self, goal: &FollowJointTrajectoryGoal) -> Result<Trajectory<7>, MotionError> {
        let asked = &goal.trajectory;
        let order = self.order(&asked.joint_names)?;
        if !goal.multi_dof_trajectory.points.is_empty() {
            return Err(MotionError::Request(
                "a multi-DOF trajectory was asked for; the arm has single joints".into(),
            ));
        }
        let mut points = asked
            .points
            .iter()
            .enumerate()
            .map(|(index, point)| timed_point(index, point, &order))
            .collect::<Result<Vec<_>, _>>()?;
        let at = self.desk.executor.held_at()?;
        if points.first().is_some_and(|first| first.time_from_start > 0.0) {
            points.insert(
                0,
                TimedPoint {
                    time_from_start: 0.0,
                    positions: at,
                    velocities: Some([0.0; 7]),
                    accelerations: Some([0.0; 7]),
                },
            );
        }
        Ok(Trajectory::through_points(&points)?)
    }

    /// Where each of our joints stands in the goal's lists.
    fn order(&self, asked: &[String]) -> Result<[usize; 7], MotionError> {
        let mut order = [0; 7];
        for (place, name) in order.iter_mut().zip(self.names.iter()) {
            *place = asked
                .iter()
                .position(|asked| asked == name)
                .ok_or_else(|| self.wrong_joints(asked))?;
        }
        if asked.len() == order.len() {
            return Ok(order);
        }
        Err(self.wrong_joints(asked))
    }

    fn wrong_joints(&self, asked: &[String]) -> MotionError {
        MotionError::Request(format!(
            "joints {}, expected in any order: {}",
            asked.join(", "),
            self.names.join(", ")
        ))
    }

    fn feed_back(&self, goal: &ActiveGoal<FollowJointTrajectory>) {
        let Some(desired) = self.desk.executor.remote().commanded() else {
            return;
        };
        let state = self.desk.executor.arm_state();
        let Some(actual) = state.borrow().joints else {
            return;
        };
        let error = std::array::from_fn(|joint| desired[joint].position - actual.angles[joint]);
        let feedback = FollowJointTrajectoryFeedback {
            joint_names: self.names.clone(),
            desired: point(
                &desired.map(|state| state.position),
                &desired.map(|state| state.velocity),
            ),
            actual: point(&actual.angles, &actual.velocities),
            error: point(&error, &[0.0; 7]),
            ..FollowJointTrajectoryFeedback::default()
        };
        // Feedback that is lost is followed by the next.
        let _ = goal.feedback(feedback);
    }

    /// Where the arm is measured further from the goal than its sender tolerates; none if nowhere.
    fn missed_goal(&self, goal: &FollowJointTrajectoryGoal) -> Option<String> {
        let (commanded, state) = (self.desk.executor.remote().commanded()?, self.desk.executor.arm_state());
        let measured = state.borrow().joints?;
        self.names.iter().enumerate().find_map(|(joint, name)| {
            let JointTolerance { position, .. } =
                goal.goal_tolerance.iter().find(|tolerance| tolerance.name == *name)?;
            let off = (commanded[joint].position - measured.angles[joint]).abs();
            (*position > 0.0 && off > *position)
                .then(|| format!("{name} is {off:.4} rad off its goal, allowed are {position} rad"))
        })
    }
}

fn timed_point(index: usize, point: &JointTrajectoryPoint, order: &[usize; 7]) -> Result<TimedPoint<7>, MotionError> {
    let sorted = |what: &str, values: &[f64]| -> Result<Option<JointValues>, MotionError> {
        match values.len() {
            0 => Ok(None),
            7 => Ok(Some(order.map(|place| values[place]))),
            found => Err(MotionError::Request(format!(
                "point {}: {found} {what}, allowed are 7{}",
                index + 1,
                if what == "positions" { "" } else { " or none" }
            ))),
        }
    };
    let positions = sorted("positions", &point.positions)?;
    Ok(TimedPoint {
        time_from_start: duration_seconds(point.time_from_start),
        positions: positions.ok_or_else(|| MotionError::Request(format!("point {} has no positions", index + 1)))?,
        velocities: sorted("velocities", &point.velocities)?,
        accelerations: sorted("accelerations", &point.accelerations)?,
    })
}

fn point(positions: &JointValues, velocities: &JointValues) -> JointTrajectoryPoint {
    JointTrajectoryPoint {
        positions: positions.to_vec(),
        velocities: velocities.to_vec(),
        ..JointTrajectoryPoint::default()
    }
}

fn code(error: &MotionError) -> i32 {
    match error {
        MotionError::Request(reason) if reason.starts_with("joints") => FollowJointTrajectoryResult::INVALID_JOINTS,
        MotionError::Stopped(_) | MotionError::Lost(_) => FollowJointTrajectoryResult::PATH_TOLERANCE_VIOLATED,
        _ => FollowJointTrajectoryResult::INVALID_GOAL,
    }
}

fn result(error_code: i32, error_string: String) -> FollowJointTrajectoryResult {
    FollowJointTrajectoryResult {
        error_code,
        error_string,
    }
}
