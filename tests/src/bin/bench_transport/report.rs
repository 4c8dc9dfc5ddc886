//! The figures, for people and as JSON.

use std::fmt;

use serde::Serialize;

/// What the benchmark found. The keys are its contract.
#[derive(Serialize)]
pub(crate) struct Report {
    /// Every pairing and size.
    pub(crate) pairs: Vec<Pair>,
    /// Median time to serialise a 28 MB map, milliseconds.
    pub(crate) serialize_28mb_ms: f64,
    /// Median time from `publish` to the subscriber in the same process, 28 MB, microseconds.
    pub(crate) handover_us: f64,
    /// Whether the subscriber in the same process got the publisher's own memory.
    pub(crate) handover_shares_memory: bool,
    /// Highest resident memory of a process that publishes 28 MB maps at 1 Hz, megabytes.
    pub(crate) rss_mb: f64,
    /// Processor share of an idle node, per cent of one core.
    pub(crate) idle_cpu_percent: f64,
    /// The kernel's limits of receive buffers, as found.
    pub(crate) kernel: String,
    /// What was left out, and why.
    pub(crate) left_out: Vec<String>,
}

/// One pairing at one size.
#[derive(Serialize)]
pub(crate) struct Pair {
    pub(crate) from: String,
    pub(crate) to: String,
    pub(crate) bytes: usize,
    pub(crate) sent: usize,
    pub(crate) delivered: usize,
    pub(crate) median_ms: Option<f64>,
    pub(crate) p99_ms: Option<f64>,
}

impl Report {
    /// Whether every pairing was measured and every message of it arrived.
    pub(crate) fn complete(&self) -> bool {
        self.left_out.is_empty()
            && self
                .pairs
                .iter()
                .all(|pair| pair.sent > 0 && pair.delivered == pair.sent)
    }

    /// Median of Rust to rclpy over median of rclpy to rclpy.
    fn ratio(&self, bytes: usize) -> Option<f64> {
        let median = |from: &str| {
            let pair = self
                .pairs
                .iter()
                .find(|p| p.from == from && p.to == "rclpy" && p.bytes == bytes)?;
            pair.median_ms
        };
        Some(median("rust")? / median("rclpy")?)
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{:>15} -> {:<15} {:>11} {:>10} {:>10} {:>9}",
            "from", "to", "bytes", "delivered", "median ms", "p99 ms"
        )?;
        for pair in &self.pairs {
            let delivered = format!("{}/{}", pair.delivered, pair.sent);
            let figure = |ms: Option<f64>| ms.map_or_else(|| "-".to_owned(), |ms| format!("{ms:.3}"));
            let (median, p99) = (figure(pair.median_ms), figure(pair.p99_ms));
            writeln!(
                f,
                "{:>15} -> {:<15} {:>11} {delivered:>10} {median:>10} {p99:>9}",
                pair.from, pair.to, pair.bytes
            )?;
        }
        for bytes in crate::run::SIZES {
            if let Some(ratio) = self.ratio(bytes) {
                writeln!(f, "{bytes} bytes: rust to rclpy takes {ratio:.2} of rclpy to rclpy")?;
            }
        }
        writeln!(f, "serialising 28 MB: {:.1} ms", self.serialize_28mb_ms)?;
        let memory = if self.handover_shares_memory {
            "the same memory"
        } else {
            "A COPY"
        };
        writeln!(f, "hand-over in the process: {:.1} us, {memory}", self.handover_us)?;
        writeln!(f, "publisher of 28 MB at 1 Hz: {:.0} MB resident at most", self.rss_mb)?;
        writeln!(f, "socket buffers: 212992 bytes; this kernel: {}", self.kernel)?;
        writeln!(f, "idle node: {:.2} % of a core", self.idle_cpu_percent)?;
        self.left_out
            .iter()
            .try_for_each(|reason| writeln!(f, "left out: {reason}"))
    }
}
