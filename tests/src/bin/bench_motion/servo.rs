//! How punctual set-points are: from the servo loop by the real driver to the simulated controller, and back and forth.

use std::time::{Duration, Instant};

use devices::JointValues;
use serde::Serialize;
use trajectory_executor::servo::{RealTime, ServoEvent};

use crate::arm::{Arm, HOME, TOOL_SPEEDS};
use crate::lateness::{Arrivals, Micros, grid};
use crate::session::Session;

/// Where the arm goes, one after the other.
const PLACES: [JointValues; 4] = [
    [0.7, -0.2, 0.1, 0.9, 0.1, 1.2, 0.6],
    [-0.5, -0.5, -0.1, 0.6, 0.0, 1.0, -0.4],
    [0.2, 0.0, 0.0, 1.2, 0.0, 1.2, 0.2],
    HOME,
];
/// Until the arm has reached where it was sent.
const SETTLING: Duration = Duration::from_millis(500);

#[derive(Debug, Serialize)]
pub(crate) struct ServoFigures {
    pub(crate) servo_seconds: f64,
    /// How late the loop wakes up on its grid of 4 ms: half and 99 of 100 are no later (rounded up by a fifth at most).
    pub(crate) servo_p50_us: f64,
    pub(crate) servo_p99_us: f64,
    pub(crate) servo_max_us: f64,
    /// Periods in which it did not wake up.
    pub(crate) servo_late_periods: u32,
    /// How late set-points leave it.
    pub(crate) sent_late_us: Micros,
    /// How late they are read from the controller's socket.
    pub(crate) received_late_us: Micros,
    pub(crate) setpoints_sent: usize,
    pub(crate) setpoints_received: usize,
    pub(crate) setpoints_lost: usize,
    /// Received ones that were never sent.
    pub(crate) setpoints_unknown: usize,
    /// Received ones that the controller refused.
    pub(crate) setpoints_refused: usize,
    pub(crate) motions: usize,
    /// Ended by the loop itself because it woke up too late.
    pub(crate) motions_stopped: usize,
    /// Between where the arm was sent and where it stands at the end, radians.
    pub(crate) end_error: f64,
    /// What the system permitted.
    pub(crate) realtime_scheduling: String,
    pub(crate) realtime_memory: String,
}

/// What was done.
struct Streamed {
    begun: Instant,
    seconds: f64,
    motions: usize,
    stopped: usize,
    end_error: f64,
}

pub(crate) async fn measure(arm: &Arm, seconds: f64, priority: u8) -> anyhow::Result<ServoFigures> {
    let room = (300.0 * (seconds + 60.0)) as usize;
    let mut session = Session::open(arm, room, priority).await?;
    let streamed = stream(&mut session, arm, seconds).await?;
    session.finish().await?;
    let figures = figures(&session, &streamed);
    session.close().await;
    Ok(figures)
}

async fn stream(session: &mut Session, arm: &Arm, seconds: f64) -> anyhow::Result<Streamed> {
    let planners = [arm.planner(TOOL_SPEEDS[0])?, arm.planner(TOOL_SPEEDS[1])?];
    let begun = Instant::now();
    let (mut motions, mut stopped) = (0, 0);
    let legs = PLACES.iter().zip(planners.iter().cycle()).cycle();
    for (to, planner) in legs {
        if begun.elapsed().as_secs_f64() >= seconds {
            break;
        }
        let from = session.commanded()?;
        session.begin(planner.joint_motion(&from, to)?)?;
        motions += 1;
        match session.event().await? {
            ServoEvent::Finished { .. } => {}
            ServoEvent::Stopped { .. } => stopped += 1,
            event => anyhow::bail!("{event:?} while a trajectory was followed"),
        }
    }
    let seconds = begun.elapsed().as_secs_f64();
    tokio::time::sleep(SETTLING).await;
    let (sent_to, stands_at) = (session.commanded()?, session.controller.moment().joints);
    let errors = sent_to.iter().zip(&stands_at).map(|(one, other)| (one - other).abs());
    Ok(Streamed {
        begun,
        seconds,
        motions,
        stopped,
        end_error: errors.fold(0.0, f64::max),
    })
}

fn figures(session: &Session, streamed: &Streamed) -> ServoFigures {
    let (sent, trace) = (session.log.sent(), session.controller.take_servo_trace());
    let begin = sent.first().map_or(streamed.begun, |sent| sent.at);
    let grid = grid(&sent, begin);
    let arrivals = Arrivals::of(&sent, &trace);
    let late = |at: Instant, place: &f64| (at - begin).as_secs_f64() - place;
    let sent_late: Vec<f64> = sent
        .iter()
        .zip(&grid)
        .map(|(sent, place)| late(sent.at, place))
        .collect();
    let received = arrivals.received_at.iter().zip(&grid);
    let received_late: Vec<f64> = received.filter_map(|(at, place)| Some(late((*at)?, place))).collect();
    let timing = session.remote.timing();
    let micros = |duration: Duration| 1e6 * duration.as_secs_f64();
    let (realtime_scheduling, realtime_memory) = permissions(session.servo.realtime());
    ServoFigures {
        servo_seconds: streamed.seconds,
        servo_p50_us: micros(timing.median),
        servo_p99_us: micros(timing.p99),
        servo_max_us: micros(timing.latest),
        servo_late_periods: timing.missed,
        sent_late_us: Micros::of(&sent_late),
        received_late_us: Micros::of(&received_late),
        setpoints_sent: sent.len(),
        setpoints_received: trace.len(),
        setpoints_lost: arrivals.lost(),
        setpoints_unknown: arrivals.unknown,
        setpoints_refused: trace.iter().filter(|point| !point.taken).count(),
        motions: streamed.motions,
        motions_stopped: streamed.stopped,
        end_error: streamed.end_error,
        realtime_scheduling,
        realtime_memory,
    }
}

fn permissions(realtime: &RealTime) -> (String, String) {
    let scheduling = match &realtime.scheduling {
        Ok(priority) => format!("SCHED_FIFO {priority}"),
        Err(reason) => format!("ordinary thread: {reason}"),
    };
    let memory = match &realtime.memory {
        Ok(()) => "locked".to_owned(),
        Err(reason) => format!("not locked: {reason}"),
    };
    (scheduling, memory)
}
