//! The capsules in `urdf/xarm7.urdf` against what is known of the arm's links.

mod common;
#[path = "common/known_links.rs"]
mod known_links;

use collision::Shape;
use common::arm;
use known_links::{Known, LINKS};
use nalgebra::{Point3, Vector3};

/// How far a link's shapes may leave the known capsule other than into a neighbour, metres.
const GROWN: f64 = 0.015;
/// What rounded ends may be wider than the neighbour's housing, mm: its known capsule is 20 mm wider.
const ROUND: f64 = 5.0;
const STEP: f64 = 0.004;

fn metres(point: [f64; 3]) -> Point3<f64> {
    Point3::from(point.map(|value| 1e-3 * value))
}

impl Known {
    fn capsule(&self) -> Shape {
        Shape::capsule(&metres(self.core[0]), &metres(self.core[1]), 1e-3 * self.radius).unwrap()
    }

    fn grid(&self, grown: f64) -> impl Iterator<Item = Point3<f64>> {
        let low = metres(self.low) - Vector3::repeat(grown);
        let counts = (metres(self.high) - low).map(|length| ((length + grown) / STEP).ceil() as usize);
        let at = move |axis: usize, index: usize| low[axis] + STEP * index as f64;
        (0..=counts.x).flat_map(move |x| {
            (0..=counts.y).flat_map(move |y| (0..=counts.z).map(move |z| Point3::new(at(0, x), at(1, y), at(2, z))))
        })
    }

    fn is_in_box(&self, point: &Point3<f64>) -> bool {
        (0..3).all(|axis| (metres(self.low)[axis]..=metres(self.high)[axis]).contains(&point[axis]))
    }

    fn is_in_housing(&self, point: &Point3<f64>) -> bool {
        self.axes.iter().any(|&(on, axis)| {
            let mut arm = point - metres(on);
            arm[axis] = 0.0;
            arm.norm() <= 1e-3 * self.housing
        })
    }

    fn is_in_neighbour(&self, point: &Point3<f64>) -> bool {
        self.ends.iter().any(|&(on, axis, sign, radius, length)| {
            let mut arm = point - metres(on);
            let along = sign * std::mem::replace(&mut arm[axis], 0.0);
            (0.0..=1e-3 * length).contains(&along) && arm.norm() <= 1e-3 * (radius + ROUND)
        })
    }
}

/// Of a point to the nearest of some shapes.
fn distance(shapes: &[Shape], point: &Point3<f64>) -> f64 {
    let dot = Shape::sphere(point, 1e-9).unwrap();
    shapes.iter().map(|shape| shape.distance(&dot, 1.0)).fold(1.0, f64::min)
}

#[test]
fn shapes_stay_within_the_known_capsules() {
    let arm = arm();
    for known in &LINKS {
        let (shapes, capsule) = (arm.shapes(known.link).expect("a link with shapes"), [known.capsule()]);
        let mut most = 0.0_f64;
        for point in known.grid(0.08) {
            let beyond = distance(&capsule, &point);
            if distance(shapes, &point) < 0.0 && !known.is_in_neighbour(&point) {
                most = most.max(beyond);
            }
        }
        println!("{}: {:.1} mm beyond the known capsule", known.link, 1e3 * most);
        assert!(most < GROWN, "{}: {most}", known.link);
    }
}

/// Housings with flat ends, as far as box and capsule leave room for them.
#[test]
fn shapes_hold_the_housings() {
    let arm = arm();
    for known in &LINKS {
        let (shapes, capsule) = (arm.shapes(known.link).expect("a link with shapes"), [known.capsule()]);
        let housings = known
            .grid(0.0)
            .filter(|point| known.is_in_box(point) && known.is_in_housing(point));
        let mut points = 0;
        for point in housings.filter(|point| distance(&capsule, point) <= 0.0) {
            points += 1;
            assert!(distance(shapes, &point) < 0.0, "{} at {point}", known.link);
        }
        assert!(points > 1000, "{}: {points}", known.link);
    }
}

#[test]
fn gripper_is_the_box_of_its_maker_and_a_narrow_cup() {
    let arm = arm();
    let links = ["vacuum_gripper", "vacuum_cup"].map(|link| arm.shapes(link).expect("a link with shapes"));
    let [body, cup] = links;
    let shapes = links.concat();
    for (point, is_inside) in [
        ([37.0, 45.0, 113.0], true),
        ([37.0, 45.0, 115.0], false),
        ([11.0, 11.0, 125.0], true),
        ([13.0, 0.0, 120.0], false),
        ([-37.0, -45.0, 1.0], true),
        ([0.0, 0.0, 127.0], false),
        ([39.0, 0.0, 60.0], false),
        ([0.0, 47.0, 60.0], false),
    ] {
        assert_eq!(distance(&shapes, &metres(point)) < 0.0, is_inside, "{point:?}");
    }
    // Its last 12 mm are the cup.
    let mouth = metres([0.0, 0.0, 126.0]);
    assert!((distance(body, &mouth) - 0.012).abs() < 1e-6 && distance(cup, &mouth).abs() < 1e-6);
}
