//! The objects and where they went: what stands on the table, what the cup holds, what lies in the bin.
//!
//! A held object moves with the cup as one piece, and what lies on it rides along. What is let go falls straight down on
//! what is below its centre of mass: into the bin's inner square, else until it meets the table or another object. What
//! lands on the table or the bin's floor alone tips over onto a face that it can stand on; what lands on another object keeps
//! its orientation. Nothing slides, and the bin's walls stop nothing that falls.

use geometry::RigidTransform;
use parking_lot::Mutex;

use crate::SimError;
use crate::arm::SuctionWorld;
use crate::physics::{Placed, gap_below};
use crate::world::World;
use ground::Ground;
use rim::Rim;

mod ground;
mod item;
mod rim;

pub(super) use item::{Inventory, Item};
pub use item::{ObjectState, Place};

/// What lies on something is this near to it, metres.
const NEAR: f64 = 0.000_5;

#[derive(Debug)]
pub(super) struct Stock {
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    /// Rises with every world.
    number: u64,
    /// Rises whenever an object comes to another place.
    revision: u64,
    items: Vec<Item>,
    grip: Grip,
    ground: Ground,
}

/// What the cup has to do with objects.
#[derive(Debug, Clone, Default)]
struct Grip {
    held: Vec<Held>,
    /// Where the cup sealed, until it is known what lies on the object.
    sealed_at: Option<RigidTransform>,
    /// Let go, and still in the air.
    falling: Vec<usize>,
}

#[derive(Debug, Clone, Copy)]
struct Held {
    item: usize,
    cup_from_object: RigidTransform,
}

impl Stock {
    pub(super) fn new(world: &World) -> Result<Self, SimError> {
        let state = Mutex::new(State::new(world, 0)?);
        Ok(Self { state })
    }

    /// Every object is where the world says, cup and bin are empty. True where that changes something that the arm did.
    pub(super) fn reset(&self, world: &World) -> Result<bool, SimError> {
        let number = self.state.lock().number + 1;
        let fresh = State::new(world, number)?;
        let mut state = self.state.lock();
        let was_changed = state.items.iter().any(|item| item.base_from_object != item.at_start);
        let revision = state.revision + 1;
        *state = State { revision, ..fresh };
        Ok(was_changed)
    }

    pub(super) fn inventory(&self) -> Inventory {
        let state = self.state.lock();
        let held = state.grip.held.iter().map(|held| (held.item, held.cup_from_object));
        Inventory {
            number: state.number,
            revision: state.revision,
            items: state.items.clone(),
            held: held.collect(),
            bin: state.ground.bin,
        }
    }

    /// The objects, those on the cup where they are for this pose of it.
    pub(super) fn objects(&self, base_from_cup: Option<&RigidTransform>) -> Vec<ObjectState> {
        let mut state = self.state.lock();
        if let Some(base_from_cup) = base_from_cup {
            state.carry(base_from_cup);
        }
        let object = |item: &Item| ObjectState {
            name: item.name.clone(),
            place: item.place,
            base_from_object: item.base_from_object,
            base_from_object_at_start: item.at_start,
        };
        state.items.iter().map(object).collect()
    }

    /// What is on the cup is moved with it; what lies on what was just taken hold of goes along; what was let go lands.
    /// Takes as long as rays do, and holds nobody up meanwhile.
    pub(super) fn follow(&self, base_from_cup: &RigidTransform) {
        let (number, mut items, grip, ground) = {
            let state = self.state.lock();
            (state.number, state.items.clone(), state.grip.clone(), state.ground)
        };
        let riders = grip
            .sealed_at
            .map(|sealed_at| (sealed_at, riders(&items, &grip, &sealed_at)));
        for &item in &grip.falling {
            ground.land(&mut items, item);
        }
        let mut state = self.state.lock();
        // Another world may have come in between.
        if state.number == number {
            state.put(&items, &grip.falling);
            if let Some((sealed_at, riders)) = riders {
                state.take_along(&riders, &sealed_at);
            }
        }
        state.carry(base_from_cup);
    }

