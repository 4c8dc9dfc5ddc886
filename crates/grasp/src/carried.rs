//! What would hang on the cup: a cylinder around the object, for those who must keep it off other things.

use geometry::Ray;
use geometry::nalgebra::{Point3, Vector3};

use crate::result::Carried;
use crate::view::{DEPTH_REACH, View};

/// Silhouettes and depths are known no better than this, metres.
const MARGIN: f64 = 0.003;
/// No cylinder is longer or wider, metres: a heap in which everything touches is no one object.
const MOST: f64 = 0.15;

/// The objects of a view, in cells.
#[derive(Debug)]
pub(crate) struct Objects {
    cells: Vec<ObjectCell>,
}

/// A cell of an object.
#[derive(Debug)]
struct ObjectCell {
    /// As the view's level counts.
    object: u16,
    place: Seen,
    /// Of the cell's side where the place is, metres per metre of distance from the camera.
    width: f64,
}

/// Where the surface in a cell is.
#[derive(Debug)]
enum Seen {
    /// By the integrated depth.
    At(Point3<f64>),
    /// Somewhere over the table: nothing is known of the depth.
    Along(Ray),
}

/// The cylinder's axis, which goes from the contact into the object.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Axis {
    pub(crate) contact: Point3<f64>,
    /// Unit.
    pub(crate) direction: Vector3<f64>,
    /// Of the table; the object ends there.
    pub(crate) table_height: f64,
}

impl Objects {
    pub(crate) fn new(view: &View<'_>) -> Self {
        let blocks = &view.level.blocks;
        let [focal, _] = view.input.camera.focal();
        let cell = |index: usize| {
            let object = view.level.object_of(index);
            let pixel = blocks.pixel((index % blocks.width) as f64, (index / blocks.width) as f64);
            let ray = (object > 0).then(|| view.ray(&pixel)).flatten()?;
            Some(ObjectCell {
                object,
                place: view
                    .depth_of(index)
                    .map_or(Seen::Along(ray), |depth| Seen::At(ray.at(depth))),
                width: blocks.factor as f64 / focal,
            })
        };
        Self {
            cells: (0..blocks.cells.len()).filter_map(cell).collect(),
        }
    }

    /// Around everything that hangs together with an object in this view's mask, and down to the table below it.
    pub(crate) fn around(&self, object: u16, view: &View<'_>, axis: &Axis) -> Carried {
        // The whole of an integrated depth is as wrong as it is at the contact.
        let shift = own_contact(view, &axis.contact).map_or_else(Vector3::zeros, |own| axis.contact - own);
        let mut carried = axis.at_contact();
        for cell in self.cells.iter().filter(|cell| cell.object == object) {
            let (upper, lower) = match &cell.place {
                Seen::At(point) => {
                    let upper = axis.over_table(point + shift);
                    (upper, axis.foot(&upper))
                }
                Seen::Along(ray) => {
                    let Some(ends) = axis.contact_and_table(ray) else {
                        continue;
                    };
                    ends
                }
            };
            let width = cell.width * (upper - view.centre).norm();
            carried = carried
                .and(&axis.around(&upper, width))
                .and(&axis.around(&lower, width));
        }
        carried
    }
}

/// The contact as this view's depth has it.
fn own_contact(view: &View<'_>, contact: &Point3<f64>) -> Option<Point3<f64>> {
    let pixel = view.project(contact)?;
    let depth = view.depth_near(&pixel, DEPTH_REACH)?;
    Some(view.ray(&pixel)?.at(depth))
}

impl Axis {
    /// What is below the contact is there in any case.
    fn at_contact(&self) -> Carried {
        self.around(&self.contact, 0.0)
            .and(&self.around(&self.foot(&self.contact), 0.0))
    }

    /// Around a place that is known to so many metres, sideways.
    fn around(&self, point: &Point3<f64>, width: f64) -> Carried {
        let from = point - self.contact;
        let along = from.dot(&self.direction);
        let level = (1.0 - self.direction.z * self.direction.z).max(0.0).sqrt();
        Carried {
            radius: (from - self.direction * along).norm() + width,
            length: along.max(0.0) + width * level,
        }
    }

    /// An object ends at the table, whatever its depth says.
    fn over_table(&self, point: Point3<f64>) -> Point3<f64> {
        Point3::new(point.x, point.y, point.z.max(self.table_height))
    }

