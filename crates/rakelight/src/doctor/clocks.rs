//! Whether this machine's clock can be compared with others', and how it is read.

use std::fs;
use std::path::Path;

use super::finding::{Finding, Section};

const CLOCKS: Section = Section("clocks");

/// Sources that take microseconds to read, or tick coarsely.
const SLOW: [&str; 4] = ["acpi_pm", "hpet", "jiffies", "refined-jiffies"];

pub(super) fn check(root: &Path) -> Vec<Finding> {
    vec![synchronised(kernel::state()), source(root)]
}

fn synchronised(state: Result<kernel::State, std::io::Error>) -> Finding {
    let what = "time of day";
    match state {
        Ok(kernel::State {
            synchronised: true,
            error,
        }) => CLOCKS.ok(
            what,
            format!("synchronised, error below {:.1} ms", error.as_secs_f64() * 1e3),
        ),
        Ok(_) => CLOCKS.warn(
            what,
            "not synchronised, says the kernel",
            "fine on one machine. With nodes on several, install chrony or systemd-timesyncd on each",
        ),
        Err(error) => CLOCKS.warn(
            what,
            format!("the kernel does not tell: {error}"),
            "fine on one machine",
        ),
    }
}

fn source(root: &Path) -> Finding {
    let what = "clock source";
    let path = root.join("sys/devices/system/clocksource/clocksource0/current_clocksource");
    let Ok(found) = fs::read_to_string(path) else {
        return CLOCKS.warn(what, "the kernel does not tell", "fine unless stamps turn out coarse");
    };
    let found = found.trim();
    if SLOW.contains(&found) {
        return CLOCKS.warn(
            what,
            format!("{found}, which is slow to read"),
            "see what the kernel log says of the better one: dmesg | grep -i clocksource",
        );
    }
    CLOCKS.ok(what, found)
}

/// What the kernel says of its clock's discipline.
mod kernel {
    use std::io;
    use std::time::Duration;

    #[derive(Debug, Clone, Copy)]
    pub(super) struct State {
        pub(super) synchronised: bool,
        /// The most that the clock may be off, as its discipline estimates.
        pub(super) error: Duration,
    }

    /// Asks; changes nothing.
    #[expect(
        unsafe_code,
        reason = "no well-kept library asks the kernel for this without changing it"
    )]
    pub(super) fn state() -> io::Result<State> {
        // SAFETY: `timex` is plain numbers, for which zeros are valid; `modes` = 0 only reads.
        let mut answer: libc::timex = unsafe { std::mem::zeroed() };
        // SAFETY: the pointer is to a whole `timex` that outlives the call.
        let code = unsafe { libc::adjtimex(&raw mut answer) };
        if code == -1 {
            return Err(io::Error::last_os_error());
        }
        Ok(State {
            synchronised: code != libc::TIME_ERROR && answer.status & libc::STA_UNSYNC == 0,
            error: Duration::from_micros(u64::try_from(answer.maxerror).unwrap_or(0)),
        })
    }
}

#[cfg(test)]
mod tests {
    use std::io;
    use std::time::Duration;

    use super::super::finding::Status;
    use super::*;

    #[test]
    fn the_kernels_answer_is_told() {
        let told = |synchronised, micros| synchronised_of(synchronised, Duration::from_micros(micros)).found;
        assert_eq!(told(true, 2500), "synchronised, error below 2.5 ms");
        assert_eq!(told(false, 0), "not synchronised, says the kernel");
        assert_eq!(synchronised(Err(io::Error::other("no"))).status, Status::Warn);
        assert!(kernel::state().is_ok_and(|state| state.error < Duration::from_hours(1)));
    }

    fn synchronised_of(synchronised: bool, error: Duration) -> Finding {
        super::synchronised(Ok(kernel::State { synchronised, error }))
    }

    #[test]
    fn a_slow_clock_source_is_a_warning() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("sys/devices/system/clocksource/clocksource0");
        assert_eq!(source(root.path()).found, "the kernel does not tell");
        fs::create_dir_all(&folder).unwrap();
        for (name, status) in [("tsc\n", Status::Ok), ("hpet\n", Status::Warn)] {
            fs::write(folder.join("current_clocksource"), name).unwrap();
            assert_eq!(source(root.path()).status, status, "{name}");
        }
    }
}
