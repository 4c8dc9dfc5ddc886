//! Ranked grasps.

use geometry::nalgebra::{Matrix3, Point2, Point3, Vector3};

use crate::options::Weights;
use crate::refusal::Refused;

/// What was found on one capture.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Best first.
    pub grasps: Vec<Grasp>,
    /// What was looked at and refused, the nearest miss last in its own order of search.
    pub refused: Vec<Refused>,
    /// How many views were planned on: 1 means that no grasp could be triangulated.
    pub views: usize,
}

/// A place for the cup.
#[derive(Debug, Clone, PartialEq)]
pub struct Grasp {
    /// Where the lip's middle meets the surface; base frame, metres.
    pub contact: Point3<f64>,
    /// Of the contact, square metres, base frame.
    pub covariance: Matrix3<f64>,
    /// Unit, base frame, out of the surface.
    pub normal: Vector3<f64>,
    /// What it rests on.
    pub source: Source,
    /// From the contact to where the patch ends, at most a few times the cup's radius; metres.
    pub patch_radius: f64,
    /// What would hang on the cup.
    pub carried: Carried,
    /// 0 to 1 each.
    pub scores: Scores,
    /// What was measured.
    pub measured: Measured,
    /// Weighted geometric mean of the scores.
    pub total: f64,
}

/// A cylinder that begins at the contact, its axis along the approach, and holds everything that would hang on the cup:
/// the object, and what touches it in a view. Metres, 3 mm of margin included, 0.15 at most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carried {
    /// From the axis to the farthest place.
    pub radius: f64,
    /// From the contact on; down to the table when the approach is from above.
    pub length: f64,
}

/// What a grasp's place rests on.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// Both views show the patch.
    BothViews {
        /// Where each view shows the contact.
        pixels: [Point2<f64>; 2],
        /// Distance of the patches' middles from each other's epipolar lines, pixels.
        epipolar_px: f64,
        /// Between the views' mean normals, radians.
        normal_angle: f64,
        /// Share of the patch in which the views contradict each other.
        mismatch: f64,
    },
    /// One view shows it, its integrated depth says how far: less certain.
    OneView {
        /// Position of the view, in the order given.
        view: usize,
        /// Where it shows the contact.
        pixel: Point2<f64>,
    },
    /// The outline of a thin object.
    Outline {
        /// Positions of the views that show it, and where they show its middle.
        pixels: Vec<(usize, Point2<f64>)>,
        /// Radius of the smallest circle around it, metres.
        radius: f64,
        /// Share of the outline on which edges were found, the lower of the views.
        coverage: f64,
    },
}

/// How good a grasp is in each respect, 0 (just allowed) to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scores {
    /// Cosine between normal and nearest reachable direction.
    pub alignment: f64,
    /// Of the patch, up to four footprints.
    pub area: f64,
    /// How far the edges' share is from its limit.
    pub edges: f64,
    /// The same of their first moment.
    pub balance: f64,
    /// How much of the compliance is left.
    pub curvature: f64,
    /// Mean confidence.
    pub confidence: f64,
    /// From the rim to the border, up to another radius.
    pub border: f64,
    /// Level distance from the object's centre of mass, against twice the cup's diameter.
    pub centre: f64,
    /// How well the contact is known along the approach.
    pub certainty: f64,
}

/// The worse of both views where both measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Angle between normal and nearest reachable direction, radians.
    pub misalignment: f64,
    /// Of the patch, square metres.
    pub area: f64,
    /// Share of the footprint that edges cover.
    pub edge_share: f64,
    /// Their first moment.
    pub edge_moment: f64,
    /// What the lip must give, metres.
    pub gap: f64,
    /// Mean, 0 to 1.
    pub confidence: f64,
    /// From the contact to where the patch ends, metres.
    pub border: f64,
    /// Level distance from the object's centre of mass, metres.
    pub from_centre: f64,
    /// Standard deviation of the contact along the normal, metres.
    pub sigma: f64,
}

impl Grasp {
    /// Unit direction of the cup's motion, into the surface.
    pub fn approach_axis(&self) -> Vector3<f64> {
        -self.normal
    }

    /// Standard deviations of the contact along the base's axes, metres.
    pub fn standard_deviations(&self) -> Vector3<f64> {
        self.covariance.diagonal().map(|variance| variance.max(0.0).sqrt())
    }
}

/// A score of 0 still leaves a grasp that passed all tests this much.
const FLOOR: f64 = 0.05;

impl Scores {
    /// Weighted geometric mean, 0 to 1.
    pub fn total(&self, weights: &Weights) -> f64 {
        let scores = self.in_order();
        let weights = weights.in_order();
        let sum: f64 = weights.iter().sum();
        let logarithm: f64 = scores
            .iter()
            .zip(weights)
            .map(|(score, weight)| weight * score.max(FLOOR).ln())
            .sum();
        (logarithm / sum).exp()
    }

    /// That the cup seals: edges, their balance, curvature, confidence and border; their geometric mean.
    pub fn seal(&self) -> f64 {
        geometric_mean(&[self.edges, self.balance, self.curvature, self.confidence, self.border])
    }

    /// That the cup holds the object's weight: alignment, area and distance from the centre of mass.
    pub fn wrench(&self) -> f64 {
        geometric_mean(&[self.alignment, self.area, self.centre])
    }

    fn in_order(&self) -> [f64; 9] {
        [
            self.alignment,
            self.area,
            self.edges,
            self.balance,
            self.curvature,
            self.confidence,
            self.border,
            self.centre,
            self.certainty,
        ]
    }
}

fn geometric_mean(scores: &[f64]) -> f64 {
    let logarithm: f64 = scores.iter().map(|score| score.max(FLOOR).ln()).sum();
    (logarithm / scores.len() as f64).exp()
}
