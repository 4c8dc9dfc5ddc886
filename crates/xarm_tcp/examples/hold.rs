//! Holds the arm where it stands for ten seconds with set-points every 4 ms, and tells how well that went: whether this
//! computer and the network to the controller are good enough. Brakes open and servos switch on, but nothing moves.
//!
//! `cargo run --release -p xarm_tcp --example hold -- 192.168.1.217`; without an address the controller is simulated.

use std::time::{Duration, Instant};

use anyhow::Context;
use devices::{Arm, ArmLink, ArmState, JointValues, SetPointStream};
use sim::arm::{ArmConfig, ArmController};
use xarm_tcp::{XArm, XArmConfig};

const PERIOD: Duration = Duration::from_millis(4);
const COUNT: u32 = 2500;

#[tokio::main]
async fn main() -> anyhow::Result<()> {
    let simulated = match std::env::args().nth(1) {
        Some(_) => None,
        None => Some(ArmController::start(ArmConfig::default())?),
    };
    let arm = XArm::open(config(simulated.as_ref()));
    let here = connected(&arm).await?;
    let stream = arm.arm().await?;
    let held = tokio::task::spawn_blocking(move || hold(stream, &here)).await?;
    arm.stop().await?;
    arm.close().await;
    held
}

fn config(simulated: Option<&ArmController>) -> XArmConfig {
    let host = std::env::args().nth(1).unwrap_or_else(|| "127.0.0.1".to_owned());
    let config = XArmConfig::new(host);
    match simulated.map(ArmController::ports) {
        None => config,
        Some(ports) => XArmConfig {
            control_port: ports.control,
            real_time_report_port: ports.real,
            rich_report_port: ports.rich,
            ..config
        },
    }
}

/// Where it stands.
async fn connected(arm: &XArm) -> anyhow::Result<JointValues> {
    let mut state = arm.state();
    let connected = |state: &ArmState| matches!(state.link, ArmLink::Connected { .. });
    let waited = tokio::time::timeout(Duration::from_secs(10), state.wait_for(connected)).await;
    let Ok(found) = waited else {
        anyhow::bail!("no arm within 10 s: {:?}", arm.state().borrow().link);
    };
    let joints = found?.joints.context("a connected arm has reported")?;
    Ok(joints.angles)
}

fn hold(mut stream: Box<dyn SetPointStream>, here: &JointValues) -> anyhow::Result<()> {
    let (mut took, mut late) = (Vec::new(), Vec::new());
    let start = Instant::now();
    for number in 0..COUNT {
        let due = start + PERIOD * number;
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        let woken = Instant::now();
        stream.send(here)?;
        took.push(woken.elapsed());
        late.push(woken - due);
    }
    print("sending a set-point took", took);
    print("the thread woke up late by", late);
    Ok(())
}

fn print(what: &str, mut times: Vec<Duration>) {
    times.sort();
    let at = |part: f64| times[((times.len() - 1) as f64 * part) as usize];
    println!(
        "{what}: median {:?}, 99 % {:?}, longest {:?}",
        at(0.5),
        at(0.99),
        at(1.0)
    );
}
