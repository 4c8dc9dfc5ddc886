//! What may come nearer than the margin, or touch.

use crate::checker::{Pair, With};
use crate::distance::UNKNOWN_DEPTH;
use crate::error::{CollisionError, require};

/// How near a link or a carried object may come to what stands around, instead of the checker's margin. It counts for
/// obstacles only, never between links. Where several apply the least one counts.
#[derive(Debug, Clone, PartialEq)]
pub struct Allowance {
    /// A link of the arm, or the carried object.
    pub link: String,
    /// An obstacle; none: all of them.
    pub obstacle: Option<String>,
    /// Metres, -0.1 to 1; negative: so deep it may be in it.
    pub margin: f64,
}

impl Allowance {
    pub(crate) fn check(&self) -> Result<(), CollisionError> {
        let place = || format!("allowance for `{}`", self.link);
        let is_allowed = (-0.1..=1.0).contains(&self.margin);
        require(&place(), "margin", self.margin, is_allowed, "-0.1 to 1 m")
    }

    fn applies(&self, pair: &Pair<'_>) -> bool {
        let With::Obstacle(obstacle) = pair.with else {
            return false;
        };
        let is_meant = |wanted: &String| *wanted == obstacle.name;
        self.link == pair.part.name && self.obstacle.as_ref().is_none_or(is_meant)
    }
}

/// What counts as a contact of a pair, metres.
pub(crate) fn margin_of(pair: &Pair<'_>, margin: f64, allowances: &[Allowance]) -> f64 {
    let applying = allowances.iter().filter(|allowance| allowance.applies(pair));
    applying.map(|allowance| allowance.margin).fold(margin, f64::min)
}

/// Whether a distance is a contact. A touch whose depth could not be told is one, however deep the pair may be.
pub(crate) fn is_contact(distance: f64, margin: f64) -> bool {
    distance < margin || distance.to_bits() == UNKNOWN_DEPTH.to_bits()
}
