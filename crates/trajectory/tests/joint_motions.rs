//! Joint motions of the xArm7 keep all limits, the tool's as well, whether they stop at waypoints or not.

mod support;

use fastrand::Rng;
use support::{HOME, N, STEP, assert_ends, assert_limits, planner, random_angles};
use trajectory::{Segment, State, Trajectory, TrajectoryError};

#[test]
fn random_motions_keep_all_limits() {
    let mut random = Rng::with_seed(11);
    for case in 0..600 {
        let planner = planner([0.25, 1.0][case % 2]);
        let (from, to) = (
            random_angles(&mut random, &planner),
            random_angles(&mut random, &planner),
        );
        let motion = planner.joint_motion(&from, &to).unwrap();
        planner.check(&motion).unwrap();
        assert_ends(&motion, &from, &to);
        assert_limits(&planner, &motion, if case % 10 == 0 { STEP } else { 8.0 * STEP });
    }
}

#[test]
fn the_bound_of_the_tools_speed_is_tight_and_holds() {
    let mut random = Rng::with_seed(12);
    let planner = planner(1.0);
    for _ in 0..100 {
        let (from, to) = (
            random_angles(&mut random, &planner),
            random_angles(&mut random, &planner),
        );
        let motion = planner.joint_motion(&from, &to).unwrap();
        let found = planner.tool_speed(&motion).unwrap();
        let seen = (0..4000).map(|index| {
            let time = motion.duration() * f64::from(index) / 4000.0;
            planner.snapshot(&motion, time).unwrap().tool_speed
        });
        let seen = seen.fold(0.0, f64::max);
        assert!(seen <= found.bound, "seen {seen}, bound {found:?}");
        assert!(seen >= 0.997 * found.bound, "seen {seen}, bound {found:?}");
        let there = planner.snapshot(&motion, found.time).unwrap().tool_speed;
        assert!((there - found.reached).abs() < 1e-9);
    }
}

#[test]
fn motions_use_one_of_their_limits_up() {
    let mut random = Rng::with_seed(13);
    for tool_speed in [0.25, 1.0] {
        let planner = planner(tool_speed);
        for _ in 0..200 {
            let (from, to) = (
                random_angles(&mut random, &planner),
                random_angles(&mut random, &planner),
            );
            let motion = planner.joint_motion(&from, &to).unwrap();
            let faster = motion.slowed(0.997).unwrap();
            assert!(planner.check(&faster).is_err(), "{from:?} to {to:?}");
            let again = planner.retimed(&motion).unwrap();
            assert!((again.duration() / motion.duration() - 1.0).abs() < 3e-3);
        }
    }
}

#[test]
fn blends_keep_all_limits_and_are_quicker_than_stops() {
    let mut random = Rng::with_seed(14);
    let (mut blended, mut stopping) = (0.0, 0.0);
    for case in 0..60 {
        let planner = planner([0.25, 1.0][case % 2]);
        let count = 2 + case % 5;
        let waypoints: Vec<[f64; N]> = (0..count).map(|_| random_angles(&mut random, &planner)).collect();
        let path = planner.through(&waypoints, 0.1).unwrap();
        planner.check(&path).unwrap();
        path.require_rest().unwrap();
        assert_ends(&path, &waypoints[0], &waypoints[count - 1]);
        assert_limits(&planner, &path, if case % 10 == 0 { STEP } else { 8.0 * STEP });
        let stops = planner.through(&waypoints, 0.0).unwrap();
        assert!(path.duration() <= stops.duration() * (1.0 + 1e-9));
        blended += path.duration();
        stopping += stops.duration();
    }
    assert!(blended < 0.9 * stopping, "{blended} s, with stops {stopping} s");
}

/// Distance of a place from the straight way between two others.
fn distance(place: &[f64; N], from: &[f64; N], to: &[f64; N]) -> f64 {
    let dot = |a: &[f64; N], b: &[f64; N]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let minus = |a: &[f64; N], b: &[f64; N]| -> [f64; N] { std::array::from_fn(|joint| a[joint] - b[joint]) };
    let (way, off) = (minus(to, from), minus(place, from));
    let share = (dot(&way, &off) / dot(&way, &way)).clamp(0.0, 1.0);
    let nearest: [f64; N] = std::array::from_fn(|joint| off[joint] - share * way[joint]);
    dot(&nearest, &nearest).sqrt()
}

