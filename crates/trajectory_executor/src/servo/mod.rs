//! The real-time part: a thread that sends a set-point to the arm every 4 ms.
//!
//! In its loop nothing allocates, locks, waits for anybody or writes a log. Commands come in and events go out through
//! wait-free rings; what is to be freed goes out through a third one. A set-point leaves only after a
//! [`SetPointGuard`](trajectory::SetPointGuard) has let it pass.
//!
//! - The arm **holds** its last set-point, or **follows** a trajectory, or **stops** within the limits.
//! - A trajectory's time goes on by one period for each set-point that is sent, so that a late wake-up makes the arm late
//!   but never makes it jump.
//! - It stops by itself when it woke up 20 ms late ([`StopCause::Late`]), when the permission ran out that whoever watches
//!   the arm's state renews ([`StopCause::Stale`]), and when the guard refuses a set-point ([`StopCause::Guard`]).

mod board;
mod config;
mod cycle;
mod realtime;
mod shared;
mod thread;
mod timing;

pub use config::ServoConfig;
pub use realtime::RealTime;
pub use timing::TimingSummary;

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use devices::{JointValues, SetPointStream, StreamFault};
use rtrb::{Consumer, Producer, RingBuffer};
use trajectory::{GuardFault, State, Trajectory};

use cycle::Cycle;
use shared::Shared;

/// Between set-points.
pub const PERIOD: Duration = Duration::from_millis(4);

/// Commands, events and waste that wait; many more than ever do.
const RING: usize = 64;

/// For the loop.
pub(crate) enum Command {
    /// Hold there, and send to this stream.
    Engage {
        stream: Box<dyn SetPointStream>,
        at: JointValues,
    },
    /// Follow from where the arm is held.
    Follow { id: u64, trajectory: Box<Trajectory<7>> },
    /// Send no more.
    Release,
}

/// From the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ServoEvent {
    /// The arm is held.
    Engaged,
    /// A trajectory was followed to its end; the arm is held there.
    Finished {
        /// Of the trajectory.
        id: u64,
    },
    /// A trajectory was not followed to its end; the arm has been decelerated and is held.
    Stopped {
        /// Of the trajectory.
        id: u64,
        /// Why.
        cause: StopCause,
    },
    /// A trajectory was not begun: nothing is engaged, or the arm is not at rest.
    Refused {
        /// Of the trajectory.
        id: u64,
    },
    /// The stream has ended; nothing is sent any more. The trajectory that was followed, if any, ended with it.
    Lost {
        /// Of the trajectory.
        id: Option<u64>,
        /// Why.
        fault: StreamFault,
    },
}

/// Why a trajectory was not followed to its end.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum StopCause {
    /// Somebody asked for it.
    #[error("stopped by request")]
    Requested,
    /// The thread woke up so much too late.
    #[error("the servo loop was {by:?} late")]
    Late {
        /// By how much.
        by: Duration,
    },
    /// Nobody has vouched for the arm's state for too long.
    #[error("the arm's state was not heard of for too long")]
    Stale,
    /// A set-point was outside the limits.
    #[error("a set-point was refused: {0}")]
    Guard(GuardFault),
}

/// Only to be freed.
enum Waste {
    Stream { _stream: Box<dyn SetPointStream> },
    Trajectory { _trajectory: Box<Trajectory<7>> },
}

/// The thread, from outside. Dropping it ends the stream at once; the arm is then held by its own controller.
pub struct Servo {
    commands: Producer<Command>,
    events: Consumer<ServoEvent>,
    waste: Consumer<Waste>,
    shared: Arc<Shared>,
    realtime: RealTime,
    thread: Option<JoinHandle<()>>,
}

/// The same loop without its thread, turned by hand: a minute of it takes no minute.
pub struct SteppedServo {
    cycle: Cycle,
    servo: Servo,
}

/// Stops, permits and looks on from anywhere, without the [`Servo`] itself.
#[derive(Clone)]
pub struct ServoRemote {
    shared: Arc<Shared>,
}

