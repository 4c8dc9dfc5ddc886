//! The firmware's clock against this host's.
//!
//! A reply's stamp `b` (board, microseconds) was taken between the moment its command left, plus the time that its bytes
//! take on the line, and the moment the reply was here, less its bytes' time. In the middle of these bounds lies a
//! measurement `y` of the host's time, with half their distance as its error. A line `host = b + offset + drift * b` is
//! fitted to the measurements of the last half minute by least squares, weighted by their errors, so that quick replies
//! count and slow ones do not; the drift is held to what a ceramic resonator may have.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use light_protocol::{BAUD, BoardTime};

use crate::line::{Arrived, Sent};

const WINDOW_MICROS: f64 = 30e6;
const MAX_SAMPLES: usize = 256;
/// A ceramic resonator's tolerance, as standard deviation.
const DRIFT_SIGMA: f64 = 0.005;
/// Nothing is known better than this, microseconds: the firmware's stamp and this host's scheduling.
const LEAST_HALF_WIDTH: f64 = 10.0;
/// Bounds that are missed by more than this, beyond three standard deviations, are of another clock, microseconds.
const JUMP_MICROS: f64 = 500.0;
/// Start bit, eight data bits, stop bit; the Uno is 2.1 % fast.
const BYTE_MICROS: f64 = 10.0 / (BAUD as f64 * 1.021) * 1e6;

/// When a stamp was taken, by this host's clock.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Exchange {
    /// Before the command was written.
    pub(crate) sent_at: Instant,
    pub(crate) bytes_sent: usize,
    /// After the reply was read.
    pub(crate) received_at: Instant,
    pub(crate) bytes_received: usize,
}

impl Exchange {
    pub(crate) fn new(sent: Sent, arrived: &Arrived) -> Self {
        Self {
            sent_at: sent.at,
            bytes_sent: sent.bytes,
            received_at: arrived.at,
            bytes_received: arrived.bytes,
        }
    }
}

/// Microseconds without a wrap: right if stamps come more often than every 35 minutes.
#[derive(Debug, Clone, Copy, Default)]
struct Unwrapped {
    last: BoardTime,
    micros: i64,
}

impl Unwrapped {
    fn micros(self, stamp: BoardTime) -> i64 {
        // Of the two ways round, the shorter: a stamp may be a little older than the newest.
        self.micros + i64::from(stamp.micros_since(self.last) as i32)
    }

    fn follow(&mut self, stamp: BoardTime) -> i64 {
        *self = Self {
            micros: self.micros(stamp),
            last: stamp,
        };
        self.micros
    }
}

/// Microseconds, all of them.
#[derive(Debug, Clone, Copy)]
struct Sample {
    board: f64,
    earliest: f64,
    latest: f64,
}

impl Sample {
    fn middle(&self) -> f64 {
        f64::midpoint(self.earliest, self.latest)
    }

    fn half_width(&self) -> f64 {
        ((self.latest - self.earliest) / 2.0).max(LEAST_HALF_WIDTH)
    }

    /// Of a value that is anywhere within the bounds.
    fn variance(&self) -> f64 {
        self.half_width().powi(2) / 3.0
    }
}

/// `host = board + offset + drift * (board - reference)`.
#[derive(Debug, Clone, Copy)]
struct Fit {
    reference: f64,
    offset: f64,
    drift: f64,
    variance_offset: f64,
    covariance: f64,
    variance_drift: f64,
    /// What no number of measurements averages away: the two ways of the line may differ.
    floor: f64,
}

impl Fit {
    fn new(samples: &VecDeque<Sample>) -> Option<Self> {
        let reference = samples.back()?.board;
        let (mut weights, mut x, mut xx, mut y, mut xy) = (0.0, 0.0, DRIFT_SIGMA.powi(-2), 0.0, 0.0);
        for sample in samples {
            let weight = sample.variance().recip();
            let (along, above) = (sample.board - reference, sample.middle() - sample.board);
            weights += weight;
            x += weight * along;
            xx += weight * along * along;
            y += weight * above;
            xy += weight * along * above;
        }
        let determinant = weights * xx - x * x;
        let floor = samples.iter().map(Sample::variance).fold(f64::INFINITY, f64::min);
        Some(Self {
            reference,
            offset: (xx * y - x * xy) / determinant,
            drift: (weights * xy - x * y) / determinant,
            variance_offset: xx / determinant,
            covariance: -x / determinant,
            variance_drift: weights / determinant,
            floor,
        })
    }

