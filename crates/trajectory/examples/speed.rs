//! How long planning and streaming take for the xArm7, and how often random motions, blends, lines and
//! stops break a limit.
//!
//! `cargo run --release -p trajectory --example speed -- [CASES]`; the last line is one JSON object.

use std::hint::black_box;
use std::time::Instant;

use fastrand::Rng;
use geometry::RigidTransform;
use kinematics::Chain;
use nalgebra::{SVector, Vector3};
use trajectory::{Planner, SetPointGuard, State, Stop, Trajectory, TrajectoryLimits};

const N: usize = 7;
const HOME: [f64; N] = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];
const PERIOD: f64 = 0.004;
/// Of the samples at which limits are looked at, seconds.
const STEP: f64 = 5e-4;

/// What was found about limits.
#[derive(Default)]
struct Found {
    samples: usize,
    /// Of samples that break a limit; of stops, a limit of a joint.
    violations: usize,
    /// Stops whose tool is faster than its limit: joints brake each by itself.
    fast_stops: usize,
    /// Largest share of the limit.
    fastest_stop: f64,
}

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let cases: usize = std::env::args().nth(1).map_or(Ok(2000), |count| count.parse())?;
    let robot = urdf_rs::read_file(concat!(env!("CARGO_MANIFEST_DIR"), "/../../urdf/xarm7.urdf"))?;
    let arm: Chain<N> = Chain::from_urdf(&robot, "link_base", "link_tcp")?;
    let planner = |tool_speed: f64| {
        let limits = TrajectoryLimits::of_chain(&arm, 20.0, 400.0, tool_speed)?;
        Planner::new(arm.clone(), limits)
    };
    let (slow, fast) = (planner(0.25)?, planner(1.0)?);
    let motion = median(cases, &mut Rng::with_seed(1), |random| joint_motion(&slow, random))?;
    let blend = median(cases / 4, &mut Rng::with_seed(2), |random| blend(&fast, random))?;
    let line = median(cases / 4, &mut Rng::with_seed(3), |random| line(&slow, random))?;
    let (guard, sample) = streaming(&fast)?;
    println!(
        "joint motion {motion:.1} us, blend of 5 waypoints {blend:.0} us, line of 200 mm {line:.0} us, guard {guard:.2} us, sample {sample:.3} us"
    );
    let mut found = Found::default();
    for planner in [&slow, &fast] {
        look_for_violations(planner, cases, &mut found)?;
    }
    println!(
        "{} violations in {} samples of motions, blends, lines and the stops from them; in {} of {} stops the tool is faster than allowed, by {:.1} % at most",
        found.violations,
        found.samples,
        found.fast_stops,
        2 * cases,
        100.0 * (found.fastest_stop - 1.0).max(0.0)
    );
    println!(
        "{}",
        serde_json::json!({
            "joint_motion_us": motion,
            "blend_us": blend,
            "line_us": line,
            "guard_us": guard,
            "sample_us": sample,
            "samples": found.samples,
            "violations": found.violations,
            "fast_stops": found.fast_stops,
            "fastest_stop": found.fastest_stop,
        })
    );
    Ok(())
}

/// Of the microseconds that a random case takes; cases that return none do not count.
fn median(
    cases: usize,
    random: &mut Rng,
    mut case: impl FnMut(&mut Rng) -> Result<Option<f64>, Failure>,
) -> Result<f64, Failure> {
    let mut times = Vec::with_capacity(cases);
    for _ in 0..cases {
        times.extend(case(random)?);
    }
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().ok_or_else(|| "no cases".into())
}

fn timed<T, E>(work: impl FnOnce() -> Result<T, E>) -> Result<f64, E> {
    let started = Instant::now();
    black_box(work()?);
    Ok(1e6 * started.elapsed().as_secs_f64())
}

/// Within half a turn of 0.
fn place(planner: &Planner<N>, random: &mut Rng) -> [f64; N] {
    planner.limits().joints.map(|joint| {
        let (lower, upper) = (joint.lower.max(-3.1), joint.upper.min(3.1));
        lower + random.f64() * (upper - lower)
    })
}

fn joint_motion(planner: &Planner<N>, random: &mut Rng) -> Result<Option<f64>, Failure> {
    let (from, to) = (place(planner, random), place(planner, random));
    Ok(Some(timed(|| planner.joint_motion(&from, &to))?))
}

fn blend(planner: &Planner<N>, random: &mut Rng) -> Result<Option<f64>, Failure> {
    let waypoints: [[f64; N]; 5] = std::array::from_fn(|_| place(planner, random));
    Ok(Some(timed(|| planner.through(&waypoints, 0.1))?))
}

/// Lines that the arm cannot follow do not count.
fn line(planner: &Planner<N>, random: &mut Rng) -> Result<Option<f64>, Failure> {
    let (from, to) = line_ends(planner, random)?;
    Ok(timed(|| planner.line(&from, &to)).ok())
}

