//! `rakelight up`: brings a cell up, keeps it alive, and takes it down.
//!
//! The cell's processes are this program again: `rakelight sim` for the simulated devices, and one `rakelight node` for
//! each process of the launch config.

mod backoff;
mod console;
pub(crate) mod locate;
mod process;
mod readiness;
mod supervisor;

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::anyhow;
use clap::Args;
use ros::{DiscoveryRange, LaunchConfig, Node, NodeOptions, ParameterValue, RosArguments};
use tokio::sync::watch;

use crate::ending::{Signals, end_of_input};
use crate::failure::Failure;
use crate::nodes::NODES;
use crate::running_cell::{self, RunningCell};
use console::{Console, Event, Ready};
use process::Job;
use readiness::Readiness;
use supervisor::{Member, Stage, Supervisor};

/// The supervisor's own node, which watches the others.
const OBSERVER: &str = "supervisor";

/// The node that writes bags, which ends after those that it listens to.
const RECORDER: &str = "bag_recorder";

/// The node that runs pick cycles.
const COORDINATOR: &str = "cell_coordinator";

/// The nodes that have devices.
const CAPTURER: &str = "camera_capture";
const LIGHTS: &str = "light_sequencer";
const ARM: &str = "trajectory_executor";

/// What the simulator does before it has images.
const RENDERING: &str = "the simulated world to be rendered";

/// How often a wait is told of where nobody sees the progress.
const REMINDER: Duration = Duration::from_secs(15);

/// A world is loaded and rendered in seconds; on a busy machine, in minutes.
const SIMULATOR_PATIENCE: Duration = Duration::from_mins(3);

#[derive(Args)]
pub(crate) struct Arguments {
    /// Launch config [default: `launch_configs/sim.yaml`, here or in the repository of this program].
    #[arg(long)]
    config: Option<PathBuf>,
    /// World file of a simulated cell, in place of the config's.
    #[arg(long)]
    world: Option<PathBuf>,
    /// Tell what happens as one JSON object a line.
    #[arg(long)]
    json: bool,
    /// End when standard input does: a pipe from the parent closes when the parent dies.
    #[arg(long)]
    end_with_stdin: bool,
}

pub(crate) async fn run(arguments: Arguments, ros_arguments: &RosArguments) -> Result<(), Failure> {
    if !ros_arguments.is_empty() {
        let problem = "--ros-args are for single nodes; write parameters into the launch config";
        return Err(Failure::usage(anyhow!(problem)));
    }
    let started = Instant::now();
    let path = locate::config(arguments.config).map_err(Failure::usage)?;
    let mut config = LaunchConfig::read(&path).map_err(Failure::usage)?;
    replace_world(&mut config, arguments.world, &path)?;
    config.check_nodes(&NODES).map_err(Failure::usage)?;
    check_world(&config, &path)?;
    let mut signals = Signals::listen()?;
    let cell = Cell::claim(&config, path).await?;
    let members = members(&config, &cell.record.config);
    let console = Arc::new(Console::new(
        arguments.json,
        members.iter().map(|member| member.job.name.len()),
    ));
    let mut supervisor = Supervisor::new(Arc::clone(&console));
    let outcome = tokio::select! {
        outcome = keep_up(&mut supervisor, members, &cell, &console, started) => outcome,
        () = signals.next() => Ok(()),
        () = end_of_input(), if arguments.end_with_stdin => Ok(()),
    };
    console.waiting(None);
    let why = if outcome.is_err() {
        "a process cannot run"
    } else {
        "asked to end"
    };
    console.tell(&Event::Stopping { why });
    take_down(&mut supervisor, &mut signals).await;
    cell.observer.shutdown().await;
    console.tell(&Event::Stopped);
    outcome
}

fn replace_world(config: &mut LaunchConfig, world: Option<PathBuf>, path: &Path) -> Result<(), Failure> {
    let Some(world) = world else {
        return Ok(());
    };
    if config.cell.simulator.is_none() {
        let (config, world) = (path.display(), world.display());
        return Err(Failure::usage(anyhow!(
            "--world {world}: {config} describes a cell without a simulator; a simulated one has `simulator:` in `cell:`"
        )));
    }
    config.cell.simulator = Some(world);
    Ok(())
}

