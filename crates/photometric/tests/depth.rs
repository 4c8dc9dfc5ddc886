//! Depth of surfaces that are known: planes, a ball, a step, path-traced objects.

use std::path::Path;

use geometry::nalgebra::{Point2, Point3, UnitQuaternion, Vector3};
use geometry::{PinholeCamera, PlumbBob, RigidTransform};
use imaging::{Image, Mask};
use photometric::{DepthMap, IntegrationInput, IntegrationOptions, PhotometricError, PixelRays, View, integrate};
use rig_scenes::SceneFolder;

/// A camera 0.3 m over the mat, looking straight down through a lens that bends lines.
fn view(size: usize) -> View {
    let middle = (size as f64 - 1.0) / 2.0;
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let lens = PlumbBob {
        k1: -0.1,
        k2: 0.02,
        ..PlumbBob::default()
    };
    let camera = PinholeCamera::new(size, size, [size as f64 * 2.0; 2], [middle; 2]).unwrap();
    View {
        camera: camera.with_distortion(lens),
        base_from_camera: RigidTransform::from_parts(Vector3::new(0.43, 0.0, 0.3), down),
    }
}

/// What a ray through a pixel meets: depth and normal.
type Scene<'a> = dyn Fn(&Point3<f64>, &Vector3<f64>) -> Option<(f64, Vector3<f64>)> + 'a;

struct Known {
    view: View,
    rays: PixelRays,
    normals: Image<[f32; 3]>,
    depth: Image<f32>,
    mask: Mask,
}

fn known(size: usize, scene: &Scene<'_>) -> Known {
    let view = view(size);
    let hit = |x: usize, y: usize| {
        let ray = view.camera.unproject(&Point2::new(x as f64, y as f64)).unwrap();
        scene(&view.centre(), &view.base_from_camera.transform_direction(&ray))
    };
    let normals = Image::from_fn(size, size, |x, y| {
        hit(x, y).map_or([f32::NAN; 3], |(_, n)| n.cast::<f32>().into())
    });
    let depth = Image::from_fn(size, size, |x, y| hit(x, y).map_or(f32::NAN, |(depth, _)| depth as f32));
    Known {
        rays: PixelRays::new(&view.camera),
        mask: Mask::from_nonzero(&depth.map(|d| u8::from(d.is_finite()))),
        view,
        normals,
        depth,
    }
}

fn solve(known: &Known) -> DepthMap {
    let confidence = known.depth.map(|d| if d.is_finite() { 1.0 } else { 0.0 });
    let input = IntegrationInput {
        normals: &known.normals,
        confidence: &confidence,
        mask: &known.mask,
        view: &known.view,
        rays: &known.rays,
    };
    integrate(&input, &IntegrationOptions::default()).unwrap()
}

/// Mean difference after one offset, and the offset, millimetres.
fn error(found: &DepthMap, truth: &Image<f32>, mask: &Mask) -> (f64, f64) {
    let pairs = found
        .depth
        .pixels()
        .iter()
        .zip(truth.pixels())
        .zip(mask.as_image().pixels());
    let mut off: Vec<f64> = pairs
        .filter(|(_, inside)| **inside != 0)
        .map(|((a, b), _)| 1e3 * f64::from(a - b))
        .filter(|off| off.is_finite())
        .collect();
    off.sort_by(f64::total_cmp);
    let middle = off[off.len() / 2];
    (
        off.iter().map(|x| (x - middle).abs()).sum::<f64>() / off.len() as f64,
        middle,
    )
}

fn plane(centre: &Point3<f64>, ray: &Vector3<f64>, through: Vector3<f64>, normal: Vector3<f64>) -> (f64, Vector3<f64>) {
    ((through - centre.coords).dot(&normal) / ray.dot(&normal), normal)
}

