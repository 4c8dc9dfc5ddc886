//! Requests and what is answered to them.

use std::time::Instant;

use xarm_protocol::{Frame, Protocol, Reply, Request, Status, register};

use super::core::{ALL_AXES, Core};
use super::task::Ticket;

/// Warnings that requests leave behind.
pub(super) mod caution {
    pub(crate) const QUEUE_FULL: u8 = 11;
    pub(crate) const PARAMETER: u8 = 12;
    pub(crate) const UNKNOWN: u8 = 13;
}

/// Who asks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Asker {
    /// Number of the client.
    pub(super) client: u64,
    /// What it wants to be told by itself: bits start 1, end 2, triggered 4.
    pub(super) feedback: u8,
    /// When the request was read.
    pub(super) at: Instant,
}

/// What a request leads to.
pub(super) enum Outcome {
    /// With data.
    Data(Vec<u8>),
    Floats(Vec<f32>),
    Done,
    /// The parameters cannot be; a warning says so.
    Invalid,
    /// There is no answer, and no harm.
    NoResult(Vec<f32>),
}

impl Core {
    pub(super) fn answer(&mut self, asker: &Asker, frame: &Frame) -> Frame {
        let register = frame.register();
        let reply = match Request::decode(register, frame.parameters()) {
            Ok(request) => {
                self.tasks = self.tasks.wrapping_add(1);
                let ticket = Ticket {
                    client: asker.client,
                    transaction: frame.transaction,
                    protocol: frame.protocol,
                    register,
                    feedback: asker.feedback,
                    task: self.tasks,
                };
                self.reply(&request, &ticket, asker.at)
            }
            Err(error) => {
                tracing::warn!("the simulated arm refuses register {register}: {error}");
                self.finish(register, Outcome::Invalid)
            }
        };
        reply.frame(frame.transaction, frame.protocol)
    }

    /// As if another client had asked.
    pub(super) fn ask(&mut self, request: &Request) -> Reply {
        let ticket = Ticket {
            client: 0,
            transaction: 0,
            protocol: Protocol::Private,
            register: request.register(),
            feedback: 0,
            task: 0,
        };
        self.reply(request, &ticket, Instant::now())
    }

    fn reply(&mut self, request: &Request, ticket: &Ticket, at: Instant) -> Reply {
        let outcome = self
            .query(request)
            .or_else(|| self.command(request))
            .or_else(|| self.set(request))
            .or_else(|| self.motion(request, ticket, at))
            .or_else(|| self.tool_request(request, ticket))
            .unwrap_or_else(|| self.not_known(ticket.register));
        self.finish(ticket.register, outcome)
    }

    fn finish(&mut self, register: u8, outcome: Outcome) -> Reply {
        if matches!(outcome, Outcome::Invalid) {
            self.warn(caution::PARAMETER);
        }
        let status = self.status();
        let data = |status, data| Reply { register, status, data };
        match outcome {
            Outcome::Data(bytes) => data(status, bytes),
            Outcome::Floats(values) => Reply::floats(register, status, &values),
            Outcome::Done => data(status, Vec::new()),
            Outcome::Invalid => data(status.and(Status::INVALID), Vec::new()),
            Outcome::NoResult(values) => Reply::floats(register, status.and(Status::INVALID), &values),
        }
    }

    fn not_known(&mut self, register: u8) -> Outcome {
        tracing::warn!("the simulated arm knows no register {register}");
        self.warn(caution::UNKNOWN);
        Outcome::Done
    }

    pub(super) fn warn(&mut self, code: u8) {
        self.warning = code;
    }

    /// Motors, state, mode, errors.
    fn command(&mut self, request: &Request) -> Option<Outcome> {
        Some(match request {
            Request::MotionEnable { axis, on } => self.enable(*axis, *on),
            Request::SetState(command) => self.set_state(*command),
            Request::SetMode(mode) => self.set_mode(*mode),
            Request::CleanError => self.clean_error(),
            Request::CleanWarning => {
                self.warning = 0;
                Outcome::Done
            }
            Request::SetFeedback(_) => Outcome::Done,
            _ => return None,
        })
    }

    fn enable(&mut self, axis: u8, on: bool) -> Outcome {
        let bits = match axis {
            1..=7 => 1 << (axis - 1),
            8 => ALL_AXES,
            _ => return Outcome::Invalid,
        };
        match on {
            true if self.error == 0 => self.enabled |= bits,
            true => {}
            false => {
                self.enabled &= !bits;
                self.stop(xarm_protocol::State::Stopped);
            }
        }
        Outcome::Done
    }

    fn clean_error(&mut self) -> Outcome {
        // A button that is still pressed is an error again at once.
        self.error = self.pressed.unwrap_or(0);
        Outcome::Done
    }
}

/// Modbus TCP, which the hardware answers on the same port and this one does not: an exception says so.
pub(super) fn modbus_exception(frame: &Frame) -> Frame {
    const ILLEGAL_FUNCTION: u8 = 1;
    let function = frame.parameters().first().copied().unwrap_or(0);
    Frame {
        transaction: frame.transaction,
        protocol: frame.protocol,
        body: vec![frame.register(), function | 0x80, ILLEGAL_FUNCTION],
    }
}

/// What a client wants to be told, when a request says so.
pub(super) fn feedback_wish(frame: &Frame) -> Option<u8> {
    match frame.parameters() {
        [mask] if frame.register() == register::SET_FEEDBACK => Some(*mask),
        _ => None,
    }
}