fn check_world(config: &LaunchConfig, path: &Path) -> Result<(), Failure> {
    match &config.cell.simulator {
        Some(world) if !world.is_file() => Err(Failure::usage(anyhow!(
            "{}: simulator: no world file at {}",
            path.display(),
            world.display()
        ))),
        _ => Ok(()),
    }
}

/// The place of a cell in the graph, and who holds it.
struct Cell {
    config: LaunchConfig,
    record: RunningCell,
    observer: Node,
    readiness: Readiness,
    /// Locked until the supervisor is gone.
    _claim: std::fs::File,
}

impl Cell {
    async fn claim(config: &LaunchConfig, path: PathBuf) -> Result<Self, Failure> {
        let options: NodeOptions = config.node_options(OBSERVER);
        let record = RunningCell {
            pid: std::process::id(),
            config: std::path::absolute(path)?,
            namespace: config.cell.namespace.clone(),
            domain_id: options.resolved_domain_id().map_err(Failure::usage)?,
            localhost: options.resolved_discovery_range().map_err(Failure::usage)? == DiscoveryRange::Localhost,
        };
        let claim = record.claim(&running_cell::folder())?;
        let observer = Node::start(options).await?;
        let names: Vec<String> = config.nodes().map(|node| qualified(config, node)).collect();
        Ok(Self {
            readiness: Readiness::new(&observer, &names)?,
            config: config.clone(),
            record,
            observer,
            _claim: claim,
        })
    }

    /// Whether it picks without anybody's `recover`.
    fn is_armed_at_start(&self) -> bool {
        self.config.parameters(ARM).get("arm_at_start") == Some(&ParameterValue::Bool(true))
    }

    fn ready(&self, since: Instant) -> Ready<'_> {
        let has = |name: &str| self.config.nodes().any(|node| node == name);
        let (picks, captures) = (has(COORDINATOR), has(CAPTURER));
        Ready {
            namespace: &self.record.namespace,
            domain_id: self.record.domain_id,
            discovery_range: if self.record.localhost {
                "this machine only"
            } else {
                "the whole subnet"
            },
            simulator: self
                .config
                .cell
                .simulator
                .as_ref()
                .map(|world| world.display().to_string()),
            nodes: self.config.nodes().map(|node| qualified(&self.config, node)).collect(),
            seconds: since.elapsed().as_secs_f64(),
            next: match (picks, captures) {
                (true, _) => &["rakelight pick", "rakelight capture --png pictures"],
                (false, true) => &["rakelight capture --png pictures"],
                (false, false) => &["rakelight doctor"],
            },
        }
    }
}

fn qualified(config: &LaunchConfig, node: &str) -> String {
    format!("{}/{node}", config.cell.namespace.trim_end_matches('/'))
}

/// The simulator, if there is one, and then a process for each group of nodes.
fn members(config: &LaunchConfig, path: &Path) -> Vec<Member> {
    let mut members = Vec::new();
    let mut add = |name: &str, arguments: Vec<OsString>, nodes: &[String], stage| {
        let job = Job {
            name: name.to_owned(),
            index: members.len(),
            arguments,
        };
        members.push(Member {
            job,
            nodes: nodes.to_vec(),
            stage,
        });
    };
    if let Some(world) = &config.cell.simulator {
        add("simulator", simulation(config, world), &[], Stage::Simulator);
    }
    for (name, nodes) in config.cell.processes.iter().filter(|(_, nodes)| !nodes.is_empty()) {
        let mut arguments: Vec<OsString> = vec!["node".into()];
        arguments.extend(nodes.iter().map(OsString::from));
        arguments.extend(["--config".into(), path.into(), "--end-with-stdin".into()]);
        let records = nodes.iter().any(|node| node == RECORDER);
        add(
            name,
            arguments,
            nodes,
            if records { Stage::Recorder } else { Stage::Nodes },
        );
    }
    members
}