    fn host(&self, board: f64) -> f64 {
        board + self.offset + self.drift * (board - self.reference)
    }

    fn sigma(&self, board: f64) -> f64 {
        let along = board - self.reference;
        let fitted = self.variance_offset + 2.0 * along * self.covariance + along * along * self.variance_drift;
        (fitted + self.floor).sqrt()
    }
}

/// The fit of one firmware's clock; a firmware that was reset has a new one.
#[derive(Debug)]
pub(crate) struct BoardClock {
    origin: Instant,
    unwrapped: Unwrapped,
    samples: VecDeque<Sample>,
    fit: Option<Fit>,
}

impl BoardClock {
    /// Of a clock that was first asked at `origin`.
    pub(crate) fn new(origin: Instant) -> Self {
        Self {
            origin,
            unwrapped: Unwrapped::default(),
            samples: VecDeque::new(),
            fit: None,
        }
    }

    /// Takes a stamp. True when the clock is not where it should be, so that all that was known is thrown away.
    pub(crate) fn add(&mut self, stamp: BoardTime, exchange: &Exchange) -> bool {
        let board = self.unwrapped.follow(stamp) as f64;
        let sample = self.sample(board, exchange);
        let jumped = self.fit.is_some_and(|fit| {
            let (host, slack) = (fit.host(board), 3.0 * fit.sigma(board) + JUMP_MICROS);
            host < sample.earliest - slack || host > sample.latest + slack
        });
        if jumped {
            self.samples.clear();
        }
        let old = |first: &Sample| board - first.board > WINDOW_MICROS;
        while self.samples.len() >= MAX_SAMPLES || self.samples.front().is_some_and(old) {
            self.samples.pop_front();
        }
        self.samples.push_back(sample);
        self.fit = Fit::new(&self.samples);
        jumped
    }

    /// This host's time of a stamp; `None` before the first exchange.
    pub(crate) fn instant(&self, stamp: BoardTime) -> Option<Instant> {
        let micros = self.fit?.host(self.unwrapped.micros(stamp) as f64);
        let apart = Duration::from_secs_f64(micros.abs() / 1e6);
        if micros >= 0.0 {
            self.origin.checked_add(apart)
        } else {
            self.origin.checked_sub(apart)
        }
    }

    /// Standard deviation of the newest times.
    pub(crate) fn uncertainty(&self) -> Duration {
        self.fit.map_or(Duration::MAX, |fit| {
            Duration::from_secs_f64(fit.sigma(fit.reference) / 1e6)
        })
    }

