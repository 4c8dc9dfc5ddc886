//! What a process costs, read from `/proc` (proc(5)).

use std::fs;

/// Resident memory of a process in megabytes; `None` once it has ended.
pub fn resident_mb(pid: u32) -> Option<f64> {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    let kilobytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes / 1024.0)
}

/// Processor time that a process has used, in seconds; `None` once it has ended.
pub fn cpu_seconds(pid: u32) -> Option<f64> {
    const TICKS_PER_SECOND: f64 = 100.0; // USER_HZ, the same on every Linux architecture this runs on
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // Fields 14 and 15; the name in field 2 may hold spaces, so count from its closing bracket.
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
    let user: f64 = fields.next()?.parse().ok()?;
    let system: f64 = fields.next()?.parse().ok()?;
    Some((user + system) / TICKS_PER_SECOND)
}

/// The kernel's limits of receive buffers, as text.
pub fn kernel_buffers() -> String {
    let value = |name: &str| {
        let text = fs::read_to_string(format!("/proc/sys/net/core/{name}")).unwrap_or_else(|_| "unknown".into());
        format!("{name} = {}", text.trim())
    };
    format!("{}, {}", value("rmem_max"), value("rmem_default"))
}
