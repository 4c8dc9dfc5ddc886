//! The world, its cameras, its lights and its arm, together: two GigE Vision cameras that expose while the pins of the
//! simulated light controller light panels and pulse trigger lines, and an arm that carries one of them.
//!
//! ```no_run
//! use std::time::Duration;
//!
//! use sim::cell::{Cell, CellOptions};
//! use sim::world::World;
//!
//! let world = World::read("launch_configs/worlds/table.yaml".as_ref())?;
//! let cell = Cell::start(world, &CellOptions::default())?;
//! println!("lights at {}", cell.board().port().display());
//! cell.wait_until_rendered(Duration::from_secs(60))?;
//! # Ok::<(), sim::SimError>(())
//! ```

use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use geometry::RigidTransform;
use gige_vision::Server;
use gige_vision::gvcp::GVCP_PORT;

use crate::SimError;
use crate::arm::ArmController;
use crate::board::{BoardConfig, Edge, LightBoard, Pin};
use crate::world::{Camera, World};
use darkroom::Darkroom;
use eye::Eye;
use gallery::Gallery;
use mount::MountedArm;
use settings::Settings;
use stock::Stock;
use wires::Wires;

mod contact;
mod darkroom;
mod eye;
mod follower;
mod gallery;
mod mount;
mod settings;
mod stock;
mod timeline;
mod unchanged;
mod wires;

pub use contact::WorldContact;
pub use gallery::Sight;
pub use stock::{ObjectState, Place};

/// How often a camera's settings are looked at, to have images of the right kind ready.
const LOOK_AROUND: Duration = Duration::from_millis(50);

/// How a cell is set up, apart from its world.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CellOptions {
    /// Of the cameras. Only the standard one is found by others' clients; 0 takes any that is free.
    pub control_port: u16,
    /// The light controller. Without a link of its own it gets that of the world.
    pub board: BoardConfig,
    /// How long a frame waits for its view to be rendered, before it is given up.
    pub patience: Duration,
}

impl Default for CellOptions {
    fn default() -> Self {
        Self {
            control_port: GVCP_PORT,
            board: BoardConfig::default(),
            patience: Duration::from_mins(1),
        }
    }
}

/// A running cell. Dropping it ends everything it started.
pub struct Cell {
    // The board's thread calls the servers: it has to end first.
    board: Arc<LightBoard>,
    wires: Arc<Wires>,
    served: Arc<[Served]>,
    gallery: Arc<Gallery>,
    stock: Arc<Stock>,
    arm: Option<MountedArm>,
    threads: Vec<JoinHandle<()>>,
}

/// A camera on the network.
struct Served {
    name: String,
    trigger_line: u8,
    server: Server,
    darkroom: Arc<Darkroom>,
}

impl Cell {
    /// Serves the cameras, switches the light controller on and begins to render.
    pub fn start(world: World, options: &CellOptions) -> Result<Self, SimError> {
        Self::start_watched(world, options, |_| {})
    }

    /// The same; `watcher` is shown every edge of the light controller's pins, in order, and must not block.
    pub fn start_watched(
        world: World,
        options: &CellOptions,
        mut watcher: impl FnMut(&Edge) + Send + 'static,
    ) -> Result<Self, SimError> {
        let mut config = options.board.clone();
        config.link = config.link.or_else(|| world.lights.port.clone());
        let cameras = world.cameras.clone();
        let stock = Arc::new(Stock::new(&world)?);
        let arm = world.arm.clone();
        let gallery = Arc::new(Gallery::new(world, stock.inventory().places()));
        let arm = arm.map(|arm| MountedArm::start(&arm, &gallery, &stock)).transpose()?;
        let wires = Arc::new(Wires::default());
        let serve = |(index, camera)| serve(index, camera, &gallery, &wires, options);
        let served: Arc<[Served]> = cameras.iter().enumerate().map(serve).collect::<Result<_, _>>()?;
        let (listeners, lines) = (Arc::clone(&served), Arc::clone(&wires));
        let board = Arc::new(LightBoard::start(&config, move |edge| {
            watcher(&edge);
            feel(edge, &listeners, &lines);
        })?);
        wires.connect(Some(Arc::clone(&board)));
        let threads = start_threads(&gallery, &served);
        Ok(Self {
            board,
            wires,
            served,
            gallery,
            stock,
            arm,
            threads,
        })
    }

    /// The camera of this name as it is on the network, to see what it does and to make it fail.
    pub fn camera(&self, name: &str) -> Option<&Server> {
        Some(&self.served[self.index(name)?].server)
    }

    /// The light controller.
    pub fn board(&self) -> &LightBoard {
        &self.board
    }

    /// The arm's controller, to see what it does and to make it fail; none in a world without.
    pub fn arm(&self) -> Option<&ArmController> {
        self.arm.as_ref().map(MountedArm::controller)
    }

    /// The world's objects, in its order, and where they went.
    pub fn objects(&self) -> Vec<ObjectState> {
        let base_from_cup = self.arm.as_ref().map(MountedArm::base_from_cup);
        self.stock.objects(base_from_cup.as_ref())
    }

    /// What the arm, or what it carried, has hit so far, oldest first.
    pub fn collisions(&self) -> Vec<WorldContact> {
        self.arm.as_ref().map_or_else(Vec::new, MountedArm::collisions)
    }

    /// As it is now.
    pub fn world(&self) -> Arc<World> {
        self.gallery.world()
    }

