//! What is said to the controller to arm, stop and recover. Nothing is taken for done before the reports say so.

use std::time::{Duration, Instant};

use devices::{ArmError, ArmFault, FaultRecovery};
use tokio::sync::watch;
use xarm_protocol::{Mode, Reply, Request, State, StateCommand, Status};

use crate::config::Timeouts;
use crate::control::connect;
use crate::error::LinkError;
use crate::faults::{KnownError, is_of_servo};
use crate::greeting::Link;
use crate::observed::{Health, Motion, Observed};
use crate::stream::Stream;

const ALL_AXES: u8 = 8;

/// A controller, and what it reports.
#[derive(Debug, Clone)]
pub(crate) struct Conversation {
    pub(crate) link: Link,
    pub(crate) observed: watch::Receiver<Observed>,
    pub(crate) timeouts: Timeouts,
}

impl Conversation {
    /// Servos on, servo mode, ready; then a connection for set-points.
    pub(crate) async fn arm(self) -> Result<Box<Stream>, ArmError> {
        self.require_reports()?;
        if let Some(fault) = self.error().await?.fault() {
            return Err(ArmError::Fault(fault));
        }
        self.make_ready(Mode::Servo).await?;
        let socket = self.connect_stream().await?;
        let here = {
            let observed = self.observed.borrow();
            let follows = observed.both().is_ok_and(|(motion, _)| motion.follows());
            observed.joints.filter(|_| follows)
        };
        let here = here.ok_or_else(|| ArmError::Refused {
            reason: "the arm was made ready to follow set-points, and is not any more".to_owned(),
        })?;
        Ok(Box::new(Stream::new(socket, here.angles)))
    }

    /// Decelerates; if that does not help, stops.
    pub(crate) async fn stop(self) -> Result<(), ArmError> {
        let stands = self.observed.borrow().motion.as_ref().is_ok_and(Motion::stands);
        if !stands && self.reach_stop(StateCommand::Decelerate).await? {
            return Ok(());
        }
        if self.reach_stop(StateCommand::Stop).await? {
            return Ok(());
        }
        Err(ArmError::Timeout {
            what: "the stop of the arm",
            timeout: self.timeouts.stop,
        })
    }

    /// Whether a state from after the command is reported as stopped in time.
    async fn reach_stop(&self, command: StateCommand) -> Result<bool, ArmError> {
        let since = Instant::now();
        let request = Request::SetState(command);
        let reply = self.link.control.ask_now("stop", request, self.timeouts.reply).await?;
        // Not every firmware knows how to decelerate.
        if reply.status.has(Status::INVALID) {
            return Ok(false);
        }
        let mut observed = self.observed.clone();
        let stopped = |motion: &Motion| motion.state == State::Stopped && motion.received_at > since;
        let waiting = observed.wait_for(|observed| observed.motion.as_ref().is_ok_and(stopped));
        Ok(matches!(
            tokio::time::timeout(self.timeouts.stop, waiting).await,
            Ok(Ok(_))
        ))
    }

    /// Cleans errors as far as they may be cleaned; servos on, position mode: the arm holds and follows nothing.
    pub(crate) async fn recover(self, looked: bool) -> Result<(), ArmError> {
        self.require_reports()?;
        if let Some(fault) = self.error().await?.fault() {
            require_permission(&fault, looked)?;
            self.ask("clean the error", Request::CleanError).await?;
        }
        self.ask("clean the warning", Request::CleanWarning).await?;
        match self.error().await?.fault() {
            Some(fault) => Err(ArmError::Fault(fault)),
            None => self.make_ready(Mode::Position).await,
        }
    }

    /// As the controller says now, servos included where it is about them.
    pub(crate) async fn error(&self) -> Result<KnownError, ArmError> {
        Ok(self.ask_error().await?)
    }

    pub(crate) async fn ask_error(&self) -> Result<KnownError, LinkError> {
        let control = &self.link.control;
        let understood = |source| LinkError::Protocol {
            address: control.address().to_owned(),
            source,
        };
        let reply = control
            .ask("which error", Request::GetError, self.timeouts.reply)
            .await?;
        let [code, _warning] = reply.read_bytes().map_err(understood)?;
        let mut servos = None;
        if is_of_servo(code) {
            let reply = control
                .ask("which servo", Request::ServoDebug, self.timeouts.reply)
                .await?;
            // Seven joints and the tool board.
            let bytes: Option<[u8; 16]> = reply.read_bytes().ok();
            servos = bytes.map(|bytes| std::array::from_fn(|joint| [bytes[2 * joint], bytes[2 * joint + 1]]));
        }
        Ok(KnownError { code, servos })
    }

