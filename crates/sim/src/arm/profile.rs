//! How far along a way one is: speed rises evenly, holds, and falls evenly.

/// A trapezoid of speed over a way of some length, at rest at both ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Trapezoid {
    length: f64,
    acceleration: f64,
    /// The speed that is reached, per second.
    top: f64,
    /// Seconds until it is.
    ramp: f64,
    duration: f64,
}

impl Trapezoid {
    /// All more than 0, the length 0 or more.
    pub(super) fn new(length: f64, speed: f64, acceleration: f64) -> Self {
        let top = speed.min((length * acceleration).sqrt());
        let ramp = top / acceleration;
        let duration = if top > 0.0 { length / top + ramp } else { 0.0 };
        Self {
            length,
            acceleration,
            top,
            ramp,
            duration,
        }
    }

    /// Seconds.
    pub(super) fn duration(&self) -> f64 {
        self.duration
    }

    /// Seconds before the end at which this much of the way is left, no more than the ramp.
    pub(super) fn time_left(&self, way: f64) -> f64 {
        (2.0 * way.max(0.0) / self.acceleration).sqrt().min(self.ramp)
    }

    pub(super) fn length(&self) -> f64 {
        self.length
    }

    /// Share of the way, 0 to 1.
    pub(super) fn share(&self, time: f64) -> f64 {
        let left = self.duration - time;
        if self.length <= 0.0 || left <= 0.0 {
            return 1.0;
        }
        let way = if time <= 0.0 {
            0.0
        } else if time < self.ramp {
            self.acceleration * time * time / 2.0
        } else if left < self.ramp {
            self.length - self.acceleration * left * left / 2.0
        } else {
            self.top * (time - self.ramp / 2.0)
        };
        way / self.length
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn speed_and_acceleration_hold(length in 0.001_f64..5.0, speed in 0.01_f64..4.0, acceleration in 0.1_f64..20.0) {
            let profile = Trapezoid::new(length, speed, acceleration);
            let step = profile.duration() / 500.0;
            let way = |index: i32| length * profile.share(f64::from(index) * step);
            for index in 1..500 {
                let speeds = [way(index) - way(index - 1), way(index + 1) - way(index)].map(|way| way / step);
                prop_assert!(speeds[0] >= -1e-9 && speeds[0] <= speed * (1.0 + 1e-6));
                prop_assert!((speeds[1] - speeds[0]).abs() <= acceleration * step * (1.0 + 1e-5) + 1e-9);
            }
            prop_assert!(way(0).abs() < 1e-12);
            prop_assert!((way(500) - length).abs() < 1e-12);
        }
    }
}