#[test]
fn a_tilted_plane_comes_back_where_its_lowest_edge_stands_on_the_table() {
    let normal = Vector3::new(0.3, -0.2, 1.0).normalize();
    let known = known(320, &|centre, ray| {
        let (depth, normal) = plane(centre, ray, Vector3::new(0.43, 0.0, 0.02), normal);
        let point = centre + ray * depth;
        (point.z > 0.0 && (point.x - 0.43).abs() < 0.055 && point.y.abs() < 0.05).then_some((depth, normal))
    });
    let found = solve(&known);
    let (mean, offset) = error(&found, &known.depth, &known.mask);
    println!("plane: {mean:.4} mm, offset {offset:.3} mm, {} steps", found.iterations);
    assert!(mean < 0.02, "{mean}");
    assert_eq!(found.parts, 1);
    let lowest = known
        .depth
        .pixels()
        .iter()
        .copied()
        .filter(|d| d.is_finite())
        .fold(0.0, f32::max);
    // How far the lowest seen point is over the table, and a share of the border beside it.
    let over = 1e3 * (0.3 - f64::from(lowest));
    assert!(
        (offset - over).abs() < 2.0,
        "offset {offset}, the lowest point is {over} mm over the table"
    );
}

#[test]
fn two_balls_come_back_round_each_at_its_own_scale() {
    let known = known(384, &|centre, ray| {
        [-0.03, 0.03].into_iter().find_map(|x| {
            let middle = Point3::new(0.43 + x, 0.0, 0.0);
            let (to, a) = (centre - middle, ray.norm_squared());
            let b = ray.dot(&to);
            let root = b * b - a * (to.norm_squared() - 0.02 * 0.02);
            let depth = (-b - root.max(0.0).sqrt()) / a;
            let normal = (to + ray * depth) / 0.02;
            (root > 0.0 && normal.z > 0.05).then_some((depth, normal))
        })
    });
    let found = solve(&known);
    let (mean, offset) = error(&found, &known.depth, &known.mask);
    println!("balls: {mean:.3} mm, offset {offset:.3} mm, {} steps", found.iterations);
    assert_eq!(found.parts, 2);
    // A ball meets the table with a wall; just inside its border it is some millimetres high, and that is what is seen.
    assert!(mean < 0.3 && (0.0..7.0).contains(&offset), "{mean} {offset}");
}

#[test]
fn one_thread_or_two_give_the_same() {
    let normal = Vector3::new(0.2, 0.1, 1.0).normalize();
    let known = known(80, &|centre, ray| {
        Some(plane(centre, ray, Vector3::new(0.43, 0.0, 0.02), normal))
    });
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| solve(&known)).depth.map(|d| d.to_bits())
    };
    assert!(with(1) == with(2));
}

#[test]
fn nothing_in_gives_nothing_out() {
    for size in [1, 2, 33] {
        let known = known(size, &|_, _| None);
        let found = solve(&known);
        assert_eq!(found.parts, 0);
        assert!(found.depth.pixels().iter().all(|d| d.is_nan()), "{size}");
    }
}

#[test]
fn a_map_of_another_size_is_named() {
    let (small, large) = (known(8, &|_, _| None), known(9, &|_, _| None));
    let confidence = Image::filled(9, 9, 1.0);
    let input = IntegrationInput {
        normals: &small.normals,
        confidence: &confidence,
        mask: &large.mask,
        view: &large.view,
        rays: &large.rays,
    };
    let error = integrate(&input, &IntegrationOptions::default()).unwrap_err();
    assert!(
        matches!(
            error,
            PhotometricError::OtherSize {
                what: "the normals",
                width: 8,
                ..
            }
        ),
        "{error}"
    );
}

#[test]
fn path_traced_objects_come_back_from_their_true_normals() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/rig/objects");
    if !folder.exists() {
        println!("SKIPPED: {} is missing", folder.display());
        return;
    }
    for name in ["pyramid", "octagon2", "spot"] {
        for view in SceneFolder::open(&folder.join(name)).unwrap().views().unwrap() {
            let truth = view.truth.unwrap();
            let known = Known {
                rays: PixelRays::new(&view.view.camera),
                view: view.view,
                normals: truth.normals,
                depth: truth.depth,
                mask: view.mask,
            };
            let found = solve(&known);
            let (mean, offset) = error(&found, &known.depth, &known.mask);
            println!(
                "{name} {}: {mean:.3} mm, offset {offset:.2} mm, {} steps",
                view.camera, found.iterations
            );
            assert!(mean < 0.4, "{name} {}: {mean} mm", view.camera);
        }
    }
}
