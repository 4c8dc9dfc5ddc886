//! Whatever the motion, limits hold between samples as well, and it ends where it should.

use fastrand::Rng;
use proptest::prelude::*;
use trajectory::{JointLimits, Motion, Quintic, State, Stop, TrajectoryError};

const N: usize = 7;

/// An arm's joint limits, as of an xArm7 in servo mode.
const LIMITS: JointLimits = JointLimits {
    lower: -3.0,
    upper: 3.0,
    velocity: 3.0,
    acceleration: 20.0,
    jerk: 400.0,
};

fn random_limits(random: &mut Rng) -> [JointLimits; N] {
    std::array::from_fn(|_| JointLimits {
        lower: -6.0 + 5.0 * random.f64(),
        upper: 1.0 + 5.0 * random.f64(),
        velocity: 0.1 + 4.0 * random.f64(),
        acceleration: 0.5 + 30.0 * random.f64(),
        jerk: 5.0 + 1000.0 * random.f64(),
    })
}

fn random_position(random: &mut Rng, limits: &[JointLimits; N]) -> [f64; N] {
    limits.map(|limits| limits.lower + random.f64() * (limits.upper - limits.lower))
}

#[test]
fn random_motions_keep_their_limits_and_use_one_of_them_up() {
    let mut random = Rng::with_seed(1);
    for _ in 0..5000 {
        let limits = random_limits(&mut random);
        let (from, to) = (
            random_position(&mut random, &limits),
            random_position(&mut random, &limits),
        );
        let motion = Motion::rest_to_rest(&from, &to, &limits).unwrap();
        assert_eq!(motion.check(&limits), Ok(()));
        let (begin, end) = (motion.sample(0.0), motion.sample(motion.duration()));
        for joint in 0..N {
            assert!((begin[joint].position - from[joint]).abs() < 1e-9);
            assert!((end[joint].position - to[joint]).abs() < 1e-9);
            assert!(end[joint].velocity.abs() < 1e-9 && end[joint].acceleration.abs() < 1e-6);
        }
        let used = motion.joints().iter().zip(&limits).map(|(joint, limits)| {
            let found = joint.extremes();
            let shares = [
                found.velocity / limits.velocity,
                found.acceleration / limits.acceleration,
                found.jerk / limits.jerk,
            ];
            shares.into_iter().fold(0.0, f64::max)
        });
        let most = used.fold(0.0, f64::max);
        assert!((0.999_999..1.000_001).contains(&most), "{most} of a limit is used");
    }
}

#[test]
fn extremes_are_those_of_dense_samples() {
    let mut random = Rng::with_seed(2);
    let mut number = || 4.0 * random.f64() - 2.0;
    for _ in 0..300 {
        let mut state = || State {
            position: number(),
            velocity: number(),
            acceleration: 5.0 * number(),
        };
        let quintic = Quintic::between(state(), state(), 1.3);
        let found = quintic.extremes();
        let samples: Vec<State> = (0..=20_000)
            .map(|step| quintic.sample(1.3 * f64::from(step) / 20_000.0))
            .collect();
        let largest = |of: fn(&State) -> f64| samples.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
        let close = |a: f64, b: f64| (a - b).abs() < 1e-5 * (1.0 + b.abs());
        assert!(close(found.position[1], largest(|state| state.position)));
        assert!(close(found.position[0], -largest(|state| -state.position)));
        assert!(close(found.velocity, largest(|state| state.velocity.abs())));
        assert!(close(found.acceleration, largest(|state| state.acceleration.abs())));
    }
}

#[test]
fn random_stops_end_at_rest_within_acceleration_and_jerk() {
    const PERIOD: f64 = 0.004;
    let mut random = Rng::with_seed(3);
    for _ in 0..10_000 {
        let limits = random_limits(&mut random);
        let states = limits.map(|limits| State {
            position: 0.0,
            velocity: limits.velocity * (2.0 * random.f64() - 1.0),
            acceleration: limits.acceleration * (2.0 * random.f64() - 1.0),
        });
        let stop = Stop::from(&states, &limits).unwrap();
        let mut before = states;
        let steps = (stop.duration() / PERIOD).ceil() as usize + 1;
        for step in 1..=steps {
            let now = stop.sample(step as f64 * PERIOD);
            for joint in 0..N {
                let limits = &limits[joint];
                let change = (now[joint].acceleration - before[joint].acceleration).abs();
                assert!(now[joint].acceleration.abs() <= limits.acceleration * (1.0 + 1e-9));
                // After the end what rounding left is dropped.
                assert!(change <= limits.jerk * PERIOD * (1.0 + 1e-6) + 1e-6, "{change}");
            }
            before = now;
        }
        let end = stop.sample(stop.duration());
        assert!(
            end.iter()
                .all(|state| state.velocity == 0.0 && state.acceleration == 0.0)
        );
        let just_before = stop.sample(stop.duration() - 1e-9);
        assert!(
            just_before.iter().all(|state| state.velocity.abs() < 1e-6),
            "{just_before:?}"
        );
    }
}

