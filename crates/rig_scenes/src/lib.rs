//! Captures kept as folders of pictures with truth beside them: what evaluations and tests read.
//!
//! A scene folder holds `scene.json` and a folder for each camera with `dark.png`, `L1.png` to `L7.png`, `mask.png` and,
//! where the truth is known, `gt.npz`. The true lights in `scene.json` are for diagnosis; nothing here hands them to a
//! solver. Not for live captures and bags: those are `recording`'s.

mod error;
mod npz;
mod scene;
mod view;
mod write;

pub use error::SceneError;
pub use npz::read_array;
pub use scene::{Hemisphere, SceneFolder, find_scenes};
pub use view::{CapturedView, Truth};
pub use write::{SceneView, write_scene};
