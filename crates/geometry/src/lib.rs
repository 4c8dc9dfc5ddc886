//! Rigid transforms between named frames and the pinhole camera with distortion.
