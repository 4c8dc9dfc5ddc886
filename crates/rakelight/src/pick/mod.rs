//! `rakelight pick`: pick cycles on a running cell.

mod progress;
mod record;
mod report;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow};
use clap::{Args, ValueEnum};
use interfaces::rakelight_msgs::action::{PickCycle, PickCycleGoal, PickCycleResult};
use interfaces::rakelight_msgs::msg::CellState;
use ros::{ActionClient, GoalHandle, Node};

use crate::ending::Signals;
use crate::failure::Failure;
use crate::place::{self, Place};
use progress::Progress;
use record::Recording;
use report::{Report, Summary};

/// Discovery takes up to 1.2 s; on a busy machine, longer.
const DISCOVERY: Duration = Duration::from_secs(6);
/// For a goal to be taken or cancelled.
const QUICK: Duration = Duration::from_secs(10);
/// No cycle takes longer: its stages have limits of their own.
const CYCLE: Duration = Duration::from_hours(1);
/// For the arm to come to rest, and the cell to say so.
const REST: Duration = Duration::from_secs(20);

#[derive(Args)]
pub(crate) struct Arguments {
    /// How many objects to pick, one after the other.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    count: u32,
    /// What to pick: bodies, sheets, or a sheet when there is no body.
    #[arg(long, value_enum, default_value_t = Mode::Auto)]
    mode: Mode,
    /// Plan everything and move nothing.
    #[arg(long)]
    dry_run: bool,
    /// Record a bag of every cycle, `cycle_1` and so on, into this folder (of the recorder's machine).
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    /// Tell of each pick, and of all of them at the end, as one JSON object a line.
    #[arg(long)]
    json: bool,
    /// Namespace of the cell.
    #[arg(long, default_value = "/cell")]
    namespace: String,
    /// Launch config of the cell, for a cell in a domain of its own [default: the environment, or the cell that runs here].
    #[arg(long)]
    config: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Mode {
    Solid,
    Thin,
    Auto,
}

impl Mode {
    /// As the action has them, in the order in which they are tried.
    fn goals(self) -> &'static [u8] {
        match self {
            Self::Solid => &[PickCycleGoal::SOLID],
            Self::Thin => &[PickCycleGoal::THIN],
            Self::Auto => &[PickCycleGoal::SOLID, PickCycleGoal::THIN],
        }
    }
}

pub(crate) async fn run(arguments: Arguments) -> Result<(), Failure> {
    let name = format!("pick_{}", std::process::id());
    let options = place::options(&name, &arguments.namespace, arguments.config.as_deref()).map_err(Failure::usage)?;
    let signals = Signals::listen()?;
    let place = Place::of(&options)?;
    let node = Node::start(options).await.map_err(Failure::usage)?;
    let outcome = picks(&node, &place, &arguments, signals).await;
    node.shutdown().await;
    Ok(outcome?)
}

async fn picks(node: &Node, place: &Place, arguments: &Arguments, signals: Signals) -> anyhow::Result<()> {
    let client = node.action_client::<PickCycle>("pick_cycle")?;
    client
        .wait_for_server(DISCOVERY)
        .await
        .map_err(|_| place.no_cell(node))?;
    let Some(folder) = &arguments.record else {
        return one_after_the_other(client, arguments, signals).await;
    };
    let recording = Recording::begin(node, folder).await?;
    let outcome = one_after_the_other(client, arguments, signals).await;
    let ended = recording.end().await;
    outcome.and(ended)
}

async fn one_after_the_other(
    client: ActionClient<PickCycle>,
    arguments: &Arguments,
    signals: Signals,
) -> anyhow::Result<()> {
    let mut picker = Picker {
        client,
        signals,
        progress: Progress::new(),
        dry_run: arguments.dry_run,
        interrupted: false,
    };
    let mut summary = Summary::new(arguments.count);
    for number in 1..=arguments.count {
        let report = picker.pick(number, arguments.mode).await?;
        tell(arguments.json, || report.to_json(), || report.for_people())?;
        let goes_on = report.another_may_succeed() && !picker.interrupted;
        summary.add(report);
        if !goes_on {
            break;
        }
    }
    if arguments.count > 1 || arguments.json {
        tell(arguments.json, || summary.to_json(), || summary.for_people())?;
    }
    if summary.all_succeeded() {
        return Ok(());
    }
    Err(anyhow!("{}", summary.failure()))
}

fn tell(
    json: bool,
    to_json: impl FnOnce() -> serde_json::Result<String>,
    for_people: impl FnOnce() -> String,
) -> anyhow::Result<()> {
    println!("{}", if json { to_json()? } else { for_people() });
    Ok(())
}

struct Picker {
    client: ActionClient<PickCycle>,
    signals: Signals,
    progress: Progress,
    dry_run: bool,
    interrupted: bool,
}

impl Picker {
    /// One object, in the first mode in which there is one.
    async fn pick(&mut self, number: u32, mode: Mode) -> anyhow::Result<Report> {
        let asked = Instant::now();
        let mut reasons = Vec::new();
        let mut last = None;
        for mode in mode.goals() {
            let result = self.cycle(number, *mode).await?;
            let found_nothing = !result.success && result.failed_stage == CellState::PLAN && !has_moved(&result);
            reasons.push(result.reason.clone());
            last = Some((*mode, result));
            if !found_nothing || self.interrupted {
                break;
            }
        }
        let (mode, result) = last.context("no mode to pick in")?;
        Ok(Report::new(number, mode, &result, &reasons, asked.elapsed()))
    }

    async fn cycle(&mut self, number: u32, mode: u8) -> anyhow::Result<Arc<PickCycleResult>> {
        let goal = PickCycleGoal {
            mode,
            dry_run: self.dry_run,
            ..PickCycleGoal::default()
        };
        let mut goal = self.client.send_goal(goal, QUICK).await?;
        let outcome = self.follow(number, &mut goal).await;
        self.progress.clear();
        outcome
    }

    /// To the cycle's end, which Ctrl-C brings about earlier.
    async fn follow(&mut self, number: u32, goal: &mut GoalHandle<PickCycle>) -> anyhow::Result<Arc<PickCycleResult>> {
        loop {
            tokio::select! {
                feedback = goal.feedback() => match feedback {
                    Some(feedback) => self.progress.tell(number, &feedback),
                    None => return Ok(goal.result(CYCLE).await?.1),
                },
                () = self.signals.next() => {
                    if self.interrupted {
                        return Err(anyhow!("interrupted again, while the cell was ending the cycle"));
                    }
                    self.interrupted = true;
                    self.progress.say("interrupted: the cycle is being cancelled");
                    if let Err(error) = goal.cancel(QUICK).await {
                        tracing::debug!(%error, "the cycle has just ended, perhaps");
                    }
                    return self.rest(goal).await;
                }
            }
        }
    }

    async fn rest(&mut self, goal: &GoalHandle<PickCycle>) -> anyhow::Result<Arc<PickCycleResult>> {
        tokio::select! {
            result = goal.result(REST) => Ok(result.context("the cycle does not end")?.1),
            () = self.signals.next() => Err(anyhow!("interrupted again, while the cell was ending the cycle")),
        }
    }
}

fn has_moved(result: &PickCycleResult) -> bool {
    result.timings.iter().any(|timing| timing.stage == CellState::EXECUTE)
}