    /// How deep (metres) the rim is in something that the cup does not hold, with its name. The table is at z = 0.
    pub(super) fn pressed(&self, base_from_cup: &RigidTransform) -> Option<(String, f64)> {
        let state = self.state.lock();
        let rim = Rim::at(base_from_cup);
        let standing = state.standing();
        let objects = standing.filter_map(|(_, item)| Some((item.name.clone(), rim.depth_in(&item.placed())?)));
        let table = std::iter::once(("table".to_owned(), rim.depth_in_table()));
        objects.chain(table).max_by(|(_, a), (_, b)| a.total_cmp(b))
    }
}

impl State {
    fn new(world: &World, number: u64) -> Result<Self, SimError> {
        let room = &world.scene.room;
        let bin = world.bin;
        let items = world.scene.bodies.iter().map(|body| Item::new(body, &bin));
        Ok(Self {
            number,
            revision: 0,
            items: items.collect::<Result<_, _>>()?,
            grip: Grip::default(),
            ground: Ground {
                bin,
                table: [room.table_centre, room.table_size],
            },
        })
    }

    fn standing(&self) -> impl Iterator<Item = (usize, &Item)> {
        let items = self.items.iter().enumerate();
        items.filter(|(_, item)| item.place == Place::OnTable)
    }

    fn carry(&mut self, base_from_cup: &RigidTransform) {
        for held in &self.grip.held {
            self.items[held.item].base_from_object = *base_from_cup * held.cup_from_object;
        }
    }

    /// Of what fell.
    fn put(&mut self, landed: &[Item], fallen: &[usize]) {
        for &item in fallen {
            tracing::info!("{} lies {}", landed[item].name, landed[item].place.words());
            self.items[item] = landed[item].clone();
            self.grip.falling.retain(|falling| *falling != item);
            self.revision += 1;
        }
    }

    /// Unless it has been let go already.
    fn take_along(&mut self, riders: &[usize], sealed_at: &RigidTransform) {
        if self.grip.sealed_at.take().is_some() {
            for &item in riders {
                self.take(item, sealed_at);
            }
        }
    }

    fn take(&mut self, item: usize, base_from_cup: &RigidTransform) {
        self.items[item].place = Place::Held;
        self.grip.held.push(Held {
            item,
            cup_from_object: base_from_cup.inverse() * self.items[item].base_from_object,
        });
        self.revision += 1;
    }

    /// The object that the whole rim lies on.
    fn touched(&self, base_from_cup: &RigidTransform) -> Option<usize> {
        let standing: Vec<_> = self.standing().map(|(index, item)| (index, item.placed())).collect();
        Rim::at(base_from_cup).sealed_on(&standing)
    }
}

impl SuctionWorld for Stock {
    fn touched(&self, base_from_cup: &RigidTransform) -> Option<f64> {
        let state = self.state.lock();
        state.touched(base_from_cup).map(|item| state.items[item].solid.mass())
    }

    fn sealed(&self, base_from_cup: &RigidTransform) {
        let mut state = self.state.lock();
        if let Some(item) = state.touched(base_from_cup) {
            state.take(item, base_from_cup);
            state.grip.sealed_at = Some(*base_from_cup);
        }
    }

    fn released(&self, base_from_cup: &RigidTransform) {
        let mut state = self.state.lock();
        state.carry(base_from_cup);
        let held: Vec<usize> = state.grip.held.drain(..).map(|held| held.item).collect();
        state.grip.sealed_at = None;
        state.grip.falling.extend(held);
    }
}

/// What lies on what was taken hold of, on that too, and so on.
fn riders(items: &[Item], grip: &Grip, base_from_cup: &RigidTransform) -> Vec<usize> {
    let at_seal = |held: &Held| Placed {
        base_from_solid: *base_from_cup * held.cup_from_object,
        ..items[held.item].placed()
    };
    let mut carriers: Vec<Placed<'_>> = grip.held.iter().map(at_seal).collect();
    let mut riders: Vec<usize> = Vec::new();
    let mut looked_at = 0;
    while let Some(carrier) = carriers.get(looked_at).copied() {
        looked_at += 1;
        for (index, item) in items.iter().enumerate() {
            let is_free = item.place == Place::OnTable && !riders.contains(&index);
            if is_free && gap_below(&item.placed(), &carrier) < NEAR {
                riders.push(index);
                carriers.push(item.placed());
            }
        }
    }
    riders
}

#[cfg(test)]
mod tests;