    fn foot(&self, point: &Point3<f64>) -> Point3<f64> {
        Point3::new(point.x, point.y, point.z.min(self.table_height))
    }

    /// Where a ray is as high as the contact, and where it meets the table.
    fn contact_and_table(&self, ray: &Ray) -> Option<(Point3<f64>, Point3<f64>)> {
        let at = |height: f64| {
            let depth = (height - ray.origin.z) / ray.direction.z;
            (depth > 0.0 && depth.is_finite()).then(|| ray.at(depth))
        };
        Some((at(self.contact.z)?, at(self.table_height)?))
    }
}

impl Carried {
    /// Of a thin object whose outline reaches so far from its middle: it may be as thick as it is high.
    pub(crate) fn thin(axis: &Axis, radius: f64) -> Self {
        Self { radius, length: 0.0 }.and(&axis.at_contact()).bounded()
    }

    /// Around both.
    pub(crate) fn and(&self, other: &Self) -> Self {
        Self {
            radius: self.radius.max(other.radius),
            length: self.length.max(other.length),
        }
    }

    /// With the margin, and no larger than any object.
    pub(crate) fn bounded(&self) -> Self {
        Self {
            radius: (self.radius + MARGIN).min(MOST),
            length: (self.length + MARGIN).min(MOST),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn down(contact: [f64; 3]) -> Axis {
        Axis {
            contact: contact.into(),
            direction: -Vector3::z(),
            table_height: 0.01,
        }
    }

    #[test]
    fn what_is_under_the_contact_reaches_down_to_the_table() {
        let carried = down([0.4, 0.1, 0.06]).at_contact();
        assert!(
            (carried.length - 0.05).abs() < 1e-12 && carried.radius < 1e-12,
            "{carried:?}"
        );
        let sideways = Axis {
            direction: Vector3::x(),
            ..down([0.4, 0.1, 0.06])
        };
        let carried = sideways.at_contact();
        assert!(
            (carried.radius - 0.05).abs() < 1e-12 && carried.length < 1e-12,
            "{carried:?}"
        );
    }

    #[test]
    fn a_depth_below_the_table_makes_nothing_longer_than_down_to_the_table() {
        let axis = down([0.4, 0.1, 0.023]);
        let place = axis.over_table(Point3::new(0.42, 0.1, -0.04));
        let carried = axis.around(&place, 0.0).and(&axis.around(&axis.foot(&place), 0.0));
        assert!((carried.length - 0.013).abs() < 1e-12, "{carried:?}");
        assert!((carried.radius - 0.02).abs() < 1e-12, "{carried:?}");
    }

    #[test]
    fn a_place_sideways_is_known_to_its_cell_only() {
        let axis = down([0.0, 0.0, 0.05]);
        let carried = axis.around(&Point3::new(0.03, 0.04, 0.02), 0.001);
        assert!((carried.radius - 0.051).abs() < 1e-12, "{carried:?}");
        assert!((carried.length - 0.03).abs() < 1e-12, "{carried:?}");
    }

    #[test]
    fn a_ray_without_depth_counts_from_the_contact_down_to_the_table() {
        let ray = Ray {
            origin: Point3::new(0.0, 0.0, 0.41),
            direction: Vector3::new(0.25, 0.0, -1.0),
        };
        let (upper, lower) = down([0.0, 0.0, 0.21]).contact_and_table(&ray).expect("it goes down");
        assert!((upper.x - 0.05).abs() < 1e-12 && (lower.x - 0.1).abs() < 1e-12);
    }

    #[test]
    fn no_cylinder_is_larger_than_any_object() {
        let heap = Carried {
            radius: 0.4,
            length: 0.02,
        };
        let bounded = heap.bounded();
        assert!((bounded.radius - MOST).abs() < 1e-12 && (bounded.length - 0.023).abs() < 1e-12);
    }

    #[test]
    fn a_thin_object_is_as_wide_as_its_outline_and_as_long_as_it_may_be_thick() {
        let carried = Carried::thin(&down([0.4, 0.1, 0.014]), 0.03);
        assert!((carried.radius - 0.033).abs() < 1e-12, "{carried:?}");
        assert!((carried.length - 0.007).abs() < 1e-12, "{carried:?}");
    }
}
