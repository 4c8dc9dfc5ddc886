//! Pictures of a target as a camera would take them.

use camera_calibration::{CharucoTarget, DetectedCorner};
use geometry::{PinholeCamera, PlumbBob, RigidTransform};
use imaging::Image;
use nalgebra::{Point2, Point3, UnitQuaternion, Vector2, Vector3};

/// Samples of a pixel in each direction.
const SAMPLES: usize = 5;
/// Black, white and the table around the target, of full scale.
const SHADES: [f64; 3] = [0.06, 0.75, 0.3];

/// How a picture is taken.
#[derive(Clone, Copy)]
pub(crate) struct Picture {
    /// Standard deviation of the lens' blur, pixels.
    pub(crate) blur: f64,
    /// Standard deviation of the noise, of full scale.
    pub(crate) noise: f64,
    pub(crate) seed: u64,
}

impl Picture {
    pub(crate) const USUAL: Self = Self {
        blur: 0.7,
        noise: 0.01,
        seed: 1,
    };

    pub(crate) fn take(&self, target: &CharucoTarget, camera: &PinholeCamera, camera_from_target: &RigidTransform) -> Image<u16> {
        let (width, height) = (camera.width(), camera.height());
        let sharp = sharp(target, camera, camera_from_target);
        let soft = blurred(&sharp, width, height, self.blur);
        let mut random = fastrand::Rng::with_seed(self.seed);
        let pixels = soft.iter().map(|value| {
            let noisy = value + self.noise * normal(&mut random);
            (noisy.clamp(0.0, 1.0) * 65_535.0).round() as u16
        });
        Image::new(width, height, pixels.collect()).expect("as many as there are pixels")
    }
}

/// A normally distributed number (Box and Muller).
pub(crate) fn normal(random: &mut fastrand::Rng) -> f64 {
    (-2.0 * (1.0 - random.f64()).ln()).sqrt() * (std::f64::consts::TAU * random.f64()).cos()
}

/// The mean over each pixel; rays are exact at pixels' corners and bilinear in between.
fn sharp(target: &CharucoTarget, camera: &PinholeCamera, camera_from_target: &RigidTransform) -> Vec<f64> {
    let target_from_camera = camera_from_target.inverse();
    let (width, height) = (camera.width(), camera.height());
    let rays: Vec<Vector2<f64>> = (0..=height)
        .flat_map(|y| (0..=width).map(move |x| Point2::new(x as f64 - 0.5, y as f64 - 0.5)))
        .map(|pixel| camera.unproject(&pixel).expect("a lens that does not fold").xy())
        .collect();
    let origin = Point3::from(target_from_camera.translation());
    let rotation = target_from_camera.rotation_matrix();
    let shade = |ray: Vector2<f64>| {
        let direction = rotation * ray.push(1.0);
        let place = origin + direction * (-origin.z / direction.z);
        shade(target, &place)
    };
    let mut pixels = Vec::with_capacity(width * height);
    for y in 0..height {
        for x in 0..width {
            let at = |dx: usize, dy: usize| rays[(y + dy) * (width + 1) + x + dx];
            let mut sum = 0.0;
            for sample in 0..SAMPLES * SAMPLES {
                let [u, v] = [sample % SAMPLES, sample / SAMPLES].map(|i| (i as f64 + 0.5) / SAMPLES as f64);
                let (top, bottom) = (at(0, 0).lerp(&at(1, 0), u), at(0, 1).lerp(&at(1, 1), u));
                sum += shade(top.lerp(&bottom, v));
            }
            pixels.push(sum / (SAMPLES * SAMPLES) as f64);
        }
    }
    pixels
}

fn shade(target: &CharucoTarget, place: &Point3<f64>) -> f64 {
    let [width, height] = target.size();
    let margin = target.square();
    let on_paper = |place: f64, side: f64| (-margin..side + margin).contains(&place);
    if !on_paper(place.x, width) || !on_paper(place.y, height) {
        SHADES[2]
    } else if target.is_black(place.x, place.y) {
        SHADES[0]
    } else {
        SHADES[1]
    }
}

/// Gaussian blur, rows then columns; the border is repeated.
fn blurred(pixels: &[f64], width: usize, height: usize, sigma: f64) -> Vec<f64> {
    if sigma <= 0.0 {
        return pixels.to_vec();
    }
    let reach = (4.0 * sigma).ceil() as i64;
    let weights: Vec<f64> = (-reach..=reach).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp()).collect();
    let total: f64 = weights.iter().sum();
    let convolve = |pixels: &[f64], along_x: bool| -> Vec<f64> {
        (0..width * height)
            .map(|index| {
                let (x, y) = ((index % width) as i64, (index / width) as i64);
                let sum: f64 = (-reach..=reach)
                    .zip(&weights)
                    .map(|(i, weight)| {
                        let (dx, dy) = if along_x { (i, 0) } else { (0, i) };
                        let column = (x + dx).clamp(0, width as i64 - 1) as usize;
                        let row = (y + dy).clamp(0, height as i64 - 1) as usize;
                        weight * pixels[row * width + column]
                    })
                    .sum();
                sum / total
            })
            .collect()
    };
    convolve(&convolve(pixels, true), false)
}

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

/// The target turned, its middle at a place before the camera.
pub(crate) fn target_at(target: &CharucoTarget, turn: [f64; 3], middle: [f64; 3]) -> RigidTransform {
    let rotation = UnitQuaternion::from_scaled_axis(turn.into());
    let [width, height] = target.size();
    let own = Vector3::new(width / 2.0, height / 2.0, 0.0);
    RigidTransform::from_parts(Vector3::from(middle) - rotation * own, rotation)
}

/// Targets as a person would hold them: near and far, in all parts of the image, tilted up to 35 degrees.
pub(crate) fn held_targets(target: &CharucoTarget, count: usize, seed: u64) -> Vec<RigidTransform> {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut around = move |size: f64| size * (2.0 * random.f64() - 1.0);
    let pose = |index: usize| {
        let distance = 0.36 + around(0.06);
        let (column, row) = ((index % 3) as f64 - 1.0, (index / 3 % 3) as f64 - 1.0);
        let middle = [0.13 * column * distance + around(0.01), 0.17 * row * distance + around(0.01), distance];
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
    [(a.translation() - b.translation()).norm(), a.rotation().angle_to(&b.rotation())]
}
