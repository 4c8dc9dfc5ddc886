//! Bodies with known surfaces, seen by two cameras or one.

mod common;

use common::{Body, Seen, inputs, see};
use geometry::nalgebra::{Point2, Point3, Rotation3, Vector3};
use grasp::{Cup, Grasp, GraspError, Plan, PlanOptions, Source, Test, plan};
use imaging::{Image, Mask};

const SIZE: usize = 640;
/// Of normals, radians in each axis: about what shading gives.
const NOISE: f64 = 0.02;

fn planned(seen: &[Seen; 2]) -> Plan {
    plan(&inputs(seen), &Cup::default(), &PlanOptions::default()).unwrap()
}

fn plate(tilt: f64) -> Body {
    let rotation =
        Rotation3::from_axis_angle(&Vector3::y_axis(), tilt) * Rotation3::from_axis_angle(&Vector3::z_axis(), 0.3);
    Body::block(Point3::new(0.43, 0.0, 0.04), [0.08, 0.07, 0.006], rotation)
}

/// Distance along the surface's normal, metres, and angle, degrees, of a contact on one of some planes.
fn off_planes(grasp: &Grasp, planes: &[(Vector3<f64>, f64)]) -> (f64, f64) {
    let angle = |normal: &Vector3<f64>| normal.dot(&grasp.normal).clamp(-1.0, 1.0).acos().to_degrees();
    let (normal, offset) = planes
        .iter()
        .min_by(|a, b| angle(&a.0).total_cmp(&angle(&b.0)))
        .unwrap();
    (normal.dot(&grasp.contact.coords) - offset, angle(normal))
}

fn refused_by(plan: &Plan, test: Test) -> Vec<(f64, f64)> {
    let failures = plan.refused.iter().flat_map(|refused| &refused.failures);
    failures
        .filter(|failure| failure.test == test)
        .map(|failure| (failure.value, failure.allowed))
        .collect()
}

#[test]
fn a_tilted_plate_is_held_in_its_middle() {
    for degrees in [0.0_f64, 15.0, -25.0] {
        let body = plate(degrees.to_radians());
        let Body::Polyhedron(faces) = &body else { unreachable!() };
        let found = planned(&see(std::slice::from_ref(&body), SIZE, NOISE));
        let best = found
            .grasps
            .first()
            .unwrap_or_else(|| panic!("{degrees}: {:?}", found.refused));
        let (off, angle) = off_planes(best, faces);
        let aside = (best.contact - Point3::new(0.43, 0.0, 0.04)).norm();
        println!(
            "plate at {degrees}: {:.2} mm off, {angle:.2} degrees, {:.1} mm aside",
            1e3 * off,
            1e3 * aside
        );
        assert!(matches!(best.source, Source::BothViews { .. }), "{:?}", best.source);
        assert!(off.abs() < 0.001 && angle < 1.5, "{off} {angle}");
        // 3 mm are half of the thickness; the middle is anywhere a radius and a half from the border.
        assert!(aside < 0.012, "{aside}");
        assert!((best.approach_axis() + best.normal).norm() < 1e-12 && (best.normal.norm() - 1.0).abs() < 1e-9);
    }
}

#[test]
fn every_grasp_of_a_pyramid_is_on_one_flank() {
    let body = Body::pyramid([0.43, 0.0], 0.11, 0.05, 0.35);
    let Body::Polyhedron(faces) = &body else { unreachable!() };
    let found = planned(&see(std::slice::from_ref(&body), SIZE, NOISE));
    assert_eq!(found.grasps.len(), 4, "{:?}", found.refused);
    for grasp in &found.grasps {
        let (off, angle) = off_planes(grasp, faces);
        println!("flank: {:.2} mm off, {angle:.2} degrees", 1e3 * off);
        assert!(off.abs() < 0.001 && angle < 1.5, "{off} {angle}");
        let heights = faces
            .iter()
            .map(|(normal, offset)| offset - normal.dot(&grasp.contact.coords));
        let second = heights
            .filter(|height| height.abs() > 0.002)
            .fold(f64::INFINITY, f64::min);
        assert!(second > 0.004, "{second} m from another face");
        assert!(grasp.measured.gap < 0.001, "{grasp:?}");
    }
}

