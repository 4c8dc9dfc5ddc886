//! Joint velocities from reports.

use std::time::{Duration, Instant};

use devices::{ARM_JOINTS, JointValues};

/// How much a new interval counts.
const GAIN: f64 = 0.02;

/// Differences of successive angles over the mean time between reports. Reports are sent evenly but may come in bunches,
/// so that the time between two of them says little.
#[derive(Debug, Clone)]
pub(crate) struct Velocities {
    period: f64,
    last: Option<(Instant, JointValues)>,
}

impl Velocities {
    /// `period` is what the reports' rate says.
    pub(crate) fn new(period: Duration) -> Self {
        Self {
            period: period.as_secs_f64(),
            last: None,
        }
    }

    /// rad/s; 0 at the first report.
    pub(crate) fn next(&mut self, received_at: Instant, angles: JointValues) -> JointValues {
        let mut velocities = [0.0; ARM_JOINTS];
        if let Some((last_at, last)) = self.last.replace((received_at, angles)) {
            let interval = received_at.saturating_duration_since(last_at).as_secs_f64();
            self.period += GAIN * (interval - self.period);
            for ((velocity, angle), last) in velocities.iter_mut().zip(angles).zip(last) {
                *velocity = (angle - last) / self.period;
            }
        }
        velocities
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reports_in_bunches_give_even_velocities() {
        let mut velocities = Velocities::new(Duration::from_millis(10));
        let start = Instant::now();
        for report in 0..200_u32 {
            // Every third waits for the next two.
            let late = [20, 10, 0][report as usize % 3];
            let at = start + Duration::from_millis(u64::from(10 * report + late));
            let found = velocities.next(at, [f64::from(report) * 0.005; ARM_JOINTS])[0];
            assert!(report == 0 || (found - 0.5).abs() < 0.03, "{found} at {report}");
        }
    }
}
