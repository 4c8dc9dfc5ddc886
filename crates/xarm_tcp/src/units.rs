//! The arm speaks millimetres, the cell metres; this is the only place that knows both.

/// Metres of a length on the wire.
pub(crate) fn metres(millimetres: f32) -> f64 {
    f64::from(millimetres) / 1000.0
}
