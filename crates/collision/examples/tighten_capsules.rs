//! Finds the xArm7's collision capsules in `urdf/xarm7.urdf` from what is known of its links.
//!
//! Known of each link's shape are a box and a capsule that hold all of it, and where its joints' axes run. The shape is
//! taken to be within box and capsule, and within `AROUND` of an axis (housings, as long as the box) or of the capsule's
//! own core (the tube between them). Up to three capsules are sought that hold this region and have the least volume
//! together, where what leaves the known capsule by more than `GROWN` counts more and what is within a neighbour nothing:
//! a random search (1+1 evolution strategy), then radii that hold every point of a fine grid.
//!
//! `cargo run --release -p collision --example tighten_capsules -- [LINK [STARTS]]` prints them in millimetres, and how much
//! smaller they are. The file's are those of 2 starts, of link4 those of 8.

#[path = "../tests/common/known_links.rs"]
mod known_links;

use known_links::{Known, LINKS};

type Point = nalgebra::Vector3<f64>;

/// How far the known capsule may be left at no cost, mm.
const GROWN: f64 = 7.0;
const STEPS: usize = 5_000;

#[derive(Clone, Copy)]
struct Capsule {
    from: Point,
    to: Point,
    radius: f64,
}

/// All in the link's frame, mm.
struct Link {
    name: &'static str,
    known: Capsule,
    low: Point,
    high: Point,
    /// A point on each joint's axis and its direction.
    axes: Vec<(Point, Point)>,
    /// Radius around the axes and around the capsule's core.
    around: [f64; 2],
    ends: Vec<End>,
}

/// Where the arm goes on: what reaches out of a link here is within its neighbour. A cylinder.
struct End {
    on: Point,
    out: Point,
    radius: f64,
    length: f64,
}

fn main() {
    let only = std::env::args().nth(1);
    let starts = std::env::args()
        .nth(2)
        .map_or(2, |count| count.parse().expect("a number of starts"));
    // Links without neighbours' places in the table keep the known capsule: two or three are no better.
    let links = LINKS.iter().filter(|link| !link.ends.is_empty());
    for known in links.filter(|link| only.as_deref().is_none_or(|only| only == link.link)) {
        let link = Link::from(known);
        let region = link.surface(6.0);
        let best = (0..starts)
            .map(|start| link.search(&region, start))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .expect("there are starts");
        let rounded = link.finish(best.1);
        let own = |point: &Point| f64::from(!link.ends.iter().any(|end| end.holds(point)));
        let (before, after) = (volume(&[link.known], 2.0, own), volume(&rounded, 2.0, own));
        let cut = link.region(2.0).len() as f64 * 8e-3;
        println!(
            "{}: {:.0} -> {:.0} cm3 ({:.0} %), region {cut:.0} cm3",
            link.name,
            before,
            after,
            100.0 * after / before
        );
        for Capsule { from, to, radius } in rounded {
            println!("    {:?} {:?} {radius}", from.as_slice(), to.as_slice());
        }
    }
}

impl Link {
    fn holds(&self, point: &Point) -> bool {
        let near_axis = self.axes.iter().any(|(on, along)| {
            let arm = point - on;
            arm.cross(along).norm() <= self.around[0]
        });
        let is_near = near_axis || self.known.core_distance(point) <= self.around[1];
        is_near && self.known.distance(point) <= 0.0
    }

    /// Points of a grid over the box, its faces included.
    fn region(&self, step: f64) -> Vec<Point> {
        grid(&self.low, &self.high, step)
            .filter(|point| self.holds(point))
            .collect()
    }

    /// Points of the region that have a neighbour outside: what holds them holds the rest.
    fn surface(&self, step: f64) -> Vec<Point> {
        let mut region = self.region(step);
        let is_within = |point: &Point| {
            let inside = point.zip_zip_map(&self.low, &self.high, |value, low, high| {
                f64::from(value > low + 0.5 * step && value < high - 0.5 * step)
            });
            inside.min() > 0.5
                && (0..6).all(|side| {
                    let mut aside = *point;
                    aside[side / 2] += if side % 2 == 0 { step } else { -step };
                    self.holds(&aside)
                })
        };
        region.retain(|point| !is_within(point));
        region
    }

