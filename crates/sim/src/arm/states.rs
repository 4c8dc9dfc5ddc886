//! Modes and states, and how clients change them.

use xarm_protocol::{Mode, State, StateCommand};

use super::answer::Outcome;
use super::core::{Core, Drive};

impl Core {
    /// Whatever moves stops; the controller wants to be set ready again.
    pub(super) fn set_mode(&mut self, mode: Mode) -> Outcome {
        if matches!(mode, Mode::JointOnline | Mode::CartesianOnline) {
            return Outcome::Invalid;
        }
        if self.error != 0 {
            return Outcome::Done;
        }
        self.stop(State::Changed);
        self.mode = mode;
        Outcome::Done
    }

    /// After a change of the configuration.
    pub(super) fn changed(&mut self) -> Outcome {
        if self.error == 0 && self.state != State::Stopped {
            self.stop(State::Changed);
        }
        Outcome::Done
    }

    pub(super) fn set_state(&mut self, command: StateCommand) -> Outcome {
        match command {
            StateCommand::Run => self.run(),
            StateCommand::Pause => self.pause(),
            StateCommand::Stop => self.stop(State::Stopped),
            StateCommand::Decelerate if self.is_ready() => self.decelerate(),
            StateCommand::Decelerate => {}
        }
        Outcome::Done
    }

    /// Ready, or on with what was paused. Without motors, or with an error, nothing happens.
    fn run(&mut self) {
        if self.error != 0 || self.enabled != super::core::ALL_AXES {
            return;
        }
        self.planner.set_paused(false);
        if self.state == State::Ready {
            return;
        }
        self.state = State::Ready;
        let goes_on = match &self.drive {
            // Until it rests; then the mode takes over.
            Drive::Stopping { stop, time } => *time < stop.duration(),
            // What was paused.
            Drive::Queue => true,
            _ => false,
        };
        if !goes_on {
            self.drive = self.drive_of_mode();
        }
    }

    fn pause(&mut self) {
        if !self.is_ready() {
            return;
        }
        if self.mode == Mode::Position {
            self.planner.set_paused(true);
            self.state = State::Paused;
        } else {
            self.stop(State::Paused);
        }
    }
}