    /// Servos on, this mode, ready, and reported to be so.
    async fn make_ready(&self, mode: Mode) -> Result<(), ArmError> {
        let enable = Request::MotionEnable {
            axis: ALL_AXES,
            on: true,
        };
        let enabled = self.link.control.ask("enable", enable, self.timeouts.enable).await?;
        self.accept("switch its servos on", enabled).await?;
        let was = self.observed.borrow().motion.as_ref().ok().map(|motion| motion.mode);
        if was == Some(Mode::FreeDrive) && mode != Mode::Position {
            // From leading by hand there is no direct way to every mode.
            self.set_mode(Mode::Position).await?;
        }
        let since = Instant::now();
        self.set_mode(mode).await?;
        self.settle(mode, since).await
    }

    async fn set_mode(&self, mode: Mode) -> Result<(), ArmError> {
        self.ask("change its mode", Request::SetMode(mode)).await?;
        // A change of mode leaves a state that wants to be ended.
        self.ask("be ready", Request::SetState(StateCommand::Run)).await?;
        Ok(())
    }

    async fn ask(&self, what: &'static str, request: Request) -> Result<(), ArmError> {
        let reply = self.link.control.ask(what, request, self.timeouts.reply).await?;
        self.accept(what, reply).await
    }

    /// Refuses what the controller refused.
    async fn accept(&self, what: &'static str, reply: Reply) -> Result<(), ArmError> {
        if reply.status.has(Status::ERROR)
            && let Some(fault) = self.error().await?.fault()
        {
            return Err(ArmError::Fault(fault));
        }
        if reply.status.has(Status::INVALID) {
            return Err(ArmError::Refused {
                reason: format!("the controller refused to {what} (status 0x{:02X})", reply.status.0),
            });
        }
        Ok(())
    }

    /// Waits for both reports from after `since`.
    async fn settle(&self, mode: Mode, since: Instant) -> Result<(), ArmError> {
        let mut fault = None;
        let settled = self.becomes(self.timeouts.settle, |motion, health| {
            if health.received_at <= since {
                return false;
            }
            fault = health.error.fault();
            fault.is_some() || (health.is_enabled() && motion.received_at > since && motion.is_ready(mode))
        });
        let settled = settled.await;
        match fault {
            Some(fault) => Err(ArmError::Fault(fault)),
            None if settled => Ok(()),
            None => Err(ArmError::Timeout {
                what: "a report that all servos are on and the mode is as it was set",
                timeout: self.timeouts.settle,
            }),
        }
    }

    async fn becomes(&self, patience: Duration, mut wanted: impl FnMut(&Motion, &Health) -> bool) -> bool {
        let mut observed = self.observed.clone();
        let waiting =
            observed.wait_for(|observed| observed.both().is_ok_and(|(motion, health)| wanted(motion, health)));
        matches!(tokio::time::timeout(patience, waiting).await, Ok(Ok(_)))
    }

    fn require_reports(&self) -> Result<(), ArmError> {
        let observed = self.observed.borrow();
        let both = observed.both().map(drop);
        both.map_err(|reason| ArmError::Disconnected {
            reason: reason.to_owned(),
        })
    }

    async fn connect_stream(&self) -> Result<std::net::TcpStream, LinkError> {
        let address = self.link.control.address();
        let socket = connect(address, self.timeouts.connect).await?;
        // It does not block: tokio has made it so.
        socket.into_std().map_err(|error| LinkError::Connect {
            address: address.to_owned(),
            reason: error.to_string(),
        })
    }
}

fn require_permission(fault: &ArmFault, looked: bool) -> Result<(), ArmError> {
    let what = match fault.recovery {
        FaultRecovery::Service => "nothing that this driver can do helps",
        FaultRecovery::AfterLook if !looked => "a person has to look at the arm before it is recovered",
        // Whether a person has done what there was to do shows when the error is cleaned.
        FaultRecovery::AfterLook | FaultRecovery::Person | FaultRecovery::Automatic => return Ok(()),
    };
    Err(ArmError::Refused {
        reason: format!("{what}: fault {}, {}", fault.code, fault.description),
    })
}
