//! The thread and its clock.

use std::io;
use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::Duration;

use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};

use super::PERIOD;
use super::cycle::Cycle;
use super::realtime::{RealTime, become_punctual};

/// Starts it and waits until it is as punctual as the system permits.
pub(super) fn start(cycle: Cycle, priority: u8) -> io::Result<(JoinHandle<()>, RealTime)> {
    let (told, told_to) = mpsc::channel();
    let thread = std::thread::Builder::new().name("servo".into()).spawn(move || {
        let realtime = become_punctual(priority);
        if told.send(realtime).is_ok() {
            run(cycle);
        }
    })?;
    let realtime = told_to.recv().map_err(io::Error::other)?;
    Ok((thread, realtime))
}

/// One turn a period, on a grid that does not drift.
fn run(mut cycle: Cycle) {
    let mut next = now() + PERIOD;
    let mut before = next;
    while !cycle.has_ended() {
        sleep_until(next);
        let woke = now();
        let late = woke.saturating_sub(next);
        cycle.turn(late, woke.saturating_sub(before));
        before = woke;
        next += PERIOD;
        let missed = late.as_nanos() / PERIOD.as_nanos();
        if missed > 0 {
            let missed = u32::try_from(missed).unwrap_or(u32::MAX);
            cycle.miss(missed);
            next += PERIOD * missed;
        }
    }
}

fn now() -> Duration {
    let time = clock_gettime(ClockId::Monotonic);
    Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec as u32)
}

fn sleep_until(time: Duration) {
    let request = Timespec {
        tv_sec: time.as_secs() as i64,
        tv_nsec: time.subsec_nanos().into(),
    };
    // A signal ends a sleep early; the rest is slept in the next round of this loop.
    while clock_nanosleep_absolute(ClockId::Monotonic, &request) == Err(rustix::io::Errno::INTR) {}
}
