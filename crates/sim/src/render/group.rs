//! What is seen in a pixel in which more than one plane is seen.

use super::direct::{Facing, Origin, Patch};
use super::stage::{Place, Stage};

/// Parts of a pixel face the same way up to this cosine between their normals.
const COSINE: f64 = 0.95;

/// Parts of a pixel on one body, or on one surface of the room.
pub(super) struct Group {
    pub(super) first: Place,
    albedos: f64,
    facings: Vec<Facing>,
    origins: Vec<Origin>,
}

impl Group {
    /// Adds a place to the group it belongs to.
    pub(super) fn add(groups: &mut Vec<Self>, stage: &Stage<'_>, place: Place) {
        let together = |group: &&mut Self| match stage.body(place.surface) {
            Some(body) => stage.body(group.first.surface) == Some(body),
            None => group.first.surface == place.surface,
        };
        let albedo = stage.albedo(&place);
        if let Some(group) = groups.iter_mut().find(together) {
            group.albedos += albedo;
            group.origins.push(Origin::of(&place));
            return group.face(&place);
        }
        groups.push(Self {
            first: place,
            albedos: albedo,
            facings: vec![Facing::of(&place)],
            origins: vec![Origin::of(&place)],
        });
    }

    /// Sums up places that face the same way.
    fn face(&mut self, place: &Place) {
        let same = |facing: &&mut Facing| facing.normal.dot(&place.normal) > COSINE * facing.normal.norm();
        match self.facings.iter_mut().find(same) {
            Some(facing) => {
                facing.normal += place.normal;
                facing.point += (place.point - facing.point) / facing.normal.norm().max(1.0);
            }
            None => self.facings.push(Facing::of(place)),
        }
    }

    /// Places in it.
    pub(super) fn count(&self) -> usize {
        self.origins.len()
    }

    pub(super) fn albedo(&self) -> f64 {
        self.albedos / self.count() as f64
    }

    /// The same as a patch whose normals add up to 1 or a little less.
    pub(super) fn patch(&mut self, shift: [f64; 2]) -> Patch<'_> {
        let share = 1.0 / self.count() as f64;
        for facing in &mut self.facings {
            facing.normal *= share;
        }
        Patch {
            facings: &self.facings,
            origins: &self.origins,
            shift,
        }
    }
}
