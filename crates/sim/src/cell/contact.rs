//! What the arm hits: its links, and what its cup carries, against objects, table and bin.
//!
//! The cup's lip, the last 12 mm of the tool, may touch: it gives way. Pressed deeper than that it is a collision too.

use collision::{ArmModel, CarriedObject, Checker, Scene, SelfCollision, Shape};
use geometry::RigidTransform;
use geometry::nalgebra::Vector3;
use kinematics::Chain;
use urdf_rs::Geometry;

use super::stock::{Inventory, Item, LIP, Place};
use crate::SimError;
use crate::arm::{ArmMoment, nominal_robot};
use crate::world::Bin;

/// Things that are less deep in each other only touch, metres.
const TOUCH: f64 = 0.001;
/// A lip that is deeper in something is pressed too far, metres.
const PRESSED: f64 = 0.005;
/// Contacts kept; later ones are counted in the log only.
const MOST_KEPT: usize = 10_000;
/// Of the URDF.
const BASE: &str = "link_base";
const GRIPPER: &str = "vacuum_gripper";
const LIP_NAME: &str = "cup";
const TABLE: &str = "table";
const BIN: &str = "bin";
/// Before the names of objects among the obstacles.
const OBJECT: &str = "object ";

/// Something that the arm hit.
#[derive(Debug, Clone, PartialEq)]
pub struct WorldContact {
    /// Of the arm as its URDF names it, `cup` for the cup's lip, or the name of the carried object.
    pub link: String,
    /// What was hit: an object's name, `table` or `bin`.
    pub object: String,
    /// The deepest that they were in each other, metres.
    pub depth: f64,
    /// When it began: microseconds of the controller's clock.
    pub micros: u64,
}

pub(super) struct Contacts {
    arm: ArmModel<7>,
    flange_from_cup: RigidTransform,
    /// What stands around.
    scene: Scene,
    /// Objects in `scene`, with where they stand there.
    standing: Vec<(String, RigidTransform)>,
    carried: Vec<CarriedObject>,
    /// Of the inventory that the scene shows.
    shown: Option<[u64; 2]>,
    looked_at: Option<[f64; 7]>,
    /// The contact of the last look.
    present: Option<WorldContact>,
}

impl Contacts {
    pub(super) fn new(flange_from_cup: &RigidTransform) -> Result<Self, SimError> {
        Ok(Self {
            arm: arm()?,
            flange_from_cup: *flange_from_cup,
            scene: Scene::new(),
            standing: Vec::new(),
            carried: Vec::new(),
            shown: None,
            looked_at: None,
            present: None,
        })
    }

    /// Looks once where the arm has moved; true when it hit something, or went a touch deeper in than it was.
    pub(super) fn look(
        &mut self,
        moment: &ArmMoment,
        inventory: &Inventory,
        pressed: Option<(String, f64)>,
        kept: &mut Vec<WorldContact>,
    ) -> bool {
        if self.looked_at == Some(moment.joints) {
            return false;
        }
        self.looked_at = Some(moment.joints);
        let version = [inventory.number, inventory.revision];
        if self.shown != Some(version)
            && let Err(error) = self.show(inventory)
        {
            tracing::warn!("collisions are not looked for: {error}");
            return false;
        }
        self.shown = Some(version);
        let found = self.pressed(pressed, moment).or_else(|| self.deepest(moment));
        self.report(found, kept)
    }

    fn report(&mut self, found: Option<WorldContact>, kept: &mut Vec<WorldContact>) -> bool {
        let Some(found) = found else {
            self.present = None;
            return false;
        };
        if let Some(present) = self.present.as_mut().filter(|present| present.is_of(&found)) {
            let is_worse = found.depth > present.depth + TOUCH;
            if is_worse {
                present.depth = found.depth;
                if let Some(last) = kept.last_mut().filter(|last| last.is_of(&found)) {
                    last.depth = found.depth;
                }
            }
            return is_worse;
        }
        let WorldContact {
            link,
            object,
            depth,
            micros,
        } = &found;
        let (millimetres, seconds) = (depth * 1e3, *micros as f64 * 1e-6);
        tracing::warn!("the arm's {link} is {millimetres:.1} mm deep in {object}, {seconds:.2} s after its start");
        if kept.len() < MOST_KEPT {
            kept.push(found.clone());
        }
        self.present = Some(found);
        true
    }

