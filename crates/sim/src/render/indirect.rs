//! Bounced and ambient light in the image, computed at few pixels and interpolated between them.
//!
//! A record keeps the light that arrives at a place as one vector per light, so that it also serves neighbours that face
//! a little differently. Records are as dense as the surroundings are close (Ward et al., "A ray tracing solution for
//! diffuse interreflection", 1988, eq. 6), from a coarse grid of pixels to finer ones.

use geometry::nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::primary::Primary;
use super::radiosity::{Radiosity, cosine_ray};
use super::random::{evenly, hash, unit};
use super::shade::{CHANNELS, Light};
use super::stage::Place;

/// Rays with which a record looks around, on bodies and in the room.
const BODY_RAYS: usize = 256;
const ROOM_RAYS: usize = 96;
/// Steps between pixels that may become records, coarse to fine; the first one for images of 768 pixels.
const COARSEST: usize = 8;
const FINEST: usize = 2;
/// Side of the buckets in which records are found, in coarsest steps.
const BUCKET: usize = 2;
/// A record is used up to this error, in Ward's measure.
const REACH: f64 = 0.2;
/// A record's surroundings are taken as at least and at most this many pixels away.
const RADIUS_PX: [f64; 2] = [4.0, 100.0];
/// Light along the surface itself counts as if it came from this cosine, or single rays would rule a record.
const LEAST_COSINE: f64 = 0.08;

/// Light around one place.
struct Record {
    point: Point3<f64>,
    normal: Vector3<f64>,
    /// Mean distance of what is around, metres.
    radius: f64,
    /// Sum of arriving light times where it comes from: its product with a normal is the irradiance there.
    vectors: [Vector3<f32>; CHANNELS],
}

/// All records of a view.
pub(super) struct Indirect {
    records: Vec<Record>,
    buckets: Vec<Vec<u32>>,
    columns: usize,
    rows: usize,
    side: usize,
}

impl Indirect {
    pub(super) fn new(primary: &Primary<'_>, radiosity: &Radiosity, seed: u64) -> Self {
        // Larger images show the same scene, which needs no more records.
        let coarsest = COARSEST * (primary.width.max(primary.height) / 768).max(1).next_power_of_two();
        let side = BUCKET * coarsest;
        let (columns, rows) = (primary.width.div_ceil(side), primary.height.div_ceil(side));
        let mut indirect = Self {
            records: Vec::new(),
            buckets: vec![Vec::new(); columns * rows],
            columns,
            rows,
            side,
        };
        let mut step = coarsest;
        while step >= FINEST {
            indirect.refine(primary, radiosity, step, seed);
            step /= 2;
        }
        indirect
    }

    /// Adds records at pixels of a grid that have too few near them.
    fn refine(&mut self, primary: &Primary<'_>, radiosity: &Radiosity, step: usize, seed: u64) {
        let middles = |length: usize| (step / 2..length).step_by(step);
        let spots: Vec<[usize; 2]> = middles(primary.height)
            .flat_map(|y| middles(primary.width).map(move |x| [x, y]))
            .collect();
        let new: Vec<([usize; 2], Record)> = spots
            .par_iter()
            .filter_map(|&[x, y]| {
                let place = primary.place(x, y)?;
                if !place.front || primary.stage.emission(&place).is_some() || self.covers(x, y, &place) {
                    return None;
                }
                let turn = hash(seed, &[1, x as u64, y as u64]);
                Some(([x, y], record(primary, radiosity, &place, turn)))
            })
            .collect();
        for ([x, y], record) in new {
            self.buckets[y / self.side * self.columns + x / self.side].push(self.records.len() as u32);
            self.records.push(record);
        }
    }

    fn covers(&self, x: usize, y: usize, place: &Place) -> bool {
        let near = self.near(x, y);
        near.map(|record| record.weight(&place.point, &place.normal))
            .sum::<f64>()
            > 0.0
    }

    fn near(&self, x: usize, y: usize) -> impl Iterator<Item = &Record> {
        let around = |at: usize, count: usize| (at / self.side).saturating_sub(1)..(at / self.side + 2).min(count);
        let columns = around(x, self.columns);
        let buckets = around(y, self.rows).flat_map(move |row| columns.clone().map(move |column| (row, column)));
        buckets
            .flat_map(|(row, column)| &self.buckets[row * self.columns + column])
            .map(|&record| &self.records[record as usize])
    }

    /// Bounced and ambient light at a place in a pixel; the normal's length scales it.
    pub(super) fn irradiance(&self, x: usize, y: usize, point: &Point3<f64>, normal: &Vector3<f64>) -> Light {
        let facing = normal.normalize();
        let mut sum = [Vector3::zeros(); CHANNELS];
        let mut total = 0.0;
        let mut best: Option<(f64, &Record)> = None;
        for record in self.near(x, y) {
            let weight = record.weight(point, &facing);
            if weight > 0.0 {
                record.add_to(&mut sum, weight);
                total += weight;
            } else if total == 0.0 {
                let error = record.error(point, &facing);
                if best.is_none_or(|(least, _)| error < least) {
                    best = Some((error, record));
                }
            }
        }
        if let (true, Some((_, record))) = (total == 0.0, best) {
            record.add_to(&mut sum, 1.0);
            total = 1.0;
        }
        sum.map(|vector| (vector.dot(normal) / total.max(1e-300)).max(0.0))
    }
}

impl Record {
    /// Ward's measure of how wrong the record is at another place. Turning is cheap: the vectors take it into account.
    fn error(&self, point: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        (point - self.point).norm() / self.radius + 2.0 * (1.0 - self.normal.dot(normal)).max(0.0)
    }

    fn weight(&self, point: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        let error = self.error(point, normal);
        // A place in front of the record's surface may see what the record cannot.
        let before = (point - self.point).dot(&(normal + self.normal)) < -0.1 * self.radius;
        if error >= REACH || before {
            return 0.0;
        }
        1.0 / error.max(1e-3) - 1.0 / REACH
    }

    fn add_to(&self, sum: &mut [Vector3<f64>; CHANNELS], weight: f64) {
        for (sum, vector) in sum.iter_mut().zip(&self.vectors) {
            *sum += vector.cast::<f64>() * weight;
        }
    }
}

fn record(primary: &Primary<'_>, radiosity: &Radiosity, place: &Place, turn: u64) -> Record {
    let body = primary.stage.body(place.surface).is_some();
    let rays = if body { BODY_RAYS } else { ROOM_RAYS };
    let shift = [unit(turn), unit(hash(turn, &[]))];
    let origin = place.lifted();
    let mut vectors = [Vector3::zeros(); CHANNELS];
    let mut inverse = 0.0;
    for index in 0..rays {
        let ray = cosine_ray(&origin, &place.normal, evenly(index, shift));
        let sight = radiosity.look(primary.stage, &ray);
        let cosine = ray.direction.dot(&place.normal).max(LEAST_COSINE);
        let along = (ray.direction / (cosine * rays as f64)).cast::<f32>();
        for (vector, light) in vectors.iter_mut().zip(sight.exitance) {
            *vector += along * light;
        }
        inverse += 1.0 / (sight.distance * rays as f64);
    }
    let pixel = place.distance / primary.focal();
    Record {
        point: place.point,
        normal: place.normal,
        radius: (1.0 / inverse).clamp(RADIUS_PX[0] * pixel, RADIUS_PX[1] * pixel),
        vectors,
    }
}
