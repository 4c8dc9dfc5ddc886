//! Quality of service by purpose.

use std::time::Duration;

use ros2_client::QosProfile;
use ros2_client::qos::{Durability as DdsDurability, History, Reliability as DdsReliability, WhenFull};

/// How long a reliable `publish` waits for room when a reader is slow.
const SEND_PATIENCE: Duration = Duration::from_secs(2);

/// Whether lost messages are sent again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reliability {
    /// May be lost. On default kernels every large image is.
    BestEffort,
    /// Repeated until acknowledged.
    Reliable,
}

/// Whether a late joiner gets what was published before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Durability {
    /// Only what is published from now on.
    Volatile,
    /// The last `depth` messages too ("latched").
    TransientLocal,
}

/// A quality-of-service profile: what is promised, and how many messages are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Qos {
    /// Whether lost messages are sent again.
    pub reliability: Reliability,
    /// Whether a late joiner gets what was published before.
    pub durability: Durability,
    /// Messages kept for a slow reader (keep-last), at least 1.
    pub depth: usize,
}

impl Qos {
    /// Whole maps (tens of megabytes): reliable, and only the newest is worth keeping.
    pub const MAP: Self = Self::reliable(1);
    /// Camera images: every image of a light sequence must arrive, so a whole sequence fits.
    pub const IMAGE: Self = Self::reliable(8);
    /// State that a late joiner needs at once (`camera_info`, `state`, `robot_description`).
    pub const LATCHED: Self = Self {
        durability: Durability::TransientLocal,
        ..Self::reliable(1)
    };
    /// Static transforms: latched, several publishers.
    pub const TF_STATIC: Self = Self {
        durability: Durability::TransientLocal,
        ..Self::reliable(100)
    };
    /// Small messages in quick succession (`/tf`, exposures, joint states).
    pub const STREAM: Self = Self::reliable(100);
    /// `/clock` and sensor streams in which only the newest sample matters.
    pub const SENSOR: Self = Self {
        reliability: Reliability::BestEffort,
        durability: Durability::Volatile,
        depth: 5,
    };
    /// Services: deep enough that a burst of callers loses nothing.
    pub(crate) const SERVICE: Self = Self::reliable(100);

    /// Reliable, volatile, the last `depth` messages.
    pub const fn reliable(depth: usize) -> Self {
        Self {
            reliability: Reliability::Reliable,
            durability: Durability::Volatile,
            depth,
        }
    }

    /// Whether a publisher with `self` serves a subscription that asks for `requested` (DDS "requested/offered").
    pub fn satisfies(&self, requested: &Self) -> bool {
        self.reliability >= requested.reliability && self.durability >= requested.durability
    }

    pub(crate) fn profile(&self) -> QosProfile {
        QosProfile::default()
            .reliability(match self.reliability {
                Reliability::BestEffort => DdsReliability::BestEffort,
                Reliability::Reliable => DdsReliability::Reliable {
                    when_full: WhenFull::Wait(SEND_PATIENCE),
                },
            })
            .durability(match self.durability {
                Durability::Volatile => DdsDurability::Volatile,
                Durability::TransientLocal => DdsDurability::TransientLocal,
            })
            .history(History::KeepLast {
                depth: self.depth.max(1),
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_offer_satisfies_what_asks_for_no_more() {
        assert!(Qos::LATCHED.satisfies(&Qos::MAP));
        assert!(Qos::MAP.satisfies(&Qos::SENSOR));
        assert!(!Qos::MAP.satisfies(&Qos::LATCHED));
        assert!(!Qos::SENSOR.satisfies(&Qos::MAP));
    }
}
