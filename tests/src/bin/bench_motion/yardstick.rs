//! What the machine can do at all: `cyclictest`, or where it is missing a loop that only sleeps.

use std::process::{Command, Stdio};
use std::time::Duration;

use anyhow::{Context, anyhow, ensure};
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};
use serde::Serialize;
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};
use trajectory_executor::servo::PERIOD;

use crate::lateness::Micros;

/// Later wake-ups are counted by cyclictest, but not sorted.
const MOST_MICROS: usize = 50_000;

#[derive(Debug, Serialize)]
pub(crate) struct Yardstick {
    /// "cyclictest", or what ran because it is missing.
    pub(crate) yardstick: &'static str,
    /// How late it wakes up on a grid of 4 ms.
    pub(crate) yardstick_late_us: Micros,
}

pub(crate) fn measure(seconds: f64, priority: u8) -> anyhow::Result<Yardstick> {
    if let Some(yardstick) = cyclictest(seconds, priority)? {
        return Ok(yardstick);
    }
    eprintln!("cyclictest is missing (package rt-tests; cargo xtask setup): a loop that only sleeps runs instead");
    let looped = std::thread::spawn(move || sleep_only(seconds, priority)).join();
    let late = looped.map_err(|_| anyhow!("the loop that only sleeps has panicked"))??;
    Ok(Yardstick {
        yardstick: "own loop of clock_nanosleep",
        yardstick_late_us: Micros::of(&late),
    })
}

/// None where it is missing.
fn cyclictest(seconds: f64, priority: u8) -> anyhow::Result<Option<Yardstick>> {
    let (period, priority) = (PERIOD.as_micros().to_string(), priority.to_string());
    let (seconds, most) = (format!("{}s", seconds.ceil() as u64), MOST_MICROS.to_string());
    let output = Command::new("cyclictest")
        .args(["--mlockall", "--quiet", "--threads=1", "--policy=fifo"])
        .args([
            "--interval",
            &period,
            "--priority",
            &priority,
            "--duration",
            &seconds,
            "--histogram",
            &most,
        ])
        .stderr(Stdio::inherit())
        .output();
    let output = match output {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        output => output?,
    };
    ensure!(output.status.success(), "cyclictest ended with {}", output.status);
    let text = String::from_utf8_lossy(&output.stdout);
    Ok(Some(Yardstick {
        yardstick: "cyclictest",
        yardstick_late_us: from_histogram(&text).with_context(|| format!("cyclictest printed: {text}"))?,
    }))
}

/// Lines of microseconds and counts, and among the comments the largest.
fn from_histogram(text: &str) -> Option<Micros> {
    let counts: Vec<(f64, u64)> = text
        .lines()
        .filter_map(|line| {
            let (micros, count) = line.split_once(char::is_whitespace)?;
            Some((micros.parse().ok()?, count.trim().parse().ok()?))
        })
        .collect();
    let total: u64 = counts.iter().map(|(_, count)| count).sum();
    let at = |share: f64| {
        let mut left = (share * total as f64).ceil() as u64;
        counts.iter().find_map(|(micros, count)| {
            left = left.saturating_sub(*count);
            (left == 0).then_some(*micros)
        })
    };
    let largest = text.lines().find_map(|line| line.strip_prefix("# Max Latencies:"))?;
    Some(Micros {
        p50: at(0.5)?,
        p99: at(0.99)?,
        max: largest.trim().parse().ok()?,
    })
}

/// Seconds by which each wake-up was late.
fn sleep_only(seconds: f64, priority: u8) -> anyhow::Result<Vec<f64>> {
    if priority > 0 {
        let value = ThreadPriorityValue::try_from(priority).map_err(|error| anyhow!("{error}"))?;
        let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
        let set = set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(value), policy);
        if let Err(error) = set {
            eprintln!("the yardstick runs as an ordinary thread: {error:?}");
        }
    }
    let periods = (seconds / PERIOD.as_secs_f64()).ceil() as usize;
    let mut late = Vec::with_capacity(periods);
    let mut next = now() + PERIOD;
    for _ in 0..periods {
        let request = Timespec {
            tv_sec: next.as_secs() as i64,
            tv_nsec: next.subsec_nanos().into(),
        };
        while clock_nanosleep_absolute(ClockId::Monotonic, &request) == Err(rustix::io::Errno::INTR) {}
        let by = now().saturating_sub(next);
        late.push(by.as_secs_f64());
        next += PERIOD * (1 + (by.as_nanos() / PERIOD.as_nanos()) as u32);
    }
    Ok(late)
}

fn now() -> Duration {
    let time = clock_gettime(ClockId::Monotonic);
    Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_histogram_of_cyclictest_is_read() {
        let text = "# /dev/cpu_dma_latency set to 0us\n# Histogram\n000000 000000\n000003 000060\n000004\t000038\n\
                    000009 000002\n# Total: 000000100\n# Min Latencies: 00003\n# Avg Latencies: 00003\n\
                    # Max Latencies: 00009\n# Histogram Overflows: 00000\n";
        let found = from_histogram(text).unwrap();
        let micros = [found.p50, found.p99, found.max].map(|micros| format!("{micros:.3}"));
        assert_eq!(micros, ["3.000", "9.000", "9.000"]);
        assert!(from_histogram("").is_none());
    }
}
