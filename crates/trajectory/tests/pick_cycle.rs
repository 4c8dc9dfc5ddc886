//! A whole cycle: past a waypoint to above the object, down, up, and back, streamed through the guard and stopped anywhere.

mod support;

use fastrand::Rng;
use geometry::RigidTransform;
use kinematics::Chain;
use nalgebra::{SVector, Vector3};
use support::{HOME, N, STEP, arm, assert_ends, assert_limits, planner};
use trajectory::{Planner, SetPointGuard, Stop, Trajectory};

const PERIOD: f64 = 0.004;
const PREGRASP: [f64; N] = [0.9, -0.1, 0.0, 0.9, 0.0, 1.0, 0.9];

fn pose(chain: &Chain<N>, angles: &[f64; N]) -> RigidTransform {
    chain.forward(&SVector::from(*angles)).unwrap()
}

fn cycle(planner: &Planner<N>) -> Trajectory<N> {
    let mut on_the_way = HOME;
    (on_the_way[0], on_the_way[1]) = (0.5, -0.5);
    let approach = planner.through(&[HOME, on_the_way, PREGRASP], 0.1).unwrap();
    let above = pose(planner.chain(), &PREGRASP);
    let below = RigidTransform::from_parts(above.translation() - Vector3::z() * 0.12, above.rotation());
    let down = planner.line(&PREGRASP, &below).unwrap().trajectory;
    let grasp = down.end().map(|state| state.position);
    let aside = RigidTransform::from_parts(above.translation() + Vector3::y() * 0.05, above.rotation());
    let up = planner.lines(&grasp, &[above, aside], 0.02).unwrap().trajectory;
    let lifted = up.end().map(|state| state.position);
    let hold = Trajectory::hold(&grasp, 0.3).unwrap();
    let back = planner.through(&[lifted, on_the_way, HOME], 0.1).unwrap();
    Trajectory::concatenate([approach, down, hold, up, back]).unwrap()
}

#[test]
fn a_cycle_keeps_all_limits() {
    for tool_speed in [0.25, 1.0] {
        let planner = planner(tool_speed);
        let cycle = cycle(&planner);
        planner.check(&cycle).unwrap();
        assert_ends(&cycle, &HOME, &HOME);
        assert_limits(&planner, &cycle, STEP);
    }
}

#[test]
fn a_cycle_can_be_stopped_at_any_set_point() {
    let mut random = Rng::with_seed(41);
    for tool_speed in [0.25, 1.0] {
        let planner = planner(tool_speed);
        let limits = planner.limits();
        let cycle = cycle(&planner);
        let mut guard = SetPointGuard::new(arm(), *limits, PERIOD, 2e-4, &HOME).unwrap();
        for step in 1..=(cycle.duration() / PERIOD) as usize {
            let states = cycle.sample(step as f64 * PERIOD);
            let wanted = states.map(|state| state.position);
            assert_eq!(guard.pass(&wanted), Ok(wanted));
            if random.u8(..) > 64 {
                continue;
            }
            let stop = Stop::from(&states, &limits.joints).unwrap();
            assert!(stop.overshoot(&limits.joints).is_none());
            let mut stopping = guard.clone();
            let mut before = wanted;
            for period in 1..=(stop.duration() / PERIOD) as usize + 3 {
                let now = stop.sample(period as f64 * PERIOD);
                let set_point = now.map(|state| state.position);
                let passed = stopping.pass_stop(&set_point).unwrap();
                for joint in 0..N {
                    assert!((passed[joint] - set_point[joint]).abs() < 1e-9);
                    assert!(
                        (passed[joint] - before[joint]).abs() <= limits.joints[joint].velocity * PERIOD * (1.0 + 1e-9)
                    );
                }
                before = passed;
            }
            for (joint, (now, state)) in stop.sample(PERIOD).iter().zip(&states).enumerate() {
                let way = state.velocity.signum();
                // Less speed than the trajectory's acceleration would have led to, unless the joint is nearly at rest.
                let unbraked = way * (state.velocity + state.acceleration * PERIOD);
                let nearly = limits.joints[joint].jerk * PERIOD * PERIOD;
                let is_braking = way * state.acceleration < 0.0;
                assert!(is_braking || state.velocity.abs() < nearly || way * now.velocity < unbraked);
            }
        }
    }
}
