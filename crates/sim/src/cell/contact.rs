//! What the arm hits: its links, and what its cup carries, against objects, table and bin.
//!
//! The cup's lip, the last 12 mm of the tool, may touch, and so may what hangs on it: it gives way. Pressed deeper than that
//! it is a collision too.

use collision::{ArmModel, CarriedObject, Checker, Contact, Scene, Touched};
use geometry::RigidTransform;

use super::stock::{Inventory, Item, Place};
use crate::SimError;
use crate::arm::ArmMoment;

mod model;

/// Things that are less deep in each other only touch, metres.
const TOUCH: f64 = 0.001;
/// What hangs on the lip may be pressed this deep into something: the lip gives way as much, metres.
const GIVEN: f64 = 0.003;
/// A lip that is deeper in something is pressed too far, metres.
const PRESSED: f64 = 0.005;
/// Things that an object may lie in when it is picked.
const MOST_OVERLAPS: usize = 8;
/// Contacts kept; later ones are counted in the log only.
const MOST_KEPT: usize = 10_000;
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
            arm: model::arm()?,
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
            && let Err(error) = self.show(inventory, &moment.joints)
        {
            tracing::warn!("collisions are not looked for: {error}");
            return false;
        }
        self.shown = Some(version);
        let found = too_deep(pressed, moment).or_else(|| self.deepest(moment));
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

    fn deepest(&self, moment: &ArmMoment) -> Option<WorldContact> {
        let free = Checker::new(&self.arm, &self.scene);
        let checkers = std::iter::once(free).chain(self.carried.iter().map(|object| free.carrying(object)));
        let contacts = checkers.filter_map(|checker| checker.check(&moment.joints).ok().flatten());
        let links: Vec<&str> = self.arm.link_names().collect();
        let is_hit =
            |contact: &Contact<'_>| contact.depth() > if links.contains(&contact.link) { TOUCH } else { GIVEN };
        let deepest = contacts.filter(is_hit).max_by(|a, b| a.depth().total_cmp(&b.depth()))?;
        Some(WorldContact {
            link: deepest.link.to_owned(),
            object: name_of(deepest.with.name()).to_owned(),
            depth: deepest.depth(),
            micros: moment.micros,
        })
    }

    fn show(&mut self, inventory: &Inventory, joints: &[f64; 7]) -> Result<(), SimError> {
        let is_other_world = self.shown.is_none_or(|[number, _]| number != inventory.number);
        if is_other_world {
            self.scene = model::surroundings(&inventory.bin)?;
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
            model::carried(&self.arm, &inventory.items[*item], &flange_from_object)
        });
        self.carried = carried.collect::<Result<_, _>>()?;
        self.except_overlaps(inventory, joints)
    }

    /// What lay in something from the start may be taken out of it.
    fn except_overlaps(&mut self, inventory: &Inventory, joints: &[f64; 7]) -> Result<(), SimError> {
        for (object, (item, _)) in self.carried.iter().zip(&inventory.held) {
            let name = &inventory.items[*item].name;
            for _ in 0..MOST_OVERLAPS {
                let found = Checker::new(&self.arm, &self.scene).carrying(object).check(joints)?;
                let overlap = found.filter(|found| found.link == name && found.depth() > TOUCH);
                let Some(Touched::Obstacle(obstacle)) = overlap.map(|found| found.with) else {
                    break;
                };
                let obstacle = obstacle.to_owned();
                self.scene.except(name, &obstacle)?;
            }
        }
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

/// A lip that is pressed on beyond what it gives way.
fn too_deep(pressed: Option<(String, f64)>, moment: &ArmMoment) -> Option<WorldContact> {
    let (object, depth) = pressed.filter(|(_, depth)| *depth > PRESSED)?;
    Some(WorldContact {
        link: LIP_NAME.to_owned(),
        object,
        depth,
        micros: moment.micros,
    })
}

/// Obstacles that are objects are told from the others.
fn label(name: &str) -> String {
    format!("{OBJECT}{name}")
}

fn name_of(label: &str) -> &str {
    label.strip_prefix(OBJECT).unwrap_or(label)
}
