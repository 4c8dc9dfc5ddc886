//! Lines of the tool: straight, within all limits, and refused with the place where the arm cannot follow.

mod support;

use fastrand::Rng;
use geometry::RigidTransform;
use kinematics::IkOptions;
use nalgebra::{SVector, UnitQuaternion, Vector3};
use support::{HOME, N, STEP, assert_limits, planner, random_angles, tool};
use trajectory::{LinePlan, Planner, TrajectoryError};

fn pose(planner: &Planner<N>, angles: &[f64; N]) -> RigidTransform {
    planner.chain().forward(&SVector::from(*angles)).unwrap()
}

fn moved(pose: &RigidTransform, by: [f64; 3]) -> RigidTransform {
    RigidTransform::from_parts(pose.translation() + Vector3::from(by), pose.rotation())
}

/// Distance from the segment between two places, metres.
fn distance(place: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> f64 {
    let way = to - from;
    let share = ((place - from).dot(&way) / way.norm_squared()).clamp(0.0, 1.0);
    (place - from - way * share).norm()
}

/// Looked at closely: straight within 0.2 mm, limits, ends.
fn assert_line(planner: &Planner<N>, plan: &LinePlan<N>, from: &[f64; N], to: &RigidTransform, step: f64) {
    let path = &plan.trajectory;
    planner.check(path).unwrap();
    path.require_rest().unwrap();
    assert!(plan.position_error <= 2e-4 && plan.rotation_error <= 1e-3);
    let begin = pose(planner, from);
    let end = pose(planner, &path.end().map(|state| state.position));
    assert!((end.translation() - to.translation()).norm() < 1e-8);
    assert!(end.rotation().angle_to(&to.rotation()) < 1e-8);
    for (state, angle) in path.start().iter().zip(from) {
        assert!((state.position - angle).abs() < 1e-9);
    }
    for index in 0..=500 {
        let states = path.sample(path.duration() * f64::from(index) / 500.0);
        let off = distance(&tool(planner, &states), &begin.translation(), &to.translation());
        assert!(
            off <= plan.position_error * 1.1 + 1e-6,
            "{off} m off, {} said",
            plan.position_error
        );
    }
    assert_limits(planner, path, step);
}

#[test]
fn the_tool_goes_straight_down_and_up_again() {
    for tool_speed in [0.25, 1.0] {
        let planner = planner(tool_speed);
        let above = pose(&planner, &HOME);
        let below = moved(&above, [0.0, 0.0, -0.2]);
        let down = planner.line(&HOME, &below).unwrap();
        assert_line(&planner, &down, &HOME, &below, STEP);
        let grasp = down.trajectory.end().map(|state| state.position);
        let up = planner.line(&grasp, &above).unwrap();
        assert_line(&planner, &up, &grasp, &above, STEP);
        let both = down.trajectory.then(up.trajectory).unwrap();
        assert!(
            both.duration() < 2.0 * (1.01 * 1.875 * 0.2 / tool_speed).max(0.8),
            "{} s",
            both.duration()
        );
        // Down and up again leads back to the same angles but for what the push away from limits has moved.
        for (state, angle) in both.end().iter().zip(HOME) {
            assert!((state.position - angle).abs() < 0.05, "{state:?}, {angle}");
        }
    }
}

/// The pose moved and turned at random, each number by at most so much.
fn moved_at_random(random: &mut Rng, start: &RigidTransform, shift: f64, turn: f64) -> RigidTransform {
    let mut number = || 2.0 * random.f64() - 1.0;
    let turn = UnitQuaternion::from_scaled_axis(turn * Vector3::new(number(), number(), number()));
    let shift = shift * Vector3::new(number(), number(), number());
    RigidTransform::from_parts(start.translation() + shift, turn * start.rotation())
}

#[test]
fn lines_where_the_arm_works_are_all_followed() {
    let mut random = Rng::with_seed(30);
    for case in 0..200 {
        let planner = planner([0.25, 1.0][case % 2]);
        let from = HOME.map(|angle| angle + 0.6 * (random.f64() - 0.5));
        let to = moved_at_random(&mut random, &pose(&planner, &from), 0.12, 0.2);
        let plan = planner.line(&from, &to).unwrap();
        assert_line(&planner, &plan, &from, &to, 8.0 * STEP);
    }
}

#[test]
fn lines_from_anywhere_keep_all_limits_or_are_refused_with_their_place() {
    let mut random = Rng::with_seed(31);
    let (mut followed, mut swings) = (0, 0);
    for case in 0..300 {
        let planner = planner([0.25, 1.0][case % 2]);
        let from = random_angles(&mut random, &planner);
        let to = moved_at_random(&mut random, &pose(&planner, &from), 0.2, 0.5);
        match planner.line(&from, &to) {
            Ok(plan) => {
                followed += 1;
                assert_line(
                    &planner,
                    &plan,
                    &from,
                    &to,
                    if case % 10 == 0 { STEP } else { 8.0 * STEP },
                );
            }
            Err(
                TrajectoryError::Unreachable { line: 1, percent, .. }
                | TrajectoryError::LimitOnLine { line: 1, percent, .. }
                | TrajectoryError::OffLine { line: 1, percent, .. },
            ) => assert!((0.0..=100.0).contains(&percent)),
            Err(TrajectoryError::Swing {
                line: 1,
                percent,
                swing,
                ..
            }) => {
                swings += 1;
                assert!((0.0..=100.0).contains(&percent) && swing.abs() > 0.25);
            }
            Err(error) => panic!("{error}"),
        }
    }
    assert!(swings > 0);
    // Of the others most ends are out of reach altogether, or the joint at its limit could not be spared.
    assert!(followed > 180, "{followed} of 300 lines followed");
}

#[test]
fn pure_turns_and_no_way_at_all() {
    let planner = planner(0.25);
    let start = pose(&planner, &HOME);
    let turned = RigidTransform::from_parts(
        start.translation(),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.3, 0.8)) * start.rotation(),
    );
    let plan = planner.line(&HOME, &turned).unwrap();
    planner.check(&plan.trajectory).unwrap();
    for index in 0..=100 {
        let states = plan
            .trajectory
            .sample(plan.trajectory.duration() * f64::from(index) / 100.0);
        assert!((tool(&planner, &states) - start.translation()).norm() <= 2e-4);
    }
    let nowhere = planner.lines(&HOME, &[start, start], 0.01).unwrap();
    assert!(nowhere.trajectory.duration() <= 1e-3 && nowhere.position_error == 0.0);
}

