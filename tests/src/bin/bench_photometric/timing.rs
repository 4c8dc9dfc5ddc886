//! Times and memory.

use std::fs;
use std::time::Instant;

/// Median duration of some runs after one that warms up, milliseconds.
pub(crate) fn median_ms<T, E>(runs: usize, mut work: impl FnMut() -> Result<T, E>) -> Result<f64, E> {
    work()?;
    let mut times = Vec::with_capacity(runs);
    for _ in 0..runs.max(1) {
        let started = Instant::now();
        let result = work()?;
        times.push(1e3 * started.elapsed().as_secs_f64());
        drop(result);
    }
    times.sort_by(f64::total_cmp);
    Ok(times[times.len() / 2])
}

/// Runs with so many threads.
pub(crate) fn threads<T: Send>(count: usize, work: impl FnOnce() -> T + Send) -> anyhow::Result<T> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build()?;
    Ok(pool.install(work))
}

/// Forgets the largest memory so far (proc(5), `clear_refs`).
pub(crate) fn reset_peak() {
    // Where the kernel does not allow it the figure holds the rendering as well, and is only too large.
    fs::write("/proc/self/clear_refs", "5").ok();
}

/// The largest resident memory since then, megabytes; NaN where the kernel does not say.
pub(crate) fn peak_mb() -> f64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().nth(1)?.parse::<f64>().ok());
    kilobytes.map_or(f64::NAN, |kilobytes| kilobytes / 1024.0)
}
