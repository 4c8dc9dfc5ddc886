//! What can be chosen.

use nalgebra::Vector3;

use crate::error::GraspError;

/// Options of planning. Lengths in metres, angles in radians, base frame.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanOptions {
    /// Sides from which the gripper can come, as directions out of the object (+Z: from above); any length.
    pub directions: Vec<Vector3<f64>>,
    /// Height of the table's plane, -1 to 1.
    pub table_height: f64,
    /// No object stands higher over the table than this; 0.001 to 1.
    pub highest: f64,
    /// How patches are looked for.
    pub search: SearchOptions,
    /// What a grasp must keep to.
    pub limits: Limits,
    /// When patches of two views are one.
    pub matching: MatchOptions,
    /// What counts how much.
    pub weights: Weights,
}

/// How graspable patches are looked for in a view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchOptions {
    /// Half the angle of the cone about a direction in which the gripper can come, 0 to 1.5.
    pub cone: f64,
    /// Angle between neighbouring orientations of the gripper in the cone, 0.1 to 1.5.
    pub step: f64,
    /// Angle between normal and approach at which the likelihood is one half, 0.02 to 1.
    pub half_likelihood: f64,
    /// Patches looked for in one orientation and view, 1 to 50.
    pub modes: usize,
    /// Patches of a view that are followed up, the largest first, 1 to 1000.
    pub patches: usize,
    /// Angle at which a surface has folded away from a patch, 0.05 to 1.
    pub fold: f64,
}

/// What a grasp must keep to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Share of the footprint that edges cover, 0 to 1; the published system recommends 0.03 to 0.05.
    pub edge_share: f64,
    /// How wide an edge counts: a step's flank and its shadow, metres; 0 to 0.01.
    pub edge_width: f64,
    /// Largest first moment of the edges in the footprint, share times distance over radius, 0 to 1.
    pub edge_moment: f64,
    /// Least mean confidence in the footprint, 0 to 1.
    pub confidence: f64,
    /// Least distance from the footprint's rim to the patch's border, metres; 0 to 0.05.
    pub border: f64,
    /// Least distance of the lip from the table, metres; -0.01 to 0.1.
    pub clearance: f64,
    /// Largest standard deviation of the contact along the approach, metres; 0.0001 to 0.05.
    pub uncertainty: f64,
    /// Cosine between normal and line of sight below which a view says nothing, 0.05 to 0.9.
    pub facing: f64,
    /// Least share of a thin object's outline on which edges must be, 0 to 1.
    pub outline: f64,
    /// The stem goes free of what rises this far over the contact, metres; 0.001 to 0.05.
    pub stem_margin: f64,
}

/// When patches of two views are taken for one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MatchOptions {
    /// Largest angle between their normals, 0.02 to 1.
    pub normal_angle: f64,
    /// Largest distance of a patch's middle from the other's epipolar line, in pixels; 0.5 to 100.
    pub epipolar_px: f64,
    /// And beyond that, as a share of the patch's smaller radius, because each view hides other parts of it; 0 to 1.
    pub epipolar_share: f64,
    /// Largest ratio of their areas on the surface, 1 to 10.
    pub area_ratio: f64,
    /// Standard deviation of a contact's place in an image, pixels; 0.05 to 10.
    pub sigma_px: f64,
    /// Standard deviation of an integrated depth, metres; 0.0001 to 0.1.
    pub sigma_depth: f64,
    /// Largest share of the patch in which the views' normals contradict each other, 0 to 1.
    pub mismatch: f64,
}

/// Exponents of the scores in their weighted geometric mean; 0 leaves a score out, all from 0 to 10.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Of the alignment of normal and direction.
    pub alignment: f64,
    /// Of the patch's size.
    pub area: f64,
    /// Of the edges' share of the footprint.
    pub edges: f64,
    /// Of the edges' first moment.
    pub balance: f64,
    /// Of the gap under the lip.
    pub curvature: f64,
    /// Of the mean confidence.
    pub confidence: f64,
    /// Of the distance to the border.
    pub border: f64,
    /// Of the distance to the centre of mass.
    pub centre: f64,
    /// Of how well the contact's place is known.
    pub certainty: f64,
}

impl Default for PlanOptions {
    fn default() -> Self {
        let (x, y) = (Vector3::x(), Vector3::y());
        Self {
            directions: vec![x, -x, y, -y, Vector3::z()],
            table_height: 0.0,
            highest: 0.25,
            search: SearchOptions::default(),
            limits: Limits::default(),
            matching: MatchOptions::default(),
            weights: Weights::default(),
        }
    }
}

impl Default for SearchOptions {
    fn default() -> Self {
        Self {
            cone: 0.8,
            step: 0.4,
            half_likelihood: 0.26,
            modes: 6,
            patches: 24,
            fold: 0.45,
        }
    }
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            edge_share: 0.04,
            edge_width: 0.001,
            edge_moment: 0.02,
            confidence: 0.3,
            border: 0.0005,
            clearance: 0.0005,
            uncertainty: 0.003,
            facing: 0.25,
            outline: 0.7,
            stem_margin: 0.004,
        }
    }
}

