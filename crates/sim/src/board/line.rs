//! The child's lines, and what follows from each.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};

use super::link::Link;
use super::progress::Progress;
use super::{Edge, Pin};

/// Number of the Uno's pin that L1 is at; the other panels follow, then the cameras' trigger lines.
const FIRST_PANEL_PIN: u8 = 4;
const FIRST_TRIGGER_PIN: u8 = 11;

/// What the child says.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Line {
    Port(PathBuf),
    Unplugged,
    Pin {
        cycle: u64,
        nanos: u64,
        pin: Pin,
        high: bool,
    },
    Time {
        nanos: u64,
    },
    Slip(Duration),
}

impl Line {
    fn parse(text: &str) -> Option<Self> {
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        match words[..] {
            ["port", path] => Some(Self::Port(path.into())),
            ["unplugged"] => Some(Self::Unplugged),
            ["pin", cycle, nanos, pin, level] => Some(Self::Pin {
                cycle: cycle.parse().ok()?,
                nanos: nanos.parse().ok()?,
                pin: pin_of(pin.parse().ok()?)?,
                high: level == "1",
            }),
            ["time", _cycle, nanos] => Some(Self::Time {
                nanos: nanos.parse().ok()?,
            }),
            ["slip", nanos] => Some(Self::Slip(Duration::from_nanos(nanos.parse().ok()?))),
            _ => None,
        }
    }
}

fn pin_of(number: u8) -> Option<Pin> {
    match number {
        FIRST_PANEL_PIN..FIRST_TRIGGER_PIN => Some(Pin::Panel(number - FIRST_PANEL_PIN + 1)),
        FIRST_TRIGGER_PIN | 12 => Some(Pin::Trigger(number - FIRST_TRIGGER_PIN + 1)),
        _ => None,
    }
}

/// The monotonic clock, which `Instant` reads too but does not show.
#[derive(Debug, Clone, Copy)]
struct MonotonicClock {
    nanos: u64,
    instant: Instant,
}

impl MonotonicClock {
    fn new() -> Self {
        let now = clock_gettime(ClockId::Monotonic);
        Self {
            nanos: now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64,
            instant: Instant::now(),
        }
    }

    fn instant(&self, nanos: u64) -> Instant {
        let apart = Duration::from_nanos(nanos.abs_diff(self.nanos));
        if nanos >= self.nanos {
            self.instant + apart
        } else {
            self.instant.checked_sub(apart).unwrap_or(self.instant)
        }
    }
}

/// Takes the child's lines.
pub(super) struct Listener<F> {
    clock: MonotonicClock,
    progress: Arc<Progress>,
    link: Arc<Link>,
    edges: F,
}

impl<F: FnMut(Edge)> Listener<F> {
    pub(super) fn new(progress: Arc<Progress>, link: Arc<Link>, edges: F) -> Self {
        Self {
            clock: MonotonicClock::new(),
            progress,
            link,
            edges,
        }
    }

    pub(super) fn take(&mut self, text: &str) {
        match Line::parse(text) {
            Some(Line::Pin {
                cycle,
                nanos,
                pin,
                high,
            }) => (self.edges)(Edge {
                at: self.clock.instant(nanos),
                cycle,
                pin,
                high,
            }),
            Some(Line::Time { nanos }) => {
                let reached = Some(self.clock.instant(nanos));
                self.progress.update(|state| state.reached = state.reached.max(reached));
            }
            Some(Line::Port(terminal)) => self.plugged(&terminal),
            Some(Line::Unplugged) => {
                self.link.remove();
                self.progress.update(|state| state.plugged = false);
            }
            Some(Line::Slip(by)) => {
                tracing::warn!(?by, "the simulated light controller was held up; its clock is set back");
                self.progress.slipped(by);
            }
            None => tracing::warn!(text, "the simulated light controller says something unknown"),
        }
    }

    fn plugged(&self, terminal: &std::path::Path) {
        let problem = self.link.lead_to(terminal).err().map(|error| error.to_string());
        self.progress.update(|state| {
            state.plugged = problem.is_none();
            state.problem = problem;
        });
    }

    pub(super) fn end(&self, last_words: Option<String>) {
        self.progress.update(|state| {
            state.ended = true;
            state.problem = state.problem.take().or(last_words);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_read() {
        let edge = Line::parse("pin 48 3000 10 1");
        let expected = Line::Pin {
            cycle: 48,
            nanos: 3000,
            pin: Pin::Panel(7),
            high: true,
        };
        assert_eq!(edge, Some(expected));
        assert_eq!(Line::parse("port /dev/pts/3"), Some(Line::Port("/dev/pts/3".into())));
        assert_eq!(Line::parse("slip 1000"), Some(Line::Slip(Duration::from_micros(1))));
    }

    #[test]
    fn what_is_no_line_is_none() {
        for text in ["", "pin 1 2 13 1", "pin 1 2 3 1", "pin x 2 4 1", "time 1", "port"] {
            assert_eq!(Line::parse(text), None, "{text}");
        }
    }

    #[test]
    fn pins_are_named_as_they_are_wired() {
        let pins = [4, 10, 11, 12].map(pin_of);
        assert_eq!(
            pins,
            [Pin::Panel(1), Pin::Panel(7), Pin::Trigger(1), Pin::Trigger(2)].map(Some)
        );
    }

    #[test]
    fn instants_follow_the_monotonic_clock() {
        let clock = MonotonicClock::new();
        let later = clock.instant(clock.nanos + 1_000_000);
        assert_eq!(later - clock.instant, Duration::from_millis(1));
        assert_eq!(clock.instant(clock.nanos - 1_000_000) + Duration::from_millis(2), later);
    }
}
