//! What is told in the end.

use std::collections::BTreeMap;
use std::fmt;

use scenarios::quantile;
use serde::Serialize;

use crate::perception::Perception;
use crate::picks::{Pick, Picks};

/// Beyond this share of misses something is wrong with the bench itself.
const LEAST_IN_BIN: f64 = 0.99;

#[derive(Debug, Serialize)]
pub(crate) struct Report {
    picks: usize,
    /// Shares of `picks`.
    first_try: f64,
    in_bin: f64,
    collisions: usize,
    /// Two views of 1000 x 1000, medians.
    plan_ms: f64,
    perception_ms: f64,
    /// In the cell, 768 x 768: from the last frame to ranked grasps, medians.
    cell_plan_ms: f64,
    cell_perception_ms: f64,
    /// A whole cycle with its verification, without the arm's motion, median.
    cycle_without_motion_s: f64,
    /// Of a pick at the first try, median.
    robot_s: f64,
    slow_robot_s: f64,
    point_err_mm: Quantiles,
    normal_err_deg: Quantiles,
    /// Misses by reason, numbers left out.
    reasons: BTreeMap<String, usize>,
    shapes: BTreeMap<String, usize>,
    solve_ms: f64,
    grasps: usize,
    #[serde(skip)]
    misses: Vec<Pick>,
    #[serde(skip)]
    contacts: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Quantiles {
    p50: f64,
    p95: f64,
}

impl Quantiles {
    fn of(values: &[f64]) -> Self {
        Self {
            p50: or_nan(values, 0.5),
            p95: or_nan(values, 0.95),
        }
    }
}

fn or_nan(values: &[f64], share: f64) -> f64 {
    quantile(values, share).unwrap_or(f64::NAN)
}

impl Report {
    pub(crate) fn new(fast: &Picks, slow: &Picks, perception: Perception) -> Self {
        let picks = &fast.all;
        let share = |count: usize| count as f64 / picks.len().max(1) as f64;
        let first = |pick: &&Pick| pick.taken.is_some() && pick.attempts == 1;
        let misses: Vec<Pick> = picks.iter().filter(|pick| pick.taken.is_none()).cloned().collect();
        let errors = || picks.iter().filter_map(|pick| pick.error);
        let of_all = |value: fn(&Pick) -> Option<f64>| picks.iter().filter_map(value).collect::<Vec<_>>();
        let contacts: Vec<String> = slow.collisions.iter().chain(&fast.collisions).cloned().collect();
        let sum = |pick: &Pick| Some(pick.first_plan? + pick.first_solve?);
        Self {
            picks: picks.len(),
            first_try: share(picks.iter().filter(first).count()),
            in_bin: share(picks.len() - misses.len()),
            collisions: contacts.len(),
            plan_ms: perception.plan_ms,
            perception_ms: perception.both_ms,
            cell_plan_ms: 1e3 * or_nan(&of_all(|pick| pick.first_plan), 0.5),
            cell_perception_ms: 1e3 * or_nan(&picks.iter().filter_map(sum).collect::<Vec<_>>(), 0.5),
            cycle_without_motion_s: or_nan(&first_tries(fast, |pick| Some(pick.without_robot())), 0.5),
            robot_s: or_nan(&first_tries(fast, Pick::robot), 0.5),
            slow_robot_s: or_nan(&first_tries(slow, Pick::robot), 0.5),
            point_err_mm: Quantiles::of(&errors().map(|error| error.point_mm).collect::<Vec<_>>()),
            normal_err_deg: Quantiles::of(&errors().map(|error| error.normal_deg).collect::<Vec<_>>()),
            reasons: reasons(&misses),
            shapes: fast.shapes.clone(),
            solve_ms: perception.solve_ms,
            grasps: perception.grasps,
            misses,
            contacts,
        }
    }

    /// Whether the cell did its work.
    pub(crate) fn complete(&self) -> bool {
        self.in_bin >= LEAST_IN_BIN && self.collisions == 0
    }
}

fn first_tries(picks: &Picks, value: fn(&Pick) -> Option<f64>) -> Vec<f64> {
    let taken = picks
        .all
        .iter()
        .filter(|pick| pick.taken.is_some() && pick.attempts == 1);
    taken.filter_map(value).collect()
}

/// Alike but for the numbers in them.
fn reasons(misses: &[Pick]) -> BTreeMap<String, usize> {
    let mut reasons = BTreeMap::new();
    for miss in misses {
        let kind: String = miss.reason.chars().filter(|c| !c.is_ascii_digit()).collect();
        *reasons.entry(kind).or_default() += 1;
    }
    reasons
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |share: f64| 100.0 * share;
        writeln!(
            f,
            "{} picks: {:.1} % in the bin at the first try, {:.1} % with retries; collisions: {}",
            self.picks,
            percent(self.first_try),
            percent(self.in_bin),
            self.collisions
        )?;
        writeln!(
            f,
            "grasps: {:.2} mm off at the median, {:.2} at 95 %; normals {:.2} and {:.2} degrees",
            self.point_err_mm.p50, self.point_err_mm.p95, self.normal_err_deg.p50, self.normal_err_deg.p95
        )?;
        writeln!(
            f,
            "1000 x 1000, both views: solve {:.0} ms, plan {:.0} ms, together {:.0} ms ({} grasps)",
            self.solve_ms, self.plan_ms, self.perception_ms, self.grasps
        )?;
        writeln!(
            f,
            "in the cell, 768 x 768: plan {:.0} ms, solve and plan {:.0} ms, a cycle without motion {:.2} s",
            self.cell_plan_ms, self.cell_perception_ms, self.cycle_without_motion_s
        )?;
        writeln!(
            f,
            "robot: {:.1} s a pick; at 0.25 m/s {:.1} s",
            self.robot_s, self.slow_robot_s
        )?;
        let shapes: Vec<String> = self
            .shapes
            .iter()
            .map(|(shape, count)| format!("{shape} {count}"))
            .collect();
        write!(f, "shapes: {}", shapes.join(", "))?;
        for miss in &self.misses {
            write!(
                f,
                "\nmissed: seed {}, {} attempts: {}",
                miss.seed, miss.attempts, miss.reason
            )?;
        }
        for contact in &self.contacts {
            write!(f, "\ncollision: {contact}")?;
        }
        Ok(())
    }
}
