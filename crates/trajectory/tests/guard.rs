//! The guard lets good trajectories and stops pass as they are, puts small faults right and refuses gross ones.

mod support;

use fastrand::Rng;
use support::{HOME, N, arm, assert_limits, planner, random_angles};
use trajectory::{GuardFault, JointLimits, Planner, SetPointGuard, State, Stop, Trajectory};

const PERIOD: f64 = 0.004;
const CORRECTION: f64 = 2e-4;

fn guard(planner: &Planner<N>, start: &[f64; N]) -> SetPointGuard<N> {
    SetPointGuard::new(arm(), *planner.limits(), PERIOD, CORRECTION, start).unwrap()
}

fn positions(states: &[State; N]) -> [f64; N] {
    states.map(|state| state.position)
}

/// Limits with a share of the jerk.
fn softer(planner: &Planner<N>, share: f64) -> [JointLimits; N] {
    planner.limits().joints.map(|limits| JointLimits {
        jerk: share * limits.jerk,
        ..limits
    })
}

fn random_trajectory(random: &mut Rng, planner: &Planner<N>, case: usize) -> Trajectory<N> {
    let waypoints: Vec<[f64; N]> = (0..2 + case % 3).map(|_| random_angles(random, planner)).collect();
    planner.through(&waypoints, 0.1).unwrap()
}

#[test]
fn good_trajectories_pass_unchanged() {
    let mut random = Rng::with_seed(21);
    for case in 0..60 {
        let planner = planner([0.25, 1.0][case % 2]);
        let path = random_trajectory(&mut random, &planner, case);
        let mut guard = guard(&planner, &positions(&path.start()));
        for step in 1..=(path.duration() / PERIOD) as usize + 4 {
            let states = path.sample(step as f64 * PERIOD);
            let wanted = positions(&states);
            assert_eq!(guard.pass(&wanted), Ok(wanted), "step {step} of case {case}");
            for (estimate, state) in guard.states().iter().zip(&states) {
                assert!(
                    (estimate.velocity - state.velocity).abs() < 2e-3,
                    "{estimate:?} {state:?}"
                );
            }
        }
    }
}

#[test]
fn stops_from_anywhere_pass_and_decelerate_at_once() {
    let mut random = Rng::with_seed(22);
    for case in 0..400 {
        let planner = planner([0.25, 1.0][case % 2]);
        let path = random_trajectory(&mut random, &planner, case);
        let mut guard = guard(&planner, &positions(&path.start()));
        let asked_at = (random.f64() * path.duration() / PERIOD) as usize;
        for step in 1..=asked_at {
            guard.pass(&positions(&path.sample(step as f64 * PERIOD))).unwrap();
        }
        let states = path.sample(asked_at as f64 * PERIOD);
        let limits = softer(&planner, 1.0);
        let stop = Stop::from(&states, &limits).unwrap();
        let first = stop.sample(PERIOD);
        for ((now, before), limits) in first.iter().zip(&states).zip(&limits) {
            let way = before.velocity.signum();
            let rate = way * (now.acceleration - before.acceleration) / PERIOD;
            // Full jerk against the motion unless it is over within the period.
            let is_over = before.velocity.abs() + before.acceleration.powi(2) / (2.0 * limits.jerk)
                < limits.jerk * PERIOD * PERIOD;
            let is_ending = way * before.acceleration < 0.0;
            assert!(
                is_over || is_ending || (rate + limits.jerk).abs() < 1e-3 * limits.jerk,
                "{before:?} {now:?}"
            );
        }
        assert!(stop.overshoot(&limits).is_none());
        for step in 1..=(stop.duration() / PERIOD) as usize + 3 {
            let wanted = positions(&stop.sample(step as f64 * PERIOD));
            let passed = guard.pass_stop(&wanted).unwrap();
            assert!(passed.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-9));
        }
    }
}

#[test]
fn small_faults_are_put_right_within_the_limits() {
    let mut random = Rng::with_seed(23);
    let planner = planner(1.0);
    let mut at_limit = 0;
    for case in 0..20 {
        let path = random_trajectory(&mut random, &planner, case);
        let mut guard = guard(&planner, &positions(&path.start()));
        let mut passed_before = [positions(&path.start()); 3];
        for step in 1..=(path.duration() / PERIOD) as usize {
            let wanted = positions(&path.sample(step as f64 * PERIOD)).map(|angle| angle + 8e-6 * (random.f64() - 0.5));
            let passed = guard.pass(&wanted).unwrap();
            for (joint, limits) in planner.limits().joints.iter().enumerate() {
                let [c, b, a] = passed_before.map(|positions| positions[joint]);
                let third = (passed[joint] - 3.0 * a + 3.0 * b - c) / PERIOD.powi(3);
                assert!(third.abs() <= limits.jerk * (1.0 + 1e-6) + 1e-3, "{third}");
                at_limit += usize::from(third.abs() > 0.999_999 * limits.jerk);
                let second = (passed[joint] - 2.0 * a + b) / PERIOD.powi(2);
                assert!(second.abs() <= limits.acceleration * (1.0 + 1e-6) + 1e-6, "{second}");
                assert!((passed[joint] - a).abs() <= limits.velocity * PERIOD * (1.0 + 1e-6));
                assert!((passed[joint] - wanted[joint]).abs() <= CORRECTION * 1.001);
            }
            passed_before = [passed_before[1], passed_before[2], passed];
        }
    }
    assert!(at_limit > 500, "{at_limit}");
}

