use std::time::Duration;

use xarm_protocol::{ReportKind, VacuumHardware};

/// Where the arm's controller is, and what is expected of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct XArmConfig {
    /// Name or address of the control box.
    pub host: String,
    /// TCP port for requests and set-points; 502.
    pub control_port: u16,
    /// TCP port of the real-time reports; 30003.
    pub real_time_report_port: u16,
    /// TCP port of the rich reports; 30002.
    pub rich_report_port: u16,
    /// How the vacuum gripper is wired.
    pub vacuum: VacuumHardware,
    /// Serial number of the only arm that is welcome; none: any.
    pub expected_serial: Option<String>,
    /// How long the driver waits for what.
    pub timeouts: Timeouts,
}

impl XArmConfig {
    /// A controller at its standard ports, a gripper with a cable, any serial number.
    pub fn new(host: impl Into<String>) -> Self {
        Self {
            host: host.into(),
            control_port: 502,
            real_time_report_port: ReportKind::Real.port(),
            rich_report_port: ReportKind::Rich.port(),
            vacuum: VacuumHardware::default(),
            expected_serial: None,
            timeouts: Timeouts::default(),
        }
    }
}

/// How long the driver waits for what. The defaults suit a controller on the same switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timeouts {
    /// For a connection to be made; 0.5 s.
    pub connect: Duration,
    /// For a reply on the control port; 1 s. Switching the servos on may take [`Timeouts::enable`].
    pub reply: Duration,
    /// For the servos to be switched on; 5 s.
    pub enable: Duration,
    /// Between questions that keep the control connection alive; 0.75 s. A controller that died is noticed within this
    /// and [`Timeouts::reply`].
    pub keep_alive: Duration,
    /// Without a real-time report (100 Hz); 0.2 s.
    pub real_time_report: Duration,
    /// Without a rich report (5 Hz); 1 s.
    pub rich_report: Duration,
    /// For reports to confirm a change of mode, enabling, or the end of a fault; 2 s.
    pub settle: Duration,
    /// For the arm to come to a stop; 2 s.
    pub stop: Duration,
    /// For the vacuum gripper's outputs to be as they were set; 1 s.
    pub suction: Duration,
}

impl Default for Timeouts {
    fn default() -> Self {
        Self {
            connect: Duration::from_millis(500),
            reply: Duration::from_secs(1),
            enable: Duration::from_secs(5),
            keep_alive: Duration::from_millis(750),
            real_time_report: Duration::from_millis(200),
            rich_report: Duration::from_secs(1),
            settle: Duration::from_secs(2),
            stop: Duration::from_secs(2),
            suction: Duration::from_secs(1),
        }
    }
}