impl Servo {
    /// Starts the thread; it sends nothing until a stream is engaged.
    pub fn start(config: ServoConfig) -> std::io::Result<Self> {
        let priority = config.priority;
        let (mut servo, cycle) = Self::new(config);
        let (thread, realtime) = thread::start(cycle, priority)?;
        servo.realtime = realtime;
        servo.thread = Some(thread);
        Ok(servo)
    }

    fn new(config: ServoConfig) -> (Self, Cycle) {
        let (commands, taken) = RingBuffer::new(RING);
        let (told, events) = RingBuffer::new(RING);
        let (thrown, waste) = RingBuffer::new(RING);
        let shared = Arc::new(Shared::new());
        let cycle = Cycle::new(config, taken, told, thrown, Arc::clone(&shared));
        let servo = Self {
            commands,
            events,
            waste,
            shared,
            realtime: RealTime::not_asked_for(),
            thread: None,
        };
        (servo, cycle)
    }

    /// What the system has permitted.
    pub fn realtime(&self) -> &RealTime {
        &self.realtime
    }

    /// Holds the arm where it stands (rad) and sends to this stream from now on; false when the loop takes nothing.
    #[must_use]
    pub fn engage(&mut self, stream: Box<dyn SetPointStream>, at: JointValues) -> bool {
        self.shared.clear_stop();
        self.commands.push(Command::Engage { stream, at }).is_ok()
    }

    /// Follows a trajectory that begins where the arm is held; false when the loop takes nothing. A stop that was
    /// requested before is forgotten.
    #[must_use]
    pub fn follow(&mut self, id: u64, trajectory: Box<Trajectory<7>>) -> bool {
        self.shared.clear_stop();
        self.commands.push(Command::Follow { id, trajectory }).is_ok()
    }

    /// Sends nothing any more; false when the loop takes nothing.
    #[must_use]
    pub fn release(&mut self) -> bool {
        self.commands.push(Command::Release).is_ok()
    }

    /// What has happened since the last call. Called some times a second it also frees what the loop is done with.
    pub fn take_event(&mut self) -> Option<ServoEvent> {
        while self.waste.pop().is_ok() {}
        self.events.pop().ok()
    }

    /// To stop it from anywhere.
    pub fn remote(&self) -> ServoRemote {
        ServoRemote {
            shared: Arc::clone(&self.shared),
        }
    }
}

impl SteppedServo {
    /// Sends nothing until a stream is engaged.
    pub fn new(config: ServoConfig) -> Self {
        let (servo, cycle) = Servo::new(config);
        Self { cycle, servo }
    }

    /// To command it.
    pub fn servo(&mut self) -> &mut Servo {
        &mut self.servo
    }

    /// What is done each period, on a wake-up that is so late.
    pub fn turn(&mut self, late: Duration) {
        self.cycle.turn(late, PERIOD + late);
    }
}

impl ServoRemote {
    /// Decelerates from the next period on; then the arm is held.
    pub fn stop(&self) {
        self.shared.request_stop();
    }

    /// Motions are allowed until then: whoever watches the arm's state renews this while all is well.
    pub fn permit_until(&self, end: Instant) {
        self.shared.permit_until(end);
    }

    /// No motion is allowed from now on.
    pub fn forbid(&self) {
        self.shared.forbid();
    }

    /// Where the arm was sent last; none before it was engaged.
    pub fn commanded(&self) -> Option<[State; 7]> {
        self.shared.board.read()
    }

    /// How punctual the loop is.
    pub fn timing(&self) -> TimingSummary {
        self.shared.timing.summary()
    }

    /// The longest period since the last call.
    pub fn take_longest_period(&self) -> Duration {
        self.shared.timing.take_longest_period()
    }
}

impl Drop for Servo {
    fn drop(&mut self) {
        self.shared.end();
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has said so on standard error.
            let _ = thread.join();
        }
    }
}
