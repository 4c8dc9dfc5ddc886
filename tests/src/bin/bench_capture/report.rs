//! The figures, for people and as JSON.

use std::fmt;

use scenarios::quantile;
use serde::Serialize;

use crate::measure::{Captures, IMAGES};
use crate::nodes::ON_MICROS;
use crate::rendering::Rendering;

/// What the benchmark found. The keys are its contract.
#[derive(Serialize)]
pub(crate) struct Report {
    /// With kernel defaults and without the capability for packet sockets: call to answer, milliseconds.
    median_ms: Option<f64>,
    p99_ms: Option<f64>,
    frames_expected: usize,
    frames_received: usize,
    void_captures: usize,
    /// The same with packet sockets.
    packet_socket: Transported,
    /// Largest difference of a panel's on-time, as seen on the simulated pins, from what was asked for.
    on_time_error_us: Option<f64>,
    on_times: usize,
    recording: Recording,
    /// How much longer a capture takes while it is recorded, per cent.
    recording_cost_percent: f64,
    render_768_s: f64,
    render_1536_s: f64,
    reasons: Vec<String>,
    kernel: String,
}

#[derive(Serialize)]
struct Transported {
    median_ms: Option<f64>,
    p99_ms: Option<f64>,
    frames_expected: usize,
    frames_received: usize,
    void_captures: usize,
}

/// What recording costs, milliseconds, and whether all was recorded.
#[derive(Serialize)]
pub(crate) struct Recording {
    pub(crate) with_ms: f64,
    pub(crate) without_ms: f64,
    pub(crate) images_expected: usize,
    pub(crate) images_recorded: usize,
}

impl Report {
    pub(crate) fn new(
        udp: Captures,
        packet_socket: Captures,
        on_micros: &[f64],
        recording: Recording,
        rendering: Rendering,
    ) -> Self {
        let errors = on_micros.iter().map(|micros| (micros - ON_MICROS).abs());
        let plain = Transported::of(&udp);
        Self {
            median_ms: plain.median_ms,
            p99_ms: plain.p99_ms,
            frames_expected: plain.frames_expected,
            frames_received: plain.frames_received,
            void_captures: plain.void_captures,
            packet_socket: Transported::of(&packet_socket),
            on_time_error_us: errors.reduce(f64::max),
            on_times: on_micros.len(),
            recording_cost_percent: 100.0 * (recording.with_ms / recording.without_ms - 1.0),
            recording,
            render_768_s: rendering.binned_s,
            render_1536_s: rendering.full_s,
            reasons: [udp.reasons, packet_socket.reasons].concat(),
            kernel: scenarios::resources::kernel_buffers(),
        }
    }

    /// Whether every image of every capture came, at the first attempt.
    pub(crate) fn complete(&self) -> bool {
        let whole = |expected, received, void| expected > 0 && expected == received && void == 0;
        let packets = &self.packet_socket;
        whole(self.frames_expected, self.frames_received, self.void_captures)
            && whole(packets.frames_expected, packets.frames_received, packets.void_captures)
            && self.recording.images_expected == self.recording.images_recorded
    }
}

impl Transported {
    fn of(captures: &Captures) -> Self {
        Self {
            median_ms: quantile(&captures.millis, 0.5),
            p99_ms: quantile(&captures.millis, 0.99),
            frames_expected: IMAGES * captures.asked,
            frames_received: captures.images,
            void_captures: captures.void,
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let figure = |ms: Option<f64>| ms.map_or_else(|| "-".to_owned(), |ms| format!("{ms:.1}"));
        writeln!(
            f,
            "{:>16} {:>10} {:>8} {:>12} {:>6}",
            "transport", "median ms", "p99 ms", "frames", "void"
        )?;
        let packets = &self.packet_socket;
        for (name, median, p99, received, expected, void) in [
            (
                "UDP",
                self.median_ms,
                self.p99_ms,
                self.frames_received,
                self.frames_expected,
                self.void_captures,
            ),
            (
                "packet socket",
                packets.median_ms,
                packets.p99_ms,
                packets.frames_received,
                packets.frames_expected,
                packets.void_captures,
            ),
        ] {
            let frames = format!("{received}/{expected}");
            writeln!(
                f,
                "{name:>16} {:>10} {:>8} {frames:>12} {void:>6}",
                figure(median),
                figure(p99)
            )?;
        }
        let error = self
            .on_time_error_us
            .map_or_else(|| "-".to_owned(), |error| format!("{error:.2}"));
        writeln!(f, "on-time of a panel: {error} us off at most, {} times", self.on_times)?;
        let Recording {
            with_ms,
            without_ms,
            images_expected,
            images_recorded,
        } = &self.recording;
        writeln!(
            f,
            "recording: {with_ms:.1} ms with, {without_ms:.1} ms without ({:+.1} %), {images_recorded} of \
             {images_expected} images in the bags",
            self.recording_cost_percent
        )?;
        writeln!(
            f,
            "rendering both views: {:.1} s at 768 x 768, {:.1} s at 1536 x 1536",
            self.render_768_s, self.render_1536_s
        )?;
        writeln!(f, "socket buffers: {}", self.kernel)?;
        self.reasons.iter().try_for_each(|reason| writeln!(f, "void: {reason}"))
    }
}
