//! The simulated cell: a world of objects under seven panels, what its cameras see of it, and the devices of the cell as
//! real wires speak to them. It depends on protocols, never on the drivers that talk to it: whatever runs against it
//! runs against hardware.
//!
//! - [`world`]: the world file, the objects, the cameras' places.
//! - [`render`]: what a camera sees of a [`scene::Scene`], one radiance image per light.
//! - [`board`]: the light controller's firmware on a simulated microcontroller behind a pseudo-terminal.
//! - [`arm`]: the xArm7's controller behind its TCP ports, and the arm that it moves.
//! - [`cell`]: all of it together: two cameras on the network that expose while the board's pins light panels, and the arm
//!   that picks objects up, drops them and hits them.

pub mod arm;
pub mod board;
pub mod cell;
mod error;
pub mod objects;
mod physics;
pub mod render;
pub mod scene;
pub mod sensor;
pub mod world;

pub use error::SimError;