#[test]
fn blended_lines_are_quicker_and_stay_within_their_tolerance() {
    for (tool_speed, tolerance) in [(0.25, 0.01), (1.0, 0.01), (1.0, 0.03)] {
        let planner = planner(tool_speed);
        let start = pose(&planner, &HOME);
        let corners = [
            moved(&start, [0.0, 0.0, 0.1]),
            moved(&start, [0.0, 0.15, 0.1]),
            moved(&start, [0.0, 0.15, 0.0]),
        ];
        let stops = planner.lines(&HOME, &corners, 0.0).unwrap();
        let blend = planner.lines(&HOME, &corners, tolerance).unwrap();
        planner.check(&blend.trajectory).unwrap();
        assert_limits(&planner, &blend.trajectory, STEP);
        assert!(
            blend.trajectory.duration() < 0.95 * stops.trajectory.duration(),
            "{} s, with stops {} s",
            blend.trajectory.duration(),
            stops.trajectory.duration()
        );
        let all = [start, corners[0], corners[1], corners[2]].map(|pose| pose.translation());
        for index in 0..=1000 {
            let states = blend
                .trajectory
                .sample(blend.trajectory.duration() * f64::from(index) / 1000.0);
            let place = tool(&planner, &states);
            let off = all.windows(2).map(|pair| distance(&place, &pair[0], &pair[1]));
            assert!(off.fold(f64::INFINITY, f64::min) <= tolerance + 2e-4);
        }
        let end = pose(&planner, &blend.trajectory.end().map(|state| state.position));
        assert!((end.translation() - corners[2].translation()).norm() < 1e-8);
    }
}

#[test]
fn a_line_out_of_reach_is_refused_where_the_reach_ends() {
    let planner = planner(0.25);
    let start = pose(&planner, &HOME);
    let error = planner.line(&HOME, &moved(&start, [0.8, 0.0, 0.0])).unwrap_err();
    let TrajectoryError::Unreachable {
        line: 1,
        percent,
        millimetres,
        ..
    } = error
    else {
        panic!("{error}")
    };
    assert!((percent * 8.0 - millimetres).abs() < 1e-6);
    // The next few millimetres cannot be reached by any angles, those before can.
    let options = IkOptions::default();
    let reaches = |millimetres: f64| {
        let there = moved(&start, [1e-3 * millimetres, 0.0, 0.0]);
        planner.chain().solve(&there, &SVector::from(HOME), &options).is_ok()
    };
    assert!(reaches(millimetres), "{error}");
    assert!(!reaches(millimetres + 20.0), "{error}");
    let corner = moved(&start, [0.0, 0.0, 0.1]);
    let error = planner
        .lines(&HOME, &[start, corner, moved(&corner, [0.8, 0.0, 0.0])], 0.01)
        .unwrap_err();
    assert!(matches!(error, TrajectoryError::Unreachable { line: 3, .. }), "{error}");
}

#[test]
fn a_joint_that_comes_to_its_limit_is_named() {
    // The elbow opens on the way up and comes to its end.
    let planner = planner(0.25);
    let mut from = HOME;
    from[5] = 3.0;
    let start = pose(&planner, &from);
    let turned = RigidTransform::from_parts(
        start.translation(),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.0, -0.6, 0.0)) * start.rotation(),
    );
    let other = RigidTransform::from_parts(
        start.translation(),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.6, 0.0)) * start.rotation(),
    );
    let errors = [turned, other].map(|pose| planner.line(&from, &pose).err());
    let named = errors
        .iter()
        .flatten()
        .find(|error| matches!(error, TrajectoryError::LimitOnLine { joint: 6, .. }));
    assert!(named.is_some(), "{errors:?}");
}

#[test]
fn what_cannot_be_is_refused() {
    let planner = planner(0.25);
    let start = pose(&planner, &HOME);
    let far = RigidTransform::from_parts(Vector3::new(f64::NAN, 0.0, 0.0), start.rotation());
    assert!(matches!(planner.line(&HOME, &far), Err(TrajectoryError::Kinematics(_))));
    assert!(matches!(
        planner.lines(&HOME, &[], 0.0),
        Err(TrajectoryError::Empty { what: "poses" })
    ));
    assert!(planner.lines(&HOME, &[start], -1.0).is_err());
    assert!(planner.line(&[9.0; N], &start).is_err());
    assert!(planner.line(&[f64::NAN; N], &start).is_err());
}
