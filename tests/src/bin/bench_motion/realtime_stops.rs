//! Stops in real time: from the request to the first set-point that decelerates, as the controller reads it.

use std::time::{Duration, Instant};

use anyhow::{Context, ensure};
use devices::JointValues;
use fastrand::Rng;
use serde::Serialize;
use trajectory::Trajectory;
use trajectory_executor::servo::{PERIOD, ServoEvent, StopCause};

use crate::arm::{Arm, HOME, TOOL_SPEEDS};
use crate::lateness::{Arrivals, Micros};
use crate::recorder::Sent;
use crate::session::Session;

/// Between these the arm goes to and fro.
const PLACES: [JointValues; 2] = [
    [0.8, -0.2, 0.1, 0.9, 0.1, 1.2, 0.6],
    [-0.8, -0.3, -0.1, 0.8, 0.0, 1.0, -0.4],
];
/// A set-point nearer to the trajectory than this is on it, radians. The first one of a stop is 1e-6 away.
const SAME: f64 = 1e-8;
/// Of a stop, set-points.
const ROOM: usize = 4000;

#[derive(Debug, Serialize)]
pub(crate) struct LiveStops {
    #[serde(rename = "realtime_stops")]
    pub(crate) count: usize,
    /// From the request until the controller has read the first set-point that decelerates.
    #[serde(rename = "realtime_stop_us")]
    pub(crate) delay: Micros,
    /// Set-points of the trajectory that left after the request: one is already under way when the request comes in the
    /// microseconds in which the loop has looked for requests and has not sent yet.
    #[serde(rename = "realtime_stop_set_points_between")]
    pub(crate) between: usize,
    /// From the request to rest.
    #[serde(rename = "realtime_stop_rest_ms")]
    pub(crate) rest_ms: Option<f64>,
}

struct Request {
    trajectory: Trajectory<7>,
    at: Instant,
    rested_at: Instant,
}

pub(crate) async fn measure(arm: &Arm, count: u32, priority: u8) -> anyhow::Result<LiveStops> {
    let mut session = Session::open(arm, ROOM * count as usize, priority).await?;
    let mut random = Rng::with_seed(7);
    let mut requests = Vec::new();
    for number in 0..count {
        let planner = arm.planner(TOOL_SPEEDS[number as usize % 2])?;
        requests.push(stop_once(&mut session, &planner, &mut random, number).await?);
    }
    session.finish().await?;
    let (sent, trace) = (session.log.sent(), session.controller.take_servo_trace());
    let arrivals = Arrivals::of(&sent, &trace);
    let (mut delays, mut between) = (Vec::new(), 0);
    for request in &requests {
        let (first, left) = first_of_stop(&sent, request)?;
        let received = arrivals.received_at[first].context("the first set-point of a stop was lost")?;
        delays.push((received - request.at).as_secs_f64());
        between = between.max(left);
    }
    session.close().await;
    let rests = requests
        .iter()
        .map(|request| (request.rested_at - request.at).as_secs_f64());
    let rest = rests.reduce(f64::max);
    Ok(LiveStops {
        count: requests.len(),
        delay: Micros::of(&delays),
        between,
        rest_ms: rest.map(|seconds| 1e3 * seconds),
    })
}

/// On the way to the other place, somewhere between a tenth and nine tenths of the time.
async fn stop_once(
    session: &mut Session,
    planner: &trajectory::Planner<7>,
    random: &mut Rng,
    number: u32,
) -> anyhow::Result<Request> {
    let from = if number == 0 { HOME } else { session.commanded()? };
    let trajectory = planner.joint_motion(&from, &PLACES[number as usize % 2])?;
    let wait = trajectory.duration() * (0.1 + 0.8 * random.f64());
    session.begin(trajectory.clone())?;
    let mut left = Duration::from_secs_f64(wait);
    while !left.is_zero() {
        let nap = left.min(Duration::from_millis(100));
        tokio::time::sleep(nap).await;
        session.remote.permit_until(Instant::now() + Duration::from_secs(1));
        left -= nap;
    }
    let at = Instant::now();
    session.remote.stop();
    let event = session.event().await?;
    let is_stopped = matches!(
        event,
        ServoEvent::Stopped {
            cause: StopCause::Requested,
            ..
        }
    );
    ensure!(is_stopped, "{event:?}, not a stop by request");
    Ok(Request {
        trajectory,
        at,
        rested_at: Instant::now(),
    })
}

/// The first set-point after the request that is off the trajectory, and how many on it left before.
fn first_of_stop(sent: &[Sent], request: &Request) -> anyhow::Result<(usize, usize)> {
    let period = PERIOD.as_secs_f64();
    let last = sent.partition_point(|sent| sent.at <= request.at).checked_sub(1);
    let last = last.context("nothing was sent before the request")?;
    let off = |index: usize, step: usize| {
        let on_it = request.trajectory.sample(step as f64 * period);
        let errors = on_it
            .iter()
            .zip(&sent[index].angles)
            .map(|(state, angle)| (state.position - angle).abs());
        errors.fold(0.0, f64::max)
    };
    let steps = 0..=(request.trajectory.duration() / period).ceil() as usize;
    let step = steps
        .min_by(|one, other| off(last, *one).total_cmp(&off(last, *other)))
        .context("a trajectory has steps")?;
    ensure!(
        off(last, step) < SAME,
        "the set-point before the request is not on the trajectory"
    );
    let left = (last + 1..sent.len()).take_while(|index| off(*index, step + index - last) < SAME);
    let left = left.count();
    ensure!(
        last + 1 + left < sent.len(),
        "no set-point left the trajectory after the request"
    );
    Ok((last + 1 + left, left))
}
