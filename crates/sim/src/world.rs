//! The simulated world: what stands on the table, how the lights are wired, where the cameras are. Read from a YAML file
//! whose every key has the rig's value as its default; an unknown key or an impossible value is an error that says where
//! it stands.
//!
//! ```yaml
//! seed: 1                       # of the sensors' noise
//! objects:
//!   - shape: octagon2           # or {kind: octagon2, width: 0.08}; or {kind: mesh, file: part.ply, scale: 0.001}
//!     pose: {x: 0.45, yaw: 0.3} # base frame, metres and radians; roll and pitch too, or quaternion: [x, y, z, w]
//!     albedo: 0.85              # or {print: 101, cell: 0.0007, range: [0.15, 0.85]}
//! lights:
//!   port: lights.tty            # a link to the light controller's serial port
//!   panels: {L3: {radiance: 0.9}}
//!   dead: [5]
//!   swapped: [[1, 2]]
//! cameras:
//!   c1: {address: 127.0.0.2, binning: 2}
//!   c2: {trigger_line: 2, read_noise: 8}
//! flange: {x: 0.45, z: 0.36, roll: 3.14159}   # where it carries c1
//! arm:                          # none: the flange stays where it is
//!   address: 127.0.0.4
//!   control_port: 5020          # the hardware's, 502, needs privileges
//!   report_ports: [30001, 30002, 30003]
//!   serial: XI130506SIM001
//!   firmware: v2.5.5
//!   vacuum: 1                   # wiring of the vacuum gripper, 1 or 2
//!   joints: [0, -0.4, 0, 0.7, 0, 1.1, 0]      # in place of `flange`
//!   collisions: stop            # or count: the arm goes on through what it hits
//! bin: {x: 0.18, y: 0.36, yaw: 0, size: 0.18, height: 0.06}   # of its inside
//! scatter: {seed: 1, count: 5}  # more objects, drawn at random: see `Scatter`
//! room: {mat_albedo: 0.04, walls: []}
//! ambient: 0.0009               # radiance from everywhere, in the panels' unit
//! ```

use std::net::Ipv4Addr;
use std::path::{Path, PathBuf};

use geometry::{PinholeCamera, RigidTransform};
use xarm_protocol::{Firmware, VacuumHardware};

use crate::SimError;
use crate::arm::ArmPorts;
use crate::scene::{Scene, View};
use crate::sensor::Sensor;

mod arm;
mod bin;
mod cameras;
mod file;
mod lights;
mod objects;
mod pose;
mod room;
mod scatter;

pub use arm::Collisions;
pub use bin::Bin;
pub use scatter::{KINDS_TO_SCATTER, Region, Scatter};

/// Everything there is.
#[derive(Debug, Clone, PartialEq)]
pub struct World {
    /// Of the sensors' noise: the same world gives the same images.
    pub seed: u64,
    /// How light is switched.
    pub lights: Lights,
    /// C1 and C2.
    pub cameras: Vec<Camera>,
    /// None: nothing but a flange that stays where it is.
    pub arm: Option<Arm>,
    /// Where the arm holds its flange.
    pub base_from_flange: RigidTransform,
    /// Where the cup drops what it picked.
    pub bin: Bin,
    /// Objects, room and panels, as they are.
    pub scene: Scene,
}

/// The light controller and its wires.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lights {
    /// A symbolic link to the controller's serial port.
    pub port: Option<PathBuf>,
    /// For the outputs L1 to L7 the number of the panel that hangs on it, 1 to 7; none is a dead one.
    pub wiring: [Option<u8>; 7],
}

/// The arm's controller, and the arm when it is switched on.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// Where it is on the network.
    pub address: Ipv4Addr,
    /// Control and reports.
    pub ports: ArmPorts,
    /// Of the arm; its joint limits follow from it.
    pub serial: String,
    /// Of the control box.
    pub firmware: Firmware,
    /// How the vacuum gripper is wired.
    pub vacuum: VacuumHardware,
    /// Radians.
    pub joints: [f64; 7],
    /// What happens when it hits something.
    pub collisions: Collisions,
}