#[test]
fn round_bodies_are_held_where_they_face_the_gripper() {
    let centre = Point3::new(0.43, 0.01, 0.06);
    let sphere = Body::Sphere { centre, radius: 0.06 };
    let cylinder = Body::Cylinder {
        centre,
        radius: 0.06,
        half_length: 0.05,
    };
    for (body, across) in [
        (sphere, Vector3::new(1.0, 1.0, 1.0)),
        (cylinder, Vector3::new(1.0, 0.0, 1.0)),
    ] {
        let found = planned(&see(&[body], SIZE, NOISE));
        assert!(found.grasps.len() > 3, "{:?}", found.refused);
        for grasp in &found.grasps {
            let from = (grasp.contact - centre).component_mul(&across);
            let (off, angle) = (from.norm() - 0.06, from.angle(&grasp.normal).to_degrees());
            println!(
                "{:.2} mm off, {angle:.2} degrees, sigma {:.2} mm",
                1e3 * off,
                1e3 * grasp.measured.sigma
            );
            assert!(off.abs() < 0.003 && angle < 6.0, "{off} {angle} {grasp:?}");
        }
        assert!(found.grasps[0].normal.z > 0.9, "{}", found.grasps[0].normal);
    }
}

#[test]
fn grasps_are_in_order_and_scores_between_0_and_1() {
    let bodies = [
        Body::block(
            Point3::new(0.40, -0.04, 0.02),
            [0.05, 0.05, 0.04],
            Rotation3::identity(),
        ),
        Body::block(Point3::new(0.46, 0.04, 0.01), [0.06, 0.05, 0.02], Rotation3::identity()),
    ];
    let seen = see(&bodies, SIZE, NOISE);
    let found = planned(&seen);
    assert!(found.grasps.len() >= 2, "{:?}", found.refused);
    assert!(found.grasps.is_sorted_by(|a, b| a.total >= b.total));
    let tops = found
        .grasps
        .iter()
        .filter(|grasp| grasp.normal.z > 0.95)
        .map(|grasp| grasp.contact.z);
    let mut tops: Vec<f64> = tops.collect();
    tops.sort_by(f64::total_cmp);
    assert!(
        (tops[0] - 0.02).abs() < 0.0015 && (tops[tops.len() - 1] - 0.04).abs() < 0.0015,
        "{tops:?}"
    );
    for grasp in &found.grasps {
        for score in [grasp.total, grasp.scores.seal(), grasp.scores.wrench()] {
            assert!((0.0..=1.0).contains(&score), "{grasp:?}");
        }
    }
    assert_eq!(found, planned(&seen), "the same views give the same plan");
    let [a, b] = inputs(&seen);
    let swapped = plan(&[b, a], &Cup::default(), &PlanOptions::default()).unwrap();
    let apart = (swapped.grasps[0].contact - found.grasps[0].contact).norm();
    assert!(apart < 0.003, "{apart} m apart when the views are exchanged");
}

#[test]
fn prints_do_not_matter_and_steps_do() {
    // A step of 4 mm runs through a plate's middle.
    let halves = [
        Body::block(
            Point3::new(0.40, 0.0, 0.010),
            [0.06, 0.10, 0.020],
            Rotation3::identity(),
        ),
        Body::block(
            Point3::new(0.46, 0.0, 0.012),
            [0.06, 0.10, 0.024],
            Rotation3::identity(),
        ),
    ];
    let found = planned(&see(&halves, SIZE, NOISE));
    let tops: Vec<&Grasp> = found.grasps.iter().filter(|grasp| grasp.normal.z > 0.95).collect();
    assert_eq!(tops.len(), 2, "{:?}", found.refused);
    for grasp in tops {
        assert!(
            (grasp.contact.x - 0.43).abs() > 0.010,
            "across the step: {}",
            grasp.contact
        );
        let height = if grasp.contact.x < 0.43 { 0.020 } else { 0.024 };
        println!("step: {:.2} mm off", 1e3 * (grasp.contact.z - height));
        assert!((grasp.contact.z - height).abs() < 0.001, "{}", grasp.contact);
    }
}

#[test]
fn an_empty_table_has_no_grasp_and_says_so() {
    let found = planned(&see(&[], 320, 0.0));
    assert_eq!(found.grasps, []);
    assert_eq!(refused_by(&found, Test::ObjectPixels).len(), 2);
    let text = found.refused[0].to_string();
    assert!(text.starts_with("view 1: 0 object pixels, a cup needs"), "{text}");
}

