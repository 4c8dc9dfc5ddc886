//! What is below everything, and how objects come to rest on it.

use geometry::RigidTransform;
use geometry::nalgebra::{UnitQuaternion, Vector3};

use super::{Item, NEAR, Place};
use crate::physics::{Placed, at_rest, way_down};
use crate::world::Bin;

/// From so far above the ground (metres) a body that has turned over comes down again.
const HIGH: f64 = 0.5;

#[derive(Debug, Clone, Copy)]
pub(super) struct Ground {
    pub(super) bin: Bin,
    /// Middle and sides of the table.
    pub(super) table: [[f64; 2]; 2],
}

impl Ground {
    /// Puts a falling object where it comes to rest, among the others.
    pub(super) fn land(&self, items: &mut [Item], falling: usize) {
        let centre = items[falling].placed().centre_of_mass();
        let (place, floor) = if self.bin.holds(&centre) {
            (Place::InBin, Bin::FLOOR)
        } else if self.has_table_below(centre.x, centre.y) {
            (Place::OnTable, 0.0)
        } else {
            items[falling].place = Place::OffTable;
            return;
        };
        let others = items.iter().enumerate();
        let below = others.filter(|(index, item)| *index != falling && item.place == place);
        let standing: Vec<_> = below.map(|(_, item)| item.placed()).collect();
        let at_rest = rest(&items[falling].placed(), &standing, floor);
        (items[falling].place, items[falling].base_from_object) = (place, at_rest);
    }

    fn has_table_below(&self, x: f64, y: f64) -> bool {
        let [centre, size] = self.table;
        (x - centre[0]).abs() <= size[0] / 2.0 && (y - centre[1]).abs() <= size[1] / 2.0
    }
}

/// Straight down; what meets nothing but the ground turns onto a face that it can stand on.
fn rest(body: &Placed<'_>, standing: &[Placed<'_>], floor: f64) -> RigidTransform {
    let way = way_down(body, standing, floor);
    if body.lowest() - floor > way + NEAR {
        return up(-way) * body.base_from_solid;
    }
    let turned = Placed {
        base_from_solid: at_rest(body),
        ..*body
    };
    let above = Placed {
        base_from_solid: up(floor + HIGH - turned.lowest()) * turned.base_from_solid,
        ..turned
    };
    up(-way_down(&above, standing, floor)) * above.base_from_solid
}

fn up(height: f64) -> RigidTransform {
    RigidTransform::from_parts(Vector3::new(0.0, 0.0, height), UnitQuaternion::identity())
}
