//! Grasps drawn into what a view shows.

use geometry::nalgebra::{Point2, Point3, Vector3};
use geometry::{PinholeCamera, RigidTransform};
use imaging::Image;

/// A picture and the camera that took it.
pub(crate) struct Overlay {
    pub(crate) picture: Image<[u8; 3]>,
    camera: PinholeCamera,
    camera_from_base: RigidTransform,
}

/// Five rows of three bits for each digit.
const DIGITS: [[u8; 5]; 10] = [
    [7, 5, 5, 5, 7],
    [2, 6, 2, 2, 7],
    [7, 1, 7, 4, 7],
    [7, 1, 3, 1, 7],
    [5, 5, 7, 1, 1],
    [7, 4, 7, 1, 7],
    [7, 4, 7, 5, 7],
    [7, 1, 1, 2, 2],
    [7, 5, 7, 5, 7],
    [7, 5, 7, 1, 7],
];
const DIGIT_SCALE: i64 = 3;

impl Overlay {
    pub(crate) fn new(picture: Image<[u8; 3]>, camera: PinholeCamera, base_from_camera: &RigidTransform) -> Self {
        Self {
            picture,
            camera,
            camera_from_base: base_from_camera.inverse(),
        }
    }

    fn pixel(&self, point: &Point3<f64>) -> Option<Point2<f64>> {
        self.camera.project(&self.camera_from_base.transform_point(point))
    }

    fn dot(&mut self, x: i64, y: i64, colour: [u8; 3]) {
        let (width, height) = (self.picture.width() as i64, self.picture.height() as i64);
        if (0..width).contains(&x) && (0..height).contains(&y) {
            self.picture.pixels_mut()[(y * width + x) as usize] = colour;
        }
    }

    /// A straight line in space.
    pub(crate) fn line(&mut self, from: &Point3<f64>, to: &Point3<f64>, colour: [u8; 3]) {
        let (Some(a), Some(b)) = (self.pixel(from), self.pixel(to)) else {
            return;
        };
        let steps = (b - a).norm().ceil().clamp(1.0, 4_000.0);
        for step in 0..=steps as i64 {
            let at = a + (b - a) * (step as f64 / steps);
            self.dot(at.x.round() as i64, at.y.round() as i64, colour);
        }
    }

    /// A circle in space, with a stroke along its normal.
    pub(crate) fn cup(&mut self, centre: &Point3<f64>, normal: &Vector3<f64>, radius: f64, colour: [u8; 3]) {
        let helper = if normal.x.abs() < 0.6 {
            Vector3::x()
        } else {
            Vector3::y()
        };
        let u = normal.cross(&helper).normalize();
        let v = normal.cross(&u);
        let at = |k: usize| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / 48.0).sin_cos();
            centre + (u * cos + v * sin) * radius
        };
        for k in 0..48 {
            self.line(&at(k), &at(k + 1), colour);
        }
        self.line(centre, &(centre + normal * 1.5 * radius), colour);
    }

    /// A number beside a point.
    pub(crate) fn number(&mut self, at: &Point3<f64>, number: usize, colour: [u8; 3]) {
        let Some(pixel) = self.pixel(at) else { return };
        let digits: Vec<usize> = number
            .to_string()
            .bytes()
            .map(|digit| usize::from(digit - b'0'))
            .collect();
        for (place, digit) in digits.into_iter().enumerate() {
            let left = pixel.x as i64 + 3 + place as i64 * 4 * DIGIT_SCALE;
            self.digit(left, pixel.y as i64 + 3, digit, colour);
        }
    }

    fn digit(&mut self, left: i64, top: i64, digit: usize, colour: [u8; 3]) {
        for (row, bits) in DIGITS[digit].iter().enumerate() {
            for column in (0..3).filter(|column| bits >> (2 - column) & 1 == 1) {
                for pixel in 0..DIGIT_SCALE * DIGIT_SCALE {
                    let (dx, dy) = (pixel % DIGIT_SCALE, pixel / DIGIT_SCALE);
                    self.dot(
                        left + column * DIGIT_SCALE + dx,
                        top + row as i64 * DIGIT_SCALE + dy,
                        colour,
                    );
                }
            }
        }
    }
}