fn random_line(planner: &Planner<N>, random: &mut Rng) -> Result<Trajectory<N>, Failure> {
    let (from, to) = line_ends(planner, random)?;
    Ok(planner.line(&from, &to)?.trajectory)
}

/// 200 mm in a random direction, starting near home.
fn line_ends(planner: &Planner<N>, random: &mut Rng) -> Result<([f64; N], RigidTransform), Failure> {
    let from = HOME.map(|angle| angle + 0.4 * (random.f64() - 0.5));
    let start = planner.chain().forward(&SVector::from(from))?;
    let mut number = || random.f64() - 0.5;
    let way = 0.2 * Vector3::new(number(), number(), number()).normalize();
    Ok((
        from,
        RigidTransform::from_parts(start.translation() + way, start.rotation()),
    ))
}

/// Median microseconds of the guard and of a sample.
fn streaming(planner: &Planner<N>) -> Result<(f64, f64), Failure> {
    let mut far = HOME;
    far[0] = 2.0;
    let path = planner
        .joint_motion(&HOME, &far)?
        .then(planner.joint_motion(&far, &HOME)?)?;
    let mut guard = SetPointGuard::new(planner.chain().clone(), *planner.limits(), PERIOD, 2e-4, &HOME)?;
    let (mut guarding, mut sampling) = (Vec::new(), Vec::new());
    for _ in 0..20 {
        for step in 0..=(path.duration() / PERIOD) as usize + 4 {
            let time = step as f64 * PERIOD;
            let wanted = path.sample(time).map(|state| state.position);
            guarding.push(timed(|| guard.pass(&wanted))?);
            let started = Instant::now();
            for shift in 0..100 {
                black_box(path.sample(black_box(time + f64::from(shift) * 1e-5)));
            }
            sampling.push(1e4 * started.elapsed().as_secs_f64());
        }
    }
    guarding.sort_by(f64::total_cmp);
    sampling.sort_by(f64::total_cmp);
    Ok((guarding[guarding.len() / 2], sampling[sampling.len() / 2]))
}

fn look_for_violations(planner: &Planner<N>, cases: usize, found: &mut Found) -> Result<(), Failure> {
    let mut random = Rng::with_seed(4);
    for case in 0..cases {
        let (from, to) = (place(planner, &mut random), place(planner, &mut random));
        let path = match case % 10 {
            0..8 => planner.joint_motion(&from, &to)?,
            8 => planner.through(&[from, to, place(planner, &mut random)], 0.1)?,
            _ => random_line(planner, &mut random).map_or_else(|_| Trajectory::hold(&from, 0.0), Ok)?,
        };
        for step in 0..=(path.duration() / STEP) as usize + 1 {
            found.samples += 1;
            found.violations += usize::from(breaks(planner, &path, step as f64 * STEP)?);
        }
        let stop = Stop::from(&path.sample(random.f64() * path.duration()), &planner.limits().joints)?;
        let mut fastest = 0.0_f64;
        for step in 0..=(stop.duration() / STEP) as usize + 1 {
            found.samples += 1;
            let states = stop.sample(step as f64 * STEP);
            found.violations += usize::from(breaks_joints(planner, &states));
            fastest = fastest.max(tool_speed(planner, &states)? / planner.limits().tool_speed);
        }
        found.fast_stops += usize::from(fastest > 1.0 + 1e-9);
        found.fastest_stop = found.fastest_stop.max(fastest);
    }
    Ok(())
}

fn tool_speed(planner: &Planner<N>, states: &[State; N]) -> Result<f64, Failure> {
    let angles = SVector::from(states.map(|state| state.position));
    let (_, jacobian) = planner.chain().jacobian(&angles)?;
    let twist = jacobian * SVector::from(states.map(|state| state.velocity));
    Ok(twist.fixed_rows::<3>(0).norm())
}

fn breaks(planner: &Planner<N>, motion: &Trajectory<N>, time: f64) -> Result<bool, Failure> {
    let now = planner.snapshot(motion, time)?;
    let jerks = now.jerk.iter().zip(&planner.limits().joints);
    let is_rough = jerks
        .into_iter()
        .any(|(jerk, limits)| jerk.abs() > limits.jerk * (1.0 + 1e-9));
    let is_fast = now.tool_speed > planner.limits().tool_speed * (1.0 + 1e-9);
    Ok(is_rough || is_fast || breaks_joints(planner, &now.states))
}

fn breaks_joints(planner: &Planner<N>, states: &[State; N]) -> bool {
    states.iter().zip(&planner.limits().joints).any(|(state, limits)| {
        let slack = 1e-9;
        state.position < limits.lower - slack
            || state.position > limits.upper + slack
            || state.velocity.abs() > limits.velocity * (1.0 + slack)
            || state.acceleration.abs() > limits.acceleration * (1.0 + slack)
    })
}
