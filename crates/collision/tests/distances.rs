//! Distances of shapes against brute force and against each other.

mod common;

use collision::{PointCloud, Shape};
use geometry::RigidTransform;
use nalgebra::{Point3, UnitQuaternion, Vector3};
use proptest::prelude::*;

const FAR: f64 = 100.0;
/// How much too far the library finds hulls, cylinders and boxes from each other: over 100 000 random pairs of a capsule
/// and a hull it was up to 18 um, where this crate's own routines were exact to rounding. Metres.
const LIBRARY: f64 = 3e-5;
/// Samples along a segment.
const SAMPLES: i32 = 400;

fn point() -> impl Strategy<Value = Point3<f64>> {
    [-0.5..0.5, -0.5..0.5, -0.5..0.5_f64].prop_map(|[x, y, z]| Point3::new(x, y, z))
}

fn frame() -> impl Strategy<Value = RigidTransform> {
    (point(), [-3.0..3.0, -1.5..1.5, -3.0..3.0_f64]).prop_map(|(origin, [roll, pitch, yaw])| {
        RigidTransform::from_parts(origin.coords, UnitQuaternion::from_euler_angles(roll, pitch, yaw))
    })
}

fn size() -> impl Strategy<Value = [f64; 3]> {
    [0.02..0.5, 0.02..0.5, 0.02..0.5_f64]
}

fn along(from: &Point3<f64>, to: &Point3<f64>) -> impl Iterator<Item = Point3<f64>> {
    (0..=SAMPLES).map(move |index| from + (to - from) * (f64::from(index) / f64::from(SAMPLES)))
}

fn to_segment(point: &Point3<f64>, from: &Point3<f64>, to: &Point3<f64>) -> f64 {
    let way = to - from;
    let share = ((point - from).dot(&way) / way.norm_squared().max(1e-300)).clamp(0.0, 1.0);
    (point - (from + way * share)).norm()
}

fn to_box(point: &Point3<f64>, frame: &RigidTransform, size: [f64; 3]) -> f64 {
    let beyond = frame.inverse().transform_point(point).coords.abs() - 0.5 * Vector3::from(size);
    beyond.sup(&Vector3::zeros()).norm() + beyond.max().min(0.0)
}

