//! How late set-points are on the loop's grid, and which of them arrived.

use std::time::Instant;

use devices::JointValues;
use scenarios::quantile;
use serde::Serialize;
use sim::arm::ServoPoint;
use trajectory_executor::servo::PERIOD;

use crate::recorder::Sent;

/// A set-point that arrives is looked for among so many sent ones.
const WINDOW: usize = 500;

/// Microseconds.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct Micros {
    pub(crate) p50: f64,
    pub(crate) p99: f64,
    pub(crate) max: f64,
}

/// Sent set-points with when they arrived.
pub(crate) struct Arrivals {
    /// By the number of the sent one.
    pub(crate) received_at: Vec<Option<Instant>>,
    /// Arrived, but never sent.
    pub(crate) unknown: usize,
}

impl Micros {
    pub(crate) fn of(seconds: &[f64]) -> Self {
        let at = |share| 1e6 * quantile(seconds, share).unwrap_or(f64::NAN);
        Self {
            p50: at(0.5),
            p99: at(0.99),
            max: at(1.0),
        }
    }
}

/// When each set-point would have been sent by a loop that is never late, seconds from `begin`. The loop skips periods in
/// which it did not wake up; its grid is taken to begin so that the most punctual set-point is not late at all.
pub(crate) fn grid(sent: &[Sent], begin: Instant) -> Vec<f64> {
    let times: Vec<f64> = sent.iter().map(|sent| (sent.at - begin).as_secs_f64()).collect();
    let Some(&first) = times.first() else {
        return Vec::new();
    };
    let offset = |grid: &[f64]| {
        let offsets = times.iter().zip(grid).map(|(time, place)| time - place);
        offsets.fold(f64::INFINITY, f64::min)
    };
    let begin = first + offset(&grid_from(first, &times)).min(0.0);
    let grid = grid_from(begin, &times);
    let rest = offset(&grid);
    grid.iter().map(|place| place + rest).collect()
}

fn grid_from(begin: f64, times: &[f64]) -> Vec<f64> {
    let period = PERIOD.as_secs_f64();
    let mut next = begin;
    let place = |time: &f64| {
        let place = next;
        let missed = ((time - place) / period).floor().max(0.0);
        next += period * (1.0 + missed);
        place
    };
    times.iter().map(place).collect()
}

impl Arrivals {
    /// By their values, which travel in single precision; in the order in which they were sent.
    pub(crate) fn of(sent: &[Sent], trace: &[ServoPoint]) -> Self {
        let mut received_at = vec![None; sent.len()];
        let (mut next, mut unknown) = (0, 0);
        for point in trace {
            let candidates = sent.iter().enumerate().skip(next).take(WINDOW);
            let found = candidates
                .into_iter()
                .find(|(_, sent)| bits(&on_the_wire(&sent.angles)) == bits(&point.angles));
            match found {
                Some((index, _)) => {
                    received_at[index] = Some(point.at);
                    next = index + 1;
                }
                None => unknown += 1,
            }
        }
        Self { received_at, unknown }
    }

    pub(crate) fn lost(&self) -> usize {
        self.received_at.iter().filter(|at| at.is_none()).count()
    }
}

fn on_the_wire(angles: &JointValues) -> JointValues {
    angles.map(|angle| f64::from(angle as f32))
}

/// To compare numbers that must be the very same.
fn bits(angles: &JointValues) -> [u64; 7] {
    angles.map(f64::to_bits)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn sent(begin: Instant, micros: &[u64]) -> Vec<Sent> {
        let one = |(number, micros): (usize, &u64)| Sent {
            at: begin + Duration::from_micros(*micros),
            angles: [0.1 * number as f64; 7],
        };
        micros.iter().enumerate().map(one).collect()
    }

    #[test]
    fn lateness_is_found_whatever_the_first_one_was() {
        let begin = Instant::now();
        // The first is 300 us late; the fourth misses two periods.
        let sent = sent(begin, &[10_300, 14_020, 18_000, 30_100, 34_000]);
        let late: Vec<i64> = sent
            .iter()
            .zip(grid(&sent, begin))
            .map(|(sent, place)| (1e6 * ((sent.at - begin).as_secs_f64() - place)).round() as i64)
            .collect();
        assert_eq!(late, [300, 20, 0, 8100, 0]);
    }

    #[test]
    fn lost_and_unknown_set_points_are_counted() {
        let begin = Instant::now();
        let sent = sent(begin, &[0, 4000, 8000, 12_000]);
        let arrived = |number: usize, angles: JointValues| ServoPoint {
            at: begin + Duration::from_millis(4 * number as u64 + 1),
            angles,
            taken: true,
        };
        let trace = [
            arrived(0, on_the_wire(&sent[0].angles)),
            arrived(1, [9.0; 7]),
            arrived(2, on_the_wire(&sent[2].angles)),
            arrived(3, on_the_wire(&sent[3].angles)),
        ];
        let arrivals = Arrivals::of(&sent, &trace);
        assert_eq!((arrivals.lost(), arrivals.unknown), (1, 1));
        assert_eq!(arrivals.received_at[2], Some(begin + Duration::from_millis(9)));
    }
}
