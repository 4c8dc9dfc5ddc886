//! How long looks take with the xArm7 in its full cell: single configurations, and a whole pick against a cloud of points.
//!
//! `cargo run --release -p collision --example speed -- [POINTS]`; the last line is one JSON object.

use std::cell::Cell;
use std::sync::Arc;
use std::time::Instant;

use collision::{
    ArmModel, Bin, CarriedObject, Checker, JointPath, PointCloud, Scene, SelfCollision, Shape, XARM7_NEVER_TOUCHING,
};
use geometry::RigidTransform;
use kinematics::{Chain, IkOptions};
use nalgebra::{Point3, SVector, UnitQuaternion, Vector3};
use trajectory::{JointLimits, Motion};

type Failure = Box<dyn std::error::Error>;

const HOME: [f64; 7] = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];
const TOLERANCE: f64 = 1e-3;
const MARGIN: f64 = 3e-3;
const ROUNDS: usize = 101;

fn main() -> Result<(), Failure> {
    let points: usize = std::env::args().nth(1).map_or(Ok(50_000), |count| count.parse())?;
    let urdf = |file| format!("{}/../../urdf/{file}", env!("CARGO_MANIFEST_DIR"));
    let robot = urdf_rs::read_file(urdf("xarm7.urdf"))?;
    let chain: Chain<7> = Chain::from_urdf(&robot, "link_base", "link_tcp")?;
    let leave_out = SelfCollision {
        never: &XARM7_NEVER_TOUCHING,
        free_at: &[HOME],
    };
    let arm = ArmModel::from_urdf(&robot, "link_base", chain, &leave_out)?;
    println!(
        "{} pairs of links: {:?}",
        arm.pairs().count(),
        arm.pairs().collect::<Vec<_>>()
    );
    let scene = cell(&urdf_rs::read_file(urdf("cell.urdf"))?)?;

    let (single, slowest, touching) = single_configurations(&Checker::new(&arm, &scene).with_margin(MARGIN)?)?;
    println!(
        "one configuration in the full cell: median {single:.2} us, p99 {slowest:.2} us, {:.0} % of them touch",
        100.0 * touching
    );

    let started = Instant::now();
    let cloud = Arc::new(PointCloud::new(&heap(points), 0.0015)?);
    let build_ms = 1e3 * started.elapsed().as_secs_f64();
    println!("cloud of {points} points: {build_ms:.1} ms to build");
    let mut with_cloud = scene.clone();
    with_cloud.add_cloud("cloud", cloud)?;
    with_cloud.except("link_base", "cloud")?;
    let checker = Checker::new(&arm, &with_cloud).with_margin(MARGIN)?;
    let (cloud_single, cloud_slowest, _) = single_configurations(&checker)?;
    println!("one configuration with the cloud too: median {cloud_single:.2} us, p99 {cloud_slowest:.2} us");

    let (to_object, to_bin) = pick(arm.chain())?;
    let cube = Shape::cuboid(&at(0.0, 0.0, 0.016), [0.05, 0.05, 0.03])?;
    let object = CarriedObject::new(&arm, "object", &[cube], &["vacuum_gripper"])?;
    let (mut times, mut looks) = (Vec::new(), 0);
    for _ in 0..ROUNDS {
        let started = Instant::now();
        let found = [
            checker.check_motion(&to_object, TOLERANCE)?,
            checker.carrying(&object).check_motion(&to_bin, TOLERANCE)?,
        ];
        times.push(1e3 * started.elapsed().as_secs_f64());
        looks = to_object.looks.take() + to_bin.looks.take();
        if let Some(contact) = found.into_iter().flatten().next() {
            return Err(format!("the pick is not free: {contact}").into());
        }
    }
    times.sort_by(f64::total_cmp);
    let pick_ms = times[ROUNDS / 2];
    let way = tool_way(arm.chain(), &to_object)? + tool_way(arm.chain(), &to_bin)?;
    println!(
        "pick of {:.2} s, {way:.2} m of the tool: {looks} looks, median {pick_ms:.2} ms, longest {:.2} ms",
        to_object.duration() + to_bin.duration(),
        times[ROUNDS - 1]
    );
    println!(
        "{}",
        serde_json::json!({
            "configuration_us": single,
            "configuration_with_cloud_us": cloud_single,
            "pick_ms": pick_ms,
            "cloud_build_ms": build_ms,
        })
    );
    Ok(())
}

/// Table, mat, seven panels and a bin beside the workspace.
fn cell(robot: &urdf_rs::Robot) -> Result<Scene, Failure> {
    let mut scene = Scene::from_urdf(robot, "link_base")?;
    let bin = Bin {
        inside: [0.2, 0.3, 0.12],
        wall: 0.005,
    };
    scene.add_bin("bin", &at(0.3, -0.42, 0.005), &bin)?;
    scene.except("link_base", "table")?;
    Ok(scene)
}

fn at(x: f64, y: f64, z: f64) -> RigidTransform {
    RigidTransform::from_parts(Vector3::new(x, y, z), UnitQuaternion::identity())
}