#[test]
fn an_object_smaller_than_the_cup_is_refused_with_both_sizes() {
    let body = Body::block(
        Point3::new(0.43, 0.0, 0.006),
        [0.012, 0.012, 0.012],
        Rotation3::identity(),
    );
    let found = planned(&see(&[body], SIZE, NOISE));
    assert_eq!(found.grasps, []);
    let borders = refused_by(&found, Test::Border);
    assert!(!borders.is_empty(), "{:?}", found.refused);
    for (value, allowed) in borders {
        assert!(value < 0.008 && (allowed - 0.0105).abs() < 1e-9, "{value} {allowed}");
    }
    let small = Cup {
        diameter: 0.006,
        compliance: 0.001,
        ..Cup::default()
    };
    let body = Body::block(
        Point3::new(0.43, 0.0, 0.006),
        [0.012, 0.012, 0.012],
        Rotation3::identity(),
    );
    let found = plan(&inputs(&see(&[body], SIZE, NOISE)), &small, &PlanOptions::default()).unwrap();
    assert!(!found.grasps.is_empty(), "a small cup holds it: {:?}", found.refused);
}

#[test]
fn edges_everywhere_leave_no_place_for_the_cup() {
    let mut seen = see(&[plate(0.0)], SIZE, NOISE);
    for view in &mut seen {
        // A line every 4 mm, and the surface between them in confident edges.
        let lines = Image::from_fn(SIZE, SIZE, |x, y| {
            u8::from(view.mask.contains(x, y) && (x % 12 == 0 || y % 12 == 0))
        });
        view.edges = Mask::from_nonzero(&lines);
        view.edge_confidence = Image::filled(SIZE, SIZE, 1.0);
    }
    let found = planned(&seen);
    assert_eq!(found.grasps, []);
    let named = refused_by(&found, Test::EdgeShare);
    assert!(
        named
            .iter()
            .any(|(value, allowed)| *value > 0.04 && (*allowed - 0.04).abs() < 1e-12),
        "{:?}",
        found.refused
    );
}

#[test]
fn with_one_view_grasps_are_flagged_and_less_certain() {
    let seen = see(&[plate(0.2)], SIZE, NOISE);
    let Body::Polyhedron(faces) = plate(0.2) else {
        unreachable!()
    };
    let both = planned(&seen);
    let one = plan(&[seen[1].input()], &Cup::default(), &PlanOptions::default()).unwrap();
    assert_eq!((one.views, both.views), (1, 2));
    let best = &one.grasps[0];
    assert!(
        matches!(best.source, Source::OneView { view: 0, .. }),
        "{:?}",
        best.source
    );
    let (off, angle) = off_planes(best, &faces);
    assert!(off.abs() < 0.001 && angle < 1.5, "{off} {angle}");
    assert!(best.measured.sigma > 2.0 * both.grasps[0].measured.sigma);
    assert!(best.total < both.grasps[0].total);
}

#[test]
fn with_one_view_and_no_depth_there_is_nothing_to_go_to() {
    let seen = see(&[plate(0.2)], SIZE, NOISE);
    let mut input = seen[0].input();
    input.depth = None;
    let found = plan(&[input], &Cup::default(), &PlanOptions::default()).unwrap();
    assert_eq!(found.grasps, []);
    assert!(!refused_by(&found, Test::Depth).is_empty());
}

#[test]
fn two_views_need_no_depth() {
    let seen = see(&[plate(0.2)], SIZE, NOISE);
    let Body::Polyhedron(faces) = plate(0.2) else {
        unreachable!()
    };
    let without = inputs(&seen).map(|mut input| {
        input.depth = None;
        input
    });
    let found = plan(&without, &Cup::default(), &PlanOptions::default()).unwrap();
    let (off, angle) = off_planes(&found.grasps[0], &faces);
    assert!(off.abs() < 0.001 && angle < 1.5, "{off} {angle}");
}

/// The first view has all of its depth so much too far away, metres.
fn misled(mut seen: [Seen; 2], by: f32) -> [Seen; 2] {
    for depth in seen[0].depth.pixels_mut() {
        *depth += by;
    }
    seen
}

