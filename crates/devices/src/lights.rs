//! Which lights are on, and for how long.

use std::fmt;
use std::time::Duration;

/// Panels of the cell, L1 to L7.
pub const PANEL_COUNT: usize = 7;

/// The light of one image: none, or one panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Channel(u8);

impl Channel {
    /// All panels off.
    pub const DARK: Self = Self(0);

    /// 0 is dark, 1 to 7 are L1 to L7; none for other numbers.
    pub const fn new(number: u8) -> Option<Self> {
        if number as usize <= PANEL_COUNT {
            Some(Self(number))
        } else {
            None
        }
    }

    /// Dark, then L1 to L7: the order of a capture.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..=PANEL_COUNT as u8).map(Self)
    }

    /// 0 is dark, 1 to 7 are L1 to L7.
    pub const fn number(self) -> u8 {
        self.0
    }

    /// The panels that are on.
    pub fn panels(self) -> PanelSet {
        let mut panels = PanelSet::NONE;
        if let Some(index) = usize::from(self.0).checked_sub(1) {
            panels.0[index] = true;
        }
        panels
    }
}

impl fmt::Display for Channel {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            0 => formatter.write_str("dark"),
            number => write!(formatter, "L{number}"),
        }
    }
}

/// Panels that are on: index 0 is L1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct PanelSet(pub [bool; PANEL_COUNT]);

impl PanelSet {
    /// All off.
    pub const NONE: Self = Self([false; PANEL_COUNT]);

    /// Whether every panel is off.
    pub fn is_none(&self) -> bool {
        *self == Self::NONE
    }
}

impl fmt::Display for PanelSet {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<String> = (1..)
            .zip(self.0)
            .filter(|(_, on)| *on)
            .map(|(number, _)| format!("L{number}"))
            .collect();
        formatter.write_str(if names.is_empty() { "none" } else { "" })?;
        formatter.write_str(&names.join("+"))
    }
}

/// One exposure's light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LightStep {
    /// What is on.
    pub channel: Channel,
    /// From the panel's rising to its falling edge.
    pub on_time: Duration,
    /// From there to the next step, all panels off.
    pub gap: Duration,
}

/// A capture's light, timed by the light controller itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LightSequence {
    /// In order; image `i` belongs to step `i`.
    pub steps: Vec<LightStep>,
    /// From a step's start to the rising edge of the cameras' trigger line.
    pub trigger_delay: Duration,
    /// Length of the trigger pulse.
    pub trigger_width: Duration,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_capture_is_dark_and_then_every_panel_once() {
        let names: Vec<String> = Channel::all().map(|channel| channel.to_string()).collect();
        assert_eq!(names, ["dark", "L1", "L2", "L3", "L4", "L5", "L6", "L7"]);
        assert!(Channel::new(8).is_none());
    }

    #[test]
    fn panels_are_named() {
        let mut panels = Channel::all().last().expect("there are panels").panels();
        assert_eq!(panels.to_string(), "L7");
        panels.0[0] = true;
        assert_eq!(
            (panels.to_string(), PanelSet::NONE.to_string()),
            ("L1+L7".into(), "none".into())
        );
    }
}
