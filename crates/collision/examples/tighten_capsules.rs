//! Finds the xArm7's collision capsules in `urdf/xarm7.urdf` from what is known of its links.
//!
//! Known of each link's shape are a box and a capsule that hold all of it, and where its joints' axes run. The shape is
//! taken to be within box and capsule, and within `AROUND` of an axis (housings, as long as the box) or of the capsule's
//! own core (the tube between them). Two or three capsules are sought that hold this region, stay within the known capsule
//! grown by `GROWN`, and have the least volume together: a random search (1+1 evolution strategy), then radii that hold
//! every point of a fine grid.
//!
//! `cargo run --release -p collision --example tighten_capsules` prints them in millimetres, and how much smaller they are.

type Point = nalgebra::Vector3<f64>;

/// How far the known capsule may be exceeded, mm.
const GROWN: f64 = 3.0;
const STEPS: usize = 12_000;
const STARTS: u64 = 4;

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
    axes: &'static [([f64; 3], [f64; 3])],
    /// Radius around the axes and around the capsule's core; infinite where nothing is assumed.
    around: [f64; 2],
    capsules: usize,
}

fn main() {
    for link in links() {
        let region = link.surface(6.0);
        let best = (0..STARTS)
            .map(|start| link.search(&region, start))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .expect("there are starts");
        let rounded = link.finish(best.1);
        let (before, after) = (volume(&[link.known], 2.0), volume(&rounded, 2.0));
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
            let arm = point - Point::from(*on);
            arm.cross(&Point::from(*along)).norm() <= self.around[0]
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

    fn search(&self, region: &[Point], start: u64) -> (f64, Vec<Capsule>) {
        let mut random = fastrand::Rng::with_seed(start);
        let mut normal = move || (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
        let mut best = vec![self.known; self.capsules];
        let spread = 0.4 * (self.high - self.low);
        for capsule in &mut best {
            for end in [&mut capsule.from, &mut capsule.to] {
                *end = 0.5 * (self.low + self.high) + spread.map(|half| half * normal().clamp(-1.0, 1.0) * 0.7);
            }
            capsule.radius = 0.7 * self.known.radius;
        }
        let (mut cost, mut sigma) = (self.cost(&best, region), 20.0);
        for _ in 0..STEPS {
            let mut trial = best.clone();
            for capsule in &mut trial {
                for end in [&mut capsule.from, &mut capsule.to] {
                    *end += Point::from_fn(|_, _| sigma * 0.3 * normal());
                }
                capsule.radius = (capsule.radius + 0.3 * sigma * normal()).max(5.0);
            }
            let found = self.cost(&trial, region);
            if found < cost {
                (best, cost, sigma) = (trial, found, (1.5 * sigma).min(30.0));
            } else {
                sigma = (0.97 * sigma).max(0.3);
            }
        }
        (cost, best)
    }

    /// Volume in cm3, plus what is left uncovered and what leaves the known capsule, both squared.
    fn cost(&self, capsules: &[Capsule], region: &[Point]) -> f64 {
        let uncovered: f64 = region
            .iter()
            .map(|point| distance(capsules, point).max(0.0).powi(2))
            .sum();
        let beyond: f64 = capsules
            .iter()
            .map(|capsule| self.beyond(capsule).max(0.0).powi(2))
            .sum();
        volume(capsules, 10.0) + 1.0 * uncovered + 50.0 * beyond
    }

    /// How far a capsule leaves the known one grown.
    fn beyond(&self, capsule: &Capsule) -> f64 {
        let of = |end: &Point| self.known.distance(end) + capsule.radius - GROWN;
        of(&capsule.from).max(of(&capsule.to))
    }

    /// Whole millimetres, and radii in halves of them that leave nothing of a fine grid out.
    fn finish(&self, mut capsules: Vec<Capsule>) -> Vec<Capsule> {
        for capsule in &mut capsules {
            capsule.from = capsule.from.map(f64::round);
            capsule.to = capsule.to.map(f64::round);
            capsule.radius = (2.0 * capsule.radius).round() / 2.0;
        }
        for point in self.region(1.5) {
            while distance(&capsules, &point) > -0.3 {
                let nearest = capsules
                    .iter_mut()
                    .min_by(|a, b| a.distance(&point).total_cmp(&b.distance(&point)));
                nearest.expect("there are capsules").radius += 0.5;
            }
        }
        capsules
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
fn volume(capsules: &[Capsule], step: f64) -> f64 {
    let corner = |sign: f64, pick: fn(f64, f64) -> f64, start: f64| {
        capsules.iter().fold(Point::repeat(start), |corner, capsule| {
            let ends = capsule
                .from
                .zip_map(&capsule.to, pick)
                .add_scalar(sign * capsule.radius);
            corner.zip_map(&ends, pick)
        })
    };
    let low = corner(-1.0, f64::min, f64::INFINITY).map(|value| (value / step).floor() * step);
    let high = corner(1.0, f64::max, f64::NEG_INFINITY);
    let count = grid(&low, &high, step)
        .filter(|point| distance(capsules, point) <= 0.0)
        .count();
    count as f64 * step.powi(3) * 1e-3
}

fn grid(low: &Point, high: &Point, step: f64) -> impl Iterator<Item = Point> {
    let (low, high) = (*low, *high);
    let counts = (high - low).map(|length| (length / step).ceil() as usize);
    let at = move |axis: usize, index: usize| (low[axis] + index as f64 * step).min(high[axis]);
    (0..=counts.x).flat_map(move |x| {
        (0..=counts.y).flat_map(move |y| (0..=counts.z).map(move |z| Point::new(at(0, x), at(1, y), at(2, z))))
    })
}

fn links() -> Vec<Link> {
    let z = ([0.0; 3], [0.0, 0.0, 1.0]);
    let y = ([0.0; 3], [0.0, 1.0, 0.0]);
    let y_at = |x: f64| ([x, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let axes = |list: Vec<([f64; 3], [f64; 3])>| -> &'static [([f64; 3], [f64; 3])] { list.leak() };
    let link = |name, known: [[f64; 3]; 2], radius, [low, high]: [[f64; 3]; 2], axes, around, capsules| Link {
        name,
        known: Capsule {
            from: known[0].into(),
            to: known[1].into(),
            radius,
        },
        low: low.into(),
        high: high.into(),
        axes,
        around,
        capsules,
    };
    let all = f64::INFINITY;
    vec![
        link(
            "link_base",
            [[0.0, 0.0, 89.0], [-13.0, 3.0, 30.0]],
            81.0,
            [[-92.0, -63.0, 0.0], [63.0, 63.0, 155.0]],
            axes(vec![]),
            [0.0, all],
            3,
        ),
        link(
            "link1",
            [[0.0, 0.0, -54.0], [0.0, 17.0, 0.0]],
            75.0,
            [[-48.0, -57.0, -112.0], [48.0, 75.0, 48.0]],
            axes(vec![z, y]),
            [50.0, 50.0],
            3,
        ),
        link(
            "link2",
            [[0.0, -32.0, 81.0], [0.0, -140.0, 19.0]],
            80.0,
            [[-48.0, -192.0, -42.0], [47.0, 47.0, 119.0]],
            axes(vec![z, y]),
            [50.0, 50.0],
            3,
        ),
        link(
            "link3",
            [[8.0, 1.0, -44.0], [51.0, -4.0, 0.0]],
            76.0,
            [[-42.0, -67.0, -101.0], [95.0, 69.0, 43.0]],
            axes(vec![z, y_at(52.5)]),
            [50.0, 50.0],
            3,
        ),
        link(
            "link4",
            [[27.0, -16.0, 78.0], [87.0, -120.0, 11.0]],
            75.0,
            [[-43.0, -169.0, -42.0], [120.0, 43.0, 107.0]],
            axes(vec![z, y_at(77.5)]),
            [50.0, 50.0],
            3,
        ),
        link(
            "link5",
            [[-1.0, 9.0, -153.0], [0.0, 46.0, 0.0]],
            56.0,
            [[-42.0, -43.0, -173.0], [42.0, 86.0, 38.0]],
            axes(vec![z, y]),
            [45.0, 45.0],
            3,
        ),
        link(
            "link6",
            [[76.0, 21.0, 0.0], [18.0, 5.0, 18.0]],
            61.0,
            [[-37.0, -38.0, -37.0], [113.0, 69.0, 58.0]],
            axes(vec![z, y_at(76.0)]),
            [45.0, 45.0],
            3,
        ),
        link(
            "link7",
            [[0.0, 0.0, -14.0], [0.0, -13.0, -14.0]],
            40.0,
            [[-37.0, -52.0, -28.0], [37.0, 37.0, 0.0]],
            axes(vec![]),
            [0.0, all],
            2,
        ),
    ]
}