fn corners(frame: &RigidTransform, size: [f64; 3]) -> Vec<Point3<f64>> {
    let corner = |index: usize| {
        let side = |axis: usize| (if index >> axis & 1 == 1 { 0.5 } else { -0.5 }) * size[axis];
        frame.transform_point(&Point3::new(side(0), side(1), side(2)))
    };
    (0..8).map(corner).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn capsules_are_as_far_apart_as_their_samples(a in point(), b in point(), c in point(), d in point(), r in 0.01..0.1, s in 0.01..0.1) {
        let distance = Shape::capsule(&a, &b, r).unwrap().distance(&Shape::capsule(&c, &d, s).unwrap(), FAR);
        let brute = along(&a, &b).map(|point| to_segment(&point, &c, &d)).fold(FAR, f64::min) - r - s;
        let step = 0.5 * (b - a).norm() / f64::from(SAMPLES);
        prop_assert!(distance <= brute + 1e-12 && distance >= brute - step, "{distance} and {brute}");
    }

    #[test]
    fn parallel_capsules_too(a in point(), way in point(), shift in point(), share in -1.0..2.0_f64) {
        let b = a + way.coords;
        let (c, d) = (a + shift.coords + way.coords * share, b + shift.coords);
        let distance = Shape::capsule(&a, &b, 0.01).unwrap().distance(&Shape::capsule(&c, &d, 0.02).unwrap(), FAR);
        let brute = along(&a, &b).map(|point| to_segment(&point, &c, &d)).fold(FAR, f64::min) - 0.03;
        let step = 0.5 * way.coords.norm() / f64::from(SAMPLES);
        prop_assert!(distance <= brute + 1e-9 && distance >= brute - step, "{distance} and {brute}");
    }

    #[test]
    fn capsule_and_box_are_as_far_apart_as_their_samples(a in point(), b in point(), r in 0.01..0.1, frame in frame(), size in size()) {
        let (capsule, cuboid) = (Shape::capsule(&a, &b, r).unwrap(), Shape::cuboid(&frame, size).unwrap());
        let distance = capsule.distance(&cuboid, FAR);
        prop_assert!((distance - cuboid.distance(&capsule, FAR)).abs() < 1e-12);
        let brute = along(&a, &b).map(|point| to_box(&point, &frame, size)).fold(FAR, f64::min);
        let step = 0.5 * (b - a).norm() / f64::from(SAMPLES);
        if brute > step {
            prop_assert!(distance <= brute - r + 1e-12 && distance >= brute - r - step, "{distance} and {brute} - {r}");
        } else {
            // The way out is not shorter than from the deepest sample, and not longer than out of the nearest face.
            let faces = (0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]).map(|(axis, sign)| {
                let most = [a, b].map(|end| sign * frame.inverse().transform_point(&end)[axis]);
                0.5 * size[axis] - most[0].min(most[1])
            });
            let shortest = faces.fold(FAR, f64::min);
            prop_assert!(-distance >= r - brute - 1e-9 && -distance <= r + shortest + 1e-9, "{distance}, {brute}, {shortest}");
        }
    }

    /// Moving out by the depth ends the contact; the library finds the same depth by another way (the box as a hull).
    #[test]
    fn box_as_box_and_as_hull_are_the_same(a in point(), b in point(), r in 0.01..0.1, frame in frame(), size in size()) {
        let capsule = Shape::capsule(&a, &b, r).unwrap();
        let as_box = capsule.distance(&Shape::cuboid(&frame, size).unwrap(), FAR);
        let as_hull = capsule.distance(&Shape::convex_hull(&corners(&frame, size)).unwrap(), FAR);
        prop_assert!(as_hull - as_box > -1e-9 && as_hull - as_box < LIBRARY, "{as_box} and {as_hull}");
    }

    #[test]
    fn boxes_touch_if_and_only_if_hulls_do(one in frame(), other in frame(), sizes in [size(), size()]) {
        let boxes = [Shape::cuboid(&one, sizes[0]).unwrap(), Shape::cuboid(&other, sizes[1]).unwrap()];
        let hulls = [(one, sizes[0]), (other, sizes[1])].map(|(frame, size)| Shape::convex_hull(&corners(&frame, size)).unwrap());
        let (distance, by_hulls) = (boxes[0].distance(&boxes[1], FAR), hulls[0].distance(&hulls[1], FAR));
        // Of two shapes in each other the library finds a way out, which is not always the shortest.
        let both_touch = distance < 0.0 && by_hulls < 0.0;
        prop_assert!(both_touch || (distance - by_hulls).abs() < LIBRARY, "{distance} and {by_hulls}");
    }

    #[test]
    fn nearest_point_of_a_cloud_is_that_of_all(seed in 0_u64..1000, count in 0_usize..300, a in point(), b in point(), frame in frame(), size in size(), bound in 0.001..1.0) {
        let mut random = fastrand::Rng::with_seed(seed);
        let points: Vec<_> = (0..count).map(|_| Point3::from(Vector3::from_fn(|_, _| 2.0 * random.f64() - 1.0))).collect();
        let cloud = PointCloud::new(&points, 0.01).unwrap();
        let capsule = Shape::capsule(&a, &b, 0.05).unwrap();
        let brute = points.iter().map(|point| to_segment(point, &a, &b) - 0.06).fold(bound, f64::min);
        prop_assert!((capsule.distance_to_cloud(&cloud, bound) - brute).abs() < 1e-12);
        let cuboid = Shape::cuboid(&frame, size).unwrap();
        let brute = points.iter().map(|point| to_box(point, &frame, size) - 0.01).fold(bound, f64::min);
        prop_assert!((cuboid.distance_to_cloud(&cloud, bound) - brute).abs() < 1e-12);
        let hull = Shape::convex_hull(&corners(&frame, size)).unwrap();
        prop_assert!((hull.distance_to_cloud(&cloud, bound) - brute).abs() < 1e-6);
    }

    #[test]
    fn a_bound_changes_nothing_below_it(a in point(), b in point(), frame in frame(), size in size(), bound in 0.0..0.3) {
        let shapes = [
            Shape::capsule(&a, &b, 0.03).unwrap(),
            Shape::cuboid(&frame, size).unwrap(),
            Shape::cylinder(&frame, size[0], size[1]).unwrap(),
        ];
        for one in &shapes {
            for other in &shapes {
                let (free, bounded) = (one.distance(other, FAR), one.distance(other, bound));
                prop_assert!((bounded - free.min(bound)).abs() < LIBRARY, "{free}, {bounded}, {bound}, {one:?} {other:?}");
            }
        }
    }
}
