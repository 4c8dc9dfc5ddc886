//! What the driver's task is asked to do.

use devices::{ArmError, SetPointStream};
use tokio::sync::oneshot;

pub(crate) type Reply<T> = oneshot::Sender<Result<T, ArmError>>;

pub(crate) enum Job {
    Arm { reply: Reply<Box<dyn SetPointStream>> },
    Stop { reply: Reply<()> },
    Recover { looked: bool, reply: Reply<()> },
}

impl Job {
    pub(crate) fn fail(self, error: ArmError) {
        // Whoever asked may have gone.
        match self {
            Self::Arm { reply } => drop(reply.send(Err(error))),
            Self::Stop { reply } | Self::Recover { reply, .. } => drop(reply.send(Err(error))),
        }
    }
}
