//! How long planning takes on two views of 1000 x 1000: `cargo run --release -p grasp --example speed`.
//!
//! Set `RAYON_NUM_THREADS` for another number of threads than there are cores.

#[path = "../tests/common/mod.rs"]
mod common;

use std::error::Error;
use std::time::Instant;

use common::{Body, inputs, see};
use geometry::nalgebra::{Point3, Rotation3, Vector3};
use grasp::{Cup, PlanOptions, plan};

const SIZE: usize = 1000;
const ROUNDS: usize = 21;

fn main() -> Result<(), Box<dyn Error>> {
    let level = Rotation3::identity();
    let turned = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.4);
    let scenes = [
        ("pyramid", vec![Body::pyramid([0.43, 0.0], 0.12, 0.06, 0.4)]),
        (
            "plate",
            vec![Body::block(Point3::new(0.43, 0.0, 0.005), [0.15, 0.15, 0.01], turned)],
        ),
        (
            "sphere",
            vec![Body::Sphere {
                centre: Point3::new(0.43, 0.0, 0.07),
                radius: 0.07,
            }],
        ),
        (
            "four blocks and a cylinder",
            vec![
                Body::block(Point3::new(0.39, -0.05, 0.02), [0.05, 0.04, 0.04], turned),
                Body::block(Point3::new(0.47, -0.05, 0.01), [0.05, 0.06, 0.02], level),
                Body::block(Point3::new(0.47, 0.05, 0.02), [0.04, 0.04, 0.04], turned),
                Body::block(Point3::new(0.39, 0.05, 0.015), [0.06, 0.04, 0.03], level),
                Body::Cylinder {
                    centre: Point3::new(0.43, 0.0, 0.025),
                    radius: 0.025,
                    half_length: 0.03,
                },
            ],
        ),
    ];
    for (name, bodies) in scenes {
        let seen = see(&bodies, SIZE, 0.02);
        let mut times = Vec::new();
        let mut grasps = 0;
        let spent = cpu_seconds();
        for _ in 0..ROUNDS {
            let started = Instant::now();
            grasps = plan(&inputs(&seen), &Cup::default(), &PlanOptions::default())?
                .grasps
                .len();
            times.push(1e3 * started.elapsed().as_secs_f64());
        }
        let spent = 1e3 * (cpu_seconds() - spent) / ROUNDS as f64;
        times.sort_by(f64::total_cmp);
        println!(
            "{name}: {:.1} ms at the median, {:.1} at best, {:.1} at worst; {spent:.1} ms of processor time; {grasps} grasps, {} threads",
            times[ROUNDS / 2],
            times[0],
            times[ROUNDS - 1],
            rayon::current_num_threads()
        );
    }
    Ok(())
}

/// Of all threads of this process: what a loaded machine does not change much.
fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
