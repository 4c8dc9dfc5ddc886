//! What makes photometric stereo impossible.

use std::ops::RangeInclusive;

/// Why lights or images were refused, with what was given and what is allowed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PhotometricError {
    /// A light needs a finite direction that is not zero.
    #[error("light {channel}: direction {direction:?} has no length or is not finite")]
    LightDirection {
        /// The light's channel.
        channel: u8,
        /// As given.
        direction: [f64; 3],
    },
    /// A light needs a positive, finite intensity.
    #[error("light {channel}: intensity {intensity} must be positive and finite")]
    LightIntensity {
        /// The light's channel.
        channel: u8,
        /// As given.
        intensity: f64,
    },
    /// A point level with or behind a panel's face gets nothing from it.
    #[error("light {channel}: its panel faces away from {point:?} (cosine {cosine:.3})")]
    BehindPanel {
        /// The light's channel.
        channel: u8,
        /// The point, base frame, metres.
        point: [f64; 3],
        /// Between the panel's facing and the way to the point.
        cosine: f64,
    },
    /// A normal has three unknowns.
    #[error("{got} lights given, at least {needed} are needed")]
    TooFewLights {
        /// Lights given.
        got: usize,
        /// Lights needed.
        needed: usize,
    },
    /// Lights in one plane say nothing about the direction across it.
    #[error(
        "lights are too close to one plane: smallest to largest singular value {ratio:.4}, at least {allowed} is needed"
    )]
    CoplanarLights {
        /// Smallest over largest singular value of the unit directions.
        ratio: f64,
        /// Smallest ratio allowed.
        allowed: f64,
    },
    /// Two light models claim the same channel.
    #[error("light channel {channel} is described twice")]
    DuplicateLight {
        /// The channel.
        channel: u8,
    },
    /// A light model has no image.
    #[error("no image of light channel {channel}; the stack holds {present:?}")]
    NoImage {
        /// The channel.
        channel: u8,
        /// Channels with an image.
        present: Vec<u8>,
    },
    /// A number is outside what makes sense.
    #[error("{what} = {value} is outside {allowed}")]
    OutOfRange {
        /// The option.
        what: &'static str,
        /// As given.
        value: f64,
        /// The range in words.
        allowed: &'static str,
    },
    /// Images of one capture must fit each other and their camera.
    #[error("{what} are {width} x {height}, expected {expected_width} x {expected_height}")]
    OtherSize {
        /// What was given.
        what: &'static str,
        /// Columns given.
        width: usize,
        /// Rows given.
        height: usize,
        /// Columns expected.
        expected_width: usize,
        /// Rows expected.
        expected_height: usize,
    },
    /// Shadows are told by what other lights show.
    #[error("of lights {present:?} none can be predicted from an overhead light, an opposed one and a fourth")]
    NoOpposedLights {
        /// Channels of the rig.
        present: Vec<u8>,
    },
}

impl PhotometricError {
    /// Refuses a number outside a range, NaN included; `allowed` is the range in words.
    pub(crate) fn require_within(
        what: &'static str,
        value: f64,
        range: RangeInclusive<f64>,
        allowed: &'static str,
    ) -> Result<(), Self> {
        if range.contains(&value) {
            return Ok(());
        }
        Err(Self::OutOfRange { what, value, allowed })
    }
}
