//! Cameras, targets and what a detector would find of them.

use camera_calibration::{CharucoTarget, DetectedCorner};
use geometry::{PinholeCamera, PlumbBob, RigidTransform};
use nalgebra::Vector2;

use crate::rendering::{normal, target_at};

/// The cell's camera on the wrist at half resolution, behind a lens that bends.
pub(crate) fn wrist_camera() -> PinholeCamera {
    let lens = PlumbBob {
        k1: -0.12,
        k2: 0.08,
        p1: 0.0008,
        p2: -0.0005,
        k3: 0.0,
    };
    let camera = PinholeCamera::new(768, 768, [1090.9, 1092.3], [385.4, 381.6]).expect("a camera");
    camera.with_distortion(lens)
}

/// Targets as a person would hold them: near and far, in all parts of the image, tilted up to 35 degrees.
pub(crate) fn held_targets(target: &CharucoTarget, count: usize, seed: u64) -> Vec<RigidTransform> {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut around = move |size: f64| size * (2.0 * random.f64() - 1.0);
    let pose = |index: usize| {
        let distance = 0.36 + around(0.06);
        let (column, row) = ((index % 3) as f64 - 1.0, (index / 3 % 3) as f64 - 1.0);
        let middle = [
            0.13 * column * distance + around(0.01),
            0.17 * row * distance + around(0.01),
            distance,
        ];
        target_at(target, [around(0.6), around(0.6), around(0.4)], middle)
    };
    (0..count).map(pose).collect()
}

/// Where a perfect detector that is off by `noise` pixels finds the corners that are in the image.
pub(crate) fn corners(
    target: &CharucoTarget,
    camera: &PinholeCamera,
    camera_from_target: &RigidTransform,
    noise: f64,
    random: &mut fastrand::Rng,
) -> Vec<DetectedCorner> {
    let [width, height] = [camera.width(), camera.height()].map(|side| side as f64);
    let corner = |id: usize| {
        let exact = camera.project(&camera_from_target.transform_point(&target.corner(id)?))?;
        let pixel = exact + Vector2::new(noise * normal(random), noise * normal(random));
        let inside = (0.0..width).contains(&pixel.x) && (0.0..height).contains(&pixel.y);
        inside.then_some(DetectedCorner { id, pixel })
    };
    (0..target.corner_count()).filter_map(corner).collect()
}

/// Distance (metres) and angle (radians) between two poses.
pub(crate) fn apart(a: &RigidTransform, b: &RigidTransform) -> [f64; 2] {
    [
        (a.translation() - b.translation()).norm(),
        a.rotation().angle_to(&b.rotation()),
    ]
}
