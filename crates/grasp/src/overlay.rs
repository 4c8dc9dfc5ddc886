//! Grasps drawn into what a view shows.

use geometry::nalgebra::{Point2, Point3, Vector3};
use geometry::{PinholeCamera, RigidTransform};
use imaging::Image;

use crate::cup::Cup;
use crate::result::{Plan, Source};
use crate::view::ViewInput;

const GRASP: [u8; 3] = [60, 255, 60];
const ONE_VIEW: [u8; 3] = [255, 220, 40];
const REFUSED: [u8; 3] = [255, 70, 70];
const EDGE: [u8; 3] = [90, 140, 255];

/// Towards the light of the relief that stands for a view's image: from the upper left, as maps have it.
const LIGHT: [f32; 3] = [0.45, 0.45, 0.77];

/// A picture of a view, to be drawn into.
#[derive(Debug, Clone)]
pub struct Overlay {
    picture: Image<[u8; 3]>,
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
    /// On a picture of the camera's size.
    pub fn new(picture: Image<[u8; 3]>, camera: PinholeCamera, base_from_camera: &RigidTransform) -> Self {
        Self {
            picture,
            camera,
            camera_from_base: base_from_camera.inverse(),
        }
    }

    /// On a relief of a view's normals.
    pub fn on_normals(normals: &Image<[f32; 3]>, camera: PinholeCamera, base_from_camera: &RigidTransform) -> Self {
        Self::new(normals.map(relief), camera, base_from_camera)
    }

    /// On a relief of the view's normals, with its depth edges in blue.
    pub fn on_relief(view: &ViewInput<'_>) -> Self {
        let mut picture = view.normals.map(relief);
        let edges = view.edges.as_image().pixels();
        for (pixel, _) in picture
            .pixels_mut()
            .iter_mut()
            .zip(edges)
            .filter(|(_, edge)| **edge != 0)
        {
            *pixel = EDGE;
        }
        Self::new(picture, view.camera, &view.base_from_camera)
    }

    /// What was drawn.
    pub fn picture(&self) -> &Image<[u8; 3]> {
        &self.picture
    }

    /// Grasps as footprint, normal and rank (0 is the best), green, or yellow where only one view shows them; what was
    /// refused in red.
    pub fn plan(&mut self, plan: &Plan, cup: &Cup) {
        for refused in &plan.refused {
            if let (Some(contact), Some(normal)) = (&refused.contact, &refused.normal) {
                self.cup(contact, normal, cup.radius(), REFUSED);
            }
        }
        for (rank, grasp) in plan.grasps.iter().enumerate().rev() {
            let colour = match grasp.source {
                Source::OneView { .. } => ONE_VIEW,
                Source::BothViews { .. } | Source::Outline { .. } => GRASP,
            };
            self.cup(&grasp.contact, &grasp.normal, cup.radius(), colour);
            self.number(&grasp.contact, rank, colour);
        }
    }

    /// One grasp in green: its footprint (metres), normal and rank.
    pub fn grasp(&mut self, contact: &Point3<f64>, normal: &Vector3<f64>, radius: f64, rank: usize) {
        self.cup(contact, normal, radius, GRASP);
        self.number(contact, rank, GRASP);
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
    fn line(&mut self, from: &Point3<f64>, to: &Point3<f64>, colour: [u8; 3]) {
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
    fn cup(&mut self, centre: &Point3<f64>, normal: &Vector3<f64>, radius: f64, colour: [u8; 3]) {
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
    fn number(&mut self, at: &Point3<f64>, number: usize, colour: [u8; 3]) {
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

/// Gray of a surface in the relief's light; black where there is no normal.
fn relief(normal: &[f32; 3]) -> [u8; 3] {
    let cosine: f32 = normal.iter().zip(LIGHT).map(|(n, l)| n * l).sum();
    if cosine.is_finite() {
        [(40.0 + 190.0 * cosine.max(0.0)).min(255.0) as u8; 3]
    } else {
        [0; 3]
    }
}
