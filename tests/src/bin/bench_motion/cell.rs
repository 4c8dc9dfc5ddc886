//! Collision checks in the full cell: single configurations, and a whole pick against a cloud of points.

use std::f64::consts::PI;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, bail};
use collision::{ArmModel, Bin, CarriedObject, Checker, PointCloud, Scene, SelfCollision, Shape, XARM7_NEVER_TOUCHING};
use devices::JointValues;
use fastrand::Rng;
use geometry::RigidTransform;
use kinematics::IkOptions;
use nalgebra::{Point3, SVector, UnitQuaternion, Vector3};
use scenarios::quantile;
use serde::Serialize;
use trajectory::{Planner, Trajectory};
use trajectory_executor::TrajectoryPath;

use crate::arm::{Arm, HOME, TOOL_SPEEDS, urdf};

/// A touch less deep than this may be missed between looks, metres.
const SHALLOW: f64 = 1e-3;
/// What comes nearer counts as a touch, metres.
const MARGIN: f64 = 3e-3;
/// Half the edge of the cubes that a cloud's points stand for, metres.
const POINT_RADIUS: f64 = 0.0015;
const CONFIGURATIONS: usize = 20_000;
const ROUNDS: usize = 101;
/// Where the object lies and the bin stands, metres.
const OBJECT: [f64; 2] = [0.43, 0.05];
const BIN: [f64; 2] = [0.3, -0.42];

#[derive(Debug, Serialize)]
pub(crate) struct Checks {
    /// One configuration among table, mat, panels and a bin.
    pub(crate) collision_us: f64,
    /// With the cloud too.
    pub(crate) collision_cloud_us: f64,
    pub(crate) cloud_points: usize,
    pub(crate) cloud_build_ms: f64,
    pub(crate) pick_seconds: f64,
    pub(crate) pick_collision_ms: f64,
    pub(crate) pick_collision_max_ms: f64,
}

pub(crate) fn measure(arm: &Arm, points: usize) -> anyhow::Result<Checks> {
    let leave_out = SelfCollision {
        never: &XARM7_NEVER_TOUCHING,
        free_at: &[HOME],
    };
    let model = ArmModel::from_urdf(&arm.robot, "link_base", arm.chain.clone(), &leave_out)?;
    let scene = cell()?;
    let collision_us = configuration_us(arm, &Checker::new(&model, &scene).with_margin(MARGIN)?)?;
    let heap = heap(points);
    let started = Instant::now();
    let cloud = Arc::new(PointCloud::new(&heap, POINT_RADIUS)?);
    let cloud_build_ms = 1e3 * started.elapsed().as_secs_f64();
    let mut with_cloud = scene;
    with_cloud.add_cloud("cloud", cloud)?;
    with_cloud.except("link_base", "cloud")?;
    let checker = Checker::new(&model, &with_cloud).with_margin(MARGIN)?;
    let pick = Pick::plan(&arm.planner(TOOL_SPEEDS[0])?)?;
    let times = pick.check_ms(&model, &checker)?;
    let at = |share| quantile(&times, share).context("there are rounds");
    Ok(Checks {
        collision_us,
        collision_cloud_us: configuration_us(arm, &checker)?,
        cloud_points: points,
        cloud_build_ms,
        pick_seconds: pick.to_object.duration() + pick.to_bin.duration(),
        pick_collision_ms: at(0.5)?,
        pick_collision_max_ms: at(1.0)?,
    })
}

/// Table, mat, seven panels and a bin beside the workspace.
fn cell() -> anyhow::Result<Scene> {
    let mut scene = Scene::from_urdf(&urdf_rs::read_file(urdf("cell.urdf"))?, "link_base")?;
    let bin = Bin {
        inside: [0.2, 0.3, 0.12],
        wall: 0.005,
    };
    let base_from_bin = RigidTransform::from_parts(Vector3::new(BIN[0], BIN[1], 0.005), UnitQuaternion::identity());
    scene.add_bin("bin", &base_from_bin, &bin)?;
    scene.except("link_base", "table")?;
    Ok(scene)
}