impl Default for MatchOptions {
    fn default() -> Self {
        Self {
            normal_angle: 0.2,
            epipolar_px: 4.0,
            epipolar_share: 0.3,
            area_ratio: 2.0,
            sigma_px: 0.7,
            sigma_depth: 0.002,
            mismatch: 0.25,
        }
    }
}

impl Default for Weights {
    fn default() -> Self {
        Self {
            alignment: 1.0,
            area: 0.5,
            edges: 1.0,
            balance: 0.5,
            curvature: 1.5,
            confidence: 1.0,
            border: 1.0,
            centre: 1.5,
            certainty: 1.0,
        }
    }
}

impl PlanOptions {
    /// The directions with unit length.
    pub(crate) fn unit_directions(&self) -> Result<Vec<Vector3<f64>>, GraspError> {
        let unit = |(index, direction): (usize, &Vector3<f64>)| {
            let unit = direction.try_normalize(1e-9).filter(|unit| unit.norm().is_finite());
            let [x, y, z] = (*direction).into();
            unit.ok_or(GraspError::Direction { index, x, y, z })
        };
        self.directions.iter().enumerate().map(unit).collect()
    }

    pub(crate) fn check(&self) -> Result<(), GraspError> {
        let within = GraspError::require_within;
        within(
            "directions",
            self.directions.len() as f64,
            1.0..=100.0,
            "1 to 100 of them",
        )?;
        within("table_height", self.table_height, -1.0..=1.0, "-1 to 1 m")?;
        within("highest", self.highest, 0.001..=1.0, "0.001 to 1 m")?;
        self.search.check()?;
        self.limits.check()?;
        self.matching.check()?;
        self.weights.check()
    }
}

impl SearchOptions {
    fn check(&self) -> Result<(), GraspError> {
        let within = GraspError::require_within;
        within("cone", self.cone, 0.0..=1.5, "0 to 1.5 rad")?;
        within("step", self.step, 0.1..=1.5, "0.1 to 1.5 rad")?;
        within("half_likelihood", self.half_likelihood, 0.02..=1.0, "0.02 to 1 rad")?;
        within("modes", self.modes as f64, 1.0..=50.0, "1 to 50")?;
        within("patches", self.patches as f64, 1.0..=1000.0, "1 to 1000")?;
        within("fold", self.fold, 0.05..=1.0, "0.05 to 1 rad")
    }
}

impl Limits {
    fn check(&self) -> Result<(), GraspError> {
        let within = GraspError::require_within;
        within("edge_share", self.edge_share, 0.0..=1.0, "0 to 1")?;
        within("edge_width", self.edge_width, 0.0..=0.01, "0 to 0.01 m")?;
        within("edge_moment", self.edge_moment, 0.0..=1.0, "0 to 1")?;
        within("confidence", self.confidence, 0.0..=1.0, "0 to 1")?;
        within("border", self.border, 0.0..=0.05, "0 to 0.05 m")?;
        within("clearance", self.clearance, -0.01..=0.1, "-0.01 to 0.1 m")?;
        within("uncertainty", self.uncertainty, 1e-4..=0.05, "0.0001 to 0.05 m")?;
        within("facing", self.facing, 0.05..=0.9, "0.05 to 0.9")?;
        within("outline", self.outline, 0.0..=1.0, "0 to 1")?;
        within("stem_margin", self.stem_margin, 0.001..=0.05, "0.001 to 0.05 m")
    }
}

impl MatchOptions {
    fn check(&self) -> Result<(), GraspError> {
        let within = GraspError::require_within;
        within("normal_angle", self.normal_angle, 0.02..=1.0, "0.02 to 1 rad")?;
        within("epipolar_px", self.epipolar_px, 0.5..=100.0, "0.5 to 100 pixels")?;
        within("epipolar_share", self.epipolar_share, 0.0..=1.0, "0 to 1")?;
        within("area_ratio", self.area_ratio, 1.0..=10.0, "1 to 10")?;
        within("sigma_px", self.sigma_px, 0.05..=10.0, "0.05 to 10 pixels")?;
        within("sigma_depth", self.sigma_depth, 1e-4..=0.1, "0.0001 to 0.1 m")?;
        within("mismatch", self.mismatch, 0.0..=1.0, "0 to 1")
    }
}

impl Weights {
    fn check(&self) -> Result<(), GraspError> {
        for (what, weight) in self.named() {
            GraspError::require_within(what, weight, 0.0..=10.0, "0 to 10")?;
        }
        let sum: f64 = self.in_order().iter().sum();
        GraspError::require_within("sum of weights", sum, 1e-3..=100.0, "more than 0")
    }

    pub(crate) fn in_order(&self) -> [f64; 9] {
        self.named().map(|(_, weight)| weight)
    }

    fn named(&self) -> [(&'static str, f64); 9] {
        [
            ("weight of alignment", self.alignment),
            ("weight of area", self.area),
            ("weight of edges", self.edges),
            ("weight of balance", self.balance),
            ("weight of curvature", self.curvature),
            ("weight of confidence", self.confidence),
            ("weight of border", self.border),
            ("weight of centre", self.centre),
            ("weight of certainty", self.certainty),
        ]
    }
}
