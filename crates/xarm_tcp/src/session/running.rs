//! The one thing that is being done to the arm.

use devices::{ArmError, SetPointStream};
use futures::FutureExt;
use futures::future::BoxFuture;

use crate::job::{Job, Reply};
use crate::motion::Conversation;
use crate::stream::Stream;

type Work<T> = BoxFuture<'static, Result<T, ArmError>>;
type StreamReply = Reply<Box<dyn SetPointStream>>;

pub(crate) enum Running {
    Nothing,
    Arm(Work<Stream>, StreamReply),
    /// Nobody waits for the driver's own stops.
    Stop(Work<()>, Option<Reply<()>>),
    Recover(Work<()>, Reply<()>),
}

/// How it ended, and who wants to know.
pub(crate) enum Done {
    Arm(Result<Stream, ArmError>, StreamReply),
    Stop(Result<(), ArmError>, Option<Reply<()>>),
    Recover(Result<(), ArmError>, Reply<()>),
}

impl Running {
    pub(crate) fn start(job: Job, conversation: Conversation) -> Self {
        match job {
            Job::Arm { reply } => Self::Arm(conversation.arm().boxed(), reply),
            Job::Stop { reply } => Self::stop(conversation, Some(reply)),
            Job::Recover { looked, reply } => Self::Recover(conversation.recover(looked).boxed(), reply),
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
        match self {
            Self::Nothing => std::future::pending().await,
            Self::Arm(work, _) => {
                let result = work.await;
                match std::mem::replace(self, Self::Nothing) {
                    Self::Arm(_, reply) => Done::Arm(result, reply),
                    _ => unreachable!("it was armed a moment ago"),
                }
            }
            Self::Stop(work, reply) => {
                let done = Done::Stop(work.await, reply.take());
                *self = Self::Nothing;
                done
            }
            Self::Recover(work, _) => {
                let result = work.await;
                match std::mem::replace(self, Self::Nothing) {
                    Self::Recover(_, reply) => Done::Recover(result, reply),
                    _ => unreachable!("it recovered a moment ago"),
                }
            }
        }
    }

    /// Gives it up, and says so.
    pub(crate) fn cancel(&mut self, error: impl Fn() -> ArmError) {
        match std::mem::replace(self, Self::Nothing) {
            Self::Nothing | Self::Stop(_, None) => {}
            Self::Arm(_, reply) => drop(reply.send(Err(error()))),
            Self::Stop(_, Some(reply)) | Self::Recover(_, reply) => drop(reply.send(Err(error()))),
        }
    }

    pub(crate) fn cancel_unless_stopping(&mut self, error: impl Fn() -> ArmError) {
        if !matches!(self, Self::Stop(..)) {
            self.cancel(error);
        }
    }
}
