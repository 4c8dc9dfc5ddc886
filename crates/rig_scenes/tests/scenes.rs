//! What is written is read; what is missing or wrong is named.

use std::path::Path;

use geometry::nalgebra::{Point3, UnitQuaternion, Vector3};
use geometry::{PinholeCamera, PlumbBob, RigidTransform};
use imaging::{Image, Mask};
use photometric::View;
use rig_scenes::{Hemisphere, SceneFolder, SceneView, Truth, find_scenes, write_scene};

const SIZE: usize = 12;

fn view() -> View {
    let camera = PinholeCamera::new(SIZE, SIZE, [20.0, 21.0], [5.5, 6.0]).unwrap();
    let lens = PlumbBob {
        k1: -0.1,
        k2: 0.02,
        ..PlumbBob::default()
    };
    let turn = UnitQuaternion::from_euler_angles(2.9, 0.1, 0.3);
    View {
        camera: camera.with_distortion(lens),
        base_from_camera: RigidTransform::from_parts(Vector3::new(0.4, 0.01, 0.3), turn),
    }
}

fn write(folder: &Path) -> (View, Vec<Image<u16>>, Truth) {
    let images: Vec<Image<u16>> = (0..8_u16)
        .map(|light| Image::from_fn(SIZE, SIZE, |x, y| 100 * light + (x * SIZE + y) as u16))
        .collect();
    let inside = |x: usize, y: usize| x > 2 && y > 3;
    let truth = Truth {
        normals: Image::from_fn(
            SIZE,
            SIZE,
            |x, y| if inside(x, y) { [0.6, 0.0, 0.8] } else { [f32::NAN; 3] },
        ),
        depth: Image::from_fn(SIZE, SIZE, |x, y| if inside(x, y) { 0.25 } else { f32::NAN }),
    };
    let mask = Mask::from_nonzero(&Image::from_fn(SIZE, SIZE, |x, y| u8::from(inside(x, y))));
    let view = view();
    let target = Hemisphere {
        centre: Point3::new(0.4, 0.1, 0.0),
        radius: 0.04,
    };
    let scene_view = SceneView {
        camera: "C1",
        view: &view,
        images: &images,
        mask: &mask,
        truth: &truth,
    };
    write_scene(folder, "a scene", Some(target), &[scene_view]).unwrap();
    (view, images, truth)
}

#[test]
fn a_scene_comes_back_as_it_was_written() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("objects/thing");
    let (view, images, truth) = write(&folder);
    assert_eq!(find_scenes(root.path()).unwrap(), std::slice::from_ref(&folder));
    let scene = SceneFolder::open(&folder).unwrap();
    assert_eq!(
        (scene.name().as_str(), scene.cameras().collect::<Vec<_>>()),
        ("thing", vec!["C1"])
    );
    assert!((scene.hemisphere().unwrap().centre - Point3::new(0.4, 0.1, 0.0)).norm() < 1e-12);
    let read = scene.views().unwrap().remove(0);
    assert_eq!(read.view.camera, view.camera);
    let moved = read.view.base_from_camera.inverse() * view.base_from_camera;
    assert!(moved.translation().norm() < 1e-9 && moved.rotation().angle() < 1e-9);
    assert_eq!(read.stack.dark(), &images[0]);
    assert_eq!(read.stack.light(7), Some(&images[7]));
    assert_eq!(read.mask.count(), 9 * 8);
    let read = read.truth.unwrap();
    let normal = read.normals.get(5, 5).unwrap();
    assert!(
        (normal[0] - 0.6).abs() < 1e-3 && (normal[2] - 0.8).abs() < 1e-3,
        "{normal:?}"
    );
    assert!(read.normals.get(0, 0).unwrap()[0].is_nan() && read.depth.get(0, 0).unwrap().is_nan());
    assert_eq!(read.depth.get(5, 5), truth.depth.get(5, 5));
}

/// The error of a scene after something was done to it.
fn error(spoil: impl Fn(&Path)) -> String {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("thing");
    write(&folder);
    spoil(&folder);
    let read = SceneFolder::open(&folder).and_then(|scene| scene.views());
    read.unwrap_err().to_string()
}

#[test]
fn what_is_missing_or_wrong_is_named() {
    let missing = error(|folder| std::fs::remove_file(folder.join("C1/L3.png")).unwrap());
    assert!(missing.contains("L3.png"), "{missing}");
    let torn = error(|folder| std::fs::write(folder.join("scene.json"), "{").unwrap());
    assert!(torn.contains("scene.json"), "{torn}");
    let other = Image::filled(3, 3, 7_u16);
    let resized =
        error(|folder| std::fs::write(folder.join("C1/L2.png"), imaging::encode_png(&other).unwrap()).unwrap());
    assert!(resized.contains("3 x 3") && resized.contains('2'), "{resized}");
    let swapped = error(|folder| {
        std::fs::copy(folder.join("C1/L2.png"), folder.join("C1/mask.png")).unwrap();
    });
    assert!(swapped.contains("mask.png"), "{swapped}");
    let untrue = error(|folder| std::fs::write(folder.join("C1/gt.npz"), "no archive").unwrap());
    assert!(untrue.contains("gt.npz"), "{untrue}");
    let nothing = find_scenes(tempfile::tempdir().unwrap().path())
        .unwrap_err()
        .to_string();
    assert!(nothing.contains("scene.json"), "{nothing}");
}
