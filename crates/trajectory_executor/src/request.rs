//! Goals of `move_tool`, as they are understood.

use devices::{ARM_JOINTS, JointValues};
use geometry::RigidTransform;
use interfaces::rakelight_msgs::action::MoveToolGoal;
use kinematics::Chain;
use nalgebra::SVector;

use crate::convert::pose;
use crate::error::MotionError;
use crate::handling::{Carried, Handling};

/// More poses than anybody needs are refused: planning them would take seconds.
const MOST_POSES: usize = 1000;
/// What is carried is no larger than what the cell is made for, metres.
const MOST_CARRIED: f64 = 0.3;

/// A goal that makes sense; whether it can be reached is another question.
#[derive(Debug)]
pub(crate) struct Request {
    pub(crate) poses: Vec<RigidTransform>,
    pub(crate) straight: bool,
    /// Metres.
    pub(crate) blend: f64,
    /// Metres per second.
    pub(crate) speed: f64,
    pub(crate) handling: Handling,
    /// Where a dry run begins (radians); none: where the arm stands.
    pub(crate) start: Option<JointValues>,
}

impl Request {
    /// `most_speed` (m/s) is what the tool may do.
    pub(crate) fn of(goal: &MoveToolGoal, most_speed: f64, chain: &Chain<7>) -> Result<Self, MotionError> {
        if goal.contact && !goal.straight {
            return wrong("contact is allowed on straight lines only: straight is false".into());
        }
        if goal.until_held && !goal.contact {
            return wrong("until_held ends a motion with contact only: contact is false".into());
        }
        Ok(Self {
            speed: speed(goal.speed, most_speed)?,
            poses: poses(goal)?,
            handling: Handling {
                contact: goal.contact,
                carried: carried(goal)?,
            },
            start: start(goal, chain)?,
            straight: goal.straight,
            blend: goal.blend,
        })
    }
}

fn wrong<T>(reason: String) -> Result<T, MotionError> {
    Err(MotionError::Request(reason))
}

fn speed(asked: f64, most: f64) -> Result<f64, MotionError> {
    if asked == 0.0 {
        return Ok(most);
    }
    if asked > 0.0 && asked <= most {
        return Ok(asked);
    }
    wrong(format!(
        "speed is {asked} m/s, allowed are 0 for the parameter's and more up to {most} (parameter tool_speed)"
    ))
}

fn poses(goal: &MoveToolGoal) -> Result<Vec<RigidTransform>, MotionError> {
    let found = goal.poses.len();
    if !(1..=MOST_POSES).contains(&found) {
        return wrong(format!("{found} poses, allowed are 1 to {MOST_POSES}"));
    }
    let poses = goal.poses.iter().enumerate();
    poses
        .map(|(index, message)| pose(&format!("pose {}", index + 1), message))
        .collect()
}

fn carried(goal: &MoveToolGoal) -> Result<Option<Carried>, MotionError> {
    let (radius, length) = (goal.carried_radius, goal.carried_length);
    for (name, value) in [("carried_radius", radius), ("carried_length", length)] {
        if !(0.0..=MOST_CARRIED).contains(&value) {
            return wrong(format!("{name} is {value} m, allowed are 0 to {MOST_CARRIED}"));
        }
    }
    match (radius > 0.0, length > 0.0) {
        (false, false) => Ok(None),
        (true, true) => Ok(Some(Carried { radius, length })),
        _ => wrong(format!(
            "carried_radius is {radius} m and carried_length {length} m, allowed are both 0 or both more"
        )),
    }
}

fn start(goal: &MoveToolGoal, chain: &Chain<7>) -> Result<Option<JointValues>, MotionError> {
    if goal.start_joints.is_empty() {
        return Ok(None);
    }
    if !goal.dry_run {
        return wrong(
            "start_joints is given, allowed is that in a dry run only: the arm begins where it stands".into(),
        );
    }
    let found = goal.start_joints.len();
    let angles = JointValues::try_from(goal.start_joints.as_slice());
    let angles = angles
        .map_err(|_| MotionError::Request(format!("start_joints has {found} angles, allowed are {ARM_JOINTS}")))?;
    let within = chain.require_limits(&SVector::from(angles));
    within.map_err(|error| MotionError::Request(format!("start_joints: {error}")))?;
    Ok(Some(angles))
}

#[cfg(test)]
mod tests {
    use interfaces::geometry_msgs::msg::{Pose, Quaternion};

    use super::*;
    use crate::model::tests::{HOME, model};

    fn goal() -> MoveToolGoal {
        let upright = Quaternion {
            x: 0.0,
            y: 0.0,
            z: 0.0,
            w: 1.0,
        };
        let pose = Pose {
            orientation: upright,
            ..Pose::default()
        };
        MoveToolGoal {
            poses: vec![pose],
            ..MoveToolGoal::default()
        }
    }

    #[test]
    fn what_makes_no_sense_says_what_is_allowed() {
        let chain = model().chain;
        let refused = |change: &dyn Fn(&mut MoveToolGoal)| {
            let mut goal = goal();
            change(&mut goal);
            Request::of(&goal, 0.25, &chain).expect_err("refused").to_string()
        };
        let too_far = [9.0, 0.0, 0.0, 0.7, 0.0, 1.1, 0.0].to_vec();
        for (text, expected) in [
            (
                refused(&|goal| goal.contact = true),
                "contact is allowed on straight lines only",
            ),
            (
                refused(&|goal| goal.until_held = true),
                "until_held ends a motion with contact only",
            ),
            (
                refused(&|goal| goal.carried_radius = f64::NAN),
                "carried_radius is NaN m, allowed are 0 to 0.3",
            ),
            (
                refused(&|goal| goal.carried_length = 0.31),
                "carried_length is 0.31 m, allowed are 0 to 0.3",
            ),
            (refused(&|goal| goal.carried_radius = -0.1), "carried_radius is -0.1 m"),
            (
                refused(&|goal| goal.carried_radius = 0.1),
                "allowed are both 0 or both more",
            ),
            (refused(&|goal| goal.speed = f64::NAN), "speed is NaN m/s"),
            (refused(&|goal| goal.start_joints = HOME.to_vec()), "in a dry run only"),
            (
                refused(&|goal| (goal.dry_run, goal.start_joints) = (true, vec![0.0; 6])),
                "start_joints has 6 angles, allowed are 7",
            ),
            (
                refused(&|goal| (goal.dry_run, goal.start_joints) = (true, too_far.clone())),
                "start_joints: ",
            ),
            (
                refused(&|goal| (goal.dry_run, goal.start_joints) = (true, vec![f64::NAN; 7])),
                "start_joints: ",
            ),
        ] {
            assert!(text.contains(expected), "{text}");
        }
    }

    #[test]
    fn what_is_asked_for_is_taken_over() {
        let goal = MoveToolGoal {
            straight: true,
            contact: true,
            carried_radius: 0.05,
            carried_length: 0.03,
            dry_run: true,
            start_joints: HOME.to_vec(),
            ..goal()
        };
        let request = Request::of(&goal, 0.25, &model().chain).expect("sound");
        assert_eq!(request.start, Some(HOME));
        let carried = Carried {
            radius: 0.05,
            length: 0.03,
        };
        assert_eq!(
            (request.handling.contact, request.handling.carried),
            (true, Some(carried))
        );
        assert!((request.speed - 0.25).abs() < 1e-12);
    }
}
