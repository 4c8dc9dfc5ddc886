//! What came of a capture, for people and programs.

use interfaces::rakelight_msgs::msg::{Grasp, GraspArray};
use serde::Serialize;

use super::compare::{Grasps, Normals};

/// Of one capture.
#[derive(Debug, Serialize)]
pub(super) struct Outcome {
    /// Position in the bag, from 1.
    pub(super) number: usize,
    pub(super) id: String,
    /// Why it was not solved or planned on as it should.
    pub(super) problem: Option<String>,
    pub(super) solved_in_s: f64,
    pub(super) cameras: Vec<CameraOutcome>,
    pub(super) plan: Option<PlanOutcome>,
}

/// Of one camera.
#[derive(Debug, Serialize)]
pub(super) struct CameraOutcome {
    pub(super) camera: String,
    /// Share of the pixels that have a normal, 0 to 1.
    pub(super) valid_fraction: f32,
    /// None when none were recorded.
    pub(super) normals: Option<Normals>,
    /// Why recorded normals were not compared.
    pub(super) not_compared: Option<String>,
}

/// Of planning.
#[derive(Debug, Serialize)]
pub(super) struct PlanOutcome {
    /// Why there is no grasp, or what was missing.
    pub(super) message: String,
    pub(super) planned_in_s: f64,
    pub(super) grasps: Vec<GraspOutcome>,
    /// None when none were recorded.
    pub(super) compared: Option<Grasps>,
}

#[derive(Debug, Serialize)]
pub(super) struct GraspOutcome {
    /// Base frame.
    contact_mm: [f64; 3],
    normal: [f64; 3],
    score: f32,
    is_reached: bool,
    cameras: Vec<String>,
}

impl GraspOutcome {
    pub(super) fn all(array: &GraspArray) -> Vec<Self> {
        array.grasps.iter().map(Self::new).collect()
    }

    fn new(grasp: &Grasp) -> Self {
        let (contact, normal) = (&grasp.contact, &grasp.normal);
        Self {
            contact_mm: [contact.x, contact.y, contact.z].map(|metres| metres * 1e3),
            normal: [normal.x, normal.y, normal.z],
            score: grasp.score,
            is_reached: !grasp.grasp_joints.is_empty(),
            cameras: grasp.cameras.clone(),
        }
    }

    fn for_people(&self) -> String {
        let Self {
            contact_mm: [x, y, z],
            normal: [nx, ny, nz],
            score,
            ..
        } = self;
        let cameras = self.cameras.join(" and ");
        let reach = if self.is_reached {
            ""
        } else {
            ", beyond the arm's reach"
        };
        format!(
            "contact ({x:.1}, {y:.1}, {z:.1}) mm, normal ({nx:.3}, {ny:.3}, {nz:.3}), score {score:.3}, {cameras}{reach}"
        )
    }
}

impl Outcome {
    /// Beyond the tolerance.
    pub(super) fn differs(&self) -> bool {
        let normals = self.cameras.iter().filter_map(|camera| camera.normals.as_ref());
        let grasps = self.plan.iter().filter_map(|plan| plan.compared.as_ref());
        let are_far = normals.into_iter().any(|normals| !normals.within_tolerance);
        are_far || grasps.into_iter().any(|grasps| !grasps.within_tolerance)
    }

    /// A recorded result that could not be held against a new one.
    pub(super) fn is_uncompared(&self) -> bool {
        self.cameras.iter().any(|camera| camera.not_compared.is_some())
    }

    pub(super) fn for_people(&self) -> String {
        let mut lines = vec![format!(
            "capture {} ({}): solved in {:.2} s",
            self.number, self.id, self.solved_in_s
        )];
        lines.extend(self.cameras.iter().map(|camera| format!("  {}", camera.for_people())));
        if let Some(plan) = &self.plan {
            lines.push(format!("  {}", plan.for_people()));
        }
        lines.extend(self.problem.iter().map(|problem| format!("  {problem}")));
        lines.join("\n")
    }
}

impl CameraOutcome {
    fn for_people(&self) -> String {
        let Self {
            camera, valid_fraction, ..
        } = self;
        let normals = self
            .normals
            .as_ref()
            .map(|normals| format!(", {}", normals.for_people()));
        let reason = self
            .not_compared
            .as_ref()
            .map(|reason| format!(", not compared: {reason}"));
        format!(
            "{camera}: normals on {:.1} % of the pixels{}{}",
            1e2 * valid_fraction,
            normals.unwrap_or_default(),
            reason.unwrap_or_default()
        )
    }
}

impl PlanOutcome {
    fn for_people(&self) -> String {
        let compared = self
            .compared
            .as_ref()
            .map(|compared| format!(", {}", compared.for_people()));
        let message = (!self.message.is_empty()).then(|| format!(": {}", self.message));
        let summary = format!(
            "grasps: {}, planned in {:.2} s{}{}",
            self.grasps.len(),
            self.planned_in_s,
            compared.unwrap_or_default(),
            message.unwrap_or_default()
        );
        let ranked = self.grasps.iter().enumerate();
        let grasps = ranked.map(|(rank, grasp)| format!("    {rank}: {}", grasp.for_people()));
        std::iter::once(summary).chain(grasps).collect::<Vec<_>>().join("\n")
    }
}

impl Normals {
    fn for_people(&self) -> String {
        if self.same {
            return "the same as recorded".into();
        }
        format!(
            "{} recorded ones by {:.3} degrees in the mean, {:.2} % of the pixels measured in one of both only",
            verb(self.within_tolerance),
            self.mean_angle,
            1e2 * self.lone_share
        )
    }
}

impl Grasps {
    fn for_people(&self) -> String {
        if self.same {
            return "the same as recorded".into();
        }
        let order = if self.same_order { "same" } else { "another" };
        format!(
            "{} the {} recorded ones: {} found again, contacts {:.2} mm, normals {:.2} degrees and scores {:.3} apart at \
             most, {order} order",
            verb(self.within_tolerance),
            self.recorded,
            self.paired,
            self.contact_mm,
            self.angle,
            self.score
        )
    }
}

fn verb(within_tolerance: bool) -> &'static str {
    if within_tolerance {
        "within tolerance of"
    } else {
        "DIFFERENT from"
    }
}
