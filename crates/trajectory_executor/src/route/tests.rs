use std::f64::consts::FRAC_PI_6;

use fastrand::Rng;
use nalgebra::{UnitQuaternion, Vector3};

use super::*;
use crate::handling::Carried;
use crate::model::tests::{HOME, model};

const GRASPS: usize = 200;
const APPROACH_SPEED: f64 = 0.05;
/// The middle of the bin, metres.
const BIN: [f64; 2] = [0.18, 0.36];
/// Turns of the tool about its axis, the least first, as grasps are placed.
const TURNS: [i8; 12] = [0, 1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6];

/// What moves with the flange.
const TOOL: [&str; 4] = ["vacuum_gripper", "vacuum_cup", "wrist_camera", "carried object"];
/// The two speeds of the tool, and the seconds that a pick takes at most on average, m/s and s.
const SPEEDS: [[f64; 2]; 2] = [[0.25, 12.0], [0.95, 6.0]];

/// Something that is picked up.
struct Pick {
    /// Where the lip comes to, metres, and from where.
    contact: Vector3<f64>,
    axis: Vector3<f64>,
    bin: RigidTransform,
    carried: Option<Carried>,
}

/// Seconds of the parts of a pick, and of the longest pick.
#[derive(Debug, Default)]
struct Times([f64; 5], f64);

impl Times {
    fn add(&mut self, other: &Self) {
        self.0.iter_mut().zip(other.0).for_each(|(sum, part)| *sum += part);
        self.1 = self.1.max(other.1);
    }
}

fn turned(model: &Model, axis: &Vector3<f64>, yaw: f64) -> UnitQuaternion<f64> {
    let held = model.chain.forward(&SVector::from(HOME)).expect("home").rotation();
    let turn = UnitQuaternion::rotation_between(&(held * Vector3::z()), axis).expect("both point down");
    turn * held * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw)
}

/// A direction no more than 25 degrees from straight down.
fn approach_axis(random: &mut Rng) -> Vector3<f64> {
    let (tilt, side) = (25_f64.to_radians() * random.f64(), std::f64::consts::TAU * random.f64());
    Vector3::new(tilt.sin() * side.cos(), tilt.sin() * side.sin(), -tilt.cos())
}

fn pick(model: &Model, random: &mut Rng) -> Pick {
    let within = |random: &mut Rng, low: f64, high: f64| low + (high - low) * random.f64();
    let axis = approach_axis(random);
    let place = Vector3::new(
        within(random, 0.33, 0.53),
        within(random, -0.1, 0.1),
        within(random, 0.01, 0.06),
    );
    // What is tilted has room below it for so much.
    let contact = Vector3::new(place.x, place.y, place.z + 0.06 * axis.xy().norm() * 0.5);
    let (radius, length) = (within(random, 0.0, 0.06), contact.z.min(0.06));
    let carried = (radius > 0.002).then_some(Carried { radius, length });
    let over = Vector3::new(BIN[0], BIN[1], within(random, 0.08, 0.25));
    Pick {
        bin: over_bin(model, over, carried, random),
        contact,
        axis,
        carried,
    }
}

/// Turned at random, but not so that the tool itself is in something, however the arm stands: low over the bin some turns
/// hold the camera into the panel beside it.
fn over_bin(model: &Model, over: Vector3<f64>, carried: Option<Carried>, random: &mut Rng) -> RigidTransform {
    let handling = Handling {
        contact: false,
        carried,
    };
    for _ in 0..20 {
        let yaw = std::f64::consts::TAU * random.f64();
        let pose = RigidTransform::from_parts(over, turned(model, &-Vector3::z(), yaw));
        let found = model.chain.solve(&pose, &SVector::from(HOME), &IkOptions::default());
        let held = Trajectory::hold(&found.expect("within reach").angles.into(), 0.1).expect("a time");
        match model.require_free(&held, &handling) {
            Err(MotionError::Collision { link, .. }) if TOOL.contains(&link.as_str()) => {}
            _ => return pose,
        }
    }
    panic!("most turns are free");
}

fn end(trajectory: &Trajectory<7>) -> JointValues {
    trajectory.end().map(|state| state.position)
}

/// The way home -> pregrasp -> grasp -> retreat -> bin -> home, each part by itself, with the tool turned as at home or as
/// little from that as all of it allows; how many turns that took.
fn cycle(model: &Model, pick: &Pick, speed: f64) -> Result<(usize, Times), (&'static str, MotionError)> {
    let mut first = None;
    for (tried, turn) in TURNS.into_iter().enumerate() {
        let rotation = turned(model, &pick.axis, f64::from(turn) * FRAC_PI_6);
        match turned_cycle(model, pick, &rotation, speed) {
            Ok(times) => return Ok((tried, times)),
            Err(error) => first.get_or_insert(error),
        };
    }
    Err(first.expect("a turn was tried"))
}

