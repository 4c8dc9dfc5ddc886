//! What is done every period.

use std::sync::Arc;
use std::time::Duration;

use devices::{JointValues, SetPointStream, StreamFault};
use rtrb::{Consumer, Producer};
use trajectory::{State, Stop, Trajectory};

use super::shared::Shared;
use super::{Command, PERIOD, ServoConfig, ServoEvent, StopCause, Waste};

/// After a longer pause the arm's controller has brought the arm to rest by itself.
const ARM_RESTS_AFTER: Duration = Duration::from_millis(100);

/// What is being done.
#[allow(clippy::large_enum_variant, reason = "a box would be freed in the loop")]
enum Phase {
    /// Nothing is sent.
    Idle,
    Hold,
    Follow {
        id: u64,
        trajectory: Box<Trajectory<7>>,
        time: f64,
    },
    Stop {
        id: u64,
        cause: StopCause,
        stop: Stop<7>,
        time: f64,
    },
}

pub(super) struct Cycle {
    config: ServoConfig,
    commands: Consumer<Command>,
    events: Producer<ServoEvent>,
    waste: Producer<Waste>,
    shared: Arc<Shared>,
    stream: Option<Box<dyn SetPointStream>>,
    phase: Phase,
}

impl Cycle {
    pub(super) fn new(
        config: ServoConfig,
        commands: Consumer<Command>,
        events: Producer<ServoEvent>,
        waste: Producer<Waste>,
        shared: Arc<Shared>,
    ) -> Self {
        Self {
            config,
            commands,
            events,
            waste,
            shared,
            stream: None,
            phase: Phase::Idle,
        }
    }

    pub(super) fn has_ended(&self) -> bool {
        self.shared.has_ended()
    }

    pub(super) fn miss(&self, periods: u32) {
        self.shared.timing.miss(periods);
    }

    /// Once a period: how late it is, and how long ago the turn before was.
    pub(super) fn turn(&mut self, late: Duration, period: Duration) {
        self.shared.timing.record(late, period);
        while let Ok(command) = self.commands.pop() {
            self.obey(command);
        }
        if let Some(cause) = self.reason_to_stop(late) {
            self.begin_stop(cause, late);
        }
        if let Some(set_point) = self.next_set_point() {
            self.send(&set_point);
        }
    }

    fn obey(&mut self, command: Command) {
        match command {
            Command::Engage { stream, at } => self.engage(stream, &at),
            Command::Follow { id, trajectory } => self.follow(id, trajectory),
            Command::Release => self.release(),
        }
    }

    fn engage(&mut self, stream: Box<dyn SetPointStream>, at: &JointValues) {
        self.release();
        if self.config.guard.rest_at(at).is_err() {
            // An arm outside its limits is not held by set-points: they would be outside as well.
            self.throw(Waste::Stream { _stream: stream });
            self.tell(ServoEvent::Lost {
                id: None,
                fault: StreamFault::Refused,
            });
            return;
        }
        self.stream = Some(stream);
        self.phase = Phase::Hold;
        self.tell(ServoEvent::Engaged);
    }

    fn follow(&mut self, id: u64, trajectory: Box<Trajectory<7>>) {
        if matches!(self.phase, Phase::Hold) {
            let time = 0.0;
            self.phase = Phase::Follow { id, trajectory, time };
        } else {
            self.throw(Waste::Trajectory {
                _trajectory: trajectory,
            });
            self.tell(ServoEvent::Refused { id });
        }
    }

    fn release(&mut self) {
        self.leave(Phase::Idle);
        if let Some(stream) = self.stream.take() {
            self.throw(Waste::Stream { _stream: stream });
        }
    }

    fn reason_to_stop(&self, late: Duration) -> Option<StopCause> {
        if !matches!(self.phase, Phase::Follow { .. }) {
            return None;
        }
        if self.shared.is_stop_requested() {
            return Some(StopCause::Requested);
        }
        if late > self.config.watchdog {
            return Some(StopCause::Late { by: late });
        }
        (!self.shared.is_permitted()).then_some(StopCause::Stale)
    }

