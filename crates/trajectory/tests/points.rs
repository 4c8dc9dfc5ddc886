//! Trajectories given by points and times.

use trajectory::{TimedPoint, Trajectory};

fn point(time_from_start: f64, position: f64) -> TimedPoint<1> {
    TimedPoint {
        time_from_start,
        positions: [position],
        velocities: None,
        accelerations: None,
    }
}

#[test]
fn all_that_is_given_is_met() {
    let full = |time: f64, [position, velocity, acceleration]: [f64; 3]| TimedPoint {
        velocities: Some([velocity]),
        accelerations: Some([acceleration]),
        ..point(time, position)
    };
    let given = [[0.0, 0.3, -1.0], [1.0, -0.5, 2.0], [0.4, 0.1, 0.5]];
    let points = [full(0.0, given[0]), full(0.7, given[1]), full(1.9, given[2])];
    let found = Trajectory::through_points(&points).unwrap();
    for (point, [position, velocity, acceleration]) in points.iter().zip(given) {
        let state = found.sample(point.time_from_start)[0];
        assert!((state.position - position).abs() < 1e-9);
        assert!((state.velocity - velocity).abs() < 1e-9);
        assert!((state.acceleration - acceleration).abs() < 1e-6);
    }
}

#[test]
fn positions_alone_give_a_smooth_way_from_rest_to_rest() {
    let points: Vec<TimedPoint<1>> = (0..8)
        .map(|index| {
            point(
                0.3 * f64::from(index) + 0.02 * f64::from(index * index),
                f64::from(index * 3 % 5),
            )
        })
        .collect();
    let found = Trajectory::through_points(&points).unwrap();
    found.require_rest().unwrap();
    for point in &points {
        assert!((found.sample(point.time_from_start)[0].position - point.positions[0]).abs() < 1e-9);
    }
    let step = 1e-5;
    let largest = found
        .segments()
        .iter()
        .map(|segment| segment.joints()[0].extremes().jerk);
    let largest = largest.fold(0.0, f64::max);
    for index in 1..(found.duration() / step) as usize {
        let (before, now) = (
            found.sample((index - 1) as f64 * step)[0],
            found.sample(index as f64 * step)[0],
        );
        assert!((now.acceleration - before.acceleration).abs() <= largest * step * 1.000_001 + 1e-9);
    }
}

#[test]
fn the_spline_inside_is_that_of_a_cubic() {
    // With the speeds at its ends given, the spline through points of a cubic is the cubic.
    let cubic = |t: f64| 0.5 + t * (0.2 + t * (-1.0 + 0.4 * t));
    let slope = |t: f64| 0.2 + t * (-2.0 + 1.2 * t);
    let bend = |t: f64| -2.0 + 2.4 * t;
    let times = [0.0, 0.5, 0.8, 1.6, 2.0, 3.0];
    let mut points = times.map(|time| point(time, cubic(time)));
    for end in [0, 5] {
        points[end].velocities = Some([slope(times[end])]);
        points[end].accelerations = Some([bend(times[end])]);
    }
    let found = Trajectory::through_points(&points).unwrap();
    for index in 0..300 {
        let time = 0.01 * f64::from(index);
        let state = found.sample(time)[0];
        assert!((state.position - cubic(time)).abs() < 1e-9);
        assert!((state.velocity - slope(time)).abs() < 1e-9);
        assert!((state.acceleration - bend(time)).abs() < 1e-8);
    }
}

#[test]
fn given_speeds_are_met_without_jumps_of_acceleration() {
    let with = |time: f64, position: f64, velocity: f64| TimedPoint {
        velocities: Some([velocity]),
        ..point(time, position)
    };
    let points = [
        with(0.0, 0.0, 0.0),
        with(0.4, 0.3, 1.5),
        point(0.7, 0.5),
        with(1.0, 0.2, -1.0),
        with(1.8, 0.0, 0.0),
    ];
    let found = Trajectory::through_points(&points).unwrap();
    found.require_rest().unwrap();
    for (point, segments) in points[1..].iter().zip(found.segments().windows(2)) {
        let (before, after) = (
            segments[0].sample(segments[0].duration())[0],
            segments[1].sample(0.0)[0],
        );
        let velocity = point.velocities.map_or(after.velocity, |all| all[0]);
        assert!((before.velocity - velocity).abs() < 1e-9 && (after.velocity - velocity).abs() < 1e-9);
        assert!((before.acceleration - after.acceleration).abs() < 1e-6);
    }
}

#[test]
fn a_single_point_is_held() {
    let found = Trajectory::through_points(&[point(0.0, 0.4)]).unwrap();
    assert!(found.duration() <= 1e-3 && (found.end()[0].position - 0.4).abs() < 1e-12);
}

#[test]
fn points_that_cannot_be_are_refused_by_name() {
    let refused = |points: &[TimedPoint<1>]| Trajectory::through_points(points).unwrap_err().to_string();
    assert_eq!(refused(&[]), "there are no points, expected at least one");
    assert_eq!(
        refused(&[point(0.5, 0.0)]),
        "point 1 is due 0.5 s from the start, allowed: 0, the first point is the start"
    );
    let later = "finite and later than the point before";
    for time in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let expected = format!("point 2 is due {time} s from the start, allowed: {later}");
        assert_eq!(refused(&[point(0.0, 0.0), point(time, 1.0)]), expected);
    }
    let odd = TimedPoint {
        velocities: Some([f64::NAN]),
        ..point(1.0, 0.0)
    };
    assert_eq!(
        refused(&[point(0.0, 0.0), odd]),
        "point 2, joint 1: velocity is NaN, expected a finite number"
    );
}
