//! Clutter drawn at random: the same for the same numbers, nothing in anything else, all of it where both cameras look.

use std::collections::HashSet;

use geometry::TriangleMesh;
use geometry::nalgebra::{Point2, Point3, Vector2};
use proptest::prelude::*;
use sim::scene::Body;
use sim::world::{KINDS_TO_SCATTER, Region, Scatter, World};

fn scatter(seed: u64, count: u32) -> Scatter {
    Scatter {
        seed,
        count,
        ..Scatter::default()
    }
}

fn bodies(scatter: &Scatter) -> Vec<Body> {
    scatter.bodies(&[]).expect("there is place")
}

/// Convex outline seen from above, counter-clockwise (Andrew's monotone chain).
fn outline(mesh: &TriangleMesh) -> Vec<Point2<f64>> {
    let mut points: Vec<_> = mesh.vertices.iter().map(Point3::xy).collect();
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let half = |points: &mut dyn Iterator<Item = Point2<f64>>| {
        let mut chain: Vec<Point2<f64>> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp(&(point - b)) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut lower = half(&mut points.iter().copied());
    lower.extend(half(&mut points.iter().rev().copied()));
    lower
}

fn sides(outline: &[Point2<f64>]) -> impl Iterator<Item = (Point2<f64>, Vector2<f64>)> {
    let next = outline.iter().cycle().skip(1);
    outline.iter().zip(next).map(|(from, to)| (*from, to - from))
}

fn distance_to_side(point: &Point2<f64>, (from, side): (Point2<f64>, Vector2<f64>)) -> f64 {
    let share = ((point - from).dot(&side) / side.norm_squared()).clamp(0.0, 1.0);
    (point - from - side * share).norm()
}

/// Of two convex outlines; 0 where a corner of one is in the other.
fn distance(a: &[Point2<f64>], b: &[Point2<f64>]) -> f64 {
    let one_way = |a: &[Point2<f64>], b: &[Point2<f64>]| {
        let to_b = |point: &Point2<f64>| {
            if sides(b).all(|(from, side)| side.perp(&(point - from)) >= 0.0) {
                return 0.0;
            }
            sides(b)
                .map(|side| distance_to_side(point, side))
                .fold(f64::INFINITY, f64::min)
        };
        a.iter().map(to_b).fold(f64::INFINITY, f64::min)
    };
    one_way(a, b).min(one_way(b, a))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn no_two_objects_touch_and_all_stand_on_the_table_in_the_region(seed in any::<u64>(), count in 1_u32..=8) {
        let scatter = scatter(seed, count);
        let bodies = bodies(&scatter);
        prop_assert_eq!(bodies.len(), count as usize);
        let outlines: Vec<_> = bodies.iter().map(|body| outline(&body.mesh)).collect();
        for (index, (body, own)) in bodies.iter().zip(&outlines).enumerate() {
            let lowest = body.mesh.vertices.iter().map(|vertex| vertex.z).fold(f64::INFINITY, f64::min);
            prop_assert!(lowest.abs() < 1e-9, "{} stands at {}", body.name, lowest);
            let half = scatter.region.size / 2.0 + 1e-9;
            for corner in own {
                let off = corner - Point2::new(scatter.region.x, scatter.region.y);
                prop_assert!(off.x.abs() <= half && off.y.abs() <= half, "{} is at {}", body.name, corner);
            }
            for (other, theirs) in bodies.iter().zip(&outlines).skip(index + 1) {
                let apart = distance(own, theirs);
                prop_assert!(apart >= scatter.clearance - 1e-9, "{} to {}: {}", body.name, other.name, apart);
            }
        }
        let names: HashSet<_> = bodies.iter().map(|body| &body.name).collect();
        prop_assert_eq!(names.len(), bodies.len());
    }

    #[test]
    fn the_same_numbers_give_the_same_objects_and_others_do_not(seed in any::<u64>()) {
        let first = bodies(&scatter(seed, 5));
        prop_assert!(first == bodies(&scatter(seed, 5)));
        prop_assert!(first != bodies(&scatter(seed.wrapping_add(1), 5)));
    }
}

#[test]
fn every_kind_comes_once_before_one_comes_again() {
    let region = Region {
        size: 0.5,
        ..Region::default()
    };
    let wide = Scatter {
        region,
        ..scatter(3, KINDS_TO_SCATTER.len() as u32)
    };
    let kind = |body: &Body| body.name.rsplit_once(' ').expect("a number").0.to_owned();
    let kinds: HashSet<_> = bodies(&wide).iter().map(kind).collect();
    assert_eq!(kinds, KINDS_TO_SCATTER.map(str::to_owned).into());
    let two = Scatter {
        shapes: vec!["disc".to_owned(), "star".to_owned()],
        ..scatter(3, 4)
    };
    let mut found: Vec<_> = bodies(&two).iter().map(kind).collect();
    found.sort();
    assert_eq!(found, ["disc", "disc", "star", "star"]);
}

#[test]
fn a_world_file_adds_clutter_to_its_objects_and_both_cameras_see_it() {
    let yaml = "
objects: [{name: disc 1, shape: {kind: box, size: [0.03, 0.03, 0.02]}}]
scatter: {seed: 8, count: 4, shapes: [disc]}
";
    let world = World::from_yaml(yaml, "".as_ref()).expect("a world");
    let names: Vec<_> = world.scene.bodies.iter().map(|body| body.name.as_str()).collect();
    assert_eq!(names, ["disc 1", "scattered disc 1", "disc 2", "disc 3", "disc 4"]);
    let block = outline(&world.scene.bodies[0].mesh);
    for body in &world.scene.bodies[1..] {
        assert!(distance(&block, &outline(&body.mesh)) >= 0.004);
    }
    for camera in &world.cameras {
        let camera_from_base = world.base_from_camera(camera).inverse();
        for body in World::scattered(&scatter(2, 6)).expect("there is place").scene.bodies {
            let (corners, count) = (body.mesh.vertices.iter(), body.mesh.vertices.len() as f64);
            let middle = Point3::from(
                corners
                    .map(|corner| corner.coords)
                    .sum::<geometry::nalgebra::Vector3<f64>>()
                    / count,
            );
            let pixel = camera
                .lens
                .project(&camera_from_base.transform_point(&middle))
                .expect("in front");
            assert!(
                (0.0..1536.0).contains(&pixel.x) && (0.0..1536.0).contains(&pixel.y),
                "{}: {pixel}",
                body.name
            );
        }
    }
}

#[test]
fn what_cannot_be_scattered_is_named() {
    for (yaml, message) in [
        (
            "scatter: {count: 40}",
            "scatter.count is 40 objects in 0.18 m; allowed is as many as have place in the region",
        ),
        (
            "scatter: {count: 256}",
            "scatter.objects is a list of 256; allowed is at most 255",
        ),
        (
            "scatter: {clearance: -1}",
            "scatter.clearance is -1; allowed is 0 to 0.5",
        ),
        (
            "scatter: {region: {size: 0}}",
            "scatter.region.size is 0; allowed is 0.05 to 10",
        ),
    ] {
        assert_eq!(World::from_yaml(yaml, "".as_ref()).unwrap_err().to_string(), message);
    }
    let unknown = World::from_yaml("scatter: {shapes: [mesh]}", "".as_ref())
        .unwrap_err()
        .to_string();
    assert!(
        unknown.starts_with("scatter.shapes is mesh; allowed is box, plate, disc"),
        "{unknown}"
    );
    assert!(
        World::from_yaml("scatter: {size: 3}", "".as_ref()).is_err(),
        "an unknown key"
    );
}
