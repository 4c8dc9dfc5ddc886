//! Closed surfaces from rings of points: every object made by code is one of these.

use geometry::TriangleMesh;
use geometry::nalgebra::Point3;

/// A surface under construction.
#[derive(Debug, Default)]
pub(super) struct Loft {
    mesh: TriangleMesh,
}

impl Loft {
    /// Rings of equally many points, each joined to the next, the first and the last closed by a fan around a point.
    /// Seen from the last ring, the points run counter-clockwise.
    pub(super) fn capped(rings: &[Vec<Point3<f64>>], first_cap: Point3<f64>, last_cap: Point3<f64>) -> TriangleMesh {
        let mut loft = Self::default();
        let starts: Vec<u32> = rings.iter().map(|ring| loft.add(ring)).collect();
        let count = rings.first().map_or(0, Vec::len) as u32;
        for pair in starts.windows(2) {
            loft.join(pair[0], pair[1], count);
        }
        if let (Some(&first), Some(&last)) = (starts.first(), starts.last()) {
            loft.close(first, count, first_cap, true);
            loft.close(last, count, last_cap, false);
        }
        loft.mesh
    }

    /// Rings of equally many points, each joined to the next and the last to the first: a body with a hole. Seen from
    /// above, the points run counter-clockwise, and the rings go up on the outside and down on the inside.
    pub(super) fn around_a_hole(rings: &[Vec<Point3<f64>>]) -> TriangleMesh {
        let mut loft = Self::default();
        let starts: Vec<u32> = rings.iter().map(|ring| loft.add(ring)).collect();
        let count = rings.first().map_or(0, Vec::len) as u32;
        for (index, &start) in starts.iter().enumerate() {
            loft.join(start, starts[(index + 1) % starts.len()], count);
        }
        loft.mesh
    }

    fn add(&mut self, ring: &[Point3<f64>]) -> u32 {
        let start = self.mesh.vertices.len() as u32;
        self.mesh.vertices.extend_from_slice(ring);
        start
    }

    fn join(&mut self, lower: u32, upper: u32, count: u32) {
        for index in 0..count {
            let next = (index + 1) % count;
            self.mesh.triangles.push([lower + index, lower + next, upper + next]);
            self.mesh.triangles.push([lower + index, upper + next, upper + index]);
        }
    }

    fn close(&mut self, ring: u32, count: u32, around: Point3<f64>, from_below: bool) {
        let centre = self.add(&[around]);
        for index in 0..count {
            let (this, next) = (ring + index, ring + (index + 1) % count);
            self.mesh.triangles.push(if from_below {
                [centre, next, this]
            } else {
                [centre, this, next]
            });
        }
    }
}

/// A flat outline at a height.
pub(super) fn ring(outline: &[[f64; 2]], z: f64) -> Vec<Point3<f64>> {
    outline.iter().map(|[x, y]| Point3::new(*x, *y, z)).collect()
}

/// An upright prism from z = 0. The whole outline must be seen from `kernel`.
pub(super) fn prism(outline: &[[f64; 2]], kernel: [f64; 2], height: f64) -> TriangleMesh {
    let [x, y] = kernel;
    Loft::capped(
        &[ring(outline, 0.0), ring(outline, height)],
        Point3::new(x, y, 0.0),
        Point3::new(x, y, height),
    )
}

/// A regular polygon whose corners lie on a circle around the origin, the first at an angle.
pub(super) fn polygon(corners: u32, radius: f64, first_at: f64) -> Vec<[f64; 2]> {
    let step = std::f64::consts::TAU / f64::from(corners);
    let angles = (0..corners).map(|corner| first_at + step * f64::from(corner));
    angles
        .map(|angle| [radius * angle.cos(), radius * angle.sin()])
        .collect()
}

/// A rectangle around the origin.
pub(super) fn rectangle(x: f64, y: f64) -> Vec<[f64; 2]> {
    let (x, y) = (x / 2.0, y / 2.0);
    vec![[-x, -y], [x, -y], [x, y], [-x, y]]
}
