//! What the controller tells by itself about commands (firmware 2.0.102 and later, when asked to).

use crate::bytes::Cursor;
use crate::error::ProtocolError;
use crate::frame::{Frame, Protocol};
use crate::register;

/// What happened to a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FeedbackKind {
    /// A motion began.
    Start,
    /// A motion ended or was discarded.
    End,
    /// Something that is no motion was done.
    Triggered,
    /// Other numbers.
    Other(u8),
}

/// How it ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FeedbackResult {
    /// As asked.
    Done,
    /// Not.
    Failed,
    /// It was never begun, or thrown away.
    Discarded,
    /// Other numbers.
    Other(u8),
}

/// A pushed frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Feedback {
    /// Of the request that it is about.
    pub transaction: u16,
    /// What happened.
    pub kind: FeedbackKind,
    /// Of the request that it is about.
    pub register: u8,
    /// Number of the command.
    pub task: u16,
    /// How it ended.
    pub result: FeedbackResult,
    /// The controller's clock, microseconds.
    pub micros: u64,
}

impl Feedback {
    /// Whether a frame is one.
    pub fn is(frame: &Frame) -> bool {
        frame.register() == register::FEEDBACK
    }

    /// From a frame.
    pub fn of_frame(frame: &Frame) -> Result<Self, ProtocolError> {
        let mut cursor = Cursor::new("feedback", "15", &frame.body);
        let [_, _, kind, register] = cursor.array()?;
        let (task, result, micros) = (cursor.u16()?, cursor.u8()?, cursor.u64()?);
        Ok(Self {
            transaction: frame.transaction,
            kind: match kind {
                1 => FeedbackKind::Start,
                2 => FeedbackKind::End,
                4 => FeedbackKind::Triggered,
                other => FeedbackKind::Other(other),
            },
            register,
            task,
            result: match result {
                0 => FeedbackResult::Done,
                1 => FeedbackResult::Failed,
                2 => FeedbackResult::Discarded,
                other => FeedbackResult::Other(other),
            },
            micros,
        })
    }

    /// To the client whose request used this protocol.
    pub fn frame(&self, protocol: Protocol) -> Frame {
        let kind = match self.kind {
            FeedbackKind::Start => 1,
            FeedbackKind::End => 2,
            FeedbackKind::Triggered => 4,
            FeedbackKind::Other(other) => other,
        };
        let result = match self.result {
            FeedbackResult::Done => 0,
            FeedbackResult::Failed => 1,
            FeedbackResult::Discarded => 2,
            FeedbackResult::Other(other) => other,
        };
        let mut body = vec![register::FEEDBACK, 0, kind, self.register];
        body.extend(self.task.to_be_bytes());
        body.push(result);
        body.extend(self.micros.to_be_bytes());
        Frame {
            transaction: self.transaction,
            protocol,
            body,
        }
    }
}