fn turned_cycle(
    model: &Model,
    pick: &Pick,
    rotation: &UnitQuaternion<f64>,
    tool_speed: f64,
) -> Result<Times, (&'static str, MotionError)> {
    let at = |offset: Vector3<f64>| RigidTransform::from_parts(pick.contact + offset, *rotation);
    let (pregrasp, grasp, retreat) = (at(-0.05 * pick.axis), at(Vector3::zeros()), at(0.1 * Vector3::z()));
    let planner = model.planner(tool_speed).expect("a speed");
    let router = |carried| Router {
        model,
        planner: &planner,
        handling: Handling {
            contact: false,
            carried,
        },
    };
    let touching = |carried| Handling { contact: true, carried };
    let line = |from: &JointValues, to, speed, handling| {
        let planner = model.planner(speed)?;
        let trajectory = planner.line(from, to)?.trajectory;
        model.require_free(&trajectory, &handling)?;
        Ok::<_, MotionError>(trajectory)
    };
    let named = |name| move |error| (name, error);
    let there = router(None)
        .to_pose(&HOME, &pregrasp)
        .map_err(named("to the pregrasp"))?;
    let down = line(&end(&there), &grasp, APPROACH_SPEED, touching(None)).map_err(named("approach"))?;
    let up = line(&end(&down), &retreat, tool_speed, touching(pick.carried)).map_err(named("retreat"))?;
    let away = router(pick.carried)
        .to_pose(&end(&up), &pick.bin)
        .map_err(named("to the bin"))?;
    let back = router(None).to_angles(&end(&away), &HOME).map_err(named("home"))?;
    let parts = [&there, &down, &up, &away, &back].map(Trajectory::duration);
    Ok(Times(parts, parts.iter().sum()))
}

#[test]
fn picks_anywhere_on_the_mat_find_a_way_to_the_bin_and_home() {
    let model = model();
    let mut random = Rng::with_seed(7);
    let mut failures = Vec::new();
    let (mut sums, mut turned) = ([Times::default(), Times::default()], 0);
    for number in 0..GRASPS {
        let pick = pick(&model, &mut random);
        for (sum, [speed, _]) in sums.iter_mut().zip(SPEEDS) {
            match cycle(&model, &pick, speed) {
                Ok((tried, times)) => {
                    turned += usize::from(tried > 0);
                    sum.add(&times);
                }
                Err((name, error)) => failures.push(format!("{number} at {speed} m/s, {name}: {error}")),
            }
        }
    }
    println!("{turned} of {} needed another turn of the tool", 2 * GRASPS);
    assert!(failures.is_empty(), "{} of {GRASPS}: {failures:#?}", failures.len());
    for (sum, [speed, most]) in sums.iter().zip(SPEEDS) {
        let parts = sum.0.map(|seconds| seconds / GRASPS as f64);
        let whole: f64 = parts.iter().sum();
        println!(
            "{speed} m/s: {whole:.2} s, home to bin to home {parts:.2?}, longest {:.2} s",
            sum.1
        );
        assert!(whole < most, "{whole} s at {speed} m/s");
    }
}

#[test]
fn a_cup_that_stands_in_the_mat_is_lifted_out_of_it() {
    let model = model();
    let planner = model.planner(0.25).expect("a speed");
    let down = RigidTransform::from_parts(Vector3::new(0.45, 0.05, -0.003), turned(&model, &-Vector3::z(), 0.0));
    let at = model
        .chain
        .solve(&down, &SVector::from(HOME), &IkOptions::default())
        .expect("within reach");
    let at: JointValues = at.angles.into();
    let router = |contact| Router {
        model: &model,
        planner: &planner,
        handling: Handling { contact, carried: None },
    };
    assert!(router(false).to_angles(&at, &HOME).is_err());
    let way = router(true).lifted(&at, &HOME).expect("straight up, and home");
    let soon = way.sample(0.2 * way.duration()).map(|state| state.position);
    let soon = model.chain.forward(&SVector::from(soon)).expect("angles").translation();
    let aside = (soon - down.translation()).xy().norm();
    assert!(soon.z > 0.01 && aside < 0.2 * soon.z, "{soon}");
}
