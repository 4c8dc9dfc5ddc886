//! Follows the arm beside its controller's clock, which waits for nothing: takes objects along, lets them fall, shows the
//! cameras, looks for collisions.

use std::sync::Arc;
use std::time::{Duration, Instant};

use geometry::RigidTransform;
use parking_lot::{Condvar, Mutex};

use super::contact::{Contacts, WorldContact};
use super::gallery::{Gallery, Scenery};
use super::stock::Stock;
use crate::arm::ArmMoment;

/// An arm that moves is followed every so many steps of its controller, and when it rests.
const STEPS_FOLLOWED: u32 = 10;
/// A joint that is slower rests, rad/s.
const RESTING: f64 = 1e-9;
/// What has been still for so long is looked at; with the pump on, the arm pauses only to take hold.
const STILL: [Duration; 2] = [Duration::from_millis(100), Duration::from_millis(500)];
/// A look that takes longer is told of: contacts are found late.
const LONG: Duration = Duration::from_millis(200);

pub(super) struct Follower {
    flange_from_cup: RigidTransform,
    gallery: Arc<Gallery>,
    stock: Arc<Stock>,
    slot: Mutex<Slot>,
    told: Condvar,
    collisions: Mutex<Vec<WorldContact>>,
}

/// The newest step of the arm.
#[derive(Default)]
struct Slot {
    steps: u32,
    /// As it was last followed.
    followed: Option<ArmMoment>,
    /// To be followed.
    next: Option<ArmMoment>,
    ended: bool,
}

impl Follower {
    pub(super) fn new(flange_from_cup: RigidTransform, gallery: Arc<Gallery>, stock: Arc<Stock>) -> Self {
        Self {
            flange_from_cup,
            gallery,
            stock,
            slot: Mutex::default(),
            told: Condvar::new(),
            collisions: Mutex::default(),
        }
    }

    /// On the controller's thread, after every step.
    pub(super) fn tell(&self, moment: &ArmMoment) {
        let mut slot = self.slot.lock();
        slot.steps = slot.steps.wrapping_add(1);
        if slot.is_news(moment) {
            slot.followed = Some(*moment);
            slot.next = Some(*moment);
            self.told.notify_one();
        }
    }

    pub(super) fn collisions(&self) -> Vec<WorldContact> {
        self.collisions.lock().clone()
    }

    pub(super) fn end(&self) {
        self.slot.lock().ended = true;
        self.told.notify_one();
    }

    /// Follows until the end; calls `hit` at every new collision.
    pub(super) fn run(&self, mut contacts: Contacts, hit: impl Fn()) {
        while let Some(moment) = self.next() {
            let start = Instant::now();
            let base_from_cup = moment.base_from_flange * self.flange_from_cup;
            self.stock.follow(&base_from_cup);
            let inventory = self.stock.inventory();
            self.gallery.show(Scenery {
                number: inventory.number,
                base_from_flange: moment.base_from_flange,
                places: inventory.places(),
                expected: inventory.places_without_held(),
                still: STILL[usize::from(moment.vacuum)],
            });
            let pressed = self.stock.pressed(&base_from_cup);
            if contacts.look(&moment, &inventory, pressed, &mut self.collisions.lock()) {
                hit();
            }
            let took = start.elapsed();
            if took > LONG {
                tracing::debug!(?took, "the arm's surroundings were looked at for long");
            }
        }
    }

    /// None at the end.
    fn next(&self) -> Option<ArmMoment> {
        let mut slot = self.slot.lock();
        while !slot.ended {
            if let Some(moment) = slot.next.take() {
                return Some(moment);
            }
            self.told.wait(&mut slot);
        }
        None
    }
}

impl Slot {
    fn is_news(&self, moment: &ArmMoment) -> bool {
        let Some(followed) = &self.followed else {
            return true;
        };
        let is_other = moment.held != followed.held || moment.vacuum != followed.vacuum;
        let rests = moment.velocities.iter().all(|velocity| velocity.abs() < RESTING);
        let has_moved = moment.joints.map(f64::to_bits) != followed.joints.map(f64::to_bits);
        is_other || has_moved && (rests || self.steps.is_multiple_of(STEPS_FOLLOWED))
    }
}
