//! What the end-to-end tests share: isolated domains, child processes that end with the test, bounded waits, the
//! warnings that the code under test gives, and images with a known pattern.
//!
//! It is not a test itself: those are in `tests/`, with Rust peers, and in `rclpy/`, with rclpy peers.
//!
//! ```no_run
//! use scenarios::{Domain, Program};
//! # async fn example() {
//! let domain = Domain::claim();
//! let node = domain.node("observer").await;
//! let mut probe = Program::start(&domain, "target/debug/probe_node", &["--map-size", "1536"]);
//! probe.wait_for_line("ready");
//! # }
//! ```

pub mod patterns;
pub mod resources;
pub mod stand_ins;

mod domain;
mod logs;
mod picking_cell;
mod place;
mod program;
mod rendered_capture;
mod statistics;
mod waiting;

pub use domain::Domain;
pub use logs::Logs;
pub use picking_cell::{PickingCell, PickingOptions, table_with};
pub use place::{NodeProcesses, Place, rakelight, repository};
pub use program::Program;
pub use rendered_capture::RenderedCapture;
pub use statistics::quantile;
pub use waiting::{TIMEOUT, eventually, within};
