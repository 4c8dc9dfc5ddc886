//! The arm in the cell: it carries a camera and, on its cup, objects; and it can hit them.

use std::sync::Arc;
use std::thread::JoinHandle;

use geometry::RigidTransform;

use super::contact::{Contacts, WorldContact};
use super::follower::Follower;
use super::gallery::Gallery;
use super::stock::Stock;
use crate::SimError;
use crate::arm::{ArmController, ArmMoment, SuctionWorld};
use crate::world::{Arm, Collisions};

pub(super) struct MountedArm {
    controller: Arc<ArmController>,
    follower: Arc<Follower>,
    flange_from_cup: RigidTransform,
    thread: Option<JoinHandle<()>>,
}

impl MountedArm {
    /// Switches it on; from now on it moves the flange.
    pub(super) fn start(arm: &Arm, gallery: &Arc<Gallery>, stock: &Arc<Stock>) -> Result<Self, SimError> {
        let mut config = arm.config();
        config.suction = Some(Arc::clone(stock) as Arc<dyn SuctionWorld>);
        let flange_from_cup = config.flange_from_cup;
        let contacts = Contacts::new(&flange_from_cup)?;
        let follower = Arc::new(Follower::new(flange_from_cup, Arc::clone(gallery), Arc::clone(stock)));
        let watcher = Arc::clone(&follower);
        let controller = ArmController::start_watched(config, move |moment: &ArmMoment| watcher.tell(moment))?;
        let controller = Arc::new(controller);
        let (running, hit) = (Arc::clone(&follower), Arc::clone(&controller));
        let stops = arm.collisions == Collisions::Stop;
        let thread = std::thread::spawn(move || {
            running.run(contacts, || {
                if stops {
                    hit.raise_error(COLLISION);
                }
            });
        });
        Ok(Self {
            controller,
            follower,
            flange_from_cup,
            thread: Some(thread),
        })
    }

    pub(super) fn controller(&self) -> &ArmController {
        &self.controller
    }

    pub(super) fn base_from_cup(&self) -> RigidTransform {
        self.controller.moment().base_from_flange * self.flange_from_cup
    }

    pub(super) fn collisions(&self) -> Vec<WorldContact> {
        self.follower.collisions()
    }

    /// What the cup held is not there any more.
    pub(super) fn let_go(&self) {
        if self.controller.moment().held.is_some() {
            self.controller.lose_object();
        }
    }
}

impl Drop for MountedArm {
    fn drop(&mut self) {
        self.follower.end();
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has said so on standard error.
            let _ = thread.join();
        }
    }
}

/// The controller's error when its motors feel more than they should.
const COLLISION: u8 = 31;
