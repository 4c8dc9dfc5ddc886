//! Where the tool goes.

use geometry::RigidTransform;
use geometry::nalgebra::{self, UnitQuaternion, Vector3};
use interfaces::geometry_msgs::msg::{Point, Pose, Quaternion};
use interfaces::rakelight_msgs::msg::Grasp;

use super::dialogue::Move;
use super::order::{Bin, Carried, Policy};

/// Turns of the tool about its own axis over the bin that are tried.
pub(super) const TURNS: u32 = 12;

/// The same at the object: where no heading does, the arm does not get there.
pub(super) const TURNS_AT_OBJECT: u32 = 6;

/// The ways of one grasp, or of what the cup holds already.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Task {
    /// None: the object is in the cup.
    pub(super) reach: Option<Reach>,
    pub(super) carried: Carried,
    /// None: it cannot be lifted further.
    pub(super) lift: Option<Move>,
    /// Over the bin; known when the whole way has been checked.
    pub(super) bin: Option<Move>,
}

/// To the object.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Reach {
    pub(super) grasp: Grasp,
    pub(super) pregrasp: Move,
    pub(super) approach: Move,
    /// Away from an object that was not taken.
    pub(super) back: Move,
}

impl Task {
    /// Takes an object and puts it into the bin.
    pub(super) fn of(grasp: Grasp, policy: &Policy) -> Self {
        let carried = carried(&grasp, policy.carried);
        let lift = Move {
            to: grasp.retreat,
            straight: true,
            contact: true,
            carried: Some(carried),
            ..Move::default()
        };
        Self {
            reach: Some(Reach::to(grasp, policy)),
            carried,
            lift: Some(lift),
            bin: None,
        }
    }

    /// Puts what the cup holds into the bin.
    pub(super) fn put_down(carried: Carried, tool: &RigidTransform, policy: &Policy) -> Self {
        let up = RigidTransform::from_parts(tool.translation() + Vector3::z() * policy.lift, tool.rotation());
        let lift = Move {
            to: pose(&up),
            straight: true,
            contact: true,
            carried: Some(carried),
            ..Move::default()
        };
        Self {
            reach: None,
            carried,
            lift: Some(lift),
            bin: None,
        }
    }
}

impl Reach {
    fn to(grasp: Grasp, policy: &Policy) -> Self {
        let approach = Move {
            to: beyond(&grasp, policy.overtravel),
            straight: true,
            speed: policy.approach_speed,
            contact: true,
            until_held: true,
            ..Move::default()
        };
        let back = Move {
            to: grasp.pregrasp,
            straight: true,
            contact: true,
            ..Move::default()
        };
        let pregrasp = Move {
            to: grasp.pregrasp,
            ..Move::default()
        };
        Self {
            grasp,
            pregrasp,
            approach,
            back,
        }
    }
}

/// The same contact with the tool turned about its own axis, by `turn` of [`TURNS_AT_OBJECT`].
pub(super) fn turned(mut grasp: Grasp, turn: u32) -> Grasp {
    if turn == 0 {
        return grasp;
    }
    let angle = std::f64::consts::TAU * f64::from(turn) / f64::from(TURNS_AT_OBJECT);
    let about_tool = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
    for pose in [&mut grasp.pregrasp, &mut grasp.grasp, &mut grasp.retreat] {
        let Quaternion { x, y, z, w } = pose.orientation;
        let before = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
        let turned = (before * about_tool).coords;
        (pose.orientation.x, pose.orientation.y) = (turned.x, turned.y);
        (pose.orientation.z, pose.orientation.w) = (turned.z, turned.w);
    }
    // Those of another heading.
    grasp.pregrasp_joints.clear();
    grasp.grasp_joints.clear();
    grasp
}

/// The planner's sizes where it knows them.
fn carried(grasp: &Grasp, default: Carried) -> Carried {
    let known = |value: f32, otherwise| if value > 0.0 { f64::from(value) } else { otherwise };
    Carried {
        radius: known(grasp.object_radius, default.radius),
        length: known(grasp.object_length, default.length),
    }
}

/// The grasp, `overtravel` metres further along the approach.
fn beyond(grasp: &Grasp, overtravel: f64) -> Pose {
    let (mut pose, along) = (grasp.grasp, &grasp.approach_axis);
    pose.position.x += along.x * overtravel;
    pose.position.y += along.y * overtravel;
    pose.position.z += along.z * overtravel;
    pose
}

