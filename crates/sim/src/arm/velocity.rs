//! Modes 4 and 5: velocities of joints or tool.

use geometry::RigidTransform;
use geometry::nalgebra::{SMatrix, SVector};

use super::STEP;
use super::model::{ArmModel, Joints};
use super::planner::fault;
use super::servo::JOINT_SPEED;

/// Damping of the pseudoinverse near singularities (m², rad²).
const DAMPING: f64 = 1e-6;

/// What the velocities are approached with, per second squared.
#[derive(Debug, Clone, Copy)]
pub(super) struct Accelerations {
    pub(super) joints: f64,
    pub(super) tool: f64,
    pub(super) rotation: f64,
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Velocity {
    Joints {
        wanted: Joints,
        now: Joints,
        /// All joints take as long as the slowest.
        synchronous: bool,
    },
    /// m/s, rad/s.
    Tool {
        wanted: [f64; 6],
        now: [f64; 6],
        in_tool: bool,
    },
}

impl Velocity {
    /// What is wanted next, from the speed that there is now.
    pub(super) fn towards(self, next: Self) -> Self {
        match (self, next) {
            (
                Self::Joints { now, .. },
                Self::Joints {
                    wanted, synchronous, ..
                },
            ) => Self::Joints {
                wanted,
                now,
                synchronous,
            },
            (Self::Tool { now, in_tool: is, .. }, Self::Tool { wanted, in_tool, .. }) if is == in_tool => {
                Self::Tool { wanted, now, in_tool }
            }
            _ => next,
        }
    }
}

/// A velocity and how long it is to last.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jog {
    pub(super) velocity: Velocity,
    /// Seconds; none: until another comes.
    pub(super) left: Option<f64>,
}

impl Jog {
    pub(super) fn joints() -> Self {
        Self {
            velocity: Velocity::Joints {
                wanted: [0.0; 7],
                now: [0.0; 7],
                synchronous: true,
            },
            left: None,
        }
    }

    pub(super) fn tool() -> Self {
        Self {
            velocity: Velocity::Tool {
                wanted: [0.0; 6],
                now: [0.0; 6],
                in_tool: false,
            },
            left: None,
        }
    }

    /// Where the joints are a step later; the number of an error when they cannot be there.
    pub(super) fn step(
        &mut self,
        accelerations: &Accelerations,
        model: &ArmModel,
        joints: &Joints,
        flange_from_tool: &RigidTransform,
    ) -> Result<Joints, u8> {
        self.end_in_time();
        let velocities = match &mut self.velocity {
            Velocity::Joints {
                wanted,
                now,
                synchronous,
            } => {
                approach(now, wanted, [accelerations.joints; 7], *synchronous);
                *now
            }
            Velocity::Tool { wanted, now, in_tool } => {
                let [tool, rotation] = [accelerations.tool, accelerations.rotation];
                approach(now, wanted, [tool, tool, tool, rotation, rotation, rotation], true);
                joint_velocities(model, joints, flange_from_tool, now, *in_tool)
            }
        };
        if velocities
            .iter()
            .any(|velocity| velocity.abs() > JOINT_SPEED * (1.0 + 1e-6))
        {
            return Err(fault::JOINT_SPEED);
        }
        let next: Joints = std::array::from_fn(|joint| joints[joint] + velocities[joint] * STEP);
        // A joint that stands outside may go back in.
        let leaves = |joint: usize| (next[joint] - joints[joint]) * (joints[joint] - model.middle(joint)) > 0.0;
        match model.outside(&next) {
            Some(joint) if leaves(joint) => Err(fault::JOINT_RANGE),
            _ => Ok(next),
        }
    }

    fn end_in_time(&mut self) {
        let Some(left) = &mut self.left else { return };
        *left -= STEP;
        if *left <= 0.0 {
            self.left = None;
            match &mut self.velocity {
                Velocity::Joints { wanted, .. } => *wanted = [0.0; 7],
                Velocity::Tool { wanted, .. } => *wanted = [0.0; 6],
            }
        }
    }
}

fn approach<const N: usize>(now: &mut [f64; N], wanted: &[f64; N], accelerations: [f64; N], together: bool) {
    let time = |index: usize| (wanted[index] - now[index]).abs() / accelerations[index];
    let slowest = (0..N).map(time).fold(0.0, f64::max);
    let times: [f64; N] = std::array::from_fn(|index| if together { slowest } else { time(index) });
    for index in 0..N {
        let share = if times[index] > STEP { STEP / times[index] } else { 1.0 };
        now[index] += (wanted[index] - now[index]) * share;
    }
}

/// `Jᵀ (J Jᵀ + λ)⁻¹ v`.
fn joint_velocities(
    model: &ArmModel,
    joints: &Joints,
    flange_from_tool: &RigidTransform,
    twist: &[f64; 6],
    in_tool: bool,
) -> Joints {
    let jacobian = model.jacobian(joints, flange_from_tool);
    let mut twist = SVector::<f64, 6>::from(*twist);
    if in_tool {
        let rotation = (model.flange(joints) * *flange_from_tool).rotation();
        let (linear, angular) = (
            rotation * twist.fixed_rows::<3>(0).into_owned(),
            rotation * twist.fixed_rows::<3>(3).into_owned(),
        );
        twist.fixed_rows_mut::<3>(0).copy_from(&linear);
        twist.fixed_rows_mut::<3>(3).copy_from(&angular);
    }
    let square = jacobian * jacobian.transpose() + SMatrix::<f64, 6, 6>::identity() * DAMPING;
    let solved = square
        .cholesky()
        .map(|square| jacobian.transpose() * square.solve(&twist));
    solved.unwrap_or_else(SVector::zeros).into()
}