#[test]
fn blends_stay_within_their_tolerance_and_do_not_stop() {
    let mut random = Rng::with_seed(15);
    let planner = planner(1.0);
    for tolerance in [0.02, 0.1, 0.5] {
        for _ in 0..20 {
            let waypoints: [[f64; N]; 4] = std::array::from_fn(|_| random_angles(&mut random, &planner));
            let path = planner.through(&waypoints, tolerance).unwrap();
            let samples = (0..=2000).map(|index| path.sample(path.duration() * f64::from(index) / 2000.0));
            let samples: Vec<_> = samples.collect();
            for states in &samples {
                let place = states.map(|state| state.position);
                let off = waypoints.windows(2).map(|pair| distance(&place, &pair[0], &pair[1]));
                assert!(off.fold(f64::INFINITY, f64::min) <= tolerance * (1.0 + 1e-9));
            }
            for waypoint in &waypoints {
                let places = samples.iter().map(|states| states.map(|state| state.position));
                let away = places.map(|place| distance(&place, waypoint, &waypoint.map(|angle| angle + 1e-9)));
                // Samples are a little apart.
                assert!(away.fold(f64::INFINITY, f64::min) <= tolerance + 5e-3);
            }
            let inside = &samples[100..1900];
            let speed = |states: &[State; N]| states.iter().map(|state| state.velocity.abs()).fold(0.0, f64::max);
            assert!(inside.iter().map(speed).fold(f64::INFINITY, f64::min) > 1e-3);
        }
    }
}

#[test]
fn waypoints_that_repeat_or_stand_alone_are_held() {
    let planner = planner(1.0);
    let alone = planner.through(&[HOME], 0.1).unwrap();
    assert!(alone.duration() <= 1e-3);
    assert_ends(&alone, &HOME, &HOME);
    assert_eq!(planner.through(&[HOME, HOME, HOME], 0.1).unwrap(), alone);
    assert_eq!(planner.joint_motion(&HOME, &HOME).unwrap(), alone);
    let mut up = HOME;
    up[1] = -0.8;
    let twice = planner.through(&[HOME, up, up], 0.1).unwrap();
    assert_eq!(twice, planner.through(&[HOME, up], 0.1).unwrap());
    assert_ends(&twice, &HOME, &up);
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let planner = planner(1.0);
    let message = |found: Result<Trajectory<N>, TrajectoryError>| found.unwrap_err().to_string();
    assert_eq!(
        message(planner.through(&[], 0.1)),
        "there are no waypoints, expected at least one"
    );
    assert_eq!(
        message(planner.through(&[HOME], f64::NAN)),
        "the blend tolerance is NaN, allowed: finite and not negative"
    );
    let mut odd = HOME;
    odd[3] = f64::NAN;
    assert_eq!(
        message(planner.through(&[odd], 0.1)),
        "joint 4: start is NaN, expected a finite number"
    );
    odd[3] = -0.5;
    assert_eq!(
        message(planner.joint_motion(&odd, &HOME)),
        "joint 4: start reaches -0.500000, allowed are -0.191986 to 3.926990"
    );
    let limits = trajectory::TrajectoryLimits {
        tool_speed: 0.0,
        ..*planner.limits()
    };
    let error = trajectory::Planner::new(support::arm(), limits).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the tool speed limit is 0, allowed: finite and more than 0 m/s"
    );
}

#[test]
fn parts_that_do_not_meet_are_refused() {
    let planner = planner(1.0);
    let mut up = HOME;
    up[1] = -0.8;
    let (there, back) = (
        planner.joint_motion(&HOME, &up).unwrap(),
        planner.joint_motion(&up, &HOME).unwrap(),
    );
    let both = there.clone().then(back.clone()).unwrap();
    assert!((both.duration() - there.duration() - back.duration()).abs() < 1e-12);
    assert_ends(&both, &HOME, &HOME);
    let wait = Trajectory::hold(&up, 0.5).unwrap();
    let waiting = Trajectory::concatenate([there.clone(), wait, back]).unwrap();
    assert!((waiting.duration() - both.duration() - 0.5).abs() < 1e-12);
    planner.check(&waiting).unwrap();
    let error = there.clone().then(there).unwrap_err();
    assert!(
        matches!(
            error,
            TrajectoryError::Jump {
                joint: 2,
                what: "position",
                ..
            }
        ),
        "{error}"
    );
    let moving = State {
        velocity: 1.0,
        ..State::at(0.0)
    };
    let flying = Trajectory::from(Segment::between(&[State::at(0.0)], &[moving], 1.0).unwrap());
    let error = flying.require_rest().unwrap_err();
    assert_eq!(error.to_string(), "joint 1: speed is 1.000000 at the end, expected 0");
    assert!(Segment::between(&[moving], &[moving], 0.0).is_err());
    assert!(Trajectory::hold(&[f64::NAN], 1.0).is_err() && Trajectory::hold(&[0.0], f64::NAN).is_err());
    assert!(Trajectory::<1>::new(Vec::new()).is_err());
}

#[test]
fn a_tool_that_is_too_fast_is_named() {
    let (fast, slow) = (planner(1.0), planner(0.25));
    let mut far = HOME;
    far[0] = 2.0;
    let motion = fast.joint_motion(&HOME, &far).unwrap();
    let error = slow.check(&motion).unwrap_err();
    assert!(
        matches!(error, TrajectoryError::ToolSpeed { most: 0.25, .. }),
        "{error}"
    );
    let middle = fast.snapshot(&motion, motion.duration() / 2.0).unwrap();
    assert!((0.99..=1.0).contains(&middle.tool_speed), "{middle:?}");
    assert!(middle.jerk[0] < 0.0 && middle.states[0].acceleration.abs() < 1e-9);
}
