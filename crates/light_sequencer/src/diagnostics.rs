//! How the light controller is, on `/diagnostics`.

use std::sync::{Arc, Weak};
use std::time::Duration;

use devices::{LightBank, LightLink};
use light_serial::{LightController, LinkStatistics};
use ros::diagnostics::{Diagnostics, Status};

pub(crate) const PART: &str = "light controller";

/// Exposures take milliseconds: a clock that is known no better than this joins images with the wrong lights.
const WORST_CLOCK: Duration = Duration::from_millis(5);

pub(crate) fn register(diagnostics: &Diagnostics, port: &str, lights: &Arc<LightController>) {
    let lights = Arc::downgrade(lights);
    diagnostics.register(PART, port, move || status(&lights));
}

fn status(lights: &Weak<LightController>) -> Status {
    let Some(lights) = lights.upgrade() else {
        return Status::stale("the driver is being closed");
    };
    let link = lights.state().borrow().link.clone();
    with_counts(of_link(&link), &lights.statistics())
}

fn of_link(link: &LightLink) -> Status {
    match link {
        LightLink::Disconnected { reason } => Status::error(reason.as_str()),
        LightLink::Connected {
            port,
            firmware_version,
            clock_uncertainty,
        } => {
            let status = if *clock_uncertainty > WORST_CLOCK {
                Status::warn("connected, but its clock is not well known")
            } else {
                Status::ok("connected")
            };
            let micros = format!("{:.0}", clock_uncertainty.as_secs_f64() * 1e6);
            status
                .value("port", port, "")
                .value("firmware version", firmware_version, "")
                .value("clock uncertainty", micros, "us")
        }
    }
}

fn with_counts(status: Status, statistics: &LinkStatistics) -> Status {
    status
        .value("frames received", statistics.frames_received, "")
        .value("bad frames received", statistics.bad_frames_received, "")
        .value("bad frames sent", statistics.bad_frames_sent, "")
        .value("reconnects", statistics.reconnects(), "")
        .value("firmware resets", statistics.firmware_resets, "")
        .value("clock jumps", statistics.clock_jumps, "")
        .value("last fault", statistics.last_fault.as_deref().unwrap_or("none"), "")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_is_as_good_as_its_clock() {
        let link = |clock_uncertainty| LightLink::Connected {
            port: "/dev/ttyACM0".into(),
            firmware_version: "1.0.0".into(),
            clock_uncertainty,
        };
        let good = of_link(&link(Duration::from_micros(120)));
        let expected = Status::ok("connected")
            .value("port", "/dev/ttyACM0", "")
            .value("firmware version", "1.0.0", "")
            .value("clock uncertainty", "120", "us");
        assert_eq!(good, expected);
        assert_ne!(of_link(&link(Duration::from_millis(50))), expected);
        let lost = LightLink::Disconnected {
            reason: "unplugged".into(),
        };
        assert_eq!(of_link(&lost), Status::error("unplugged"));
    }
}