/// Points on a bumpy heap around the middle of the workspace, with a dip where the object to pick was cut out.
fn heap(points: usize) -> Vec<Point3<f64>> {
    let mut random = Rng::with_seed(3);
    let surface = |x: f64, y: f64| 0.02 + 0.015 * (40.0 * x).sin() * (35.0 * y).cos();
    let mut cloud = Vec::with_capacity(points);
    while cloud.len() < points {
        let (x, y) = (0.43 + 0.44 * (random.f64() - 0.5), 0.58 * (random.f64() - 0.5));
        if (x - OBJECT[0]).hypot(y - OBJECT[1]) > 0.06 {
            cloud.push(Point3::new(x, y, surface(x, y) + 0.001 * random.f64()));
        }
    }
    cloud
}

/// Median over random configurations.
fn configuration_us(arm: &Arm, checker: &Checker<'_, 7>) -> anyhow::Result<f64> {
    let mut random = Rng::with_seed(1);
    let mut times = Vec::with_capacity(CONFIGURATIONS);
    for _ in 0..CONFIGURATIONS {
        let angles = arm.anywhere(&mut random);
        let started = Instant::now();
        std::hint::black_box(checker.check(&angles)?);
        times.push(1e6 * started.elapsed().as_secs_f64());
    }
    quantile(&times, 0.5).context("there are configurations")
}

/// From home over the object and straight down to it; up again and into the bin.
struct Pick {
    to_object: Trajectory<7>,
    to_bin: Trajectory<7>,
}

impl Pick {
    fn plan(planner: &Planner<7>) -> anyhow::Result<Self> {
        let [x, y] = OBJECT;
        let pregrasp = solve(planner, &pose(x, y, 0.15), &HOME)?;
        let down = planner.line(&pregrasp, &pose(x, y, 0.04))?.trajectory;
        let up = planner.line(&end(&down), &pose(x, y, 0.25))?.trajectory;
        let over_bin = solve(planner, &pose(BIN[0], BIN[1], 0.25), &end(&up))?;
        let away = planner.joint_motion(&end(&up), &over_bin)?;
        let into_bin = planner.line(&over_bin, &pose(BIN[0], BIN[1], 0.17))?.trajectory;
        Ok(Self {
            to_object: planner.joint_motion(&HOME, &pregrasp)?.then(down)?,
            to_bin: Trajectory::concatenate([up, away, into_bin])?,
        })
    }

    /// The second half with an object in the cup.
    fn check_ms(&self, arm: &ArmModel<7>, checker: &Checker<'_, 7>) -> anyhow::Result<Vec<f64>> {
        let tool_from_cube = RigidTransform::from_parts(Vector3::new(0.0, 0.0, 0.016), UnitQuaternion::identity());
        let cube = Shape::cuboid(&tool_from_cube, [0.05, 0.05, 0.03])?;
        let object = CarriedObject::new(arm, "object", &[cube], &["vacuum_gripper", "vacuum_cup"])?;
        let mut times = Vec::with_capacity(ROUNDS);
        for _ in 0..ROUNDS {
            let started = Instant::now();
            let to_object = checker.check_motion(&TrajectoryPath::new(&self.to_object), SHALLOW)?;
            let carrying = checker.carrying(&object);
            let to_bin = carrying.check_motion(&TrajectoryPath::new(&self.to_bin), SHALLOW)?;
            times.push(1e3 * started.elapsed().as_secs_f64());
            if let Some(contact) = to_object.or(to_bin) {
                bail!("the pick is not free: {contact}");
            }
        }
        Ok(times)
    }
}

/// The cup looks down.
fn pose(x: f64, y: f64, z: f64) -> RigidTransform {
    RigidTransform::from_parts(Vector3::new(x, y, z), UnitQuaternion::from_euler_angles(PI, 0.0, 0.0))
}

fn solve(planner: &Planner<7>, pose: &RigidTransform, seed: &JointValues) -> anyhow::Result<JointValues> {
    let found = planner
        .chain()
        .solve(pose, &SVector::from(*seed), &IkOptions::default())?;
    Ok(found.angles.into())
}

fn end(trajectory: &Trajectory<7>) -> JointValues {
    trajectory.end().map(|state| state.position)
}
