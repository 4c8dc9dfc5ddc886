//! How long forward and inverse kinematics of the xArm7 take, and how often the inverse succeeds: random reachable poses,
//! always from the home angles.
//!
//! `cargo run --release -p kinematics --example speed -- [POSES]`; the last line is one JSON object.

use std::time::Instant;

use kinematics::{Chain, IkOptions};
use nalgebra::SVector;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let poses: usize = std::env::args().nth(1).map_or(Ok(10_000), |count| count.parse())?;
    let robot = urdf_rs::read_file(concat!(env!("CARGO_MANIFEST_DIR"), "/../../urdf/xarm7.urdf"))?;
    let arm: Chain<7> = Chain::from_urdf(&robot, "link_base", "link_eef")?;
    let home = SVector::from([0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0]);
    let mut random = fastrand::Rng::with_seed(1);
    let targets: Vec<SVector<f64, 7>> = (0..poses)
        .map(|_| {
            SVector::from_fn(|joint, _| {
                let limits = arm.joints()[joint].limits;
                limits.lower + random.f64() * (limits.upper - limits.lower)
            })
        })
        .collect();
    let started = Instant::now();
    let mut sum = 0.0;
    for angles in &targets {
        let (tip, jacobian) = arm.jacobian(angles)?;
        sum += tip.translation().x + jacobian[(0, 0)];
    }
    let fk_us = 1e6 * started.elapsed().as_secs_f64() / poses as f64;
    let (mut times, mut solved, mut from_seed) = (Vec::with_capacity(poses), 0_usize, 0_usize);
    for angles in &targets {
        let pose = arm.forward(angles)?;
        let started = Instant::now();
        let found = arm.solve(&pose, &home, &IkOptions::default());
        times.push(1e6 * started.elapsed().as_secs_f64());
        let Ok(found) = found else { continue };
        let reached = arm.forward(&found.angles)?;
        let apart = (reached.translation() - pose.translation()).norm();
        solved += usize::from(apart < 1e-5 && reached.rotation().angle_to(&pose.rotation()) < 1e-5);
        from_seed += usize::from(found.attempts == 1);
    }
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times[((share * poses as f64) as usize).min(poses - 1)];
    println!(
        "pose and Jacobian {fk_us:.2} us (sum {sum:.1}); inverse: {solved} of {poses} solved, {from_seed} of them from the seed, median {:.0} us, p99 {:.0} us, longest {:.0} us",
        at(0.5),
        at(0.99),
        at(1.0)
    );
    println!(
        "{}",
        serde_json::json!({
            "ik_success": solved as f64 / poses as f64,
            "ik_median_us": at(0.5),
            "fk_us": fk_us,
        })
    );
    Ok(())
}
