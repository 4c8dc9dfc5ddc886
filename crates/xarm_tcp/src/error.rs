//! Why there is no link to the controller.

use std::time::Duration;

use devices::ArmError;
use xarm_protocol::ProtocolError;

/// Every failure of the link, by cause. Users see its text as the reason of a lost link.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LinkError {
    #[error("cannot connect to {address}: {reason}")]
    Connect { address: String, reason: String },
    #[error("the controller at {address} did not answer `{what}` within {waited:?}")]
    Silent {
        address: String,
        what: &'static str,
        waited: Duration,
    },
    #[error("the connection to {address} was lost: {reason}")]
    Lost { address: String, reason: String },
    #[error("the controller at {address} sent what is not understood: {source}")]
    Protocol { address: String, source: ProtocolError },
    #[error("the controller at {address} cannot be used: {source}")]
    Unsupported { address: String, source: ProtocolError },
    #[error("the arm at {address} has {found} joints; this driver is for the xArm7, which has 7")]
    OtherAxes { address: String, found: u8 },
    #[error("the arm at {address} has serial number {found}, expected is {expected}")]
    OtherArm {
        address: String,
        found: String,
        expected: String,
    },
}

impl LinkError {
    /// Whether it stays so until somebody changes the arm or the configuration.
    pub(crate) fn is_lasting(&self) -> bool {
        matches!(
            self,
            Self::Unsupported { .. } | Self::OtherAxes { .. } | Self::OtherArm { .. }
        )
    }
}

impl From<LinkError> for ArmError {
    fn from(error: LinkError) -> Self {
        Self::Disconnected {
            reason: error.to_string(),
        }
    }
}