#[test]
fn a_stop_decelerates_from_the_first_set_point_on() {
    let moving = State {
        position: 0.5,
        velocity: 1.0,
        acceleration: 3.0,
    };
    let stop = Stop::from(&[moving], &[LIMITS]).unwrap();
    let first = stop.sample(0.004)[0];
    assert!((first.acceleration - (3.0 - 400.0 * 0.004)).abs() < 1e-9, "{first:?}");
    assert_eq!(stop.overshoot(&[LIMITS]), None);
    let near_the_end = State {
        position: 2.99,
        ..moving
    };
    assert_eq!(
        Stop::from(&[near_the_end], &[LIMITS]).unwrap().overshoot(&[LIMITS]),
        Some(1)
    );
}

#[test]
fn joints_at_rest_stay_where_they_are() {
    let stop = Stop::from(&[State::at(1.0)], &[LIMITS]).unwrap();
    assert!(stop.duration() < 1e-12 && (stop.rest()[0] - 1.0).abs() < 1e-12);
    let motion = Motion::rest_to_rest(&[1.0], &[1.0], &[LIMITS]).unwrap();
    assert!(motion.duration() <= 1e-3 && (motion.sample(5e-4)[0].position - 1.0).abs() < 1e-12);
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let refused = |from: f64, to: f64, limits: JointLimits| {
        Motion::rest_to_rest(&[0.0, from], &[0.0, to], &[LIMITS, limits])
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        refused(f64::NAN, 0.0, LIMITS),
        "joint 2: start is NaN, expected a finite number"
    );
    assert_eq!(
        refused(0.0, 3.5, LIMITS),
        "joint 2: end reaches 3.500000, allowed are -3.000000 to 3.000000"
    );
    let still = JointLimits {
        velocity: 0.0,
        ..LIMITS
    };
    assert!(refused(0.0, 1.0, still).contains("the limit of velocity is 0"));
    let turned = JointLimits { upper: -4.0, ..LIMITS };
    assert!(refused(0.0, 1.0, turned).contains("the limit of position is -4"));
    let state = State {
        velocity: f64::INFINITY,
        ..State::default()
    };
    let error = Stop::from(&[state], &[LIMITS]).unwrap_err();
    assert!(
        matches!(
            error,
            TrajectoryError::NotFinite {
                joint: 1,
                what: "velocity",
                ..
            }
        ),
        "{error}"
    );
}

#[test]
fn a_motion_that_is_too_fast_is_named() {
    let motion = Motion::rest_to_rest(&[0.0], &[1.0], &[LIMITS]).unwrap();
    let slower = JointLimits {
        velocity: 0.5 * motion.joints()[0].extremes().velocity,
        ..LIMITS
    };
    let error = motion.check(&[slower]).unwrap_err();
    assert!(
        matches!(
            error,
            TrajectoryError::Outside {
                joint: 1,
                what: "speed",
                ..
            }
        ),
        "{error}"
    );
}

proptest! {
    #[test]
    fn a_quintic_meets_both_of_its_states(
        from in prop::array::uniform3(-3.0_f64..3.0), to in prop::array::uniform3(-3.0_f64..3.0), duration in 0.1_f64..5.0,
    ) {
        let state = |[position, velocity, acceleration]: [f64; 3]| State { position, velocity, acceleration };
        let quintic = Quintic::between(state(from), state(to), duration);
        for (found, wanted) in [(quintic.sample(0.0), state(from)), (quintic.sample(duration), state(to))] {
            prop_assert!((found.position - wanted.position).abs() < 1e-9);
            prop_assert!((found.velocity - wanted.velocity).abs() < 1e-8);
            prop_assert!((found.acceleration - wanted.acceleration).abs() < 1e-6);
        }
    }
}
