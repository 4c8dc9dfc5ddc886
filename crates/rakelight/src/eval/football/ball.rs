//! The ball as a sphere: where it is in the photographs, and the lights that it shows.

use anyhow::{Context, ensure};
use geometry::nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};
use geometry::{PinholeCamera, RigidTransform};
use imaging::{ExposureStack, Image, Mask};
use photometric::View;

use super::circle::Circle;

/// Of a football, metres; only the scale of the depth hangs on it.
pub(super) const RADIUS: f64 = 0.11;
/// Above the middle of the mat; base frame, metres.
pub(super) const CENTRE: Point3<f64> = Point3::new(0.43, 0.0, RADIUS);
/// Rounds in which samples that a light model does not explain lose their weight.
const ROUNDS: usize = 8;
/// Misfit at which a sample counts half, as a share of the brightest prediction: grain, seams and shadows.
const SEAM: f64 = 0.05;
/// Samples that face a light less than this are left out: half in shadow.
const GRAZING: f64 = 0.15;

/// The sphere and the camera that looks at its middle.
pub(super) struct Ball {
    pub(super) view: View,
    /// Of each pixel of the ball: its position and the sphere's normal there, base frame.
    pub(super) normals: Vec<(usize, Vector3<f64>)>,
}

impl Ball {
    /// The circle that most of the mask's outline lies on, seen by a camera of a focal length (pixels) that looks straight
    /// down at the sphere's middle.
    pub(super) fn of(mask: &Mask, focal: [f64; 2]) -> anyhow::Result<Self> {
        let (width, height) = (mask.as_image().width(), mask.as_image().height());
        let Circle { middle, radius } = Circle::of_outline(mask)?;
        // The sphere's outline is the cone of its tangents.
        let sine = (radius / focal[0]).atan().sin();
        let camera = PinholeCamera::new(width, height, focal, middle)?;
        let centre = CENTRE.coords + Vector3::z() * (RADIUS / sine);
        let half_turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let view = View {
            camera,
            base_from_camera: RigidTransform::from_parts(centre, half_turn),
        };
        let normal = |at: usize| {
            let pixel = [(at % width) as f64 - middle[0], (at / width) as f64 - middle[1]];
            let ray = Vector3::new(pixel[0] / focal[0], pixel[1] / focal[1], 1.0).normalize();
            let normal = meet(&ray, sine)?;
            Some((at, view.base_from_camera.transform_direction(&normal)))
        };
        let inside = (0..width * height).filter(|&at| mask.contains(at % width, at / width));
        let normals: Vec<_> = inside.filter_map(normal).collect();
        ensure!(
            !normals.is_empty(),
            "no pixel of the mask lies in the circle of its outline"
        );
        Ok(Self { view, normals })
    }

    /// The ball's part of the mask.
    pub(super) fn mask(&self, mask: &Mask) -> Mask {
        let mut ball = Image::filled(mask.as_image().width(), mask.as_image().height(), 0_u8);
        for (at, _) in &self.normals {
            ball.pixels_mut()[*at] = 1;
        }
        Mask::from_nonzero(&ball)
    }

    /// One vector for each light, base frame, digital numbers: the one that the sphere's samples fit best (iteratively
    /// reweighted least squares with Cauchy's weight). Saturated and grazing samples do not count.
    pub(super) fn lights(&self, stack: &ExposureStack) -> anyhow::Result<Vec<(u8, Vector3<f64>)>> {
        stack
            .channels()
            .map(|channel| {
                let light = self.light(stack, channel);
                Ok((
                    channel,
                    light.with_context(|| format!("light {channel} lights nothing"))?,
                ))
            })
            .collect()
    }

    fn light(&self, stack: &ExposureStack, channel: u8) -> Option<Vector3<f64>> {
        let (image, dark) = (stack.light(channel)?.pixels(), stack.dark().pixels());
        let usable = self.normals.iter().filter(|(at, _)| image[*at] < stack.saturation());
        let samples: Vec<_> = usable
            .map(|(at, normal)| (f64::from(image[*at]) - f64::from(dark[*at]), normal))
            .collect();
        let mut light: Option<Vector3<f64>> = None;
        for _ in 0..ROUNDS {
            let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
            for (signal, normal) in &samples {
                let weight = light.map_or(1.0, |light| weight(&light, normal, *signal));
                matrix += *normal * normal.transpose() * weight;
                right += *normal * (weight * signal);
            }
            light = Some(matrix.try_inverse()? * right);
        }
        light
    }
}

fn weight(light: &Vector3<f64>, normal: &Vector3<f64>, signal: f64) -> f64 {
    let strength = light.norm();
    let predicted = light.dot(normal);
    if predicted < GRAZING * strength {
        return 0.0;
    }
    1.0 / (1.0 + ((signal - predicted) / (SEAM * strength)).powi(2))
}

/// The normal where a ray from the origin meets the sphere of a radius about (0, 0, 1); none where it misses.
fn meet(ray: &Vector3<f64>, radius: f64) -> Option<Vector3<f64>> {
    let square = ray.z * ray.z - (1.0 - radius * radius);
    let distance = (square >= 0.0).then(|| ray.z - square.sqrt())?;
    Some((ray * distance - Vector3::z()) / radius)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sphere of 60 pixels radius under one light.
    fn shaded(light: Vector3<f64>) -> (Ball, ExposureStack) {
        let disc = |x: usize, y: usize| u8::from((x as f64 - 80.0).hypot(y as f64 - 75.0) <= 60.0);
        let mask = Mask::from_nonzero(&Image::from_fn(160, 150, disc));
        let ball = Ball::of(&mask, [20_000.0; 2]).expect("a ball");
        let mut image = Image::filled(160, 150, 200_u16);
        for (at, normal) in &ball.normals {
            image.pixels_mut()[*at] = 200 + light.dot(normal).max(0.0).round() as u16;
        }
        let dark = Image::filled(160, 150, 200_u16);
        (
            ball,
            ExposureStack::new(&[1], [(0, dark), (1, image)], u16::MAX).expect("a stack"),
        )
    }

    #[test]
    fn a_light_is_found_from_the_ball_that_it_lights() {
        let light = Vector3::new(12_000.0, -9_000.0, 20_000.0);
        let (ball, stack) = shaded(light);
        let found = ball.lights(&stack).expect("lights")[0].1;
        assert!((found - light).norm() < 0.01 * light.norm(), "{found}");
    }

    #[test]
    fn the_middle_faces_the_camera_and_the_right_faces_right() {
        let (ball, _) = shaded(Vector3::z());
        let at = |x: usize, y: usize| {
            let found = ball.normals.iter().find(|(at, _)| *at == y * 160 + x);
            found.expect("on the ball").1
        };
        assert!((at(80, 75) - Vector3::z()).norm() < 0.02);
        assert!(at(120, 75).x > 0.6 && at(80, 115).y < -0.6);
    }
}
