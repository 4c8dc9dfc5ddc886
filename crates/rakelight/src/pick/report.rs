//! What is told of picks.

use std::fmt::Write;
use std::time::Duration;

use interfaces::rakelight_msgs::action::{PickCycleGoal, PickCycleResult};
use interfaces::rakelight_msgs::msg::CellState;
use serde::Serialize;

/// One pick.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Report {
    pick: u32,
    success: bool,
    mode: &'static str,
    /// Why not, or after a success what went wrong on the way; empty: nothing.
    reason: String,
    failed_stage: Option<&'static str>,
    capture_id: String,
    /// Of the grasp that was used, base frame, metres.
    contact: Option<[f64; 3]>,
    /// From the request to its answer.
    seconds: f64,
    stages: Vec<StageTime>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct StageTime {
    stage: &'static str,
    succeeded: bool,
    seconds: f64,
}

pub(super) fn stage_name(stage: u8) -> &'static str {
    match stage {
        CellState::CAPTURE => "capture",
        CellState::SOLVE => "solve",
        CellState::PLAN => "plan",
        CellState::EXECUTE => "execute",
        _ => "begin",
    }
}

impl Report {
    /// `reasons` are of every mode that was tried.
    pub(super) fn new(pick: u32, mode: u8, result: &PickCycleResult, reasons: &[String], took: Duration) -> Self {
        let contact = &result.grasp.contact;
        let is_grasped = !result.grasp.grasp_joints.is_empty();
        Self {
            pick,
            success: result.success,
            mode: if mode == PickCycleGoal::THIN { "thin" } else { "solid" },
            reason: match (result.success, reasons) {
                (false, [solid, thin]) => format!("as a solid object: {solid}; as a thin one: {thin}"),
                _ => result.reason.clone(),
            },
            failed_stage: (!result.success && result.failed_stage != 0).then(|| stage_name(result.failed_stage)),
            capture_id: result.capture_id.clone(),
            contact: is_grasped.then_some([contact.x, contact.y, contact.z]),
            seconds: took.as_secs_f64(),
            stages: result.timings.iter().map(StageTime::from).collect(),
        }
    }

    /// Whether there is reason to believe that the next pick differs.
    pub(super) fn another_may_succeed(&self) -> bool {
        self.success || self.stages.iter().any(|stage| stage.stage == "execute")
    }

    pub(super) fn to_json(&self) -> serde_json::Result<String> {
        serde_json::to_string(self)
    }

    pub(super) fn for_people(&self) -> String {
        let mut text = match (self.success, self.failed_stage) {
            (true, _) => format!("pick {}: done after {:.1} s", self.pick, self.seconds),
            (false, Some(stage)) => format!(
                "pick {}: failed in stage {stage} after {:.1} s",
                self.pick, self.seconds
            ),
            (false, None) => format!("pick {}: not begun", self.pick),
        };
        if !self.stages.is_empty() {
            let stages: Vec<String> = self.stages.iter().map(StageTime::for_people).collect();
            // Writing to a String cannot fail.
            let _ = write!(text, " ({})", stages.join(", "));
        }
        if !self.reason.is_empty() {
            let _ = write!(text, "\n  {}", self.reason);
        }
        text
    }
}

impl From<&interfaces::rakelight_msgs::msg::StageTiming> for StageTime {
    fn from(timing: &interfaces::rakelight_msgs::msg::StageTiming) -> Self {
        Self {
            stage: stage_name(timing.stage),
            succeeded: timing.succeeded,
            seconds: f64::from(timing.duration.sec) + f64::from(timing.duration.nanosec) * 1e-9,
        }
    }
}

impl StageTime {
    fn for_people(&self) -> String {
        format!("{} {:.2} s", self.stage, self.seconds)
    }
}

/// Of several picks.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Summary {
    asked: u32,
    reports: Vec<Report>,
}

/// As programs read it.
#[derive(Serialize)]
struct Figures {
    asked: u32,
    succeeded: usize,
    failed: usize,
    not_tried: usize,
    median_seconds: Vec<(&'static str, f64)>,
    reasons: Vec<String>,
}

impl Summary {
    pub(super) fn new(asked: u32) -> Self {
        Self {
            asked,
            reports: Vec::new(),
        }
    }

    pub(super) fn add(&mut self, report: Report) {
        self.reports.push(report);
    }

    pub(super) fn all_succeeded(&self) -> bool {
        self.succeeded() == self.asked as usize
    }

    /// In one line.
    pub(super) fn failure(&self) -> String {
        format!("{} of {} picks succeeded", self.succeeded(), self.asked)
    }

    fn succeeded(&self) -> usize {
        self.reports.iter().filter(|report| report.success).count()
    }

    fn figures(&self) -> Figures {
        let failed = self.reports.iter().filter(|report| !report.success);
        Figures {
            asked: self.asked,
            succeeded: self.succeeded(),
            failed: self.reports.len() - self.succeeded(),
            not_tried: self.asked as usize - self.reports.len(),
            median_seconds: self.medians(),
            reasons: failed.map(|report| report.reason.clone()).collect(),
        }
    }

