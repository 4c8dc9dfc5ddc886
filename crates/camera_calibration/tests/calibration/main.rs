//! Calibrations against cameras, targets and arms that are known.

mod detect;
mod hand_eye;
mod intrinsics;
mod rendering;
mod scenes;