/// A camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// `c1` or `c2`.
    pub name: String,
    /// What it calls itself on the network.
    pub serial: String,
    /// Where it is on the network.
    pub address: Ipv4Addr,
    /// Lens and sensor, without binning.
    pub lens: PinholeCamera,
    /// What holds it.
    pub mount: Mount,
    /// The light controller's trigger line that it listens to, 1 or 2.
    pub trigger_line: u8,
    /// From light to numbers.
    pub sensor: Sensor,
    /// The binning that a client will probably ask for: it is rendered first.
    pub binning: u32,
}

/// What holds a camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mount {
    /// Eye to hand.
    Table {
        /// Fixed.
        base_from_camera: RigidTransform,
    },
    /// Eye in hand.
    Flange {
        /// Fixed.
        flange_from_camera: RigidTransform,
    },
}

impl World {
    /// Reads a world file. Relative paths in it begin at its folder.
    pub fn read(path: &Path) -> Result<Self, SimError> {
        let text = std::fs::read_to_string(path).map_err(|reason| SimError::ReadFile {
            path: path.to_owned(),
            reason,
        })?;
        let folder = path.parent().unwrap_or(Path::new(""));
        Self::from_yaml(&text, folder).map_err(|reason| SimError::World {
            path: path.to_owned(),
            reason: Box::new(reason),
        })
    }

    /// From a world file's text; relative paths in it begin at `folder`. An empty text is the rig with nothing in it.
    pub fn from_yaml(text: &str, folder: &Path) -> Result<Self, SimError> {
        let file: Option<file::WorldFile> = serde_yaml_ng::from_str(text)?;
        file.unwrap_or_default().resolve(folder)
    }

    /// What a camera sees when `binning` columns and rows of its sensor are averaged.
    pub fn view(&self, camera: &Camera, binning: [u32; 2]) -> Result<View, SimError> {
        Ok(View {
            camera: camera.binned_lens(binning)?,
            base_from_camera: self.base_from_camera(camera),
        })
    }

    /// Where a camera is.
    pub fn base_from_camera(&self, camera: &Camera) -> RigidTransform {
        camera.mount.base_from_camera(&self.base_from_flange)
    }

    /// The camera of this name.
    pub fn camera(&self, name: &str) -> Option<&Camera> {
        self.cameras.iter().find(|camera| camera.name == name)
    }
}

impl Camera {
    /// Of an image in which `binning` columns and rows of the sensor are averaged.
    pub(crate) fn binned_lens(&self, binning: [u32; 2]) -> Result<PinholeCamera, SimError> {
        binned(&self.lens, binning)
    }
}

impl Mount {
    /// Where the camera is when the flange is there.
    pub fn base_from_camera(&self, base_from_flange: &RigidTransform) -> RigidTransform {
        match *self {
            Self::Table { base_from_camera } => base_from_camera,
            Self::Flange { flange_from_camera } => *base_from_flange * flange_from_camera,
        }
    }
}

/// As cameras do it: columns and rows that do not fill a binned pixel are lost.
fn binned(lens: &PinholeCamera, binning: [u32; 2]) -> Result<PinholeCamera, SimError> {
    let [x, y] = binning.map(|factor| factor.max(1));
    let scale = [f64::from(x), f64::from(y)];
    let both =
        |values: [f64; 2], convert: fn(f64, f64) -> f64| [convert(values[0], scale[0]), convert(values[1], scale[1])];
    let camera = PinholeCamera::new(
        lens.width() / x as usize,
        lens.height() / y as usize,
        both(lens.focal(), |focal, scale| focal / scale),
        // Integer positions are the middles of pixels.
        both(lens.principal(), |principal, scale| (principal + 0.5) / scale - 0.5),
    )?;
    Ok(camera.with_distortion(lens.distortion()))
}
