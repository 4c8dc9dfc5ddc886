//! One plan: from solved views to grasps with poses and joint angles.

use grasp::{GraspError, Plan, ViewInput};
use rayon::prelude::*;

use crate::captures::SolvedCapture;
use crate::parameters::Settings;
use crate::reach::{Placed, Reach};
use crate::request::Mode;
use crate::summary::refusals;

/// What was found on a capture.
#[derive(Debug)]
pub(crate) struct Planned {
    pub(crate) capture: SolvedCapture,
    pub(crate) mode: Mode,
    pub(crate) settings: Settings,
    /// Its grasps are those of `placed`, in the same order.
    pub(crate) plan: Plan,
    /// What the arm reaches before what it does not, the best first.
    pub(crate) placed: Vec<Placed>,
}

impl Planned {
    pub(crate) fn new(
        capture: SolvedCapture,
        mode: Mode,
        settings: Settings,
        reach: &Reach,
    ) -> Result<Self, GraspError> {
        let inputs: Vec<ViewInput<'_>> = capture.views.iter().map(|view| view.input()).collect();
        let planner = match mode {
            Mode::Solid => grasp::plan,
            Mode::Thin => grasp::plan_thin,
        };
        let mut plan = planner(&inputs, &settings.cup, &settings.options)?;
        let grasps = plan.grasps.into_par_iter().take(settings.most_grasps);
        let mut placed: Vec<Placed> = grasps.map(|grasp| reach.place(grasp, &settings.way)).collect();
        // Stable: each part stays in the plan's order.
        placed.sort_by_key(|placed| placed.joints.is_err());
        plan.grasps = placed.iter().map(|placed| placed.grasp.clone()).collect();
        Ok(Self {
            capture,
            mode,
            settings,
            plan,
            placed,
        })
    }

    /// The best grasp, if the arm reaches any.
    pub(crate) fn best(&self) -> Option<&Placed> {
        self.placed.first().filter(|placed| placed.joints.is_ok())
    }

    pub(crate) fn cameras(&self) -> Vec<&str> {
        self.capture.views.iter().map(|view| view.camera.as_str()).collect()
    }

    /// Why there is no grasp that the arm reaches; none when there is one.
    pub(crate) fn reason(&self) -> Option<String> {
        if self.best().is_some() {
            return None;
        }
        let Some(Placed {
            grasp,
            joints: Err(error),
            ..
        }) = self.placed.first()
        else {
            return Some(format!("no grasp: {}", refusals(&self.plan, &self.cameras())));
        };
        let (count, at) = (self.placed.len(), grasp.contact * 1e3);
        Some(format!(
            "grasps found: {count}, within the arm's reach: none; the best, at ({:.0}, {:.0}, {:.0}) mm: {error}",
            at.x, at.y, at.z
        ))
    }

    /// That a camera is missing, if one is.
    pub(crate) fn note(&self) -> Option<String> {
        let missing = &self.capture.missing;
        let alone = self.cameras().join(" and ");
        (!missing.is_empty()).then(|| format!("planned on {alone} alone: {}", missing.join("; ")))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::sync::Arc;

    use geometry::nalgebra::Point3;
    use grasp::{Cup, PlanOptions, Source, Way};

    use super::*;
    use crate::reach::tests::reach;
    use crate::view::SolvedView;
    use crate::view::tests::{disc, plate_at};

    /// On the plate with its middle there, seen by `c1` while `c2` is missing.
    pub(crate) fn planned(middle: [f64; 2], cup: Cup) -> Planned {
        planned_on(plate_at("c1", middle), Mode::Solid, cup)
    }

    pub(crate) fn planned_on(view: SolvedView, mode: Mode, cup: Cup) -> Planned {
        let capture = SolvedCapture {
            id: "a".into(),
            views: vec![Arc::new(view)],
            missing: vec!["c2 took no part in it".into()],
        };
        let settings = Settings {
            cup,
            options: PlanOptions::default(),
            way: Way {
                pregrasp_distance: 0.05,
                retreat_height: 0.1,
            },
            most_grasps: 3,
        };
        Planned::new(capture, mode, settings, &reach()).expect("a plan")
    }

    #[test]
    fn a_plate_within_reach_is_grasped_and_the_missing_camera_named() {
        let planned = planned([0.4, 0.0], Cup::default());
        assert!(planned.reason().is_none());
        let best = planned.best().expect("a grasp");
        assert!((best.grasp.contact.z - 0.01).abs() < 0.002);
        assert_eq!(
            planned.note().as_deref(),
            Some("planned on c1 alone: c2 took no part in it")
        );
    }

    #[test]
    fn a_plate_beyond_reach_is_found_and_said_to_be_beyond_reach() {
        let planned = planned([1.4, 0.0], Cup::default());
        assert!(planned.best().is_none() && !planned.placed.is_empty());
        let reason = planned.reason().expect("a reason");
        assert!(
            reason.starts_with("grasps found: 1, within the arm's reach: none") && reason.contains("mm and"),
            "{reason}"
        );
    }

    #[test]
    fn a_plate_too_small_for_the_cup_says_so() {
        let cup = Cup {
            diameter: 0.1,
            ..Cup::default()
        };
        let planned = planned([0.4, 0.0], cup);
        let reason = planned.reason().expect("a reason");
        assert!(
            reason.starts_with("no grasp: ") && reason.contains("needed"),
            "{reason}"
        );
    }

    #[test]
    fn a_disc_on_the_plate_is_found_by_its_outline() {
        let planned = planned_on(disc("c1", 40.0), Mode::Thin, Cup::default());
        let best = planned.best().expect("a grasp");
        let off = best.grasp.contact - Point3::new(0.4, 0.0, 0.01);
        assert!(off.norm() < 0.001, "{off}");
        assert!(matches!(best.grasp.source, Source::Outline { .. }));
    }
}
