//! Times and durations to and from nanoseconds and the standard library's types.

use std::time::Duration as StdDuration;

use crate::builtin_interfaces::msg::{Duration, Time};

const NANOS_PER_SECOND: i64 = 1_000_000_000;

/// A time or duration that does not fit the other representation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{found} s do not fit; allowed: from {min} s to {max} s")]
pub struct TimeOutOfRange {
    /// Whole seconds, rounded down.
    pub found: i128,
    /// The least that fits.
    pub min: i128,
    /// The most that fits.
    pub max: i128,
}

/// The 32-bit seconds of the message, and nanoseconds below a second.
fn split(nanoseconds: i64) -> Result<(i32, u32), TimeOutOfRange> {
    let found = nanoseconds.div_euclid(NANOS_PER_SECOND);
    let seconds = i32::try_from(found).map_err(|_| out_of_range(found.into(), i32::MIN.into()))?;
    Ok((seconds, nanoseconds.rem_euclid(NANOS_PER_SECOND) as u32))
}

fn out_of_range(found: i128, min: i128) -> TimeOutOfRange {
    TimeOutOfRange {
        found,
        min,
        max: i32::MAX.into(),
    }
}

fn join(sec: i32, nanosec: u32) -> i64 {
    i64::from(sec) * NANOS_PER_SECOND + i64::from(nanosec)
}

macro_rules! nanosecond_conversions {
    ($message:ident, $what:literal) => {
        impl $message {
            #[doc = concat!("From nanoseconds ", $what, "; the message holds 32 bits of seconds.")]
            pub fn from_nanos(nanoseconds: i64) -> Result<Self, TimeOutOfRange> {
                let (sec, nanosec) = split(nanoseconds)?;
                Ok(Self { sec, nanosec })
            }

            #[doc = concat!("Nanoseconds ", $what, ".")]
            pub fn to_nanos(self) -> i64 {
                join(self.sec, self.nanosec)
            }
        }

        impl TryFrom<StdDuration> for $message {
            type Error = TimeOutOfRange;

            fn try_from(duration: StdDuration) -> Result<Self, TimeOutOfRange> {
                let seconds = duration.as_secs();
                let sec = i32::try_from(seconds).map_err(|_| out_of_range(seconds.into(), 0))?;
                Ok(Self {
                    sec,
                    nanosec: duration.subsec_nanos(),
                })
            }
        }

        impl TryFrom<$message> for StdDuration {
            type Error = TimeOutOfRange;

            /// Fails for negative values, which the standard library's type cannot hold.
            fn try_from(message: $message) -> Result<Self, TimeOutOfRange> {
                let nanoseconds = message.to_nanos();
                u64::try_from(nanoseconds)
                    .map(StdDuration::from_nanos)
                    .map_err(|_| out_of_range(nanoseconds.div_euclid(NANOS_PER_SECOND).into(), 0))
            }
        }
    };
}

nanosecond_conversions!(Time, "since the clock's epoch");
nanosecond_conversions!(Duration, "from start to end, negative if it ends before it starts");
