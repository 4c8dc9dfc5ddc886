/// What happened on the way to the controller since the driver was started; for diagnostics.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ArmStatistics {
    /// Times that the controller was reached.
    pub connections: u64,
    /// Times that a report connection was closed because nothing, or nothing that is understood, came.
    pub report_failures: u64,
    /// Streams of set-points that were handed over.
    pub streams: u64,
    /// Why the newest stream ended, for people.
    pub last_stream_end: Option<String>,
    /// The newest fault, for people.
    pub last_fault: Option<String>,
}

impl ArmStatistics {
    /// Times that the controller was reached again.
    pub fn reconnects(&self) -> u64 {
        self.connections.saturating_sub(1)
    }
}
