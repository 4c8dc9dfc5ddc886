//! Joint angles for a grasp, of the arm as drawn.

use std::f64::consts::FRAC_PI_6;

use geometry::nalgebra::UnitQuaternion;
use grasp::{Approach, Grasp, Way};
use kinematics::{Chain, IkOptions, KinematicsError};
use nalgebra::SVector;

use crate::error::Error;
use crate::parameters::Parameters;

const ARM: &str = include_str!("../../../urdf/xarm7.urdf");
const TOOL: &str = "link_tcp";

/// Turns of the tool about its own axis that are tried, in 30 degrees, the least first.
const TURNS: [i8; 12] = [0, 1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6];
/// The seed is near and there are other turns to try: what takes longer is not worth the time.
const ATTEMPTS: usize = 12;

/// Angles from the base on, radians.
pub(crate) type Joints = [f64; 7];

pub(crate) struct Reach {
    chain: Chain<7>,
    home: SVector<f64, 7>,
    /// How the tool is held at home.
    base_from_held: UnitQuaternion<f64>,
}

/// A grasp with the tool's poses and, if the arm gets there, its angles.
#[derive(Debug)]
pub(crate) struct Placed {
    pub(crate) grasp: Grasp,
    pub(crate) approach: Approach,
    pub(crate) joints: Result<Angles, KinematicsError>,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Angles {
    pub(crate) pregrasp: Joints,
    pub(crate) grasp: Joints,
}

impl Reach {
    pub(crate) fn load(parameters: &Parameters) -> Result<Self, Error> {
        let file = &parameters.arm_description;
        let (what, text) = if file.is_empty() {
            ("the built-in one".to_owned(), Ok(ARM.to_owned()))
        } else {
            (file.clone(), std::fs::read_to_string(file))
        };
        let wrong = |reason: &dyn std::fmt::Display| Error::Description {
            what: what.clone(),
            reason: reason.to_string(),
        };
        let robot = urdf_rs::read_from_string(&text.map_err(|error| wrong(&error))?).map_err(|error| wrong(&error))?;
        let base = parameters.base_frame_id.get();
        let chain = Chain::from_urdf(&robot, &base, TOOL).map_err(|error| wrong(&error))?;
        Self::new(chain, &parameters.home)
    }

    pub(crate) fn new(chain: Chain<7>, home: &[f64]) -> Result<Self, Error> {
        let wrong = |reason| Error::Value { name: "home", reason };
        let angles = Joints::try_from(home).map_err(|_| wrong(format!("{} angles, allowed are 7", home.len())))?;
        let home = SVector::from(angles);
        let held = chain.require_limits(&home).and_then(|()| chain.forward(&home));
        let held = held.map_err(|error| wrong(error.to_string()))?;
        Ok(Self {
            chain,
            home,
            base_from_held: held.rotation(),
        })
    }

    /// The tool turned as at home, or as little from that as the arm needs to get there.
    pub(crate) fn place(&self, grasp: Grasp, way: &Way) -> Placed {
        let turned = |turn: i8| grasp.approach(&self.base_from_held, f64::from(turn) * FRAC_PI_6, way);
        let mut nearest = None;
        for turn in TURNS {
            let approach = turned(turn);
            match self.angles(&approach) {
                Ok(angles) => {
                    return Placed {
                        approach,
                        joints: Ok(angles),
                        grasp,
                    };
                }
                Err(error) => nearest.get_or_insert((approach, error)),
            };
        }
        let (approach, error) = nearest.expect("at least one turn was tried");
        Placed {
            approach,
            joints: Err(error),
            grasp,
        }
    }

    fn angles(&self, approach: &Approach) -> Result<Angles, KinematicsError> {
        let options = IkOptions {
            attempts: ATTEMPTS,
            ..IkOptions::default()
        };
        let pregrasp = self.chain.solve(&approach.pregrasp, &self.home, &options)?.angles;
        let grasp = self.chain.solve(&approach.grasp, &pregrasp, &options)?.angles;
        Ok(Angles {
            pregrasp: pregrasp.into(),
            grasp: grasp.into(),
        })
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use grasp::{Cup, PlanOptions, plan};

    use super::*;
    use crate::view::tests::plate_at;

    const WAY: Way = Way {
        pregrasp_distance: 0.05,
        retreat_height: 0.1,
    };

    pub(crate) fn reach() -> Reach {
        let robot = urdf_rs::read_from_string(ARM).expect("the built-in arm");
        let chain = Chain::from_urdf(&robot, "link_base", TOOL).expect("a chain");
        Reach::new(chain, &[0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0]).expect("home is within the limits")
    }

    fn grasp_at(middle: [f64; 2]) -> Grasp {
        let view = plate_at("c1", middle);
        let found = plan(&[view.input()], &Cup::default(), &PlanOptions::default()).expect("a plan");
        found.grasps.into_iter().next().expect("the plate can be held")
    }

    #[test]
    fn angles_give_the_poses_and_the_way_between_them_is_short() {
        let reach = reach();
        for middle in [[0.4, 0.0], [0.3, 0.25], [0.55, -0.2]] {
            let placed = reach.place(grasp_at(middle), &WAY);
            let angles = placed.joints.expect("within reach");
            let poses = [placed.approach.pregrasp, placed.approach.grasp];
            for (joints, pose) in [angles.pregrasp, angles.grasp].into_iter().zip(poses) {
                let reached = reach.chain.forward(&SVector::from(joints)).expect("finite");
                assert!((reached.translation() - pose.translation()).norm() < 1e-6);
                assert!(reached.rotation().angle_to(&pose.rotation()) < 1e-6);
            }
            let change = SVector::from(angles.grasp) - SVector::from(angles.pregrasp);
            assert!(change.amax() < 0.5, "{change}");
        }
    }

    #[test]
    fn what_is_too_far_away_says_by_how_much() {
        let placed = reach().place(grasp_at([1.4, 0.0]), &WAY);
        let error = placed.joints.expect_err("beyond reach").to_string();
        assert!(error.contains("mm and"), "{error}");
    }

    #[test]
    fn a_home_that_the_arm_cannot_have_is_refused() {
        let Reach { chain, .. } = reach();
        for (home, expected) in [(&[0.0; 6][..], "6 angles"), (&[9.0; 7], "limits")] {
            let text = Reach::new(chain.clone(), home).err().expect("refused").to_string();
            assert!(text.contains("parameter home") && text.contains(expected), "{text}");
        }
    }
}