    fn pressed(&self, pressed: Option<(String, f64)>, moment: &ArmMoment) -> Option<WorldContact> {
        let (object, depth) = pressed.filter(|(_, depth)| *depth > PRESSED)?;
        Some(WorldContact {
            link: LIP_NAME.to_owned(),
            object,
            depth,
            micros: moment.micros,
        })
    }

    fn deepest(&self, moment: &ArmMoment) -> Option<WorldContact> {
        let free = Checker::new(&self.arm, &self.scene);
        let checkers = std::iter::once(free).chain(self.carried.iter().map(|object| free.carrying(object)));
        let contacts = checkers.filter_map(|checker| checker.check(&moment.joints).ok().flatten());
        let deepest = contacts.max_by(|a, b| a.depth().total_cmp(&b.depth()))?;
        (deepest.depth() > TOUCH).then(|| WorldContact {
            link: deepest.link.to_owned(),
            object: name_of(deepest.with.name()).to_owned(),
            depth: deepest.depth(),
            micros: moment.micros,
        })
    }

    fn show(&mut self, inventory: &Inventory) -> Result<(), SimError> {
        let is_other_world = self.shown.is_none_or(|[number, _]| number != inventory.number);
        if is_other_world {
            self.scene = surroundings(&inventory.bin)?;
            self.standing.clear();
        }
        self.clear_away(inventory)?;
        let stands = |item: &&Item| item.place == Place::OnTable;
        for item in inventory.items.iter().filter(stands) {
            if self.standing.iter().all(|(name, _)| *name != item.name) {
                let mesh = item.solid.mesh();
                self.scene.add_mesh(&label(&item.name), &item.base_from_object, mesh)?;
                self.standing.push((item.name.clone(), item.base_from_object));
            }
        }
        let carried = inventory.held.iter().map(|(item, cup_from_object)| {
            let flange_from_object = self.flange_from_cup * *cup_from_object;
            carried(&self.arm, &inventory.items[*item], &flange_from_object)
        });
        self.carried = carried.collect::<Result<_, _>>()?;
        Ok(())
    }

    /// What does not stand any more where it stood.
    fn clear_away(&mut self, inventory: &Inventory) -> Result<(), SimError> {
        let stands = |(name, there): &(String, RigidTransform)| {
            let mut items = inventory.items.iter();
            items.any(|item| item.name == *name && item.place == Place::OnTable && item.base_from_object == *there)
        };
        let (stay, gone): (Vec<_>, Vec<_>) = self.standing.drain(..).partition(stands);
        self.standing = stay;
        for (name, _) in gone {
            self.scene.remove(&label(&name))?;
        }
        Ok(())
    }
}

impl WorldContact {
    fn is_of(&self, other: &Self) -> bool {
        self.link == other.link && self.object == other.object
    }
}

/// Obstacles that are objects are told from the others.
fn label(name: &str) -> String {
    format!("{OBJECT}{name}")
}

fn name_of(label: &str) -> &str {
    label.strip_prefix(OBJECT).unwrap_or(label)
}

/// The nominal arm with its gripper and camera, without the cup's lip. That it touches itself is not looked for here: its
/// controller does.
fn arm() -> Result<ArmModel<7>, SimError> {
    let mut robot = nominal_robot()?;
    let gripper = robot.links.iter_mut().find(|link| link.name == GRIPPER);
    for collision in gripper.into_iter().flat_map(|link| &mut link.collision) {
        if let Geometry::Box { size } = &mut collision.geometry {
            size.0[2] -= LIP;
            collision.origin.xyz.0[2] -= LIP / 2.0;
        }
    }
    let names: Vec<&str> = robot.links.iter().map(|link| link.name.as_str()).collect();
    let pairs: Vec<[&str; 2]> = names.iter().flat_map(|a| names.iter().map(move |b| [*a, *b])).collect();
    let leave_out = SelfCollision {
        never: &pairs,
        free_at: &[],
    };
    let chain = Chain::from_urdf(&robot, BASE, "link_eef").map_err(crate::arm::ArmError::from)?;
    Ok(ArmModel::from_urdf(&robot, BASE, chain, &leave_out)?)
}

/// What is there besides the objects.
fn surroundings(bin: &Bin) -> Result<Scene, SimError> {
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

fn carried(arm: &ArmModel<7>, item: &Item, flange_from_object: &RigidTransform) -> Result<CarriedObject, SimError> {
    let shape = Shape::mesh(&item.solid.mesh().transformed(flange_from_object))?;
    Ok(CarriedObject::new(arm, &item.name, &[shape], &[GRIPPER])?)
}
