//! Where cycles are asked for: one at a time, and only when the cell can do it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use geometry::nalgebra::Vector3;
use interfaces::rakelight_msgs::msg::{ArmState, CellState, StageTiming};
use parking_lot::Mutex;
use ros::Clock;
use tokio_util::sync::CancellationToken;

use crate::arm::Arm;
use crate::board::Board;
use crate::convert;
use crate::cycle::{Carried, Command, Cycle, Kind, Mode, Order, Outcome, View};
use crate::drive::Drive;
use crate::hands::{Hands, Wanted};
use crate::parameters::Parameters;
use crate::presence::Presence;
use crate::record::Recording;

/// What somebody wants.
#[derive(Debug, Clone)]
pub(crate) struct Wish {
    /// For people.
    pub(crate) asker: &'static str,
    pub(crate) modes: Vec<Mode>,
    pub(crate) wanted: Wanted,
    pub(crate) dry_run: bool,
}

/// How a wish ended.
pub(crate) struct Answer {
    pub(crate) outcome: Outcome,
    pub(crate) timings: Vec<StageTiming>,
}

pub(crate) struct Desk {
    pub(crate) parameters: Arc<Parameters>,
    pub(crate) hands: Arc<Hands>,
    pub(crate) arm: Arm,
    pub(crate) presence: Presence,
    pub(crate) board: Board,
    pub(crate) recording: Recording,
    pub(crate) clock: Clock,
    /// What hung on the cup when the last cycle ended.
    pub(crate) carried: Mutex<Option<Carried>>,
    /// A cycle was dropped while the arm may have moved: nobody attends to it.
    pub(crate) abandoned: AtomicBool,
}

impl Desk {
    /// One cycle, or why there is none. `tell` hears how it goes.
    pub(crate) async fn serve(
        &self,
        wish: Wish,
        cancel: CancellationToken,
        tell: impl FnMut(&View, &[StageTiming]) + Send,
    ) -> Answer {
        if let Err(reason) = self.board.begin(wish.asker) {
            return refused(reason);
        }
        let busy = Busy {
            desk: self,
            ended: false,
        };
        match self.cycle(&wish).await {
            Ok(cycle) => busy.run(cycle, wish, cancel, tell).await,
            Err(reason) => {
                tracing::warn!(reason, "no cycle");
                refused(reason)
            }
        }
    }

    /// Everything is looked at before anything is done.
    async fn cycle(&self, wish: &Wish) -> Result<(Cycle, Option<Command>), String> {
        let missing = self.presence.missing(self.records());
        if !missing.is_empty() {
            return Err(format!("the cell is not ready: waiting for {}", missing.join(", ")));
        }
        let policy = self.parameters.policy().map_err(|error| error.to_string())?;
        let patience = self.parameters.arm_state_timeout();
        let state = self.arm.fresh(patience).await?;
        if let Some(unfit) = convert::unfit(&state).filter(|_| !wish.dry_run) {
            return Err(unfit);
        }
        let home = self.hands.home_joints().await?;
        let direction = &wish.wanted.direction;
        let order = Order {
            modes: wish.modes.clone(),
            target: wish.wanted.target.clone(),
            direction: Vector3::new(direction.x, direction.y, direction.z),
            dry_run: wish.dry_run,
            cameras: self.parameters.cameras.clone(),
            at_home: self.arm.is_at(&home, patience).await?,
            held: self.held(&state),
        };
        Ok(Cycle::begin(order, policy, &convert::report(&state)))
    }

    fn held(&self, state: &ArmState) -> Option<Carried> {
        let holds = state.vacuum == ArmState::VACUUM_HELD;
        let known = *self.carried.lock();
        holds.then(|| known.unwrap_or_else(|| self.parameters.carried()))
    }

    pub(crate) fn records(&self) -> bool {
        self.parameters.record.get() == "all"
    }

