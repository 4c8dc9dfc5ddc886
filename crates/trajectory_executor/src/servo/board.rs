//! Where the arm was sent last, for anybody to read without a lock.

use std::sync::atomic::{AtomicU64, Ordering, fence};

use trajectory::State;

const JOINTS: usize = 7;
/// Reads that collide with a write so often are given up.
const ATTEMPTS: usize = 1000;

/// One writes, anybody reads: a sequence lock over atomics. The version is odd while a write is under way and 0 before the
/// first.
pub(super) struct Board {
    version: AtomicU64,
    numbers: [[AtomicU64; 3]; JOINTS],
}

impl Default for Board {
    fn default() -> Self {
        Self {
            version: AtomicU64::new(0),
            numbers: std::array::from_fn(|_| std::array::from_fn(|_| AtomicU64::new(0))),
        }
    }
}

impl Board {
    pub(super) fn write(&self, states: &[State; JOINTS]) {
        let version = self.version.load(Ordering::Relaxed);
        self.version.store(version + 1, Ordering::Relaxed);
        fence(Ordering::Release);
        for (numbers, state) in self.numbers.iter().zip(states) {
            let values = [state.position, state.velocity, state.acceleration];
            for (number, value) in numbers.iter().zip(values) {
                number.store(value.to_bits(), Ordering::Relaxed);
            }
        }
        self.version.store(version + 2, Ordering::Release);
    }

    pub(super) fn read(&self) -> Option<[State; JOINTS]> {
        for _ in 0..ATTEMPTS {
            let before = self.version.load(Ordering::Acquire);
            if before == 0 {
                return None;
            }
            let states = self.numbers.each_ref().map(|numbers| {
                let [position, velocity, acceleration] = numbers
                    .each_ref()
                    .map(|number| f64::from_bits(number.load(Ordering::Relaxed)));
                State {
                    position,
                    velocity,
                    acceleration,
                }
            });
            fence(Ordering::Acquire);
            if before.is_multiple_of(2) && before == self.version.load(Ordering::Relaxed) {
                return Some(states);
            }
            std::hint::spin_loop();
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;

    #[test]
    fn what_is_read_was_written_as_a_whole() {
        let (board, ended) = (Board::default(), AtomicBool::new(false));
        assert_eq!(board.read(), None);
        let whole = |states: [State; JOINTS]| states.iter().all(|state| *state == states[0]);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                for round in 0..200_000 {
                    let number = f64::from(round);
                    let state = State {
                        position: number,
                        velocity: number,
                        acceleration: number,
                    };
                    board.write(&[state; JOINTS]);
                }
                ended.store(true, Ordering::Release);
            });
            while !ended.load(Ordering::Acquire) {
                assert!(board.read().is_none_or(whole));
            }
        });
        assert_eq!(board.read().map(|states| states[6].velocity), Some(199_999.0));
    }
}
