//! Which exposure makes the brightest pixels of a capture as bright as they should be.

use std::ops::RangeInclusive;
use std::time::Duration;

use imaging::{ExposureStack, Image};

/// Share of the pixels that may be brighter than the level: a few highlights and defects do not count.
const BRIGHTER_SHARE: f64 = 0.001;

/// Below this share of full scale a level is noise, and a proportion to it means nothing.
const DARK_SHARE: f64 = 0.003;

/// How much longer to expose when nothing was seen.
const DARK_STEP: f64 = 8.0;

/// How bright a capture is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Brightness {
    /// 99.9th percentile over the image of the brightest light's value after dark subtraction, share of full scale.
    pub level: f64,
    /// Share of the pixels that are saturated under some light.
    pub saturated: f64,
}

/// What to do about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ExposureAdvice {
    /// The level is within the tolerance.
    Reached,
    /// Take another capture with this exposure.
    Expose(Duration),
    /// The exposure that is needed is out of range: this is as near as it gets, and it was tried.
    AtLimit {
        /// The exposure that would be needed.
        needed: Duration,
    },
    /// Nothing is seen even with the longest exposure.
    AllDark,
}

impl Brightness {
    /// Measures a capture; full scale is the stack's saturation.
    pub fn of(stack: &ExposureStack) -> Self {
        let full_scale = f64::from(stack.saturation());
        let lit: Vec<&Image<u16>> = stack.channels().filter_map(|channel| stack.light(channel)).collect();
        let brightest = |(index, &dark): (usize, &u16)| {
            let raw = lit.iter().map(|image| image.pixels()[index]).max().unwrap_or(0);
            (raw.saturating_sub(dark), raw >= stack.saturation())
        };
        let pixels: Vec<(u16, bool)> = stack.dark().pixels().iter().enumerate().map(brightest).collect();
        let saturated = pixels.iter().filter(|(_, saturated)| *saturated).count() as f64 / pixels.len() as f64;
        let mut levels: Vec<u16> = pixels.into_iter().map(|(level, _)| level).collect();
        let brighter = (levels.len() as f64 * BRIGHTER_SHARE) as usize;
        let at = levels.len() - 1 - brighter;
        let level = f64::from(*levels.select_nth_unstable(at).1) / full_scale;
        Self { level, saturated }
    }

    /// What to do to get from this brightness, taken with `exposure`, to `target` (a share of full scale) within a
    /// relative `tolerance`.
    pub fn advise(
        &self,
        exposure: Duration,
        target: f64,
        tolerance: f64,
        range: &RangeInclusive<Duration>,
    ) -> ExposureAdvice {
        let clipped = self.saturated > BRIGHTER_SHARE;
        if !clipped && (self.level / target - 1.0).abs() <= tolerance {
            return ExposureAdvice::Reached;
        }
        let is_dark = self.level < DARK_SHARE;
        let factor = match (clipped, is_dark) {
            // How much too bright it is cannot be seen: the more pixels are lost, the more.
            (true, _) if self.saturated > 0.1 => 0.25,
            (true, _) => 0.6,
            (_, true) => DARK_STEP,
            _ => target / self.level,
        };
        let needed = exposure.mul_f64(factor);
        let allowed = needed.clamp(*range.start(), *range.end());
        match (allowed == exposure, is_dark) {
            (false, _) => ExposureAdvice::Expose(allowed),
            (true, true) => ExposureAdvice::AllDark,
            (true, false) => ExposureAdvice::AtLimit { needed },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TARGET: f64 = 0.8;
    const TOLERANCE: f64 = 0.02;

    fn range() -> RangeInclusive<Duration> {
        Duration::from_micros(20)..=Duration::from_millis(900)
    }

    /// A grey ramp whose brightest pixels get `per_second` digital numbers a second; the second light is half as bright.
    fn capture(exposure: Duration, per_second: f64) -> ExposureStack {
        let image = |share: f64| {
            Image::from_fn(64, 64, |x, y| {
                let pixel = f64::from((y * 64 + x) as u16) / 4095.0;
                (400.0 + share * pixel * per_second * exposure.as_secs_f64()).min(65_520.0) as u16
            })
        };
        ExposureStack::new(&[1, 2], [(0, image(0.0)), (1, image(1.0)), (2, image(0.5))], 65_520).unwrap()
    }

    /// Exposures that were tried, and how it ended.
    fn search(per_second: f64) -> (Vec<Duration>, ExposureAdvice) {
        let mut tried = vec![Duration::from_micros(2500)];
        for _ in 0..6 {
            let exposure = tried[tried.len() - 1];
            let brightness = Brightness::of(&capture(exposure, per_second));
            match brightness.advise(exposure, TARGET, TOLERANCE, &range()) {
                ExposureAdvice::Expose(next) => tried.push(next),
                end => return (tried, end),
            }
        }
        let last = ExposureAdvice::Expose(tried[tried.len() - 1]);
        (tried, last)
    }

    #[test]
    fn the_level_is_that_of_the_brightest_light_without_the_dark() {
        let brightness = Brightness::of(&capture(Duration::from_millis(1), 30_000_000.0));
        assert!((brightness.level - 30_000.0 / 65_520.0).abs() < 0.001, "{brightness:?}");
        assert!(brightness.saturated < 1e-9, "{brightness:?}");
    }

    #[test]
    fn one_step_is_enough_unless_the_image_is_clipped_or_black() {
        let wanted = 0.8 * 65_520.0;
        for (factor, steps) in [(1.0, 1), (0.3, 2), (1.21, 2), (2.5, 4), (0.0035, 3)] {
            let (tried, end) = search(factor * wanted / 0.0025);
            assert_eq!(end, ExposureAdvice::Reached, "{factor}: {tried:?}");
            assert!(tried.len() <= steps, "{factor}: {tried:?}");
            let reached = tried[tried.len() - 1].as_secs_f64() * factor / 0.0025;
            assert!((reached - 1.0).abs() <= TOLERANCE, "{factor}: {reached}");
        }
    }

    #[test]
    fn what_cannot_be_reached_is_said() {
        assert_eq!(search(0.0).1, ExposureAdvice::AllDark);
        let (tried, end) = search(0.002 * 52_416.0 / 0.0025);
        assert_eq!(tried[tried.len() - 1], *range().end());
        assert!(
            matches!(end, ExposureAdvice::AtLimit { needed } if needed > *range().end()),
            "{end:?}"
        );
        let (tried, end) = search(1000.0 * 52_416.0 / 0.0025);
        assert_eq!(
            (tried[tried.len() - 1], matches!(end, ExposureAdvice::AtLimit { .. })),
            (*range().start(), true)
        );
    }

    #[test]
    fn a_few_highlights_do_not_count() {
        let mut images = [Image::filled(64, 64, 400_u16), Image::filled(64, 64, 30_400)];
        images[1].pixels_mut()[..4].fill(65_520);
        let [dark, lit] = images;
        let brightness = Brightness::of(&ExposureStack::new(&[1], [(0, dark), (1, lit)], 65_520).unwrap());
        assert!((brightness.level - 30_000.0 / 65_520.0).abs() < 1e-9, "{brightness:?}");
        assert_eq!(
            brightness.advise(Duration::from_millis(1), 30_000.0 / 65_520.0, 0.02, &range()),
            ExposureAdvice::Reached
        );
    }
}
