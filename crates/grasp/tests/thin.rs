//! Thin objects by their outlines.

mod common;
#[path = "../examples/common/mod.rs"]
mod scenes;

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use common::{Body, Seen, inputs, see};
use geometry::nalgebra::{Point3, Rotation3, Vector3};
use grasp::{Cup, Plan, PlanOptions, Source, Test, plan_thin};

const SIZE: usize = 640;

fn planned(seen: &[Seen; 2]) -> Plan {
    plan_thin(&inputs(seen), &Cup::default(), &PlanOptions::default()).unwrap()
}

/// A prism with many sides on the table.
fn disc(middle: [f64; 2], radius: f64, thickness: f64, sides: usize) -> Body {
    let side = |k: usize| {
        let (sin, cos) = (TAU * k as f64 / sides as f64 + 0.1).sin_cos();
        let normal = Vector3::new(cos, sin, 0.0);
        (
            normal,
            normal.x * middle[0] + normal.y * middle[1] + radius * (TAU / 2.0 / sides as f64).cos(),
        )
    };
    let faces = (0..sides)
        .map(side)
        .chain([(Vector3::z(), thickness), (-Vector3::z(), 0.0)]);
    Body::Polyhedron(faces.collect())
}

#[test]
fn discs_octagons_and_cards_are_held_in_their_middle() {
    let card = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.5);
    let bodies = [
        ("disc", disc([0.43, 0.01], 0.025, 0.003, 90), 0.003, 0.025),
        ("octagon", disc([0.43, 0.01], 0.025, 0.003, 8), 0.003, 0.025),
        ("triangle", disc([0.43, 0.01], 0.04, 0.004, 3), 0.004, 0.04),
        (
            "card",
            Body::block(Point3::new(0.43, 0.01, 0.0015), [0.08, 0.05, 0.003], card),
            0.003,
            0.04_f64.hypot(0.025),
        ),
    ];
    for (name, body, thickness, reach) in bodies {
        let found = planned(&see(&[body], SIZE, 0.3));
        assert_eq!(found.grasps.len(), 1, "{name}: {:?}", found.refused);
        let grasp = &found.grasps[0];
        let off = grasp.contact - Point3::new(0.43, 0.01, thickness);
        println!(
            "{name}: {:.2?} mm off, sigma {:.2} mm",
            (1e3 * off).as_slice(),
            1e3 * grasp.measured.sigma
        );
        assert!(off.xy().norm() < 0.001 && off.z.abs() < 0.0015, "{name}: {off}");
        assert_eq!(grasp.approach_axis(), -Vector3::z());
        let (radius, length) = (grasp.carried.radius - 0.003, grasp.carried.length - 0.003);
        assert!((radius - reach).abs() < 0.0015, "{name}: {radius}");
        assert!((length - thickness).abs() < 0.0015, "{name}: {length}");
    }
}

#[test]
fn what_lies_on_top_comes_first() {
    let on_top = disc([0.44, -0.01], 0.02, 0.008, 60);
    let below = Body::block(
        Point3::new(0.43, 0.0, 0.002),
        [0.13, 0.12, 0.004],
        Rotation3::identity(),
    );
    let found = planned(&see(&[below, on_top], SIZE, 0.0));
    let first = &found.grasps[0];
    assert!(
        (first.contact - Point3::new(0.44, -0.01, 0.008)).norm() < 0.002,
        "{first:?}"
    );
}

#[test]
fn what_is_narrower_than_the_cup_is_refused() {
    let strip = Body::block(
        Point3::new(0.43, 0.0, 0.0015),
        [0.08, 0.012, 0.003],
        Rotation3::identity(),
    );
    let found = planned(&see(&[strip], SIZE, 0.0));
    assert_eq!(found.grasps, []);
    let failures: Vec<_> = found.refused.iter().flat_map(|refused| &refused.failures).collect();
    let border = failures
        .iter()
        .find(|failure| failure.test == Test::Border)
        .expect("named the border");
    assert!((border.value - 0.006).abs() < 0.001, "{border:?}");
}

#[test]
fn without_edges_the_plan_says_that_there_is_no_outline() {
    let found = planned(&see(&[], 128, 0.0));
    assert_eq!(found.grasps, []);
    assert_eq!(found.refused.len(), 2);
    assert_eq!(
        found.refused[1].to_string(),
        "view 2: 0 outlines of a thin object, needed 1"
    );
}

#[test]
fn an_outline_that_one_view_shows_is_refused_with_two_and_flagged_with_one() {
    let seen = see(&[disc([0.43, 0.01], 0.025, 0.003, 90)], SIZE, 0.0);
    let empty = see(&[], SIZE, 0.0);
    let [first, _] = inputs(&seen);
    let [_, second] = inputs(&empty);
    let both = plan_thin(&[first, second], &Cup::default(), &PlanOptions::default()).unwrap();
    assert_eq!(both.grasps, []);
    assert!(
        both.refused
            .iter()
            .any(|refused| refused.failures.iter().any(|failure| failure.test == Test::OutlinePair))
    );
    let one = plan_thin(&[first], &Cup::default(), &PlanOptions::default()).unwrap();
    assert_eq!(one.views, 1);
    let Source::Outline { pixels, .. } = &one.grasps[0].source else {
        panic!("{:?}", one.grasps[0].source)
    };
    assert_eq!(pixels.len(), 1);
    assert!((one.grasps[0].contact - Point3::new(0.43, 0.01, 0.003)).norm() < 0.001);
}

fn scene(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/data/rig/objects")
        .join(name);
    if folder.exists() {
        return Some(folder);
    }
    println!("SKIPPED: {} is missing", folder.display());
    None
}

/// A disc of 50 mm on a plate with the same print: no contrast, only shadows tell it.
#[test]
fn the_printed_disc_is_held_in_its_middle() {
    let Some(folder) = scene("disc") else { return };
    let solved = scenes::solve_scene(&folder, &scenes::lights().unwrap()).unwrap();
    let inputs = scenes::inputs(&solved);
    let found = plan_thin(&inputs, &Cup::default(), &PlanOptions::default()).unwrap();
    let grasp = &found.grasps[0];
    // Its foot is 3 mm over the table, its thickness 3.15 mm.
    let off = grasp.contact - Point3::new(0.444, -0.009, 0.00615);
    println!(
        "disc: {:.2?} mm off, sigma {:.2} mm",
        (1e3 * off).as_slice(),
        1e3 * grasp.measured.sigma
    );
    assert!(off.xy().norm() < 0.001 && off.z.abs() < 0.002, "{off}");
    let Source::Outline { radius, coverage, .. } = grasp.source else {
        panic!("{:?}", grasp.source)
    };
    assert!((radius - 0.025).abs() < 0.0015 && coverage > 0.9, "{radius} {coverage}");
    // The disc hangs on the cup, not the plate that it lies on.
    let carried = grasp.carried;
    assert!((carried.radius - 0.028).abs() < 0.0015, "{carried:?}");
    assert!((carried.length - 0.009).abs() < 0.002, "{carried:?}");
}
