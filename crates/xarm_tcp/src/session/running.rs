//! The one thing that is being done to the arm.

use devices::{ArmError, SetPointStream};
use futures::FutureExt;
use futures::future::BoxFuture;

use crate::job::{Job, Reply};
use crate::motion::Conversation;
use crate::stream::Stream;

type Work<T> = BoxFuture<'static, Result<T, ArmError>>;
type StreamReply = Reply<Box<dyn SetPointStream>>;

/// Whoever waits for it gets an answer; nobody waits for the driver's own stops.
pub(crate) enum Running {
    Nothing,
    Arm(Work<Box<Stream>>, Option<StreamReply>),
    Stop(Work<()>, Option<Reply<()>>),
    Recover(Work<()>, Option<Reply<()>>),
}

/// How it ended, and who wants to know.
pub(crate) enum Done {
    Arm(Result<Box<Stream>, ArmError>, Option<StreamReply>),
    Stop(Result<(), ArmError>, Option<Reply<()>>),
    Recover(Result<(), ArmError>, Option<Reply<()>>),
}

impl Running {
    pub(crate) fn start(job: Job, conversation: Conversation) -> Self {
        match job {
            Job::Arm { reply } => Self::Arm(conversation.arm().boxed(), Some(reply)),
            Job::Stop { reply } => Self::stop(conversation, Some(reply)),
            Job::Recover { looked, reply } => Self::Recover(conversation.recover(looked).boxed(), Some(reply)),
        }
    }

    pub(crate) fn stop(conversation: Conversation, reply: Option<Reply<()>>) -> Self {
        Self::Stop(conversation.stop().boxed(), reply)
    }

    pub(crate) fn is_idle(&self) -> bool {
        matches!(self, Self::Nothing)
    }

    /// Waits for ever when there is nothing; may be given up and called again.
    pub(crate) async fn done(&mut self) -> Done {
        let done = match self {
            Self::Nothing => std::future::pending().await,
            Self::Arm(work, reply) => Done::Arm(work.await, reply.take()),
            Self::Stop(work, reply) => Done::Stop(work.await, reply.take()),
            Self::Recover(work, reply) => Done::Recover(work.await, reply.take()),
        };
        *self = Self::Nothing;
        done
    }

    /// Gives it up, and says so.
    pub(crate) fn cancel(&mut self, error: ArmError) {
        match std::mem::replace(self, Self::Nothing) {
            Self::Nothing => {}
            Self::Arm(_, reply) => answer(reply, Err(error)),
            Self::Stop(_, reply) | Self::Recover(_, reply) => answer(reply, Err(error)),
        }
    }

    pub(crate) fn cancel_unless_stopping(&mut self, error: ArmError) {
        if !matches!(self, Self::Stop(..)) {
            self.cancel(error);
        }
    }
}

/// Whoever asked may have gone.
pub(crate) fn answer<T>(reply: Option<Reply<T>>, result: Result<T, ArmError>) {
    if let Some(reply) = reply {
        let _ = reply.send(result);
    }
}
