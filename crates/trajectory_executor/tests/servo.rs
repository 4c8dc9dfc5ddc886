//! The servo loop, turned by hand: nothing here waits for a clock.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use devices::{JointValues, SetPointStream, StreamFault};
use kinematics::Chain;
use trajectory::{JointLimits, Planner, SetPointGuard, Trajectory, TrajectoryLimits};
use trajectory_executor::servo::{PERIOD, ServoConfig, ServoEvent, ServoRemote, SteppedServo, StopCause};

const HOME: JointValues = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];
const AWAY: JointValues = [0.9, -0.2, 0.3, 0.9, -0.4, 1.3, 0.5];
const JERK: f64 = 200.0;
/// More periods than any motion here takes.
const PATIENCE: usize = 5000;

/// Keeps what is sent; room is made before, so that it allocates nothing.
struct Kept {
    sent: Arc<Mutex<Vec<JointValues>>>,
    left: usize,
}

impl SetPointStream for Kept {
    fn send(&mut self, angles: &JointValues) -> Result<(), StreamFault> {
        self.left = self.left.checked_sub(1).ok_or(StreamFault::Disconnected)?;
        self.sent.lock().unwrap().push(*angles);
        Ok(())
    }
}

struct Bench {
    servo: SteppedServo,
    remote: ServoRemote,
    planner: Planner<7>,
    sent: Arc<Mutex<Vec<JointValues>>>,
}

impl Bench {
    /// Held at home; the stream breaks after so many set-points.
    fn new(breaks_after: usize) -> Self {
        let urdf = concat!(env!("CARGO_MANIFEST_DIR"), "/../../urdf/xarm7.urdf");
        let chain = Chain::from_urdf(&urdf_rs::read_file(urdf).unwrap(), "link_base", "link_tcp").unwrap();
        let limits = TrajectoryLimits::of_chain(&chain, 10.0, JERK, 0.9).unwrap();
        let mut servo = SteppedServo::new(config(&chain, &limits));
        let remote = servo.servo().remote();
        remote.permit_until(Instant::now() + Duration::from_hours(1));
        let sent = Arc::new(Mutex::new(Vec::with_capacity(100_000)));
        let stream = Kept {
            sent: Arc::clone(&sent),
            left: breaks_after,
        };
        assert!(servo.servo().engage(Box::new(stream), HOME));
        let planner = Planner::new(chain, limits).unwrap();
        let mut bench = Self {
            servo,
            remote,
            planner,
            sent,
        };
        bench.turn(1);
        assert_eq!(bench.event(), Some(ServoEvent::Engaged));
        bench
    }

    fn turn(&mut self, times: usize) {
        for _ in 0..times {
            self.servo.turn(Duration::ZERO);
        }
    }

    fn event(&mut self) -> Option<ServoEvent> {
        self.servo.servo().take_event()
    }

    fn next_event(&mut self) -> ServoEvent {
        for _ in 0..PATIENCE {
            if let Some(event) = self.event() {
                return event;
            }
            self.turn(1);
        }
        panic!("nothing happens in {PATIENCE} periods");
    }

    fn follow(&mut self, trajectory: &Trajectory<7>) {
        assert!(self.servo.servo().follow(1, Box::new(trajectory.clone())));
    }

    fn motion(&self) -> Trajectory<7> {
        self.planner.joint_motion(&HOME, &AWAY).unwrap()
    }

    fn sent(&self) -> Vec<JointValues> {
        self.sent.lock().unwrap().clone()
    }

    /// Differences of third order of what was sent, over the period's cube: no jerk is larger.
    fn largest_jerk(&self) -> f64 {
        let cube = PERIOD.as_secs_f64().powi(3);
        let third = |four: &[JointValues], joint: usize| {
            (four[3][joint] - 3.0 * four[2][joint] + 3.0 * four[1][joint] - four[0][joint]).abs() / cube
        };
        let sent = self.sent();
        let jerks = sent
            .windows(4)
            .flat_map(|four| (0..7).map(move |joint| third(four, joint)));
        jerks.fold(0.0, f64::max)
    }
}

fn config(chain: &Chain<7>, limits: &TrajectoryLimits<7>) -> ServoConfig {
    let gate = TrajectoryLimits {
        joints: limits.joints.map(|joint| JointLimits {
            acceleration: 1.1 * joint.acceleration,
            jerk: 1.1 * joint.jerk,
            ..joint
        }),
        tool_speed: 0.99,
    };
    ServoConfig {
        guard: SetPointGuard::new(chain.clone(), gate, PERIOD.as_secs_f64(), 1e-6, &HOME).unwrap(),
        stop_limits: limits.joints.map(|joint| JointLimits {
            jerk: 0.85 * joint.jerk,
            ..joint
        }),
        watchdog: Duration::from_millis(20),
        priority: 0,
    }
}