#[test]
fn a_depth_that_is_wrong_in_one_view_misleads_nobody() {
    let block = Body::block(Point3::new(0.43, 0.0, 0.02), [0.07, 0.06, 0.04], Rotation3::identity());
    for by in [-0.017, -0.012, 0.006, 0.012, 0.017] {
        let seen = misled(see(std::slice::from_ref(&block), SIZE, NOISE), by);
        let found = planned(&seen);
        let tops: Vec<&Grasp> = found.grasps.iter().filter(|grasp| is_top(grasp)).collect();
        for grasp in &tops {
            let height = grasp.contact.z;
            assert!(
                (height - 0.04).abs() < 0.001,
                "{by}: {height} of 0.04, {:?}",
                grasp.source
            );
        }
        assert!(!tops.is_empty(), "{by}: {:?}", found.refused);
    }
}

fn is_top(grasp: &Grasp) -> bool {
    grasp.normal.z > 0.9
}

#[test]
fn what_one_view_alone_finds_is_not_taken_through_what_the_other_sees() {
    let block = Body::block(Point3::new(0.43, 0.0, 0.02), [0.07, 0.06, 0.04], Rotation3::identity());
    let mut options = PlanOptions::default();
    options.matching.area_ratio = 1.0;
    let seen = |by| misled(see(std::slice::from_ref(&block), SIZE, NOISE), by);
    let right = plan(&inputs(&seen(0.0)), &Cup::default(), &options).unwrap();
    let found_alone = |grasp: &Grasp| matches!(grasp.source, Source::OneView { .. });
    assert!(right.grasps.iter().any(found_alone), "{:?}", right.refused);
    let wrong = plan(&inputs(&seen(0.016)), &Cup::default(), &options).unwrap();
    let below = wrong
        .grasps
        .iter()
        .filter(|grasp| is_top(grasp) && grasp.contact.z < 0.035);
    assert_eq!(below.count(), 0, "{:?}", wrong.grasps);
    assert!(!refused_by(&wrong, Test::Stem).is_empty(), "{:?}", wrong.refused);
}

#[test]
fn an_object_that_the_only_view_cuts_off_is_not_taken_at_a_guess() {
    let at = |y: f64| Body::block(Point3::new(0.43, y, 0.01), [0.06, 0.05, 0.02], Rotation3::identity());
    let alone = |y: f64| {
        let seen = see(&[at(y)], SIZE, NOISE);
        plan(&inputs(&seen)[..1], &Cup::default(), &PlanOptions::default()).unwrap()
    };
    let (whole, cut) = (alone(0.0), alone(0.1));
    assert!(!whole.grasps.is_empty(), "{:?}", whole.refused);
    assert!(cut.grasps.is_empty(), "{:?}", cut.grasps);
    assert!(!refused_by(&cut, Test::Cut).is_empty(), "{:?}", cut.refused);
}

#[test]
fn nothing_beside_a_wall_is_taken_by_a_stem_that_hits_it() {
    let floor = Body::block(
        Point3::new(0.43, 0.0, 0.005),
        [0.026, 0.10, 0.010],
        Rotation3::identity(),
    );
    let wall = Body::block(
        Point3::new(0.43, 0.0, 0.035),
        [0.10, 0.028, 0.070],
        Rotation3::identity(),
    );
    let found = planned(&see(&[floor.clone(), wall], SIZE, NOISE));
    let thick = Cup {
        stem_diameter: 0.09,
        ..Cup::default()
    };
    let free = planned(&see(std::slice::from_ref(&floor), SIZE, NOISE));
    assert!(!free.grasps.is_empty(), "{:?}", free.refused);
    let wall = Body::block(
        Point3::new(0.43, 0.0, 0.035),
        [0.10, 0.028, 0.070],
        Rotation3::identity(),
    );
    let blocked = plan(
        &inputs(&see(&[floor, wall], SIZE, NOISE)),
        &thick,
        &PlanOptions::default(),
    )
    .unwrap();
    let low = |plan: &Plan| {
        plan.grasps
            .iter()
            .filter(|grasp| grasp.contact.z < 0.015 && grasp.normal.z > 0.9)
            .count()
    };
    assert_eq!(low(&blocked), 0, "{:?}", blocked.grasps);
    assert!(low(&found) > 0, "{:?}", found.refused);
    assert!(!refused_by(&blocked, Test::Stem).is_empty(), "{:?}", blocked.refused);
}