    /// From capsules along the axes and the known core.
    fn search(&self, region: &[Point], start: u64) -> (f64, Vec<Capsule>) {
        let mut random = fastrand::Rng::with_seed(start);
        let mut normal = move || (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
        let core = Capsule {
            radius: 55.0,
            ..self.known
        };
        let along = self.axes.iter().map(|(on, along)| {
            let at = |corner: &Point| on + 0.5 * corner.component_mul(along);
            Capsule {
                from: at(&self.low),
                to: at(&self.high),
                radius: 55.0,
            }
        });
        let mut best: Vec<Capsule> = along.chain([core]).collect();
        close(&mut best, region);
        let (mut cost, mut sigma) = (self.cost(&best), 15.0);
        for step in 0..STEPS {
            let mut trial = best.clone();
            let chosen = step % (trial.len() + 1);
            for (index, capsule) in trial.iter_mut().enumerate() {
                if index != chosen && chosen < best.len() {
                    continue;
                }
                for end in [&mut capsule.from, &mut capsule.to] {
                    *end += Point::from_fn(|_, _| 0.3 * sigma * normal());
                }
                capsule.radius = (capsule.radius + 0.3 * sigma * normal()).max(5.0);
            }
            close(&mut trial, region);
            let found = self.cost(&trial);
            if found < cost {
                (best, cost, sigma) = (trial, found, (1.5 * sigma).min(20.0));
            } else {
                sigma = (0.985 * sigma).max(0.5);
            }
        }
        (cost, best)
    }

    /// Volume in cm3, more where it leaves the known capsule, nothing within neighbours.
    fn cost(&self, capsules: &[Capsule]) -> f64 {
        let weight = |point: &Point| {
            let is_in_neighbour = self.ends.iter().any(|end| end.holds(point));
            let beyond = (self.known.distance(point) - GROWN).max(0.0);
            if is_in_neighbour { 0.0 } else { 1.0 + beyond.powi(2) }
        };
        volume(capsules, 8.0, weight)
    }

    /// Whole millimetres, and radii in halves of them that leave nothing of a fine grid out.
    fn finish(&self, mut capsules: Vec<Capsule>) -> Vec<Capsule> {
        for capsule in &mut capsules {
            capsule.from = capsule.from.map(f64::round);
            capsule.to = capsule.to.map(f64::round);
            capsule.radius = (2.0 * capsule.radius).round() / 2.0;
        }
        let region = self.region(1.5);
        close(&mut capsules, &region);
        for capsule in &mut capsules {
            capsule.radius = (2.0 * capsule.radius).ceil() / 2.0;
        }
        for index in (0..capsules.len()).rev() {
            let mut others = capsules.clone();
            others.remove(index);
            if region.iter().all(|point| distance(&others, point) <= 0.0) {
                capsules = others;
            }
        }
        capsules
    }
}

/// Grows all radii by what is missing to hold all of the points, or shrinks them by what is too much.
fn close(capsules: &mut [Capsule], region: &[Point]) {
    let missing = region
        .iter()
        .map(|point| distance(capsules, point))
        .fold(f64::NEG_INFINITY, f64::max);
    for capsule in capsules {
        capsule.radius = (capsule.radius + missing).max(1.0);
    }
}

impl End {
    fn holds(&self, point: &Point) -> bool {
        let arm = point - self.on;
        let along = arm.dot(&self.out);
        (0.0..=self.length).contains(&along) && (arm - self.out * along).norm() <= self.radius
    }
}

impl Capsule {
    fn core_distance(&self, point: &Point) -> f64 {
        let (along, arm) = (self.to - self.from, point - self.from);
        let share = (arm.dot(&along) / along.norm_squared().max(1e-12)).clamp(0.0, 1.0);
        (arm - along * share).norm()
    }

    fn distance(&self, point: &Point) -> f64 {
        self.core_distance(point) - self.radius
    }
}

fn distance(capsules: &[Capsule], point: &Point) -> f64 {
    capsules
        .iter()
        .map(|capsule| capsule.distance(point))
        .fold(f64::INFINITY, f64::min)
}

/// Of all capsules together, cm3.
fn volume(capsules: &[Capsule], step: f64, weight: impl Fn(&Point) -> f64) -> f64 {
    let reach = |capsule: &Capsule, sign: f64, pick: fn(f64, f64) -> f64| {
        capsule
            .from
            .zip_map(&capsule.to, pick)
            .add_scalar(sign * capsule.radius)
    };
    let low = capsules.iter().map(|capsule| reach(capsule, -1.0, f64::min));
    let low = low
        .reduce(|a, b| a.inf(&b))
        .unwrap_or_default()
        .map(|value| (value / step).floor() * step);
    let high = capsules.iter().map(|capsule| reach(capsule, 1.0, f64::max));
    let high = high.reduce(|a, b| a.sup(&b)).unwrap_or_default();
    let inside = grid(&low, &high, step).filter(|point| capsules.iter().any(|capsule| capsule.distance(point) <= 0.0));
    inside.map(|point| weight(&point)).sum::<f64>() * step.powi(3) * 1e-3
}

fn grid(low: &Point, high: &Point, step: f64) -> impl Iterator<Item = Point> {
    let (low, high) = (*low, *high);
    let counts = (high - low).map(|length| (length / step).ceil() as usize);
    let at = move |axis: usize, index: usize| (low[axis] + index as f64 * step).min(high[axis]);
    (0..=counts.x).flat_map(move |x| {
        (0..=counts.y).flat_map(move |y| (0..=counts.z).map(move |z| Point::new(at(0, x), at(1, y), at(2, z))))
    })
}

impl From<&Known> for Link {
    fn from(known: &Known) -> Self {
        let unit = |axis: usize| Point::from_fn(|row, _| f64::from(u8::from(row == axis)));
        Self {
            name: known.link,
            known: Capsule {
                from: known.core[0].into(),
                to: known.core[1].into(),
                radius: known.radius,
            },
            low: known.low.into(),
            high: known.high.into(),
            axes: known.axes.iter().map(|&(on, axis)| (on.into(), unit(axis))).collect(),
            around: known.around,
            ends: (known.ends.iter())
                .map(|&(on, axis, sign, radius, length)| End {
                    on: on.into(),
                    out: sign * unit(axis),
                    radius,
                    length,
                })
                .collect(),
        }
    }
}
