//! The simulated arm alone, for clients in other languages: reports at the standard ports, the control port at a free one
//! unless another is named.
//!
//! The cup can take hold of a table whose top is at `--table` metres. It prints `control PORT`, then `ready`, and ends
//! when it is told to. On SIGUSR1 the arm feels a collision.

use std::net::Ipv4Addr;
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Context;
use clap::Parser;
use geometry::RigidTransform;
use sim::arm::{ArmConfig, ArmController, ArmPorts, SuctionWorld};
use tokio::signal::unix::{SignalKind, signal};
use tracing_subscriber::EnvFilter;
use xarm_protocol::{Firmware, VacuumHardware};

/// The controller's number of it.
const COLLISION: u8 = 31;
/// A cup holds on to what is this near, metres.
const COMPLIANCE: f64 = 0.003;

#[derive(Parser)]
struct Options {
    /// Where it is on the network.
    #[arg(long)]
    address: Ipv4Addr,
    /// 0: any free one.
    #[arg(long, default_value_t = 0)]
    control_port: u16,
    /// A Unix socket beside the control port.
    #[arg(long)]
    socket: Option<PathBuf>,
    /// Such as v2.5.5.
    #[arg(long)]
    firmware: Firmware,
    /// How the vacuum gripper is wired, 1 or 2.
    #[arg(long, default_value_t = 1)]
    vacuum: u8,
    /// Height of the table's top, metres.
    #[arg(long, default_value_t = 0.2)]
    table: f64,
}

#[derive(Debug)]
struct Table {
    height: f64,
}

impl SuctionWorld for Table {
    fn touched(&self, base_from_cup: &RigidTransform) -> Option<f64> {
        let is_near = (base_from_cup.translation().z - self.height).abs() <= COMPLIANCE;
        is_near.then_some(0.3)
    }
}

fn config(options: &Options) -> anyhow::Result<ArmConfig> {
    let mut config = ArmConfig {
        address: options.address,
        ports: ArmPorts {
            control: options.control_port,
            ..ArmPorts::STANDARD
        },
        socket: options.socket.clone(),
        vacuum: VacuumHardware::of_version(options.vacuum).context("--vacuum is 1 or 2")?,
        suction: Some(Arc::new(Table { height: options.table })),
        ..ArmConfig::default()
    };
    config.identity.firmware = options.firmware;
    Ok(config)
}

#[tokio::main]
async fn main() -> anyhow::Result<()> {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("info"));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .init();
    let arm = ArmController::start(config(&Options::parse())?)?;
    let mut terminated = signal(SignalKind::terminate())?;
    let mut collided = signal(SignalKind::user_defined1())?;
    println!("control {}\nready", arm.ports().control);
    loop {
        tokio::select! {
            outcome = tokio::signal::ctrl_c() => return Ok(outcome?),
            _ = terminated.recv() => return Ok(()),
            _ = collided.recv() => arm.raise_error(COLLISION),
        }
    }
}
