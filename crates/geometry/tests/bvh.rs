//! The hierarchy against a plain loop over all triangles in double precision.

use geometry::nalgebra::{Matrix3, Point3, Vector3};
use geometry::{GeometryError, Ray, TriangleBvh, TriangleMesh};
use proptest::prelude::*;

/// Distance and barycentric weights of a ray's meeting with the plane of a triangle, by Cramer's rule.
fn meet(ray: &Ray, corners: &[Point3<f64>; 3]) -> Option<[f64; 3]> {
    let [a, b, c] = corners;
    let matrix = Matrix3::from_columns(&[-ray.direction, b - a, c - a]);
    let solution = matrix.try_inverse()? * (ray.origin - a);
    Some([solution.x, solution.y, solution.z])
}

/// Nearest distance, and how far from an edge that hit is in barycentric weights; both for triangles shrunk or grown by
/// `margin`.
fn brute_force(mesh: &TriangleMesh, ray: &Ray, margin: f64) -> Option<(f64, usize)> {
    (0..mesh.triangles.len())
        .filter_map(|triangle| {
            let [distance, u, v] = meet(ray, &mesh.corners(triangle))?;
            let inside = u.min(v).min(1.0 - u - v) >= margin && distance > 0.0;
            inside.then_some((distance, triangle))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
}

fn point(range: f64) -> impl Strategy<Value = Point3<f64>> {
    [-range..range, -range..range, -range..range].prop_map(Point3::from)
}

/// Small triangles anywhere in a cube, some of them in one place.
fn soup() -> impl Strategy<Value = TriangleMesh> {
    let triangle = (point(1.0), point(0.3), point(0.3)).prop_map(|(a, b, c)| [a, a + b.coords, a + c.coords]);
    (prop::collection::vec(triangle, 1..120), 0..12_usize).prop_map(|(mut triangles, copies)| {
        triangles.extend(std::iter::repeat_n(triangles[0], copies));
        let vertices: Vec<_> = triangles.iter().flatten().copied().collect();
        let triangles = (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
        TriangleMesh {
            vertices,
            triangles: triangles.collect(),
        }
    })
}

proptest! {
    #[test]
    fn finds_what_a_loop_over_all_triangles_finds(mesh in soup(), from in point(3.0), to in point(1.0)) {
        let ray = Ray::between(&from, &to);
        let bvh = TriangleBvh::new(&mesh).unwrap();
        let hit = bvh.closest_hit(&ray, f64::INFINITY);
        // Rounding may decide either way within a hair of an edge.
        let (sure, possible) = (brute_force(&mesh, &ray, 1e-3), brute_force(&mesh, &ray, -1e-3));
        if let Some((distance, _)) = sure {
            prop_assert!(hit.is_some_and(|hit| hit.distance <= distance + 1e-4), "{hit:?} but {sure:?}");
        }
        if let Some(hit) = hit {
            let (nearest, _) = possible.expect("a hit near some triangle");
            prop_assert!(hit.distance >= nearest - 1e-4, "{hit:?} but {possible:?}");
            let corners = mesh.corners(hit.triangle as usize);
            let [u, v] = hit.barycentric;
            let place = corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v;
            prop_assert!((place - ray.at(hit.distance)).norm() < 1e-3, "{place} but {}", ray.at(hit.distance));
        }
    }

    #[test]
    fn any_hit_agrees_with_the_closest(mesh in soup(), from in point(3.0), to in point(1.0), limit in 0.1..2.0) {
        let ray = Ray::between(&from, &to);
        let bvh = TriangleBvh::new(&mesh).unwrap();
        let closest = bvh.closest_hit(&ray, f64::INFINITY);
        prop_assert_eq!(bvh.any_hit(&ray, f64::INFINITY), closest.is_some());
        prop_assert_eq!(bvh.any_hit(&ray, limit), closest.is_some_and(|hit| (hit.distance as f32) < limit as f32));
        prop_assert_eq!(bvh.closest_hit(&ray, limit).is_some(), bvh.any_hit(&ray, limit));
    }
}

/// A height field of 2 x size x size triangles without a gap.
fn carpet(size: u32) -> TriangleMesh {
    let height = |x: u32, y: u32| 0.05 * (f64::from(x) * 0.9).sin() * (f64::from(y) * 0.7).cos();
    let at = |x: u32, y: u32| y * (size + 1) + x;
    let grid = |count: u32| (0..count).flat_map(move |y| (0..count).map(move |x| (x, y)));
    let step = 1.0 / f64::from(size);
    TriangleMesh {
        vertices: grid(size + 1)
            .map(|(x, y)| Point3::new(f64::from(x) * step, f64::from(y) * step, height(x, y)))
            .collect(),
        triangles: grid(size)
            .flat_map(|(x, y)| {
                let (low, high) = (at(x, y), at(x + 1, y + 1));
                [[low, at(x + 1, y), high], [low, high, at(x, y + 1)]]
            })
            .collect(),
    }
}

#[test]
fn no_ray_slips_between_neighbouring_triangles() {
    let bvh = TriangleBvh::new(&carpet(40)).unwrap();
    // Straight at vertices, edges and diagonals from above, where a crack would show first.
    for step in 1..400 {
        let along = f64::from(step) / 400.0;
        for across in [0.5 + 1e-9, 0.5, along] {
            let ray = Ray {
                origin: Point3::new(along, across, 2.0),
                direction: Vector3::new(0.0, 0.0, -1.0),
            };
            assert!(bvh.any_hit(&ray, f64::INFINITY), "{along} {across}");
        }
    }
}

#[test]
fn a_mesh_without_triangles_is_never_hit() {
    let bvh = TriangleBvh::new(&TriangleMesh::default()).unwrap();
    let ray = Ray::between(&Point3::origin(), &Point3::new(0.0, 0.0, 1.0));
    assert_eq!(bvh.closest_hit(&ray, f64::INFINITY), None);
}

#[test]
fn triangles_without_area_are_never_hit() {
    let vertices = vec![Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(2.0, 0.0, 0.0)];
    let triangles = vec![[0, 0, 0], [0, 1, 2], [0, 1, 1]];
    let bvh = TriangleBvh::new(&TriangleMesh { vertices, triangles }).unwrap();
    for x in [0.0, 0.5, 1.0] {
        let ray = Ray::between(&Point3::new(x, 0.0, 1.0), &Point3::new(x, 0.0, 0.0));
        assert!(!bvh.any_hit(&ray, f64::INFINITY), "x = {x}");
    }
}

#[test]
fn a_mesh_far_from_the_origin_is_as_exact_as_one_near_it() {
    let mut mesh = carpet(20);
    let far = Vector3::new(1000.0, -2000.0, 500.0);
    let near = TriangleBvh::new(&mesh).unwrap();
    for vertex in &mut mesh.vertices {
        *vertex += far;
    }
    let moved = TriangleBvh::new(&mesh).unwrap();
    let ray = Ray::between(&Point3::new(0.3, 0.4, 1.0), &Point3::new(0.31, 0.42, 0.0));
    let there = Ray {
        origin: ray.origin + far,
        ..ray
    };
    let (a, b) = (
        near.closest_hit(&ray, 2.0).unwrap(),
        moved.closest_hit(&there, 2.0).unwrap(),
    );
    assert!((a.distance - b.distance).abs() < 1e-6, "{a:?} {b:?}");
}

#[test]
fn refuses_vertices_that_are_not_there_or_nowhere() {
    let mesh = TriangleMesh {
        vertices: vec![Point3::origin(); 3],
        triangles: vec![[0, 1, 2], [0, 1, 3]],
    };
    let error = TriangleBvh::new(&mesh).unwrap_err();
    assert_eq!(error.to_string(), "triangle 1 uses vertex 3, there are 3");
    let nowhere = TriangleMesh {
        vertices: vec![Point3::new(0.0, f64::NAN, 0.0)],
        triangles: Vec::new(),
    };
    assert!(matches!(
        TriangleBvh::new(&nowhere).unwrap_err(),
        GeometryError::NotFinite { what: "vertex", .. }
    ));
}