    /// Tells how the cell is while no cycle runs.
    pub(crate) fn tell_idle(&self) {
        let (stage, waiting_for, fault) = self.idle();
        self.board.idle(stage, waiting_for, fault.as_deref());
    }

    fn idle(&self) -> (u8, Vec<String>, Option<String>) {
        let waiting_for = self.presence.missing(self.records());
        let state = self.arm.last();
        match state {
            Some(state) if waiting_for.is_empty() => {
                let stage = convert::idle_stage(&state);
                let fault = convert::unfit(&state).filter(|_| stage == CellState::FAULT);
                (stage, waiting_for, fault)
            }
            _ => (CellState::STARTING, waiting_for, None),
        }
    }
}

/// The cell is busy until this is dropped.
struct Busy<'a> {
    desk: &'a Desk,
    ended: bool,
}

impl Busy<'_> {
    async fn run(
        mut self,
        cycle: (Cycle, Option<Command>),
        wish: Wish,
        cancel: CancellationToken,
        mut tell: impl FnMut(&View, &[StageTiming]) + Send,
    ) -> Answer {
        let desk = self.desk;
        let recorded = if desk.records() {
            Some(desk.recording.start(&desk.parameters).await)
        } else {
            None
        };
        let (begin, begun) = (desk.clock.now_nanos(), Instant::now());
        let drive = Drive {
            hands: Arc::clone(&desk.hands),
            arm: desk.arm.clone(),
            wanted: wish.wanted,
            cancel,
        };
        let mut last = None;
        let hear = |view: &View, now: Duration| {
            let timings = desk.board.going(view, begin, now);
            tell(view, &timings);
            last = Some(view.timings.clone());
        };
        let mut outcome = drive.run(cycle, hear).await;
        let timings = convert::timings(&last.unwrap_or_default(), begin, begun.elapsed());
        if let Some(problem) = desk.end_of_recording(recorded).await {
            add(&mut outcome.reason, &problem);
        }
        self.end(&outcome, !wish.dry_run);
        Answer { outcome, timings }
    }

    fn end(&mut self, outcome: &Outcome, counts: bool) {
        self.ended = true;
        *self.desk.carried.lock() = outcome.carried;
        match outcome.kind {
            Kind::Succeeded => tracing::info!(capture_id = outcome.capture_id, note = outcome.reason, "picked"),
            Kind::Failed => tracing::warn!(capture_id = outcome.capture_id, reason = outcome.reason, "not picked"),
            Kind::Cancelled => tracing::info!(capture_id = outcome.capture_id, reason = outcome.reason, "cancelled"),
        }
        let (stage, waiting_for, _) = self.desk.idle();
        self.desk.board.ended(Some(outcome), counts, stage, waiting_for);
    }
}

impl Drop for Busy<'_> {
    fn drop(&mut self) {
        if !self.ended {
            if self.desk.board.is_executing() {
                self.desk.abandoned.store(true, Ordering::SeqCst);
            }
            let (stage, waiting_for, _) = self.desk.idle();
            self.desk.board.ended(None, false, stage, waiting_for);
        }
    }
}

impl Desk {
    /// What is to be said of a bag that is not as wanted.
    async fn end_of_recording(&self, started: Option<Result<(), String>>) -> Option<String> {
        let problem = match started? {
            Ok(()) => self.recording.stop().await.err(),
            Err(reason) => Some(reason),
        };
        problem.map(|reason| format!("the cycle is not recorded: {reason}"))
    }
}

fn add(reason: &mut String, more: &str) {
    if !reason.is_empty() {
        reason.push_str("; ");
    }
    reason.push_str(more);
}

/// Nothing was begun.
fn refused(reason: String) -> Answer {
    Answer {
        outcome: Outcome {
            kind: Kind::Failed,
            reason,
            failed_stage: None,
            capture_id: String::new(),
            grasp: None,
            moved: false,
            carried: None,
        },
        timings: Vec::new(),
    }
}
