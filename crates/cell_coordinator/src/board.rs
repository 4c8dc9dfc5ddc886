//! What the cell tells of itself: `state`.

use std::time::Duration;

use interfaces::builtin_interfaces::msg::Time;
use interfaces::rakelight_msgs::msg::{CellState, StageTiming};
use parking_lot::Mutex;
use ros::{Clock, Node, Publisher, Qos};

use crate::convert;
use crate::cycle::{Kind, Outcome, View};

pub(crate) struct Board {
    state: Mutex<State>,
    publisher: Publisher<CellState>,
    clock: Clock,
}

struct State {
    told: CellState,
    /// What a cycle that runs does now, and who asked for it.
    running: Option<(String, String)>,
    was_told: bool,
}

impl Board {
    pub(crate) fn new(node: &Node) -> Result<Self, ros::Error> {
        Ok(Self {
            state: Mutex::new(State {
                told: CellState::default(),
                running: None,
                was_told: false,
            }),
            publisher: node.publisher("state", Qos::LATCHED)?,
            clock: node.clock().clone(),
        })
    }

    /// What runs and who asked for it, if something does; otherwise `asker`'s cycle runs from now on.
    pub(crate) fn begin(&self, asker: &str) -> Result<(), String> {
        let mut state = self.state.lock();
        if let Some((asked, detail)) = &state.running {
            return Err(format!(
                "the cell is busy: a cycle that was asked for by {asked} runs (stage {}: {detail})",
                stage_name(state.told.stage)
            ));
        }
        state.running = Some((asker.to_owned(), "it begins".to_owned()));
        Ok(())
    }

    /// A cycle goes on. `begin` in nanoseconds of the node's clock; `now` the time since. Gives the timings told.
    pub(crate) fn going(&self, view: &View, begin: i64, now: Duration) -> Vec<StageTiming> {
        let timings = convert::timings(&view.timings, begin, now);
        self.change(|state| {
            if let Some(running) = &mut state.running {
                running.1.clone_from(&view.detail);
            }
            state.told.stage = view.stage.map_or(CellState::IDLE, convert::stage);
            state.told.capture_id.clone_from(&view.capture_id);
            state.told.timings.clone_from(&timings);
        });
        timings
    }

    /// A cycle has ended, and the cell is as `idle` says.
    pub(crate) fn ended(&self, outcome: Option<&Outcome>, counts: bool, idle: u8, waiting_for: Vec<String>) {
        let now = self.clock.now();
        self.change(|state| {
            state.running = None;
            state.told.stage = idle;
            state.told.waiting_for = waiting_for;
            let Some(outcome) = outcome else { return };
            match outcome.kind {
                Kind::Succeeded if counts => state.told.cycles_succeeded += 1,
                Kind::Failed | Kind::Cancelled if counts => state.told.cycles_failed += 1,
                _ => {}
            }
            if !outcome.reason.is_empty() {
                state.trouble(&outcome.reason, now);
            }
        });
    }

    /// The cell as it is while no cycle runs; `fault` in words, if there is one.
    pub(crate) fn idle(&self, idle: u8, waiting_for: Vec<String>, fault: Option<&str>) {
        let now = self.clock.now();
        self.change(|state| {
            state.told.waiting_for = waiting_for;
            if state.running.is_some() {
                return;
            }
            if let Some(fault) = fault.filter(|_| state.told.stage != idle) {
                state.trouble(fault, now);
            }
            state.told.stage = idle;
        });
    }

    /// The arm moves, or may.
    pub(crate) fn is_executing(&self) -> bool {
        let state = self.state.lock();
        state.running.is_some() && state.told.stage == CellState::EXECUTE
    }

    /// Tells what has changed, if anything has.
    fn change(&self, change: impl FnOnce(&mut State)) {
        let mut state = self.state.lock();
        let before = state.told.clone();
        change(&mut state);
        if state.was_told && before == state.told {
            return;
        }
        state.told.header.stamp = self.clock.now();
        state.was_told = true;
        // Published within the lock, so that what is latched is the newest.
        if let Err(error) = self.publisher.publish(state.told.clone()) {
            tracing::warn!(%error, "a state is lost");
        }
    }
}

impl State {
    fn trouble(&mut self, reason: &str, now: Time) {
        reason.clone_into(&mut self.told.last_error);
        self.told.last_error_at = now;
    }
}

fn stage_name(stage: u8) -> &'static str {
    match stage {
        CellState::CAPTURE => "capture",
        CellState::SOLVE => "solve",
        CellState::PLAN => "plan",
        CellState::EXECUTE => "execute",
        _ => "begin",
    }
}
