//! Why there is no link to the firmware.

use std::io;
use std::time::Duration;

use light_protocol::LightProtocolError;

/// Every failure of the link, by cause. Users see its text as the reason of a lost link.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LinkError {
    #[error("port {port} does not exist: is the light controller plugged in?")]
    NoPort { port: String },
    #[error("port {port} is in use by another program")]
    InUse { port: String },
    #[error("this user may not open port {port}: {advice}")]
    Forbidden { port: String, advice: String },
    #[error("cannot open port {port}: {reason}")]
    Open { port: String, reason: String },
    #[error("nothing at port {port} answered within {waited:?}: is it the light controller, with its firmware?")]
    NoAnswer { port: String, waited: Duration },
    #[error("port {port}: {source}")]
    OtherFirmware { port: String, source: LightProtocolError },
    #[error("the controller at port {port} fell silent")]
    Silent { port: String },
    #[error("port {port} was lost: {reason}")]
    Lost { port: String, reason: io::Error },
    #[error("the controller at port {port} was reset ({cause})")]
    Reset { port: String, cause: String },
}
