//! What the controller's reports say, put together.

use std::time::Instant;

use devices::{ARM_JOINTS, JointReading};
use xarm_protocol::{Mode, ReportKind, State};

use crate::faults::{KnownError, Servos};

/// A bit for each joint.
const ALL_JOINTS: u8 = (1 << ARM_JOINTS) - 1;

/// By the newest reports; what is not reported says why.
#[derive(Debug, Clone)]
pub(crate) struct Observed {
    pub(crate) motion: Result<Motion, String>,
    pub(crate) health: Result<Health, String>,
    /// Stays when reports fail.
    pub(crate) joints: Option<JointReading>,
}

/// From a real-time report.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion {
    pub(crate) mode: Mode,
    pub(crate) state: State,
    pub(crate) received_at: Instant,
}

/// From a rich report.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Health {
    pub(crate) error: KnownError,
    pub(crate) brakes: u8,
    pub(crate) enabled: u8,
    /// The torques are currents.
    pub(crate) has_currents: bool,
    pub(crate) received_at: Instant,
}

impl Observed {
    pub(crate) fn nothing() -> Self {
        let waiting = |kind: ReportKind| format!("no {} report has come yet", kind.name());
        Self {
            motion: Err(waiting(ReportKind::Real)),
            health: Err(waiting(ReportKind::Rich)),
            joints: None,
        }
    }

    pub(crate) fn lose(&mut self, kind: ReportKind, reason: String) {
        match kind {
            ReportKind::Real => self.motion = Err(reason),
            ReportKind::Normal | ReportKind::Rich => self.health = Err(reason),
        }
    }

    /// Both, if both are reported.
    pub(crate) fn both(&self) -> Result<(&Motion, &Health), &str> {
        match (&self.motion, &self.health) {
            (Ok(motion), Ok(health)) => Ok((motion, health)),
            (Err(reason), _) | (_, Err(reason)) => Err(reason),
        }
    }

    /// The newest; torques that are currents are no numbers.
    pub(crate) fn reading(&self) -> Option<JointReading> {
        let mut reading = self.joints?;
        if self.health.as_ref().is_ok_and(|health| health.has_currents) {
            reading.torques = [f64::NAN; ARM_JOINTS];
        }
        Some(reading)
    }
}

impl Motion {
    /// Whether set-points are obeyed.
    pub(crate) fn follows(&self) -> bool {
        self.is_ready(Mode::Servo)
    }

    /// Whether nothing moves that would have to slow down.
    pub(crate) fn stands(&self) -> bool {
        matches!(self.state, State::Stopped | State::Changed | State::Paused)
    }

    /// Whether the controller is ready in this mode.
    pub(crate) fn is_ready(&self, mode: Mode) -> bool {
        self.mode == mode && matches!(self.state, State::Moving | State::Ready)
    }
}

impl Health {
    pub(crate) fn new(error: u8, servos: Option<Servos>, [brakes, enabled]: [u8; 2], has_currents: bool) -> Self {
        Self {
            error: KnownError { code: error, servos },
            brakes,
            enabled,
            has_currents,
            received_at: Instant::now(),
        }
    }

    /// All servos are on and all brakes are open.
    pub(crate) fn is_enabled(&self) -> bool {
        self.brakes & self.enabled & ALL_JOINTS == ALL_JOINTS
    }
}
