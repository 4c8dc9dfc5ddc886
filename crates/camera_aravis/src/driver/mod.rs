//! The camera's thread: it alone touches Aravis' camera and stream, which may block for seconds.
//!
//! Commands, frames and the loss of control come through one channel, so that the thread sleeps until there is
//! something to do and then does it at once.

mod buffers;
mod clock;
mod features;
mod opening;
mod session;
mod setup;
mod stream;
mod transport;

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

use devices::{AppliedSettings, CameraError, CameraLink, CameraSettings};
use tokio::sync::watch;

use crate::CameraConfig;
use crate::camera::{Command, Event};
use session::Session;

/// How often the statistics are looked at.
const STATISTICS_PERIOD: Duration = Duration::from_secs(1);

/// What Aravis' own threads report.
#[derive(Debug)]
pub(crate) enum Report {
    /// A frame has ended, whole or not.
    Buffer {
        /// Which stream it is from.
        stream: u64,
        buffer: aravis::Buffer,
        at: Instant,
    },
    /// The camera does not answer any more, or has another master.
    ControlLost {
        /// Which opening of the camera it was.
        session: u64,
    },
}

/// The thread and what it owns between two openings.
pub(crate) struct Driver {
    pub(crate) config: CameraConfig,
    pub(crate) events: Receiver<Event>,
    /// For Aravis' threads.
    pub(crate) reports: Sender<Event>,
    pub(crate) link: watch::Sender<CameraLink>,
    /// The last ones that were accepted.
    pub(crate) settings: Option<CameraSettings>,
    /// Counts openings and streams, so that late reports are known.
    pub(crate) number: u64,
}

/// Why a session is over.
enum Over {
    /// The driver is to end.
    Ended,
    /// For people.
    Lost(String),
}

impl Driver {
    pub(crate) fn run(mut self) {
        while let Some(mut session) = self.open() {
            let over = self.serve(&mut session);
            session.disarm();
            match over {
                Over::Ended => return session.close(),
                Over::Lost(reason) => {
                    tracing::warn!(guid = self.config.guid, reason, "the camera is lost");
                    self.publish_lost(reason);
                }
            }
            // Letting go of a camera that does not answer takes seconds: people are told before.
            drop(session);
        }
    }

    fn publish_lost(&self, reason: String) {
        let lost = CameraLink::Lost { reason };
        self.link.send_if_modified(|link| {
            let changed = *link != lost;
            *link = lost;
            changed
        });
    }

    /// Tries until the camera is open and set up as it was before; none when the driver is to end.
    fn open(&mut self) -> Option<Session> {
        loop {
            match self.try_open() {
                Ok(session) => return Some(session),
                Err(reason) => {
                    tracing::debug!(guid = self.config.guid, reason, "the camera does not open");
                    self.publish_lost(reason);
                }
            }
            if !self.pause() {
                return None;
            }
        }
    }

    fn try_open(&mut self) -> Result<Session, String> {
        self.number += 1;
        let mut session = Session::open(&self.config, &self.reports, self.number)?;
        if let Some(settings) = self.settings {
            self.number += 1;
            session
                .configure(settings, self.number)
                .map_err(|error| format!("it is there, but not as it was: {error}"))?;
        }
        tracing::info!(guid = self.config.guid, identity = ?session.identity(), "the camera is open");
        self.link.send_replace(session.link());
        Ok(session)
    }

    /// Waits for the next attempt; false when the driver is to end.
    fn pause(&self) -> bool {
        let end = Instant::now() + self.config.retry;
        loop {
            match self.events.recv_timeout(end.saturating_duration_since(Instant::now())) {
                Ok(Event::Command(command)) => self.refuse(command),
                Ok(Event::Report(_)) => {}
                Ok(Event::End) | Err(RecvTimeoutError::Disconnected) => return false,
                Err(RecvTimeoutError::Timeout) => return true,
            }
        }
    }

    fn refuse(&self, command: Command) {
        let reason = match &*self.link.borrow() {
            CameraLink::Lost { reason } => reason.clone(),
            CameraLink::Open { .. } => "it is being opened".into(),
        };
        command.refuse(CameraError::Lost {
            guid: self.config.guid.clone(),
            reason,
        });
    }

    fn serve(&mut self, session: &mut Session) -> Over {
        let mut look = Instant::now() + STATISTICS_PERIOD;
        loop {
            let event = self.events.recv_timeout(look.saturating_duration_since(Instant::now()));
            let done = match event {
                Ok(Event::Command(command)) => self.carry_out(session, command),
                Ok(Event::Report(report)) => session.take(report),
                Ok(Event::End) | Err(RecvTimeoutError::Disconnected) => return Over::Ended,
                Err(RecvTimeoutError::Timeout) => Ok(()),
            };
            if let Err(reason) = done {
                return Over::Lost(reason);
            }
            if Instant::now() >= look {
                look = Instant::now() + STATISTICS_PERIOD;
                self.publish_statistics(session);
            }
        }
    }

    fn publish_statistics(&self, session: &Session) {
        let now = session.link();
        self.link.send_if_modified(|link| {
            let changed = *link != now;
            *link = now;
            changed
        });
    }

    /// Fails when the camera is lost by it.
    fn carry_out(&mut self, session: &mut Session, command: Command) -> Result<(), String> {
        match command {
            Command::Configure(settings, reply) => {
                let outcome = self.configure(session, settings);
                self.publish_statistics(session);
                answer(reply, outcome)
            }
            Command::Arm(count, reply) => answer(reply, session.arm(count)),
            Command::Trigger(reply) => answer(reply, session.trigger()),
        }
    }

    fn configure(&mut self, session: &mut Session, settings: CameraSettings) -> Result<AppliedSettings, CameraError> {
        if session.is_armed() {
            let guid = self.config.guid.clone();
            return Err(CameraError::Armed { guid });
        }
        self.number += 1;
        let error = match session.configure(settings, self.number) {
            Ok(applied) => {
                self.settings = Some(settings);
                return Ok(applied);
            }
            Err(error) => error,
        };
        // All or none: what was set before is set again.
        if let (Some(before), false) = (self.settings, matches!(error, CameraError::Lost { .. })) {
            self.number += 1;
            session
                .configure(before, self.number)
                .map_err(|second| CameraError::Lost {
                    guid: self.config.guid.clone(),
                    reason: format!("{error}; and the settings before that are refused too: {second}"),
                })?;
        }
        Err(error)
    }
}

/// Answers a command; an answer that says that the camera is lost ends the session too.
fn answer<T>(
    reply: tokio::sync::oneshot::Sender<Result<T, CameraError>>,
    outcome: Result<T, CameraError>,
) -> Result<(), String> {
    let lost = match &outcome {
        Err(CameraError::Lost { reason, .. }) => Err(reason.clone()),
        _ => Ok(()),
    };
    // Who asked may have gone away meanwhile.
    let _ = reply.send(outcome);
    lost
}
