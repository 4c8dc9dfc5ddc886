//! The servo loop turned by hand.

use std::time::{Duration, Instant};

use anyhow::ensure;
use devices::JointValues;
use trajectory::Trajectory;
use trajectory_executor::servo::{ServoConfig, ServoEvent, ServoRemote, SteppedServo};

use crate::recorder::Log;

/// Nobody has to vouch for the arm meanwhile.
const LONG: Duration = Duration::from_hours(1);

pub(crate) struct Stepped {
    servo: SteppedServo,
    remote: ServoRemote,
    log: Log,
}

impl Stepped {
    /// Holds the arm at `start`; room for so many set-points.
    pub(crate) fn holding(config: ServoConfig, start: JointValues, room: usize) -> anyhow::Result<Self> {
        let mut servo = SteppedServo::new(config);
        let remote = servo.servo().remote();
        remote.permit_until(Instant::now() + LONG);
        let mut stepped = Self {
            servo,
            remote,
            log: Log::with_room(room),
        };
        stepped.engage(start, None)?;
        stepped.turn();
        ensure!(
            stepped.take_event() == Some(ServoEvent::Engaged),
            "the loop holds nothing"
        );
        Ok(stepped)
    }

    /// With a stream that fails after so many set-points, if it does.
    pub(crate) fn engage(&mut self, start: JointValues, fails_after: Option<usize>) -> anyhow::Result<()> {
        let mut stream = self.log.recorder(None);
        stream.fails_after = fails_after;
        ensure!(
            self.servo.servo().engage(Box::new(stream), start),
            "the loop takes no stream"
        );
        Ok(())
    }

    pub(crate) fn follow(&mut self, trajectory: Trajectory<7>) -> anyhow::Result<()> {
        let is_taken = self.servo.servo().follow(1, Box::new(trajectory));
        ensure!(is_taken, "the loop takes no trajectory");
        Ok(())
    }

    pub(crate) fn remote(&self) -> &ServoRemote {
        &self.remote
    }

    pub(crate) fn turn(&mut self) {
        self.turn_late(Duration::ZERO);
    }

    pub(crate) fn turn_late(&mut self, late: Duration) {
        self.servo.turn(late);
    }

    pub(crate) fn take_event(&mut self) -> Option<ServoEvent> {
        self.servo.servo().take_event()
    }

    pub(crate) fn sent(&self) -> Vec<JointValues> {
        self.log.sent().iter().map(|sent| sent.angles).collect()
    }
}
