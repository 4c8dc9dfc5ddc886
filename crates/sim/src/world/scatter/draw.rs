//! Shapes of random sizes.

use std::path::Path;

use geometry::TriangleMesh;
use geometry::nalgebra::{Point2, Point3};

use crate::SimError;
use crate::objects::{
    Ball, BentCylinder, Bracket, Cross, Cuboid, Cylinder, Gear, Octagon1, Octagon2, Pyramid, Relief, Shape, Star, Wedge,
};
use crate::scene::Albedo;

/// Kinds of shape that are scattered.
pub const KINDS_TO_SCATTER: [&str; 16] = [
    "box",
    "plate",
    "disc",
    "cylinder",
    "octagon1",
    "octagon2",
    "star",
    "gear",
    "cross",
    "bracket",
    "pyramid",
    "wedge",
    "sphere",
    "hemisphere",
    "bent_cylinder",
    "relief",
];

/// An object without a place.
#[derive(Debug, Clone)]
pub(super) struct Draw {
    pub(super) kind: String,
    /// Standing on z = 0.
    pub(super) mesh: TriangleMesh,
    /// Of the circle around it, seen from above.
    pub(super) middle: Point2<f64>,
    /// Of that circle, metres.
    pub(super) radius: f64,
    pub(super) albedo: Albedo,
}

pub(super) fn draw(kind: &str, random: &mut fastrand::Rng) -> Result<Draw, SimError> {
    let mesh = shape(kind, random)?.mesh(Path::new(""))?;
    let (middle, radius) = circle(&mesh);
    Ok(Draw {
        kind: kind.to_owned(),
        mesh,
        middle,
        radius,
        albedo: Draw::albedo(random),
    })
}

/// Around a mesh, seen from above: its middle is that of the mesh's sides along x and y.
pub(super) fn circle(mesh: &TriangleMesh) -> (Point2<f64>, f64) {
    let corners = || mesh.vertices.iter().map(Point3::xy);
    let low = corners().fold(Point2::new(f64::INFINITY, f64::INFINITY), |low, corner| {
        low.inf(&corner)
    });
    let high = corners().fold(Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY), |high, corner| {
        high.sup(&corner)
    });
    let middle = low + (high - low) / 2.0;
    let radius = corners().map(|corner| (corner - middle).norm()).fold(0.0, f64::max);
    (middle, radius)
}

/// Of sizes (metres) that a cup of 20 mm finds a level place on, but for pyramid, wedge, ball, bent cylinder and relief.
fn shape(kind: &str, random: &mut fastrand::Rng) -> Result<Shape, SimError> {
    let mut between = |least: f64, most: f64| least + (most - least) * random.f64();
    Ok(match kind {
        "box" => Shape::Box(Cuboid {
            size: Some([between(0.026, 0.036), between(0.025, 0.03), between(0.01, 0.03)]),
        }),
        "plate" => {
            let side = between(0.028, 0.036);
            Shape::Plate(Cuboid {
                size: Some([side, side, between(0.004, 0.01)]),
            })
        }
        "disc" => Shape::Disc(Cylinder {
            diameter: Some(between(0.03, 0.05)),
            height: Some(between(0.003, 0.005)),
            segments: None,
        }),
        "cylinder" => Shape::Cylinder(Cylinder {
            diameter: Some(between(0.026, 0.04)),
            height: Some(between(0.01, 0.03)),
            segments: None,
        }),
        "octagon1" => Shape::Octagon1(Octagon1 {
            width: between(0.03, 0.046),
            height: between(0.006, 0.014),
        }),
        "octagon2" => {
            let width = between(0.085, 0.095);
            Shape::Octagon2(Octagon2 {
                width,
                height: 0.29 * width,
            })
        }
        "star" => {
            let diameter = between(0.05, 0.06);
            Shape::Star(Star {
                points: 5,
                diameter,
                inner_diameter: 0.6 * diameter,
                height: between(0.006, 0.016),
            })
        }
        "gear" => {
            let diameter = between(0.066, 0.072);
            Shape::Gear(Gear {
                teeth: 14,
                diameter,
                root_diameter: 0.8 * diameter,
                bore: between(0.005, 0.007),
                height: between(0.006, 0.014),
            })
        }
        "cross" => Shape::Cross(Cross {
            length: between(0.04, 0.05),
            width: between(0.025, 0.028),
            height: between(0.006, 0.016),
        }),
        "bracket" => Shape::Bracket(Bracket {
            length: between(0.046, 0.054),
            width: between(0.026, 0.03),
            height: between(0.008, 0.02),
        }),
        "pyramid" => {
            let side = between(0.03, 0.038);
            Shape::Pyramid(Pyramid {
                side,
                height: between(0.4, 0.55) * side,
            })
        }
        "wedge" => Shape::Wedge(Wedge {
            size: [between(0.026, 0.034), between(0.026, 0.034)],
            high: between(0.012, 0.02),
            low: between(0.003, 0.006),
        }),
        "sphere" => Shape::Sphere(Ball {
            radius: Some(between(0.012, 0.018)),
            segments: None,
        }),
        "hemisphere" => Shape::Hemisphere(Ball {
            radius: Some(between(0.014, 0.022)),
            segments: None,
        }),
        "bent_cylinder" => Shape::BentCylinder(BentCylinder {
            diameter: between(0.014, 0.018),
            bend_radius: between(0.022, 0.028),
            angle: between(1.4, 2.0),
            segments: 96,
        }),
        "relief" => {
            let side = between(0.03, 0.036);
            Shape::Relief(Relief {
                size: [side, side],
                height: between(0.006, 0.01),
                depth: between(0.002, 0.004),
                seed: random.u64(..),
                cells: 80,
            })
        }
        unknown => return Err(SimError::value("shapes", unknown, KINDS_TO_SCATTER.join(", "))),
    })
}
