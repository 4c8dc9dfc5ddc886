//! How punctual the loop is.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::Duration;

/// Buckets of a quarter of an octave, from 1 us on; the last one takes the rest.
const PER_OCTAVE: f64 = 4.0;
const BUCKETS: usize = 72;

/// Counted by the loop, read by anybody.
pub(super) struct Timing {
    buckets: [AtomicU32; BUCKETS],
    periods: AtomicU64,
    missed: AtomicU32,
    /// Nanoseconds.
    latest: AtomicU64,
    /// Nanoseconds, since somebody took it.
    longest_period: AtomicU64,
}

/// How late the loop woke up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TimingSummary {
    /// Wake-ups since the start.
    pub periods: u64,
    /// Whole periods in which it did not wake up.
    pub missed: u32,
    /// Half of all wake-ups were no later than this (within a fifth).
    pub median: Duration,
    /// 99 of 100 were no later than this (within a fifth).
    pub p99: Duration,
    /// The latest.
    pub latest: Duration,
}

impl Default for Timing {
    fn default() -> Self {
        Self {
            buckets: std::array::from_fn(|_| AtomicU32::new(0)),
            periods: AtomicU64::new(0),
            missed: AtomicU32::new(0),
            latest: AtomicU64::new(0),
            longest_period: AtomicU64::new(0),
        }
    }
}

impl Timing {
    pub(super) fn record(&self, late: Duration, period: Duration) {
        self.buckets[bucket(late)].fetch_add(1, Ordering::Relaxed);
        self.periods.fetch_add(1, Ordering::Relaxed);
        self.latest.fetch_max(late.as_nanos() as u64, Ordering::Relaxed);
        self.longest_period
            .fetch_max(period.as_nanos() as u64, Ordering::Relaxed);
    }

    pub(super) fn miss(&self, periods: u32) {
        self.missed.fetch_add(periods, Ordering::Relaxed);
    }

    pub(super) fn take_longest_period(&self) -> Duration {
        Duration::from_nanos(self.longest_period.swap(0, Ordering::Relaxed))
    }

    pub(super) fn summary(&self) -> TimingSummary {
        TimingSummary {
            periods: self.periods.load(Ordering::Relaxed),
            missed: self.missed.load(Ordering::Relaxed),
            median: self.quantile(0.5),
            p99: self.quantile(0.99),
            latest: Duration::from_nanos(self.latest.load(Ordering::Relaxed)),
        }
    }

    fn quantile(&self, share: f64) -> Duration {
        let counts = self.buckets.each_ref().map(|bucket| bucket.load(Ordering::Relaxed));
        let total: u64 = counts.iter().map(|count| u64::from(*count)).sum();
        let wanted = (share * total as f64).ceil() as u64;
        let mut sum = 0;
        for (index, count) in counts.iter().enumerate() {
            sum += u64::from(*count);
            if sum >= wanted && sum > 0 {
                return upper_end(index);
            }
        }
        Duration::ZERO
    }
}

fn bucket(late: Duration) -> usize {
    let micros = late.as_secs_f64() * 1e6;
    ((micros.max(1.0).log2() * PER_OCTAVE).floor() as usize).min(BUCKETS - 1)
}

fn upper_end(bucket: usize) -> Duration {
    Duration::from_secs_f64(((bucket + 1) as f64 / PER_OCTAVE).exp2() * 1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_right_within_a_bucket() {
        let timing = Timing::default();
        for micros in 1..=1000 {
            timing.record(Duration::from_micros(micros), Duration::from_millis(4));
        }
        let summary = timing.summary();
        let within = |found: Duration, true_micros: f64| {
            let ratio = found.as_secs_f64() * 1e6 / true_micros;
            assert!((1.0..1.2).contains(&ratio), "{found:?}");
        };
        within(summary.median, 500.0);
        within(summary.p99, 990.0);
        assert_eq!((summary.periods, summary.latest), (1000, Duration::from_millis(1)));
        assert_eq!(timing.take_longest_period(), Duration::from_millis(4));
        assert_eq!(timing.take_longest_period(), Duration::ZERO);
    }
}