    /// From where the arm was sent last; from rest there, when it has come to rest by itself meanwhile.
    fn begin_stop(&mut self, cause: StopCause, late: Duration) {
        let Phase::Follow { id, trajectory, time } = &self.phase else {
            return;
        };
        let (id, mut states) = (*id, trajectory.sample(*time));
        if let StopCause::Guard(_) = cause {
            // What was refused was never sent: the arm is on the way that the guard has seen.
            states = self.config.guard.states();
        }
        if late > ARM_RESTS_AFTER {
            states = states.map(|state| State::at(state.position));
            let at = states.map(|state| state.position);
            // It passed before.
            let _ = self.config.guard.rest_at(&at);
        }
        match Stop::from(&states, &self.config.stop_limits) {
            Ok(stop) => {
                let time = 0.0;
                self.leave(Phase::Stop { id, cause, stop, time });
            }
            // The guard's states are finite and the limits were checked: holding is all that is left.
            Err(_) => self.hold_after_stop(id, cause),
        }
    }

    fn next_set_point(&mut self) -> Option<JointValues> {
        let period = PERIOD.as_secs_f64();
        let (wanted, end) = match &mut self.phase {
            Phase::Idle => return None,
            Phase::Hold => return Some(self.held()),
            Phase::Follow { trajectory, time, .. } => {
                *time += period;
                (trajectory.sample(*time), *time >= trajectory.duration())
            }
            Phase::Stop { stop, time, .. } => {
                *time += period;
                (stop.sample(*time), *time >= stop.duration())
            }
        };
        let wanted = wanted.map(|state| state.position);
        let guard = &mut self.config.guard;
        // Joints that stop each in its own time may move the tool faster for a moment; that is no reason not to stop.
        let passed = match self.phase {
            Phase::Stop { .. } => guard.pass_stop(&wanted),
            _ => guard.pass(&wanted),
        };
        match passed {
            Ok(passed) => {
                if end {
                    self.finish();
                }
                Some(passed)
            }
            Err(fault) => Some(self.after_refusal(StopCause::Guard(fault))),
        }
    }

    fn held(&self) -> JointValues {
        self.config.guard.states().map(|state| state.position)
    }

    /// A trajectory that is refused is stopped, from this period on; a stop that is refused ends where the arm is.
    fn after_refusal(&mut self, cause: StopCause) -> JointValues {
        if let Phase::Stop { id, cause, .. } = self.phase {
            self.hold_after_stop(id, cause);
            return self.held();
        }
        self.begin_stop(cause, Duration::ZERO);
        if matches!(self.phase, Phase::Stop { .. }) {
            return self.next_set_point().unwrap_or_else(|| self.held());
        }
        self.held()
    }

    fn finish(&mut self) {
        match self.phase {
            Phase::Follow { id, .. } => {
                self.leave(Phase::Hold);
                self.tell(ServoEvent::Finished { id });
            }
            Phase::Stop { id, cause, .. } => self.hold_after_stop(id, cause),
            Phase::Idle | Phase::Hold => {}
        }
    }

    fn hold_after_stop(&mut self, id: u64, cause: StopCause) {
        let at = self.held();
        // It passed before.
        let _ = self.config.guard.rest_at(&at);
        self.leave(Phase::Hold);
        self.tell(ServoEvent::Stopped { id, cause });
    }

    fn send(&mut self, set_point: &JointValues) {
        let Some(stream) = &mut self.stream else {
            return;
        };
        match stream.send(set_point) {
            Ok(()) => self.shared.board.write(&self.config.guard.states()),
            Err(fault) => {
                let id = match self.phase {
                    Phase::Follow { id, .. } | Phase::Stop { id, .. } => Some(id),
                    Phase::Idle | Phase::Hold => None,
                };
                self.release();
                self.tell(ServoEvent::Lost { id, fault });
            }
        }
    }

    fn leave(&mut self, next: Phase) {
        if let Phase::Follow { trajectory, .. } = std::mem::replace(&mut self.phase, next) {
            self.throw(Waste::Trajectory {
                _trajectory: trajectory,
            });
        }
    }

    /// Freeing is for others. When nobody has emptied the ring for long it is left unfreed.
    fn throw(&mut self, waste: Waste) {
        if let Err(rtrb::PushError::Full(waste)) = self.waste.push(waste) {
            std::mem::forget(waste);
        }
    }

    /// An event that nobody takes is lost.
    fn tell(&mut self, event: ServoEvent) {
        let _ = self.events.push(event);
    }
}
