//! The bodies that can hit each other.

use collision::{ArmModel, CarriedObject, Scene, SelfCollision, Shape};
use geometry::RigidTransform;
use geometry::nalgebra::Vector3;
use kinematics::Chain;

use super::super::stock::Item;
use super::{BIN, TABLE};
use crate::SimError;
use crate::arm::{ArmError, nominal_robot};
use crate::world::Bin;

/// Of the URDF.
const BASE: &str = "link_base";
const GRIPPER: &str = "vacuum_gripper";
/// The lip, which is looked at by its rim.
const CUP: &str = "vacuum_cup";

/// The nominal arm with its gripper and camera, without the cup's lip. That it touches itself is not looked for here: its
/// controller does.
pub(super) fn arm() -> Result<ArmModel<7>, SimError> {
    let mut robot = nominal_robot()?;
    for link in robot.links.iter_mut().filter(|link| link.name == CUP) {
        link.collision.clear();
    }
    let names: Vec<&str> = robot.links.iter().map(|link| link.name.as_str()).collect();
    let pairs: Vec<[&str; 2]> = names.iter().flat_map(|a| names.iter().map(move |b| [*a, *b])).collect();
    let leave_out = SelfCollision {
        never: &pairs,
        free_at: &[],
    };
    let chain = Chain::from_urdf(&robot, BASE, "link_eef").map_err(ArmError::from)?;
    Ok(ArmModel::from_urdf(&robot, BASE, chain, &leave_out)?)
}

/// What is there besides the objects.
pub(super) fn surroundings(bin: &Bin) -> Result<Scene, SimError> {
    let mut scene = Scene::new();
    scene.add_half_space(TABLE, &Vector3::z_axis(), 0.0)?;
    // It stands there.
    scene.except(BASE, TABLE)?;
    let walls = collision::Bin {
        inside: [bin.size, bin.size, bin.height - Bin::FLOOR],
        wall: Bin::WALL,
    };
    scene.add_bin(BIN, &bin.base_from_bin(), &walls)?;
    Ok(scene)
}

pub(super) fn carried(
    arm: &ArmModel<7>,
    item: &Item,
    flange_from_object: &RigidTransform,
) -> Result<CarriedObject, SimError> {
    let shape = Shape::mesh(&item.solid.mesh().transformed(flange_from_object))?;
    Ok(CarriedObject::new(arm, &item.name, &[shape], &[GRIPPER])?)
}