/// The gripper of the cell: wide, and close behind the lip.
fn with_a_wide_gripper() -> Cup {
    Cup {
        body_diameter: 0.12,
        body_distance: 0.007,
        ..Cup::default()
    }
}

/// What rises over 12 mm is this much deeper in a view than it is.
fn misled_about_the_high(seen: &mut Seen, by: f32) {
    let (camera, pose, depth) = (seen.camera, seen.base_from_camera, seen.depth.clone());
    let moved = |x: usize, y: usize| {
        let depth = depth.row(y)[x];
        let ray = camera.unproject(&Point2::new(x as f64, y as f64)).unwrap();
        let place = pose.transform_point(&Point3::from(ray * f64::from(depth)));
        if place.z > 0.012 { depth + by } else { depth }
    };
    seen.depth = Image::from_fn(SIZE, SIZE, moved);
}

#[test]
fn what_one_view_has_at_another_depth_is_not_hidden_behind_its_neighbour_or_itself() {
    let high = Body::block(
        Point3::new(0.41, -0.03, 0.009),
        [0.05, 0.05, 0.018],
        Rotation3::identity(),
    );
    let low = Body::block(
        Point3::new(0.46, 0.03, 0.004),
        [0.04, 0.04, 0.008],
        Rotation3::identity(),
    );
    let right = see(&[high, low], SIZE, NOISE);
    for (view, by) in [(0, 0.0), (0, 0.018), (0, -0.012), (1, 0.014), (1, -0.012)] {
        let mut seen = right.clone();
        misled_about_the_high(&mut seen[view], by);
        let found = plan(&inputs(&seen), &with_a_wide_gripper(), &PlanOptions::default()).unwrap();
        let heights: Vec<f64> = found.grasps.iter().map(|grasp| grasp.contact.z).collect();
        let is_high = |height: &f64| (height - 0.018).abs() < 0.001;
        let all_high = !heights.is_empty() && heights.iter().all(is_high);
        assert!(all_high, "{view} {by}: {heights:?}, {:?}", found.refused);
        let blocked = refused_by(&found, Test::Stem);
        assert!(
            !blocked.is_empty(),
            "{view} {by}: the gripper would hit the high block: {:?}",
            found.refused
        );
    }
}

#[test]
fn numbers_that_are_none_are_refused() {
    let seen = see(&[], 64, 0.0);
    let refuse = |cup: Cup, options: PlanOptions| plan(&inputs(&seen), &cup, &options).unwrap_err().to_string();
    let usual = PlanOptions::default;
    let cup = Cup {
        diameter: f64::NAN,
        ..Cup::default()
    };
    assert_eq!(refuse(cup, usual()), "cup diameter = NaN, allowed: 0.002 to 0.2 m");
    let mut options = usual();
    options.limits.edge_share = f64::NAN;
    assert_eq!(refuse(Cup::default(), options), "edge_share = NaN, allowed: 0 to 1");
    let mut options = usual();
    options.table_height = f64::INFINITY;
    assert!(refuse(Cup::default(), options).starts_with("table_height = inf"));
    let mut options = usual();
    options.directions = vec![Vector3::zeros()];
    assert!(refuse(Cup::default(), options).starts_with("direction 0 is (0, 0, 0)"));
    let mut options = usual();
    options.directions.clear();
    assert!(refuse(Cup::default(), options).starts_with("directions = 0"));
    let mut options = usual();
    options.weights.centre = f64::NAN;
    assert!(refuse(Cup::default(), options).starts_with("weight of centre = NaN"));
}

#[test]
fn views_that_do_not_fit_are_refused() {
    let seen = see(&[], 64, 0.0);
    let refuse = |inputs: &[grasp::ViewInput<'_>]| plan(inputs, &Cup::default(), &PlanOptions::default()).unwrap_err();
    assert_eq!(refuse(&[]), GraspError::Views { found: 0 });
    let [a, b] = inputs(&seen);
    assert_eq!(refuse(&[a, b, a]), GraspError::Views { found: 3 });
    let other = Image::filled(32, 64, 0.0);
    let mut wrong = a;
    wrong.confidence = &other;
    assert_eq!(
        refuse(&[wrong]).to_string(),
        "view c1: the confidence is 32 x 64, expected 64 x 64"
    );
}