/// The world's devices are where the nodes of the config look for them.
fn simulation(config: &LaunchConfig, world: &Path) -> Vec<OsString> {
    let mut arguments: Vec<OsString> = vec!["sim".into(), world.into(), "--end-with-stdin".into()];
    if let Some(ParameterValue::String(port)) = config.parameters(LIGHTS).get("port") {
        arguments.extend(["--light-port".into(), port.into()]);
    }
    let arm = config.parameters(ARM);
    if let (Some(ParameterValue::String(host)), Some(ParameterValue::Integer(port))) =
        (arm.get("host"), arm.get("control_port"))
    {
        arguments.extend(["--arm".into(), format!("{host}:{port}").into()]);
    }
    for (name, value) in config.parameters(CAPTURER) {
        if let (Some(camera), ParameterValue::String(guid)) = (name.strip_suffix(".guid"), value) {
            arguments.extend(["--camera".into(), format!("{camera}={guid}").into()]);
        }
    }
    for (name, value) in config.parameters(CAPTURER) {
        let camera = name.strip_suffix(".ImageFormatControl.BinningHorizontal");
        if let (Some(camera), ParameterValue::Integer(binning @ (1 | 2 | 4))) = (camera, value) {
            arguments.extend(["--binning".into(), format!("{camera}={binning}").into()]);
        }
    }
    arguments
}

/// Starts everything and keeps it alive until something cannot be.
async fn keep_up(
    supervisor: &mut Supervisor,
    members: Vec<Member>,
    cell: &Cell,
    console: &Console,
    started: Instant,
) -> Result<(), Failure> {
    let mut world = None;
    for member in members {
        let simulates = member.stage == Stage::Simulator;
        let ready = supervisor.start(member);
        if simulates {
            wait_for_simulator(supervisor, ready.clone(), console).await?;
            world = Some(ready);
        }
    }
    let starts = supervisor.starts();
    tokio::select! {
        ended = supervisor.next_end() => ended,
        never = announce(cell, world, console, starts, started) => match never {},
    }
}

async fn wait_for_simulator(
    supervisor: &mut Supervisor,
    mut ready: watch::Receiver<bool>,
    console: &Console,
) -> Result<(), Failure> {
    console.waiting(Some(RENDERING));
    tokio::select! {
        ended = supervisor.next_end() => ended,
        is_ready = tokio::time::timeout(SIMULATOR_PATIENCE, ready.wait_for(|ready| *ready)) => match is_ready {
            Ok(_) => Ok(()),
            Err(_) => Err(Failure::from(anyhow!("the simulator is not ready after {SIMULATOR_PATIENCE:?}"))),
        },
    }
}

/// Tells whenever all nodes answer, after every start of a process anew. At first the cell has to be idle if its arm is
/// armed at the start; later it may have been stopped.
async fn announce(
    cell: &Cell,
    world: Option<watch::Receiver<bool>>,
    console: &Console,
    mut starts: watch::Receiver<u64>,
    mut since: Instant,
) -> std::convert::Infallible {
    let mut idle = cell.is_armed_at_start();
    loop {
        starts.borrow_and_update();
        tokio::select! {
            () = all_ready(cell, world.clone(), console, idle) => {
                idle = false;
                console.tell(&Event::Ready(cell.ready(since)));
            }
            () = remind(console) => {}
            _ = starts.changed() => continue,
        }
        // The sender lives in the supervisor, which outlives this.
        let _ = starts.changed().await;
        since = Instant::now();
    }
}

/// Nodes and devices first: the cameras' settings decide what the simulated world has to render.
async fn all_ready(cell: &Cell, world: Option<watch::Receiver<bool>>, console: &Console, idle: bool) {
    cell.readiness.wait(console, idle).await;
    if let Some(mut world) = world {
        console.waiting(Some(RENDERING));
        // The sender lives as long as the simulator.
        let _ = world.wait_for(|ready| *ready).await;
    }
    console.waiting(None);
}

/// Tells again and again what is waited for.
async fn remind(console: &Console) {
    loop {
        tokio::time::sleep(REMINDER).await;
        console.still_waiting();
    }
}

/// A second signal kills what has not ended yet.
async fn take_down(supervisor: &mut Supervisor, signals: &mut Signals) {
    let kill = supervisor.killer();
    let asked_again = async {
        signals.next().await;
        kill.cancel();
        std::future::pending::<()>().await;
    };
    tokio::select! {
        () = supervisor.stop() => {}
        () = asked_again => {}
    }
}
