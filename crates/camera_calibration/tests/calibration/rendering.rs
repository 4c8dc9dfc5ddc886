//! Pictures of a target as a camera would take them.

use camera_calibration::CharucoTarget;
use geometry::nalgebra::{Point2, Point3, UnitQuaternion, Vector2, Vector3};
use geometry::{PinholeCamera, RigidTransform};
use imaging::Image;

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

    pub(crate) fn take(
        &self,
        target: &CharucoTarget,
        camera: &PinholeCamera,
        camera_from_target: &RigidTransform,
    ) -> Image<u16> {
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
    let weights: Vec<f64> = (-reach..=reach)
        .map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp())
        .collect();
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

/// The target turned, its middle at a place before the camera.
pub(crate) fn target_at(target: &CharucoTarget, turn: [f64; 3], middle: [f64; 3]) -> RigidTransform {
    let rotation = UnitQuaternion::from_scaled_axis(turn.into());
    let [width, height] = target.size();
    let own = Vector3::new(width / 2.0, height / 2.0, 0.0);
    RigidTransform::from_parts(Vector3::from(middle) - rotation * own, rotation)
}
