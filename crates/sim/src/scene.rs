//! What light falls on: surfaces, panels and room, base frame, metres. A scene is a value: rendering it twice gives the
//! same images.

mod rig;

use geometry::nalgebra::{Point3, Unit, Vector3};
use geometry::{PinholeCamera, RigidTransform, TriangleMesh};

pub use rig::AMBIENT_RADIANCE;

/// All that shines and reflects. Surfaces are Lambertian.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Objects, base frame; they cast shadows and are labelled by their position in this list.
    pub bodies: Vec<Body>,
    /// Table, mat, walls and ceiling.
    pub room: Room,
    /// L1 to L7.
    pub panels: [Panel; 7],
    /// Radiance of everything that is not modelled, from every direction, in the panels' unit.
    pub ambient_radiance: f64,
}

/// An object.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// For people and labels.
    pub name: String,
    /// Base frame.
    pub mesh: TriangleMesh,
    /// Where its own frame is, for albedo patterns and truth.
    pub base_from_body: RigidTransform,
    /// How much light it reflects.
    pub albedo: Albedo,
}

/// Share of light that a surface reflects, 0..=1.
#[derive(Debug, Clone, PartialEq)]
pub enum Albedo {
    /// The same everywhere.
    Uniform(f64),
    /// A random print: square cells on the x-y plane of the body's frame, each with an albedo of its own.
    Print {
        /// Which print.
        seed: u64,
        /// Side of a cell, metres.
        cell: f64,
        /// Least and most albedo.
        range: [f64; 2],
    },
}

/// The surroundings: the table's top is the plane z = 0, the mat lies in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Room {
    /// Middle of the mat, base frame, on z = 0.
    pub mat_centre: [f64; 2],
    /// Sides of the mat along x and y.
    pub mat_size: [f64; 2],
    /// Of the mat.
    pub mat_albedo: f64,
    /// Middle and sides of the table, x and y.
    pub table_centre: [f64; 2],
    /// Sides of the table along x and y.
    pub table_size: [f64; 2],
    /// Of the table.
    pub table_albedo: f64,
    /// Walls and ceiling.
    pub walls: Vec<Wall>,
}

/// A one-sided rectangle that reflects.
#[derive(Debug, Clone, PartialEq)]
pub struct Wall {
    /// Middle.
    pub centre: Point3<f64>,
    /// Out of the reflecting side.
    pub normal: Unit<Vector3<f64>>,
    /// Unit vector along the first side.
    pub right: Unit<Vector3<f64>>,
    /// Length along `right`, and across it.
    pub size: [f64; 2],
    /// How much light it reflects.
    pub albedo: f64,
}

/// A light: a one-sided rectangle of constant radiance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Panel {
    /// Middle of the bright side.
    pub centre: Point3<f64>,
    /// Out of the bright side.
    pub facing: Unit<Vector3<f64>>,
    /// Unit vector along the long side.
    pub right: Unit<Vector3<f64>>,
    /// Length along `right`, and across it.
    pub size: [f64; 2],
    /// Relative to L1 of the rig as drawn.
    pub radiance: f64,
}

/// From where a scene is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Lens and image.
    pub camera: PinholeCamera,
    /// Where it is.
    pub base_from_camera: RigidTransform,
}
