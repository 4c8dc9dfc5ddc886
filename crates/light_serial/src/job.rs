//! What the driver's task is asked to do.

use devices::{LightError, SequenceReport};
use light_protocol::Sequence;
use tokio::sync::oneshot;

use crate::convert::ManualLight;

pub(crate) type Reply<T> = oneshot::Sender<Result<T, LightError>>;

pub(crate) enum Job {
    /// Given up when nobody waits for its reply any more.
    Run {
        sequence: Box<Sequence>,
        reply: Reply<SequenceReport>,
    },
    Set {
        light: ManualLight,
        reply: Reply<()>,
    },
    Off {
        reply: Reply<()>,
    },
}

impl Job {
    pub(crate) fn fail(self, error: LightError) {
        // Whoever asked may have gone.
        match self {
            Self::Run { reply, .. } => drop(reply.send(Err(error))),
            Self::Set { reply, .. } | Self::Off { reply } => drop(reply.send(Err(error))),
        }
    }
}
