//! Objects one by one, and all of them at one time.

use std::sync::Arc;

use geometry::RigidTransform;

use super::super::gallery::Places;
use crate::SimError;
use crate::physics::{Placed, Solid};
use crate::scene::Body;
use crate::world::Bin;

/// Where an object is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Place {
    /// It stands on the table, or on what stands there.
    OnTable,
    /// It hangs on the cup, or lies on what does.
    Held,
    /// Out of the cameras' sight.
    InBin,
    /// On the floor.
    OffTable,
}

/// An object of the world.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectState {
    /// As in the world file.
    pub name: String,
    /// Where it is.
    pub place: Place,
    /// Where it is exactly.
    pub base_from_object: RigidTransform,
    /// Where the world put it.
    pub base_from_object_at_start: RigidTransform,
}

#[derive(Debug, Clone)]
pub(in crate::cell) struct Item {
    pub(in crate::cell) name: String,
    pub(in crate::cell) solid: Arc<Solid>,
    pub(in crate::cell) place: Place,
    pub(in crate::cell) base_from_object: RigidTransform,
    pub(super) at_start: RigidTransform,
}

/// What cameras and contacts need to know, at one time.
#[derive(Debug, Clone)]
pub(in crate::cell) struct Inventory {
    pub(in crate::cell) number: u64,
    pub(in crate::cell) revision: u64,
    pub(in crate::cell) items: Vec<Item>,
    /// Of the object on the cup, with what lies on it.
    pub(in crate::cell) held: Vec<(usize, RigidTransform)>,
    pub(in crate::cell) bin: Bin,
}

impl Item {
    pub(super) fn new(body: &Body, bin: &Bin) -> Result<Self, SimError> {
        let body_from_base = body.base_from_body.inverse();
        let mut item = Self {
            name: body.name.clone(),
            solid: Arc::new(Solid::new(body.mesh.transformed(&body_from_base))?),
            place: Place::OnTable,
            base_from_object: body.base_from_body,
            at_start: body.base_from_body,
        };
        let centre = item.placed().centre_of_mass();
        if bin.holds(&centre) && centre.z < bin.height {
            item.place = Place::InBin;
        }
        Ok(item)
    }

    pub(in crate::cell) fn placed(&self) -> Placed<'_> {
        Placed {
            solid: &self.solid,
            base_from_solid: self.base_from_object,
        }
    }
}

impl Place {
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::OnTable => "on the table",
            Self::Held => "on the cup",
            Self::InBin => "in the bin",
            Self::OffTable => "on the floor, beside the table",
        }
    }
}

impl Inventory {
    /// Where the objects are that cameras can see.
    pub(in crate::cell) fn places(&self) -> Places {
        let seen = |(index, item): (usize, &Item)| {
            matches!(item.place, Place::OnTable | Place::Held).then_some((index, item.base_from_object))
        };
        self.items.iter().enumerate().filter_map(seen).collect()
    }

    /// The same, once what is held is out of sight; none when nothing is held.
    pub(in crate::cell) fn places_without_held(&self) -> Option<Places> {
        let stays = |(index, _): &(usize, RigidTransform)| self.items[*index].place == Place::OnTable;
        let is_held = self.items.iter().any(|item| item.place == Place::Held);
        is_held.then(|| self.places().into_iter().filter(stays).collect())
    }
}