    /// Changes the world from the next frame on: every object is where it says, cup and bin are empty. What is on the
    /// network has to stay: the cameras' addresses, serial numbers, sensor sizes and trigger lines, the lights' port, and
    /// the arm, which stays where it went.
    pub fn set_world(&self, mut world: World) -> Result<(), SimError> {
        unchanged::check(&world, &self.world())?;
        let arm_changed_it = self.stock.reset(&world)?;
        if let Some(arm) = &self.arm {
            arm.let_go();
            world.base_from_flange = arm.controller().moment().base_from_flange;
        }
        let inventory = self.stock.inventory();
        self.gallery.set_world(world, inventory.number, inventory.places());
        if arm_changed_it {
            tracing::info!("every object is back where the world says; cup and bin are empty");
        }
        Ok(())
    }

    /// Moves the flange, and with it the camera that hangs on it; an arm moves it by itself.
    pub fn set_flange(&self, base_from_flange: RigidTransform) {
        self.gallery.set_flange(base_from_flange);
    }

    /// Waits until every camera's view of the present world is rendered, at the binning that it is set to.
    pub fn wait_until_rendered(&self, timeout: Duration) -> Result<(), SimError> {
        let end = Instant::now() + timeout;
        for camera in 0..self.served.len() {
            let left = end.saturating_duration_since(Instant::now());
            self.gallery.wait_for_wanted(camera, left)?;
        }
        Ok(())
    }

    /// Whether every camera's view of the present world is rendered; fails when one cannot be.
    pub fn is_rendered(&self) -> Result<bool, SimError> {
        for camera in 0..self.served.len() {
            if !self.gallery.is_rendered(camera)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Whether every camera's view is rendered as it will be when the arm is back where frames were taken, and its cup
    /// empty: frames come at once then. False as long as it is not known where that is.
    pub fn is_prepared(&self) -> bool {
        (0..self.served.len()).all(|camera| self.gallery.is_prepared(camera))
    }

    /// What a camera sees at the binning that it is set to, with the truth about it; none before it is rendered.
    pub fn sight(&self, name: &str) -> Option<Arc<Sight>> {
        Some(self.gallery.current(self.index(name)?)?.sight)
    }

    fn index(&self, name: &str) -> Option<usize> {
        self.served.iter().position(|served| served.name == name)
    }
}

impl Drop for Cell {
    fn drop(&mut self) {
        self.gallery.end();
        self.wires.connect(None);
        // It looks at all the rest.
        self.arm = None;
        for served in self.served.iter() {
            served.darkroom.end();
        }
        for thread in self.threads.drain(..) {
            // A thread that panicked has said so on standard error.
            let _ = thread.join();
        }
    }
}

fn serve(
    index: usize,
    camera: &Camera,
    gallery: &Arc<Gallery>,
    wires: &Arc<Wires>,
    options: &CellOptions,
) -> Result<Served, SimError> {
    let darkroom = Arc::new(Darkroom::new(index));
    let started = Arc::new(OnceLock::new());
    let eye = Eye {
        camera: index,
        gallery: Arc::clone(gallery),
        darkroom: Arc::clone(&darkroom),
        wires: Arc::clone(wires),
        started: Arc::clone(&started),
        patience: options.patience,
    };
    let server = Server::start_on_port(&camera.device_config(), options.control_port, eye).map_err(|reason| {
        SimError::Camera {
            name: camera.name.clone(),
            reason,
        }
    })?;
    let now = Instant::now();
    // Device time began when the server did, which is a valid instant; and nobody else sets this.
    let _ = started.set(now.checked_sub(server.device_time(now)).unwrap_or(now));
    Ok(Served {
        name: camera.name.clone(),
        trigger_line: camera.trigger_line,
        server,
        darkroom,
    })
}

/// On the board's thread, for every edge in turn.
fn feel(edge: Edge, cameras: &[Served], wires: &Wires) {
    match edge.pin {
        Pin::Panel(output) => wires.record(output, edge.at, edge.high),
        Pin::Trigger(line) if edge.high => {
            for camera in cameras.iter().filter(|camera| camera.trigger_line == line) {
                camera.server.line_trigger(edge.at);
            }
        }
        Pin::Trigger(_) => {}
    }
}

fn start_threads(gallery: &Arc<Gallery>, served: &Arc<[Served]>) -> Vec<JoinHandle<()>> {
    let renderer = Arc::clone(gallery);
    let mut threads = vec![std::thread::spawn(move || renderer.run())];
    for camera in 0..served.len() {
        let (gallery, served) = (Arc::clone(gallery), Arc::clone(served));
        threads.push(std::thread::spawn(move || {
            work_ahead(camera, &gallery, &served[camera]);
        }));
    }
    threads
}

/// Has the view of the binning rendered that a client set, and its next images ready.
fn work_ahead(camera: usize, gallery: &Gallery, served: &Served) {
    let mut at_once = false;
    while at_once || served.darkroom.rest(LOOK_AROUND) {
        at_once = look_ahead(camera, gallery, served).unwrap_or_else(|error| {
            tracing::warn!("camera {} cannot work ahead: {error}", served.name);
            false
        }) && served.darkroom.rest(Duration::ZERO);
    }
}

fn look_ahead(camera: usize, gallery: &Gallery, served: &Served) -> Result<bool, SimError> {
    let Some(settings) = Settings::of_server(&served.server) else {
        return Ok(false);
    };
    // Before a client came, the world's guess is better than the device's default.
    if served.server.controller().is_some() {
        gallery.want(camera, settings.binning);
    }
    match gallery.probable(camera, settings.binning) {
        Some(exhibit) => served.darkroom.work_ahead(&exhibit, &settings),
        None => Ok(false),
    }
}
