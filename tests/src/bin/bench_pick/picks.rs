//! Pick after pick.

use std::collections::BTreeMap;

use interfaces::rakelight_msgs::action::{PickCycleGoal, PickCycleResult};
use interfaces::rakelight_msgs::msg::{CellState, Grasp, StageTiming};
use scenarios::PickingCell;
use sim::cell::Place;

use crate::Arguments;
use crate::cell;
use crate::truth::{GraspError, error};

/// Tool speed of the slow picks, m/s.
pub(crate) const SLOW: f64 = 0.25;

/// What came of one request for a pick.
#[derive(Debug, Clone)]
pub(crate) struct Pick {
    pub(crate) seed: u64,
    /// What the arm took, if something is in the bin that was not there before.
    pub(crate) taken: Option<String>,
    /// Times that the arm set out.
    pub(crate) attempts: usize,
    /// Why not, as the cell says it.
    pub(crate) reason: String,
    /// Of the grasp that was used last.
    pub(crate) error: Option<GraspError>,
    /// Seconds that each stage took, summed up over attempts, by its constant of `CellState`.
    pub(crate) seconds: BTreeMap<u8, f64>,
    /// Of the first plan of the cycle, seconds.
    pub(crate) first_plan: Option<f64>,
    /// Of the first solution of the cycle, seconds.
    pub(crate) first_solve: Option<f64>,
}

/// Picks, and what happened meanwhile.
#[derive(Debug, Default)]
pub(crate) struct Picks {
    pub(crate) all: Vec<Pick>,
    /// Of arm or what it carried with the world, as the simulator saw them.
    pub(crate) collisions: Vec<String>,
    /// By shape, how many lay on the table.
    pub(crate) shapes: BTreeMap<String, usize>,
}

/// So many picks at a speed of the tool (m/s); another world when the table is empty or a pick has failed.
pub(crate) async fn run(cell: &PickingCell, arguments: &Arguments, speed: f64, count: usize) -> anyhow::Result<Picks> {
    cell.set_parameter("trajectory_executor", "tool_speed", speed).await?;
    let mut picks = Picks::default();
    let mut seed = arguments.seed;
    while picks.all.len() < count {
        cell.set_world(cell::world(arguments, seed)?)?;
        picks.count_shapes(cell);
        clear(cell, seed, count, &mut picks).await?;
        seed += 1;
    }
    Ok(picks)
}

/// Until the table is empty, a pick fails, or there were enough.
async fn clear(cell: &PickingCell, seed: u64, count: usize, picks: &mut Picks) -> anyhow::Result<()> {
    while picks.all.len() < count && !on_table(cell).is_empty() {
        let collisions = cell.simulated.collisions().len();
        let pick = one(cell, seed).await?;
        let new = cell.simulated.collisions().into_iter().skip(collisions);
        picks
            .collisions
            .extend(new.map(|contact| format!("seed {seed}: {contact:?}")));
        eprintln!("{:4}/{count} {}", picks.all.len() + 1, pick.told());
        let failed = pick.taken.is_none();
        picks.all.push(pick);
        if failed {
            cell.recover().await?;
            break;
        }
    }
    Ok(())
}

async fn one(cell: &PickingCell, seed: u64) -> anyhow::Result<Pick> {
    let bodies = cell.simulated.world().scene.bodies.clone();
    let before = in_bin(cell);
    // A thin object is tried when there is nothing else.
    let mut result = cell.pick(PickCycleGoal::default()).await?;
    let mut solid = String::new();
    if !result.success && result.failed_stage == CellState::PLAN {
        let thin = PickCycleGoal {
            mode: PickCycleGoal::THIN,
            ..PickCycleGoal::default()
        };
        solid = format!("as a solid object: {}; as a thin one: ", result.reason);
        result = cell.pick(thin).await?;
    }
    let taken = in_bin(cell).into_iter().find(|name| !before.contains(name));
    let reason = match (&taken, result.success) {
        (None, true) => "said to be in the bin, but it is not".to_owned(),
        (Some(_), false) => format!("in the bin, but said not to be: {}", result.reason),
        (None, false) => format!("{solid}{}; on the table: {}", result.reason, on_table(cell).join(", ")),
        (Some(_), true) => result.reason.clone(),
    };
    let used = result.grasp != Grasp::default();
    Ok(Pick {
        seed,
        attempts: stages(&result, CellState::EXECUTE).count(),
        error: used.then(|| error(&result.grasp, &bodies)).flatten(),
        taken: taken.filter(|_| result.success),
        reason,
        first_plan: stages(&result, CellState::PLAN).next().map(seconds),
        first_solve: stages(&result, CellState::SOLVE).next().map(seconds),
        seconds: by_stage(&result),
    })
}

fn in_bin(cell: &PickingCell) -> Vec<String> {
    names(cell, Place::InBin)
}

fn on_table(cell: &PickingCell) -> Vec<String> {
    names(cell, Place::OnTable)
}

fn names(cell: &PickingCell, place: Place) -> Vec<String> {
    let objects = cell.simulated.objects().into_iter();
    objects
        .filter(|object| object.place == place)
        .map(|object| object.name)
        .collect()
}

fn stages(result: &PickCycleResult, stage: u8) -> impl Iterator<Item = &StageTiming> {
    result.timings.iter().filter(move |timing| timing.stage == stage)
}

fn by_stage(result: &PickCycleResult) -> BTreeMap<u8, f64> {
    let mut sums = BTreeMap::new();
    for timing in &result.timings {
        *sums.entry(timing.stage).or_default() += seconds(timing);
    }
    sums
}

fn seconds(timing: &StageTiming) -> f64 {
    f64::from(timing.duration.sec) + 1e-9 * f64::from(timing.duration.nanosec)
}

impl Pick {
    /// Seconds of the arm.
    pub(crate) fn robot(&self) -> Option<f64> {
        self.seconds.get(&CellState::EXECUTE).copied()
    }

    /// Seconds of all other stages.
    pub(crate) fn without_robot(&self) -> f64 {
        let others = self.seconds.iter().filter(|(stage, _)| **stage != CellState::EXECUTE);
        others.map(|(_, seconds)| seconds).sum()
    }

    fn told(&self) -> String {
        let error = self.error.map_or_else(String::new, |error| {
            format!(", {:.2} mm and {:.1} degrees off", error.point_mm, error.normal_deg)
        });
        let robot = self.robot().unwrap_or_default();
        match &self.taken {
            Some(name) => format!(
                "seed {}: {name}, attempt {}, robot {robot:.1} s, else {:.1} s{error}",
                self.seed,
                self.attempts,
                self.without_robot()
            ),
            None => format!(
                "seed {}: MISSED after {} attempts: {}{error}",
                self.seed, self.attempts, self.reason
            ),
        }
    }
}

impl Picks {
    fn count_shapes(&mut self, cell: &PickingCell) {
        for object in cell.simulated.objects() {
            let shape = object.name.split(' ').next().unwrap_or(&object.name).to_owned();
            *self.shapes.entry(shape).or_default() += 1;
        }
    }
}