/// Where a trajectory is at the end of a period.
fn wanted(motion: &Trajectory<7>, period: usize) -> JointValues {
    motion
        .sample(period as f64 * PERIOD.as_secs_f64())
        .map(|state| state.position)
}

fn off(a: &JointValues, b: &JointValues) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn a_trajectory_is_sent_to_its_end_as_it_is() {
    let mut bench = Bench::new(PATIENCE);
    let motion = bench.motion();
    bench.follow(&motion);
    assert_eq!(bench.next_event(), ServoEvent::Finished { id: 1 });
    let sent = bench.sent();
    // The first was held; then one for each period.
    for (index, sent) in sent.iter().enumerate().skip(1) {
        let off = off(sent, &wanted(&motion, index));
        assert!(off < 1e-12, "set-point {index}: {off}");
    }
    assert!(off(sent.last().unwrap(), &AWAY) < 1e-9);
}

#[test]
fn a_stop_decelerates_in_the_next_period_and_ends_at_rest_whenever_it_comes() {
    let motion = Bench::new(1).motion();
    let periods = (motion.duration() / PERIOD.as_secs_f64()) as usize;
    for begin in (1..periods).step_by(7) {
        let mut bench = Bench::new(PATIENCE);
        bench.follow(&motion);
        bench.turn(begin);
        bench.remote.stop();
        let before = bench.sent().len();
        let cause = StopCause::Requested;
        assert_eq!(bench.next_event(), ServoEvent::Stopped { id: 1, cause }, "at {begin}");
        let first = bench.sent()[before];
        assert!(
            off(&first, &wanted(&motion, begin + 1)) > 0.0,
            "the trajectory went on at {begin}"
        );
        bench.turn(2);
        let sent = bench.sent();
        assert!(
            off(&sent[sent.len() - 1], &sent[sent.len() - 2]) <= 0.0,
            "no rest at {begin}"
        );
        assert!(
            bench.largest_jerk() < 1.1 * JERK * 1.001,
            "at {begin}: {}",
            bench.largest_jerk()
        );
    }
}

#[test]
fn what_happens_to_the_loop_or_the_arm_stops_a_motion_and_is_named() {
    let late = Duration::from_millis(25);
    let cause = |happen: &dyn Fn(&mut Bench)| {
        let mut bench = Bench::new(PATIENCE);
        let motion = bench.motion();
        bench.follow(&motion);
        bench.turn(60);
        happen(&mut bench);
        match bench.next_event() {
            ServoEvent::Stopped { cause, .. } => cause,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(cause(&|bench| bench.servo.turn(late)), StopCause::Late { by: late });
    assert_eq!(cause(&|bench| bench.remote.forbid()), StopCause::Stale);
}

#[test]
fn a_jump_is_not_sent_but_refused() {
    let mut bench = Bench::new(PATIENCE);
    // It begins elsewhere: nobody but the gate has looked at it.
    let elsewhere = bench.planner.joint_motion(&AWAY, &HOME).unwrap();
    bench.follow(&elsewhere);
    let event = bench.next_event();
    let is_refused = matches!(
        event,
        ServoEvent::Stopped {
            cause: StopCause::Guard(_),
            ..
        }
    );
    assert!(is_refused, "{event:?}");
    assert!(
        bench.sent().iter().all(|sent| off(sent, &HOME) < 1e-12),
        "the arm was held all the time"
    );
}

#[test]
fn a_stream_that_breaks_ends_the_motion_and_nothing_more_is_sent() {
    let mut bench = Bench::new(80);
    let motion = bench.motion();
    bench.follow(&motion);
    let fault = StreamFault::Disconnected;
    assert_eq!(bench.next_event(), ServoEvent::Lost { id: Some(1), fault });
    bench.turn(10);
    assert_eq!(bench.sent().len(), 80);
    bench.follow(&motion);
    assert_eq!(bench.next_event(), ServoEvent::Refused { id: 1 });
}

#[test]
fn no_turn_of_the_loop_allocates() {
    let mut bench = Bench::new(PATIENCE);
    let motion = bench.motion();
    let held = allocation_counter::measure(|| bench.turn(50));
    bench.follow(&motion);
    let followed = allocation_counter::measure(|| bench.turn(100));
    bench.remote.stop();
    let stopped = allocation_counter::measure(|| bench.turn(400));
    assert!(matches!(bench.next_event(), ServoEvent::Stopped { .. }));
    let counts = [held, followed, stopped].map(|counted| counted.count_total);
    assert_eq!(counts, [0; 3]);
}
