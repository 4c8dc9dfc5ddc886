use std::path::PathBuf;

/// Where the light controller is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LightSerialConfig {
    /// The serial port, or a link to it such as those in `/dev/serial/by-id`, which is followed at every opening.
    pub port: PathBuf,
}

impl LightSerialConfig {
    /// The controller at this port.
    pub fn new(port: impl Into<PathBuf>) -> Self {
        Self { port: port.into() }
    }
}