/// Points on a bumpy heap around the middle of the workspace, with a dip where the object to pick was cut out.
fn heap(points: usize) -> Vec<Point3<f64>> {
    let mut random = fastrand::Rng::with_seed(3);
    let surface = |x: f64, y: f64| 0.02 + 0.015 * (40.0 * x).sin() * (35.0 * y).cos();
    let mut cloud = Vec::with_capacity(points);
    while cloud.len() < points {
        let (x, y) = (0.43 + 0.44 * (random.f64() - 0.5), 0.58 * (random.f64() - 0.5));
        if (x - 0.43).hypot(y - 0.05) > 0.06 {
            cloud.push(Point3::new(x, y, surface(x, y) + 0.001 * random.f64()));
        }
    }
    cloud
}

/// Median and 99th percentile of the time (microseconds) over random configurations within the joints' limits, and the share that touches.
fn single_configurations(checker: &Checker<'_, 7>) -> Result<(f64, f64, f64), Failure> {
    let mut random = fastrand::Rng::with_seed(1);
    let (mut times, mut touching) = (Vec::new(), 0_usize);
    for _ in 0..20_000 {
        let angles = checker.arm().chain().joints().each_ref().map(|joint| {
            let limits = joint.limits;
            limits.lower + random.f64() * (limits.upper - limits.lower)
        });
        let started = Instant::now();
        let found = checker.check(&angles)?;
        times.push(1e6 * started.elapsed().as_secs_f64());
        touching += usize::from(found.is_some());
    }
    times.sort_by(f64::total_cmp);
    let count = times.len();
    Ok((
        times[count / 2],
        times[count * 99 / 100],
        touching as f64 / count as f64,
    ))
}

/// Metres.
fn tool_way(chain: &Chain<7>, path: &Motions) -> Result<f64, Failure> {
    let tool = |step: u32| -> Result<Vector3<f64>, Failure> {
        let angles = path.angles(path.duration() * f64::from(step) / 1000.0);
        Ok(chain.forward(&SVector::from(angles))?.translation())
    };
    (1..=1000).map(|step| Ok((tool(step)? - tool(step - 1)?).norm())).sum()
}

/// Motions from rest to rest, one after the other.
struct Motions {
    parts: Vec<Motion<7>>,
    looks: Cell<usize>,
}

/// From home over the object down to it; up again and over the bin.
fn pick(chain: &Chain<7>) -> Result<(Motions, Motions), Failure> {
    let above = |x, y, z| {
        RigidTransform::from_parts(
            Vector3::new(x, y, z),
            UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.0, 0.0),
        )
    };
    let solve = |x, y, z, seed: &[f64; 7]| -> Result<[f64; 7], Failure> {
        let found = chain.solve(&above(x, y, z), &SVector::from(*seed), &IkOptions::default())?;
        Ok(found.angles.into())
    };
    let pregrasp = solve(0.43, 0.05, 0.15, &HOME)?;
    let mut down = vec![HOME, pregrasp];
    for step in 1..=4 {
        down.push(solve(
            0.43,
            0.05,
            0.15 - 0.0275 * f64::from(step),
            &down[down.len() - 1],
        )?);
    }
    let mut away: Vec<[f64; 7]> = down[1..].iter().rev().copied().collect();
    for (x, y) in [(0.43, 0.05), (0.3, -0.42)] {
        away.push(solve(x, y, 0.47, &away[away.len() - 1])?);
    }
    away.push(solve(0.3, -0.42, 0.17, &away[away.len() - 1])?);
    Ok((Motions::through(&down)?, Motions::through(&away)?))
}

impl Motions {
    fn through(waypoints: &[[f64; 7]]) -> Result<Self, Failure> {
        let limits = JointLimits {
            lower: -7.0,
            upper: 7.0,
            velocity: 2.0,
            acceleration: 10.0,
            jerk: 200.0,
        };
        let parts = waypoints
            .windows(2)
            .map(|pair| Motion::rest_to_rest(&pair[0], &pair[1], &[limits; 7]));
        Ok(Self {
            parts: parts.collect::<Result<_, _>>()?,
            looks: Cell::new(0),
        })
    }

    /// Each motion with its begin.
    fn timed(&self) -> impl Iterator<Item = (f64, &Motion<7>)> {
        self.parts.iter().scan(0.0, |begin, part| {
            let this = *begin;
            *begin += part.duration();
            Some((this, part))
        })
    }
}

impl JointPath<7> for Motions {
    fn duration(&self) -> f64 {
        self.parts.iter().map(Motion::duration).sum()
    }

    fn angles(&self, time: f64) -> [f64; 7] {
        self.looks.set(self.looks.get() + 1);
        let at = self.timed().take_while(|(begin, _)| *begin <= time).last();
        at.map_or(HOME, |(begin, part)| {
            part.sample(time - begin).map(|state| state.position)
        })
    }

    /// The speed of a minimum-jerk motion rises to its middle and falls from there.
    fn speed_bounds(&self, from: f64, to: f64) -> [f64; 7] {
        let mut most = [0.0_f64; 7];
        for (begin, part) in self.timed() {
            if begin > to || begin + part.duration() < from {
                continue;
            }
            let fastest = (begin + 0.5 * part.duration()).clamp(from, to) - begin;
            for (most, state) in most.iter_mut().zip(part.sample(fastest)) {
                *most = most.max(state.velocity.abs());
            }
        }
        most
    }
}