    fn sample(&self, board: f64, exchange: &Exchange) -> Sample {
        let since_origin = |instant: Instant| (instant.saturating_duration_since(self.origin)).as_secs_f64() * 1e6;
        let (sent, received) = (since_origin(exchange.sent_at), since_origin(exchange.received_at));
        let earliest = sent + exchange.bytes_sent as f64 * BYTE_MICROS;
        let latest = received - exchange.bytes_received as f64 * BYTE_MICROS;
        if earliest <= latest {
            return Sample {
                board,
                earliest,
                latest,
            };
        }
        // A line that is quicker than it may be: a terminal without a UART behind it.
        Sample {
            board,
            earliest: sent,
            latest: received,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A board whose clock is `drift` fast and wraps soon.
    struct Board {
        start: Instant,
        at_start: u32,
        drift: f64,
        random: fastrand::Rng,
    }

    impl Board {
        fn new(clock: &BoardClock, drift: f64) -> Self {
            Self {
                start: clock.origin,
                at_start: u32::MAX - 5_000_000,
                drift,
                random: fastrand::Rng::with_seed(7),
            }
        }

        fn stamp(&self, at: Instant) -> BoardTime {
            let micros = (at - self.start).as_secs_f64() * 1e6 * (1.0 + self.drift);
            BoardTime(self.at_start.wrapping_add(micros as u64 as u32))
        }

        /// Two delays of a few hundred microseconds, one in ten of them much longer.
        fn exchange(&mut self, seconds: f64) -> (BoardTime, Exchange) {
            let mut delay = || {
                let tail = if self.random.u8(0..10) == 0 { 20_000.0 } else { 100.0 };
                Duration::from_secs_f64((50.0 + self.random.f64() * tail) / 1e6)
            };
            let (there, back) = (delay(), delay());
            let sent_at = self.start + Duration::from_secs_f64(seconds);
            let wire = |bytes: f64| Duration::from_secs_f64(bytes * BYTE_MICROS / 1e6);
            let stamped_at = sent_at + wire(7.0) + there;
            let exchange = Exchange {
                sent_at,
                bytes_sent: 7,
                received_at: stamped_at + wire(13.0) + back,
                bytes_received: 13,
            };
            (self.stamp(stamped_at), exchange)
        }

        fn error_micros(&self, clock: &BoardClock, seconds: f64) -> f64 {
            let at = self.start + Duration::from_secs_f64(seconds);
            let found = clock.instant(self.stamp(at)).expect("it has a fit");
            let error = if found > at { found - at } else { at - found };
            error.as_secs_f64() * 1e6
        }
    }

    #[test]
    fn the_clock_is_known_to_a_fraction_of_a_slow_lines_delays() {
        for drift in [-0.005, 0.0, 0.003] {
            let mut clock = BoardClock::new(Instant::now());
            let mut board = Board::new(&clock, drift);
            for second in 1..=60 {
                let (stamp, exchange) = board.exchange(f64::from(second));
                assert!(!clock.add(stamp, &exchange), "no jump at {second} s");
            }
            let error = board.error_micros(&clock, 60.3);
            println!("drift {drift}: {error:.1} us, said {:?}", clock.uncertainty());
            assert!(error < 60.0, "{error} us");
            assert!(error < 3.0 * clock.uncertainty().as_secs_f64() * 1e6);
        }
    }

    #[test]
    fn the_wrap_of_the_firmwares_clock_is_not_seen() {
        let mut clock = BoardClock::new(Instant::now());
        let mut board = Board::new(&clock, 0.0);
        // It wraps after five seconds.
        for second in 1..=10 {
            let (stamp, exchange) = board.exchange(f64::from(second));
            assert!(!clock.add(stamp, &exchange));
        }
        assert!(
            board.stamp(board.start + Duration::from_secs(10)).0 < 6_000_000,
            "it has wrapped"
        );
        for before_or_behind_it in [4.9, 5.1, 9.0] {
            assert!(board.error_micros(&clock, before_or_behind_it) < 1000.0);
        }
    }

    #[test]
    fn stamps_are_unwrapped_both_ways() {
        let mut unwrapped = Unwrapped::default();
        let first = unwrapped.follow(BoardTime(u32::MAX - 99));
        let second = unwrapped.follow(BoardTime(100));
        assert_eq!(second - first, 200);
        assert_eq!(unwrapped.micros(BoardTime(u32::MAX - 99)), first, "an older stamp");
        let hours: i64 = (1..=10).map(|_| unwrapped.follow(BoardTime(100)) - second).sum();
        assert_eq!(hours, 0);
        let mut micros = 100_u32;
        for _ in 0..10 {
            micros = micros.wrapping_add(1_000_000_000);
            unwrapped.follow(BoardTime(micros));
        }
        assert_eq!(unwrapped.micros - second, 10_000_000_000);
    }

    #[test]
    fn a_clock_that_was_set_back_is_noticed_and_learnt_anew() {
        let mut clock = BoardClock::new(Instant::now());
        let mut board = Board::new(&clock, 0.0);
        for second in 1..=10 {
            let (stamp, exchange) = board.exchange(f64::from(second));
            clock.add(stamp, &exchange);
        }
        board.at_start -= 300_000;
        let (stamp, exchange) = board.exchange(11.0);
        assert!(clock.add(stamp, &exchange), "it jumped by 0.3 s");
        let (stamp, exchange) = board.exchange(12.0);
        assert!(!clock.add(stamp, &exchange));
        assert!(board.error_micros(&clock, 12.0) < 1000.0 + clock.uncertainty().as_secs_f64() * 3e6);
    }
}