    /// Of every stage that was reached, and of whole picks that succeeded.
    fn medians(&self) -> Vec<(&'static str, f64)> {
        let of = |name: &'static str| {
            let stages = self.reports.iter().flat_map(|report| &report.stages);
            let times = stages.filter(|stage| stage.stage == name && stage.succeeded);
            median(times.map(|stage| stage.seconds).collect()).map(|median| (name, median))
        };
        let whole = self.reports.iter().filter(|report| report.success);
        let whole = median(whole.map(|report| report.seconds).collect()).map(|median| ("pick", median));
        ["capture", "solve", "plan", "execute"]
            .into_iter()
            .filter_map(of)
            .chain(whole)
            .collect()
    }

    pub(super) fn to_json(&self) -> serde_json::Result<String> {
        #[derive(Serialize)]
        struct Line {
            summary: Figures,
        }
        serde_json::to_string(&Line {
            summary: self.figures(),
        })
    }

    pub(super) fn for_people(&self) -> String {
        let figures = self.figures();
        let mut text = format!(
            "{} picks: {} done, {} failed",
            self.asked, figures.succeeded, figures.failed
        );
        if figures.not_tried > 0 {
            let _ = write!(text, ", {} not tried", figures.not_tried);
        }
        if !figures.median_seconds.is_empty() {
            let medians: Vec<String> = figures
                .median_seconds
                .iter()
                .map(|(name, seconds)| format!("{name} {seconds:.2} s"))
                .collect();
            let _ = write!(text, "; in the median {}", medians.join(", "));
        }
        text
    }
}

/// The lower of the two in the middle.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len().saturating_sub(1) / 2).copied()
}

#[cfg(test)]
mod tests {
    use interfaces::builtin_interfaces::msg::Duration as DurationMessage;
    use interfaces::rakelight_msgs::msg::StageTiming;

    use super::*;

    fn timing(stage: u8, sec: i32) -> StageTiming {
        StageTiming {
            stage,
            succeeded: true,
            duration: DurationMessage { sec, nanosec: 0 },
            ..StageTiming::default()
        }
    }

    fn picked(pick: u32, seconds: i32) -> Report {
        let mut result = PickCycleResult {
            success: true,
            capture_id: "a".into(),
            timings: vec![timing(CellState::CAPTURE, 1), timing(CellState::EXECUTE, seconds)],
            ..PickCycleResult::default()
        };
        result.grasp.contact.x = 0.4;
        result.grasp.grasp_joints = vec![0.0; 7];
        Report::new(
            pick,
            PickCycleGoal::SOLID,
            &result,
            &[String::new()],
            Duration::from_secs(9),
        )
    }

    fn empty(pick: u32) -> Report {
        let result = PickCycleResult {
            reason: "nothing to pick: no sheet".into(),
            failed_stage: CellState::PLAN,
            timings: vec![timing(CellState::CAPTURE, 1)],
            ..PickCycleResult::default()
        };
        let reasons = ["nothing to pick: no body".to_owned(), result.reason.clone()];
        Report::new(
            pick,
            PickCycleGoal::THIN,
            &result,
            &reasons,
            Duration::from_millis(1500),
        )
    }

    #[test]
    fn a_pick_is_told_for_people_and_for_programs() {
        assert_eq!(
            picked(1, 7).for_people(),
            "pick 1: done after 9.0 s (capture 1.00 s, execute 7.00 s)"
        );
        assert_eq!(
            empty(2).for_people(),
            "pick 2: failed in stage plan after 1.5 s (capture 1.00 s)\n  as a solid object: nothing to pick: no body; \
             as a thin one: nothing to pick: no sheet"
        );
        let json: serde_json::Value = serde_json::from_str(&picked(1, 7).to_json().unwrap()).unwrap();
        assert_eq!((&json["contact"][0], &json["mode"]), (&0.4.into(), &"solid".into()));
        assert_eq!(json["stages"][1]["seconds"], 7.0);
        let json: serde_json::Value = serde_json::from_str(&empty(2).to_json().unwrap()).unwrap();
        assert_eq!(
            (&json["contact"], &json["failed_stage"]),
            (&serde_json::Value::Null, &"plan".into())
        );
    }

    #[test]
    fn after_a_table_without_objects_no_more_picks_are_tried() {
        assert!(picked(1, 7).another_may_succeed() && !empty(1).another_may_succeed());
    }

    #[test]
    fn several_picks_are_summed_up() {
        let mut summary = Summary::new(4);
        for report in [picked(1, 7), picked(2, 3), empty(3)] {
            summary.add(report);
        }
        assert!(!summary.all_succeeded());
        assert_eq!(
            summary.for_people(),
            "4 picks: 2 done, 1 failed, 1 not tried; in the median capture 1.00 s, execute 3.00 s, pick 9.00 s"
        );
        let json: serde_json::Value = serde_json::from_str(&summary.to_json().unwrap()).unwrap();
        assert_eq!(
            (&json["summary"]["succeeded"], &json["summary"]["not_tried"]),
            (&2.into(), &1.into())
        );
        let mut summary = Summary::new(1);
        summary.add(picked(1, 7));
        assert!(summary.all_succeeded());
    }
}
