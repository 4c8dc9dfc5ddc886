//! When each output of the light controller was on.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Changes kept per output: many sequences, and cameras ask soon.
const MOST_CHANGES: usize = 1024;

/// What the outputs L1 to L7 did.
#[derive(Debug, Default)]
pub(super) struct Timeline {
    outputs: [VecDeque<Change>; 7],
}

#[derive(Debug, Clone, Copy)]
struct Change {
    at: Instant,
    high: bool,
}

impl Timeline {
    /// Output 1 to 7 changed.
    pub(super) fn record(&mut self, output: u8, at: Instant, high: bool) {
        let Some(changes) = usize::from(output)
            .checked_sub(1)
            .and_then(|index| self.outputs.get_mut(index))
        else {
            return;
        };
        if changes.len() == MOST_CHANGES {
            changes.pop_front();
        }
        // A clock that was set back does not undo what happened.
        let at = changes.back().map_or(at, |last| at.max(last.at));
        changes.push_back(Change { at, high });
    }

    /// The share of a time for which each output was on.
    pub(super) fn shares(&self, from: Instant, length: Duration) -> [f64; 7] {
        let until = from + length;
        std::array::from_fn(|index| {
            let on = time_on(&self.outputs[index], from, until);
            (on.as_secs_f64() / length.as_secs_f64().max(1e-9)).min(1.0)
        })
    }
}

fn time_on(changes: &VecDeque<Change>, from: Instant, until: Instant) -> Duration {
    // Before the first change that is known the output was at the other level.
    let mut high = changes.front().is_some_and(|first| !first.high);
    let (mut on, mut since) = (Duration::ZERO, from);
    for change in changes {
        let at = change.at.clamp(from, until);
        if high {
            on += at - since;
        }
        (high, since) = (change.high, at);
    }
    if high { on + (until - since) } else { on }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shares(changes: &[(u8, u64, bool)], from: u64, length: u64) -> [f64; 7] {
        let start = Instant::now();
        let at = |micros| start + Duration::from_micros(micros);
        let mut timeline = Timeline::default();
        for (output, micros, high) in changes {
            timeline.record(*output, at(*micros), *high);
        }
        timeline.shares(at(from), Duration::from_micros(length))
    }

    #[test]
    fn a_pulse_counts_for_the_part_inside_the_exposure() {
        let pulse = [(2, 1000, true), (2, 3000, false)];
        for (from, length, expected) in [
            (1000, 2000, 1.0),
            (0, 4000, 0.5),
            (2000, 4000, 0.25),
            (1500, 500, 1.0),
            (3000, 100, 0.0),
            (0, 1000, 0.0),
        ] {
            let found = shares(&pulse, from, length);
            assert!((found[1] - expected).abs() < 1e-9, "{found:?} of {from} + {length}");
            assert!(found[0].abs() < 1e-9 && found[6].abs() < 1e-9, "{found:?}");
        }
    }

    #[test]
    fn several_pulses_add_up_and_one_may_still_last() {
        let pulses = [
            (7, 0, true),
            (7, 100, false),
            (7, 200, true),
            (7, 300, false),
            (7, 400, true),
        ];
        assert!((shares(&pulses, 0, 500)[6] - 0.6).abs() < 1e-9);
    }

    #[test]
    fn what_is_forgotten_leaves_the_level_it_had() {
        let many: Vec<_> = (0..3000).map(|index| (1, index * 10, index % 2 == 0)).collect();
        assert!((shares(&many, 29_000, 1000)[0] - 0.5).abs() < 1e-9);
    }
}