#[test]
fn gross_faults_are_refused_by_name_and_leave_the_guard_as_it_was() {
    let planner = planner(1.0);
    let mut guard = guard(&planner, &HOME);
    let with = |joint: usize, value: f64| {
        let mut wanted = HOME;
        wanted[joint - 1] = value;
        wanted
    };
    let fault = guard.pass(&with(3, f64::NAN)).unwrap_err();
    assert!(matches!(fault, GuardFault::NotFinite { joint: 3, .. }), "{fault}");
    let fault = guard.pass(&with(4, -0.2)).unwrap_err();
    assert!(matches!(fault, GuardFault::Position { joint: 4, .. }), "{fault}");
    let fault = guard.pass(&with(2, -0.3)).unwrap_err();
    assert_eq!(
        fault.to_string(),
        "joint 2: the set-point asks for speed 25.0000, allowed are 3.1416; it is off by 0.099974 rad"
    );
    let fault = guard.pass(&with(7, 0.004)).unwrap_err();
    assert!(
        matches!(
            fault,
            GuardFault::Rate {
                joint: 7,
                what: "acceleration",
                ..
            }
        ),
        "{fault}"
    );
    assert_eq!(guard.states(), HOME.map(State::at));
    assert_eq!(guard.pass(&HOME), Ok(HOME));
}

#[test]
fn a_tool_that_is_too_fast_is_refused() {
    let (fast, slow) = (planner(1.0), planner(0.25));
    let mut far = HOME;
    far[0] = 2.0;
    let path = fast.joint_motion(&HOME, &far).unwrap();
    let mut guard = guard(&slow, &HOME);
    let fault = (1..400).find_map(|step| guard.pass(&positions(&path.sample(f64::from(step) * PERIOD))).err());
    assert!(
        matches!(fault, Some(GuardFault::ToolSpeed { allowed: 0.25, .. })),
        "{fault:?}"
    );
}

#[test]
fn after_a_fault_the_arm_stops_from_where_the_guard_says() {
    let mut random = Rng::with_seed(24);
    let planner = planner(1.0);
    let stop_limits = softer(&planner, 0.8);
    for case in 0..200 {
        let path = random_trajectory(&mut random, &planner, case);
        let mut guard = guard(&planner, &positions(&path.start()));
        let asked_at = (random.f64() * path.duration() / PERIOD) as usize;
        for step in 1..=asked_at {
            guard.pass(&positions(&path.sample(step as f64 * PERIOD))).unwrap();
        }
        let stop = Stop::from(&guard.states(), &stop_limits).unwrap();
        for step in 1..=(stop.duration() / PERIOD) as usize + 3 {
            let found = guard.pass_stop(&positions(&stop.sample(step as f64 * PERIOD)));
            assert!(found.is_ok(), "{found:?} in case {case}");
        }
    }
}

#[test]
fn what_a_guard_cannot_have_is_refused() {
    let limits = *planner(1.0).limits();
    assert!(SetPointGuard::new(arm(), limits, 0.0, CORRECTION, &HOME).is_err());
    assert!(SetPointGuard::new(arm(), limits, PERIOD, f64::NAN, &HOME).is_err());
    assert!(SetPointGuard::new(arm(), limits, PERIOD, CORRECTION, &[9.0; N]).is_err());
    let slow = planner(0.25);
    assert_limits(&slow, &Trajectory::hold(&HOME, 0.1).unwrap(), PERIOD);
}

#[test]
fn nothing_allocates_in_the_servo_loop() {
    let planner = planner(1.0);
    let mut far = HOME;
    far[0] = 2.0;
    let path = planner.joint_motion(&HOME, &far).unwrap();
    let mut guard = guard(&planner, &HOME);
    let counted = allocation_counter::measure(|| {
        for step in 1..50 {
            let states = path.sample(f64::from(step) * PERIOD);
            assert!(guard.pass(&positions(&states)).is_ok());
        }
        assert!(guard.pass(&[f64::NAN; N]).is_err() && guard.pass(&far).is_err());
        let stop = Stop::from(&guard.states(), &planner.limits().joints).unwrap();
        assert!(guard.pass_stop(&positions(&stop.sample(PERIOD))).is_ok());
    });
    assert_eq!(counted.count_total, 0);
}
