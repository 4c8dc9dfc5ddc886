/// What happened at the port since the driver was started; for diagnostics.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LinkStatistics {
    /// Whole frames that came.
    pub frames_received: u64,
    /// Frames that came damaged, and other garbage.
    pub bad_frames_received: u64,
    /// Frames that the firmware says came damaged.
    pub bad_frames_sent: u64,
    /// Times that the firmware was found at the port.
    pub connections: u64,
    /// Times that the firmware restarted while it was connected.
    pub firmware_resets: u64,
    /// Times that the firmware's clock was not where it should have been.
    pub clock_jumps: u64,
    /// The newest fault, for people.
    pub last_fault: Option<String>,
}

impl LinkStatistics {
    /// Times that the firmware was found again.
    pub fn reconnects(&self) -> u64 {
        self.connections.saturating_sub(1)
    }
}
