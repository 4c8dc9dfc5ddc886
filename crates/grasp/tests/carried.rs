//! What would hang on the cup, against the bodies themselves.

mod common;

use common::{Body, Seen, inputs, see};
use geometry::nalgebra::{Point3, Rotation3, Vector3};
use grasp::{Cup, Grasp, Plan, PlanOptions, plan};

const SIZE: usize = 640;
/// Of normals, radians in each axis: about what shading gives.
const NOISE: f64 = 0.02;

fn planned(seen: &[Seen; 2]) -> Plan {
    plan(&inputs(seen), &Cup::default(), &PlanOptions::default()).unwrap()
}

/// The cylinder around places of a body about a grasp's axis, metres: radius and length.
fn cylinder(grasp: &Grasp, places: &[Point3<f64>]) -> (f64, f64) {
    let axis = grasp.approach_axis();
    let one = |place: &Point3<f64>| {
        let from = place - grasp.contact;
        let along = from.dot(&axis);
        ((from - axis * along).norm(), along)
    };
    let all = places.iter().map(one);
    all.fold((0.0, 0.0), |most: (f64, f64), next| {
        (most.0.max(next.0), most.1.max(next.1))
    })
}

/// Corners of a block that stands on the table, or of a pyramid when its top is a point.
fn corners(middle: [f64; 2], size: [f64; 3], top: f64, turned: f64) -> Vec<Point3<f64>> {
    let (sin, cos) = turned.sin_cos();
    let signs = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
    let corner = |[a, b]: [f64; 2], share: f64, z: f64| {
        let (x, y) = (a * size[0] / 2.0 * share, b * size[1] / 2.0 * share);
        Point3::new(middle[0] + x * cos - y * sin, middle[1] + x * sin + y * cos, z)
    };
    let both = signs
        .into_iter()
        .flat_map(|sign| [corner(sign, 1.0, 0.0), corner(sign, top, size[2])]);
    both.collect()
}

/// Everything that hangs on the cup is in the cylinder, and the cylinder is not much larger.
#[test]
fn what_is_carried_holds_the_body_and_little_more() {
    let turned = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.3);
    let block = Body::block(Point3::new(0.43, 0.0, 0.02), [0.08, 0.05, 0.04], turned);
    let pyramid = Body::pyramid([0.43, 0.0], 0.11, 0.05, 0.35);
    for (name, body, places) in [
        ("block", block, corners([0.43, 0.0], [0.08, 0.05, 0.04], 1.0, 0.3)),
        ("pyramid", pyramid, corners([0.43, 0.0], [0.11, 0.11, 0.05], 0.0, 0.35)),
    ] {
        let found = planned(&see(&[body], SIZE, NOISE));
        assert!(!found.grasps.is_empty(), "{name}: {:?}", found.refused);
        for grasp in &found.grasps {
            let (radius, length) = cylinder(grasp, &places);
            let carried = grasp.carried;
            println!(
                "{name}: radius {:.1} mm of {:.1}, length {:.1} mm of {:.1}",
                1e3 * carried.radius,
                1e3 * radius,
                1e3 * carried.length,
                1e3 * length
            );
            assert!(
                (radius..radius + 0.008).contains(&carried.radius),
                "{name}: {radius} {carried:?}"
            );
            assert!(
                (length..length + 0.008).contains(&carried.length),
                "{name}: {length} {carried:?}"
            );
        }
    }
}

#[test]
fn what_touches_the_object_is_carried_with_it_and_what_stands_apart_is_not() {
    let straight = Rotation3::identity();
    let object = Body::block(Point3::new(0.41, 0.0, 0.02), [0.04, 0.04, 0.04], straight);
    let beside = |gap: f64| Body::block(Point3::new(0.45 + gap, 0.0, 0.015), [0.04, 0.04, 0.03], straight);
    let radius = |bodies: &[Body]| {
        let found = planned(&see(bodies, SIZE, NOISE));
        let on_object = found.grasps.iter().find(|grasp| grasp.contact.x < 0.43);
        on_object
            .unwrap_or_else(|| panic!("{:?}", found.refused))
            .carried
            .radius
    };
    let (alone, apart) = (
        radius(std::slice::from_ref(&object)),
        radius(&[object.clone(), beside(0.02)]),
    );
    assert!(
        (0.028..0.037).contains(&alone) && (apart - alone).abs() < 0.003,
        "{alone} {apart}"
    );
    // From the object's middle to the far corners of the neighbour, which is lower.
    let touching = radius(&[object, beside(0.0)]);
    assert!((0.063..0.075).contains(&touching), "{touching}");
}