/// Straight down over the bin, turned by `turn` of [`TURNS`] from the tool's own heading.
pub(super) fn over_bin(bin: &Bin, carried: Carried, tool: &RigidTransform, turn: u32) -> Move {
    let height = bin.rim + carried.length + bin.clearance;
    let heading = heading(tool) + std::f64::consts::TAU * f64::from(turn) / f64::from(TURNS);
    let down = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading)
        * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let to = RigidTransform::from_parts(bin.position.coords + Vector3::z() * height, down);
    Move {
        to: pose(&to),
        carried: Some(carried),
        ..Move::default()
    }
}

/// Of the tool's x axis on the table, radians from the base's x axis.
fn heading(tool: &RigidTransform) -> f64 {
    let x = tool.transform_direction(&Vector3::x());
    x.y.atan2(x.x)
}

fn pose(transform: &RigidTransform) -> Pose {
    let (at, [x, y, z, w]) = (transform.translation(), transform.quaternion_xyzw());
    Pose {
        position: Point {
            x: at.x,
            y: at.y,
            z: at.z,
        },
        orientation: Quaternion { x, y, z, w },
    }
}

#[cfg(test)]
mod tests {
    use geometry::nalgebra::Point3;
    use interfaces::geometry_msgs::msg::Vector3 as Vector3Message;

    use super::*;

    const CARRIED: Carried = Carried {
        radius: 0.03,
        length: 0.04,
    };

    fn turned_tool(heading: f64) -> RigidTransform {
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading)
            * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        RigidTransform::from_parts(Vector3::new(0.4, 0.0, 0.3), rotation)
    }

    fn transform(pose: &Pose) -> RigidTransform {
        let (at, q) = (&pose.position, &pose.orientation);
        RigidTransform::from_quaternion_xyzw([at.x, at.y, at.z], [q.x, q.y, q.z, q.w]).expect("a pose")
    }

    #[test]
    fn over_the_bin_the_tool_points_down_and_what_hangs_on_it_clears_the_rim() {
        let bin = Bin {
            position: Point3::new(0.18, 0.36, 0.0),
            rim: 0.06,
            clearance: 0.02,
        };
        for turn in 0..TURNS {
            let there = transform(&over_bin(&bin, CARRIED, &turned_tool(0.7), turn).to);
            assert!((there.translation() - Vector3::new(0.18, 0.36, 0.12)).norm() < 1e-12);
            assert!((there.transform_direction(&Vector3::z()) + Vector3::z()).norm() < 1e-12);
            let x = there.transform_direction(&Vector3::x());
            let expected = 0.7 + f64::from(turn) * std::f64::consts::TAU / 12.0;
            assert!((x - Vector3::new(expected.cos(), expected.sin(), 0.0)).norm() < 1e-12);
        }
    }

    #[test]
    fn the_approach_goes_on_along_its_axis() {
        let mut grasp = Grasp {
            approach_axis: Vector3Message {
                x: 0.6,
                y: 0.0,
                z: -0.8,
            },
            ..Grasp::default()
        };
        grasp.grasp.position.z = 0.03;
        let beyond = beyond(&grasp, 0.005).position;
        assert!((beyond.x - 0.003).abs() < 1e-12 && (beyond.z - 0.026).abs() < 1e-12);
    }

    #[test]
    fn a_turned_grasp_points_the_same_way_from_the_same_place() {
        let mut grasp = Grasp::default();
        for at in [&mut grasp.pregrasp, &mut grasp.grasp, &mut grasp.retreat] {
            *at = pose(&turned_tool(0.4));
        }
        assert_eq!(turned(grasp.clone(), 0), grasp);
        let now = transform(&turned(grasp, 1).retreat);
        let expected = turned_tool(0.4 - std::f64::consts::TAU / 6.0);
        assert!((now.translation() - expected.translation()).norm() < 1e-12);
        assert!(now.rotation().angle_to(&expected.rotation()) < 1e-9);
    }

    #[test]
    fn sizes_that_the_planner_does_not_know_are_the_default() {
        let mut grasp = Grasp::default();
        assert_eq!(carried(&grasp, CARRIED), CARRIED);
        grasp.object_length = 0.5;
        let carried = carried(&grasp, CARRIED);
        assert_eq!((carried.radius, carried.length), (0.03, 0.5));
    }
}
