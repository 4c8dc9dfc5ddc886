//! One frame's transforms to its parent over time.

use std::collections::BTreeMap;
use std::time::Duration;

use geometry::RigidTransform;

/// `parent_from_child` by time in nanoseconds; never empty.
#[derive(Debug, Clone)]
pub(super) enum History {
    /// Holds at all times.
    Static(RigidTransform),
    /// Holds between its first and last time.
    Moving(BTreeMap<i64, RigidTransform>),
}

/// A time that a history does not cover.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Outside {
    pub(super) oldest: i64,
    pub(super) newest: i64,
}

impl History {
    /// Adds a transform and forgets what is older than `kept` before the newest; gives back the newest time when the
    /// new transform itself is older than that.
    pub(super) fn insert(&mut self, stamp: i64, parent_from_child: RigidTransform, kept: Duration) -> Result<(), i64> {
        let Self::Moving(samples) = self else {
            *self = Self::Static(parent_from_child);
            return Ok(());
        };
        let newest = samples.last_key_value().map_or(stamp, |(newest, _)| stamp.max(*newest));
        let horizon = newest.saturating_sub(i64::try_from(kept.as_nanos()).unwrap_or(i64::MAX));
        if stamp < horizon {
            return Err(newest);
        }
        samples.insert(stamp, parent_from_child);
        if samples.first_key_value().is_some_and(|(oldest, _)| *oldest < horizon) {
            *samples = samples.split_off(&horizon);
        }
        Ok(())
    }

    /// First and last known time; `None` = always.
    pub(super) fn span(&self) -> Option<Outside> {
        let Self::Moving(samples) = self else { return None };
        let (oldest, newest) = (samples.first_key_value()?.0, samples.last_key_value()?.0);
        Some(Outside {
            oldest: *oldest,
            newest: *newest,
        })
    }

    /// The transform at a time: as it was sent, or in proportion between its neighbours.
    pub(super) fn at(&self, time: i64) -> Result<RigidTransform, Outside> {
        let samples = match self {
            Self::Static(parent_from_child) => return Ok(*parent_from_child),
            Self::Moving(samples) => samples,
        };
        match (samples.range(..=time).next_back(), samples.range(time..).next()) {
            (Some((before, earlier)), Some((after, later))) if before < after => {
                let fraction = (time - before) as f64 / (after - before) as f64;
                Ok(earlier.interpolate(later, fraction))
            }
            (Some((_, exact)), Some(_)) => Ok(*exact),
            _ => Err(self.span().unwrap_or(Outside {
                oldest: time,
                newest: time,
            })),
        }
    }
}
