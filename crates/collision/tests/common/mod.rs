//! The arm and its cell, as the tests use them.

#![allow(dead_code)]

use std::path::{Path, PathBuf};

use collision::{ArmModel, Scene, SelfCollision, XARM7_NEVER_TOUCHING};
use geometry::RigidTransform;
use kinematics::Chain;
use nalgebra::{UnitQuaternion, Vector3};

pub(crate) const HOME: [f64; 7] = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];

pub(crate) fn urdf(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../urdf").join(file)
}

pub(crate) fn robot() -> urdf_rs::Robot {
    urdf_rs::read_file(urdf("xarm7.urdf")).expect("xarm7.urdf is a URDF")
}

pub(crate) fn chain() -> Chain<7> {
    Chain::from_urdf(&robot(), "link_base", "link_tcp").expect("a chain of seven joints")
}

pub(crate) fn arm() -> ArmModel<7> {
    let leave_out = SelfCollision {
        never: &XARM7_NEVER_TOUCHING,
        free_at: &[HOME, [0.0; 7]],
    };
    ArmModel::from_urdf(&robot(), "link_base", chain(), &leave_out).expect("an arm")
}

/// Table, mat and panels; the arm's base stands on the table.
pub(crate) fn cell() -> Scene {
    let robot = urdf_rs::read_file(urdf("cell.urdf")).expect("cell.urdf is a URDF");
    let mut scene = Scene::from_urdf(&robot, "link_base").expect("a scene");
    scene.except("link_base", "table").expect("the table is there");
    scene
}

pub(crate) fn at(x: f64, y: f64, z: f64) -> RigidTransform {
    RigidTransform::from_parts(Vector3::new(x, y, z), UnitQuaternion::identity())
}
