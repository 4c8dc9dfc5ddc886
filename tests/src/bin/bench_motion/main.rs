//! Measures the arm's mathematics and its servo loop: inverse kinematics, trajectories and their limits, collision checks,
//! how punctual set-points are between the real driver and the simulated controller, allocations in the loop, and stops.
//!
//! pinocchio (`tests/peers/motion_peer.py`) and cyclictest run in the same run as yardsticks, where they are installed.

mod allocations;
mod arm;
mod cell;
mod inverse;
mod lateness;
mod realtime_stops;
mod recorder;
mod report;
mod servo;
mod session;
mod stepped;
mod stops;
mod trajectories;
mod yardstick;

use clap::Parser;

use arm::Arm;
use report::Report;

#[derive(Parser)]
#[command(about = "Measures the arm's mathematics and its servo loop; see the README for the figures to expect")]
struct Arguments {
    /// Print one JSON object as the last thing on standard output.
    #[arg(long)]
    json: bool,
    /// Random poses for inverse kinematics.
    #[arg(long, default_value_t = 10_000, value_parser = clap::value_parser!(u64).range(1..))]
    poses: u64,
    /// Random trajectories whose limits are checked.
    #[arg(long, default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(1..))]
    trajectories: u64,
    /// Points of the cloud that a pick is checked against.
    #[arg(long, default_value_t = 50_000)]
    points: usize,
    /// Random stops of the loop turned by hand.
    #[arg(long, default_value_t = 10_000, value_parser = clap::value_parser!(u64).range(1..))]
    stops: u64,
    /// Stops in real time.
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..))]
    realtime_stops: u32,
    /// How long set-points are streamed, seconds; as long again for the yardstick.
    #[arg(long, default_value_t = 60.0)]
    servo_seconds: f64,
    /// `SCHED_FIFO` priority of the servo thread and of the yardstick; 0: ordinary threads.
    #[arg(long, default_value_t = 80, value_parser = clap::value_parser!(u8).range(0..=99))]
    priority: u8,
}

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    let report = measure(&Arm::load()?, &arguments)?;
    println!("{report}");
    if arguments.json {
        println!("{}", serde_json::to_string(&report)?);
    }
    Ok(())
}

fn measure(arm: &Arm, arguments: &Arguments) -> anyhow::Result<Report> {
    let step = |what: &str| eprintln!("{what} ...");
    step("inverse kinematics");
    let inverse = inverse::measure(arm, arguments.poses)?;
    step("trajectories");
    let trajectories = trajectories::measure(arm, arguments.trajectories)?;
    step("collision");
    let collision = cell::measure(arm, arguments.points)?;
    step("allocations");
    let allocations = allocations::measure(arm)?;
    step("stops");
    let stops = stops::measure(arm, arguments.stops)?;
    step("servo loop");
    let runtime = tokio::runtime::Runtime::new()?;
    let (seconds, priority) = (arguments.servo_seconds, arguments.priority);
    let servo = runtime.block_on(servo::measure(arm, seconds, priority))?;
    let realtime_stops = runtime.block_on(realtime_stops::measure(arm, arguments.realtime_stops, priority))?;
    step("yardstick of the servo loop");
    let yardstick = yardstick::measure(seconds, priority)?;
    Ok(Report {
        inverse,
        trajectories,
        collision,
        allocations,
        stops,
        servo,
        realtime_stops,
        yardstick,
    })
}
