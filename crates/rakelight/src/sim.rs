//! `rakelight sim WORLD.yaml`: the simulated cell's cameras, light controller and arm, for drivers to open as if they were
//! hardware.

mod overrides;
mod pictures;

use std::io::Write;
use std::net::SocketAddrV4;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use anyhow::Context;
use clap::Args;
use sim::cell::{Cell, CellOptions};
use sim::world::World;

use crate::ending::asked_to_end;
use crate::failure::Failure;
use overrides::{CameraBinning, CameraPlace, Overrides};

/// How often it is looked whether the views are rendered.
const LOOK_AROUND: Duration = Duration::from_millis(20);
/// How often it is looked whether the world file has changed.
const REREAD: Duration = Duration::from_secs(1);

#[derive(Args)]
pub(crate) struct Arguments {
    /// World file, for instance `launch_configs/worlds/table.yaml`. It is read again when it changes.
    world: PathBuf,
    /// Link to the light controller's serial port, in place of the world file's.
    #[arg(long, value_name = "PATH")]
    light_port: Option<PathBuf>,
    /// Address or serial number of a camera, in place of the world file's.
    #[arg(long = "camera", value_name = "c1=127.0.0.9")]
    cameras: Vec<CameraPlace>,
    /// Binning that a camera will be set to, so that it is rendered at once, in place of the world file's.
    #[arg(long = "binning", value_name = "c1=2")]
    binnings: Vec<CameraBinning>,
    /// Address and control port of the arm, in place of the world file's.
    #[arg(long = "arm", value_name = "127.0.0.9:5020")]
    arm: Option<SocketAddrV4>,
    /// Stop when standard input ends, as well as on Ctrl-C.
    #[arg(long)]
    end_with_stdin: bool,
    /// Write what each camera would see under each light, and the truth about it, to this folder and end.
    #[arg(long, value_name = "DIR")]
    png: Option<PathBuf>,
}

pub(crate) async fn run(arguments: Arguments) -> Result<(), Failure> {
    let overrides = Overrides {
        light_port: arguments.light_port,
        cameras: arguments.cameras,
        binnings: arguments.binnings,
        arm: arguments.arm,
    };
    let world = overrides.read(&arguments.world).map_err(Failure::usage)?;
    if let Some(folder) = arguments.png {
        return Ok(pictures::write(&world, &folder)?);
    }
    let changed_at = changed_at(&arguments.world);
    let started = Instant::now();
    let cell = Cell::start(world, &CellOptions::default())?;
    say(&devices(&cell))?;
    tokio::select! {
        ended = asked_to_end(arguments.end_with_stdin) => Ok(ended?),
        failed = serve(&cell, started) => failed,
        never = follow(&cell, &arguments.world, changed_at, &overrides) => match never {},
    }
}

/// Tells whenever the cell becomes ready, and when it is no longer: until new views are rendered, no frame comes.
async fn serve(cell: &Cell, mut since: Instant) -> Result<(), Failure> {
    loop {
        while !cell.is_rendered()? {
            tokio::time::sleep(LOOK_AROUND).await;
        }
        say(&format!("rendered in {:.1} s\nready\n", since.elapsed().as_secs_f64()))?;
        while cell.is_rendered()? {
            tokio::time::sleep(LOOK_AROUND).await;
        }
        since = Instant::now();
        say("rendering\n")?;
    }
}

fn devices(cell: &Cell) -> String {
    let world = cell.world();
    let camera = |camera: &sim::world::Camera| format!("camera {} {} {}\n", camera.name, camera.serial, camera.address);
    let cameras: String = world.cameras.iter().map(camera).collect();
    let arm = cell
        .arm()
        .map(|arm| format!("arm {}:{}\n", arm.address(), arm.ports().control));
    let lights = cell.board().port().display();
    format!("{cameras}lights {lights}\n{}", arm.unwrap_or_default())
}

/// At once, also into a pipe.
fn say(text: &str) -> std::io::Result<()> {
    let mut output = std::io::stdout().lock();
    output.write_all(text.as_bytes())?;
    output.flush()
}

/// Changes the world whenever its file changes; one that is not valid is named and changes nothing.
async fn follow(
    cell: &Cell,
    path: &Path,
    mut known: Option<SystemTime>,
    overrides: &Overrides,
) -> std::convert::Infallible {
    loop {
        tokio::time::sleep(REREAD).await;
        // A file that is being replaced is not there for a moment.
        let Some(now) = changed_at(path).filter(|now| Some(*now) != known) else {
            continue;
        };
        known = Some(now);
        match overrides.read(path).and_then(|world| change(cell, world)) {
            Ok(()) => tracing::info!("read {} again", path.display()),
            Err(error) => tracing::error!("the world stays as it was: {error:#}"),
        }
    }
}

fn change(cell: &Cell, world: World) -> anyhow::Result<()> {
    cell.set_world(world).context("this cannot change while the cell runs")
}

fn changed_at(path: &Path) -> Option<SystemTime> {
    std::fs::metadata(path).and_then(|metadata| metadata.modified()).ok()
}
