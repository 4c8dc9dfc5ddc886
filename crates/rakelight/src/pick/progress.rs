//! How a cycle goes, on the terminal.

use indicatif::{ProgressBar, ProgressStyle};
use interfaces::rakelight_msgs::action::PickCycleFeedback;

use super::report::stage_name;

/// Steps of the bar.
const STEPS: u64 = 1000;

/// A bar on standard error; nothing where that is no terminal.
pub(super) struct Progress(ProgressBar);

impl Progress {
    pub(super) fn new() -> Self {
        let bar = ProgressBar::new(STEPS);
        if let Ok(style) = ProgressStyle::with_template("{bar:24} {msg}") {
            bar.set_style(style);
        }
        Self(bar)
    }

    pub(super) fn tell(&self, number: u32, feedback: &PickCycleFeedback) {
        let share = f64::from(feedback.progress.clamp(0.0, 1.0));
        self.0.set_position((share * STEPS as f64) as u64);
        let stage = stage_name(feedback.stage);
        self.say(&format!("pick {number}: {stage}: {}", feedback.detail));
    }

    pub(super) fn say(&self, text: &str) {
        self.0.set_message(text.to_owned());
    }

    pub(super) fn clear(&self) {
        self.0.finish_and_clear();
        self.0.reset();
    }
}
