//! The cell that is measured: simulated in this process, its nodes in processes of their own.

use std::time::Duration;

use scenarios::{Domain, NodeProcesses, Place, rakelight, repository};
use sim::cell::{Cell, CellOptions};
use sim::world::World;
use tokio::process::Command;

use crate::pins::Pins;

/// How long each panel is on, microseconds: the exposure and the node's margin, both as configured by default.
pub(crate) const ON_MICROS: f64 = 3500.0;

/// What a stock kernel grants a UDP socket, whatever this machine allows.
const KERNEL_DEFAULT_BUFFER: &str = "212992";

/// How the cameras' frames travel.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Transport {
    /// Kernel defaults, and no capability for anything else.
    Udp,
    PacketSocket,
}

/// The default scene with all pixels, at addresses of its own.
pub(crate) fn world(place: &Place) -> anyhow::Result<World> {
    let mut world = World::read(&repository().join("launch_configs/worlds/table.yaml"))?;
    for camera in &mut world.cameras {
        camera.binning = 1;
    }
    Ok(place.settle(world))
}

/// Serves it, and tells `pins` what the board's pins do.
pub(crate) fn simulated_cell(world: World, pins: &Pins) -> anyhow::Result<Cell> {
    let taker = pins.clone();
    let cell = Cell::start_watched(world, &CellOptions::default(), move |edge| taker.take(edge))?;
    cell.wait_until_rendered(Duration::from_mins(5))?;
    Ok(cell)
}

/// Those that a capture and its recording need.
pub(crate) fn start(domain: &Domain, place: &Place, transport: Transport) -> anyhow::Result<NodeProcesses> {
    let config = place.config("sim_full.yaml")?;
    let mut nodes = NodeProcesses::default();
    for node in ["light_sequencer", "camera_capture", "bag_recorder"] {
        let mut command = program(transport)?;
        command
            .args(["node", node, "--end-with-stdin", "--config"])
            .arg(&config);
        if node == "camera_capture" {
            command.args(transport_arguments(transport));
        }
        command.env("RAKELIGHT_SOCKET_BUFFER_BYTES", KERNEL_DEFAULT_BUFFER);
        nodes.start_command(domain, command)?;
    }
    Ok(nodes)
}

/// The command line, without the capability for packet sockets where they shall not be used.
fn program(transport: Transport) -> anyhow::Result<Command> {
    let program = rakelight()?;
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
