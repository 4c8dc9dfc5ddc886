//! The cell that is measured: simulated in this process, its nodes in processes of their own.

use std::net::Ipv4Addr;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Duration;

use anyhow::{Context, bail};
use scenarios::Domain;
use sim::cell::{Cell, CellOptions};
use sim::world::World;
use tokio::process::{Child, Command};

use crate::pins::Pins;

/// How long each panel is on, microseconds: the exposure and the node's margin, both as configured by default.
pub(crate) const ON_MICROS: f64 = 3500.0;

/// What the nodes are started with.
const CONFIG: &str = "launch_configs/sim_full.yaml";
const WORLD: &str = "launch_configs/worlds/table.yaml";
/// As in these two files.
const PORT: &str = "/tmp/rakelight-lights";
const ADDRESSES: [&str; 2] = ["127.0.0.2", "127.0.0.3"];

/// What a stock kernel grants a UDP socket, whatever this machine allows.
const KERNEL_DEFAULT_BUFFER: &str = "212992";

const PATIENCE: Duration = Duration::from_secs(30);

/// How the cameras' frames travel.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Transport {
    /// Kernel defaults, and no capability for anything else.
    Udp,
    PacketSocket,
}

/// The nodes' processes, as in the launch config.
pub(crate) struct Nodes {
    processes: Vec<Child>,
}

/// The default scene at addresses of its own, so that a running cell is left alone.
pub(crate) fn world(folder: &Path) -> anyhow::Result<World> {
    let mut world = World::read(&repository().join(WORLD))?;
    world.lights.port = Some(port(folder));
    for (camera, address) in world.cameras.iter_mut().zip(addresses()) {
        camera.address = address;
        camera.binning = 1;
    }
    Ok(world)
}

/// Serves it, and tells `pins` what the board's pins do.
pub(crate) fn simulated_cell(world: World, pins: &Pins) -> anyhow::Result<Cell> {
    let taker = pins.clone();
    let cell = Cell::start_watched(world, &CellOptions::default(), move |edge| taker.take(edge))?;
    cell.wait_until_rendered(Duration::from_mins(5))?;
    Ok(cell)
}

impl Nodes {
    pub(crate) fn start(domain: &Domain, folder: &Path, transport: Transport) -> anyhow::Result<Self> {
        let config = config(folder)?;
        let processes = ["light_sequencer", "camera_capture", "bag_recorder"].map(|node| {
            let mut command = program(transport)?;
            command
                .args(["node", node, "--end-with-stdin", "--config"])
                .arg(&config);
            if node == "camera_capture" {
                command.args(transport_arguments(transport));
            }
            command
                .envs(domain.environment())
                .env("RAKELIGHT_SOCKET_BUFFER_BYTES", KERNEL_DEFAULT_BUFFER)
                .stdin(Stdio::piped())
                .stdout(Stdio::null())
                .kill_on_drop(true);
            command.spawn().with_context(|| format!("cannot start {command:?}"))
        });
        let processes = processes.into_iter().collect::<anyhow::Result<_>>()?;
        Ok(Self { processes })
    }

    pub(crate) async fn stop(mut self) -> anyhow::Result<()> {
        for process in &mut self.processes {
            drop(process.stdin.take());
            let status = tokio::time::timeout(PATIENCE, process.wait())
                .await
                .context("a node does not end")??;
            if !status.success() {
                bail!("a node ended with {status}");
            }
        }
        Ok(())
    }
}

/// The command line, without the capability for packet sockets where they shall not be used.
fn program(transport: Transport) -> anyhow::Result<Command> {
    let folder = std::env::var_os("RAKELIGHT_BIN_DIR").map(PathBuf::from);
    let folder = folder.context("RAKELIGHT_BIN_DIR is not set; start with `cargo xtask bench capture`")?;
    let program = folder.join("rakelight");
    if transport == Transport::PacketSocket {
        return Ok(Command::new(program));
    }
    let mut command = Command::new("setpriv");
    command
        .args(["--bounding-set=-net_raw", "--inh-caps=-net_raw", "--"])
        .arg(program);
    Ok(command)
}

fn transport_arguments(transport: Transport) -> Vec<String> {
    let allowed = transport == Transport::PacketSocket;
    let parameter = |name: String| ["-p".to_owned(), name];
    let cameras = ["c1", "c2"].into_iter().flat_map(|camera| {
        let place = format!("{camera}.TransportLayerControl");
        [
            parameter(format!("{place}.packet_socket:={allowed}")),
            parameter(format!("{place}.socket_buffer:={KERNEL_DEFAULT_BUFFER}")),
        ]
    });
    ["--ros-args".to_owned()].into_iter().chain(cameras.flatten()).collect()
}

/// The launch config of the full-size cell, at this bench's addresses.
fn config(folder: &Path) -> anyhow::Result<PathBuf> {
    let source = repository().join(CONFIG);
    let text = std::fs::read_to_string(&source).with_context(|| format!("cannot read {}", source.display()))?;
    let mut text = text.replace("$(dirname)", &source.with_file_name("").display().to_string());
    for (from, to) in ADDRESSES.into_iter().zip(addresses()) {
        text = text.replace(from, &to.to_string());
    }
    let text = text.replace(PORT, &port(folder).display().to_string());
    let world = format!("simulator: {}", repository().join(WORLD).display());
    let text = text.replace("simulator: worlds/table.yaml", &world);
    let path = folder.join("cell.yaml");
    std::fs::write(&path, text)?;
    Ok(path)
}

fn port(folder: &Path) -> PathBuf {
    folder.join("lights")
}

/// Of loopback, for this process alone.
fn addresses() -> [Ipv4Addr; 2] {
    let [.., middle, low] = std::process::id().to_be_bytes();
    [1, 2].map(|last| Ipv4Addr::new(127, 64 + (middle & 63), low, last))
}

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}
