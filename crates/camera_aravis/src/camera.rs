//! The camera as the rest of the cell sees it.

use std::sync::mpsc;

use devices::{AppliedSettings, Camera, CameraError, CameraLink, CameraSettings, Frames};
use futures::future::BoxFuture;
use tokio::sync::{oneshot, watch};

use crate::CameraConfig;

/// Where the answer to a command goes.
type Reply<T> = oneshot::Sender<Result<T, CameraError>>;

/// What is asked of the camera's thread.
#[derive(Debug)]
pub(crate) enum Command {
    Configure(CameraSettings, Reply<AppliedSettings>),
    Arm(usize, Reply<Frames>),
    Trigger(Reply<()>),
}

/// A GigE Vision camera, opened and kept open by a thread of its own.
#[derive(Debug)]
pub struct AravisCamera {
    guid: String,
    commands: mpsc::Sender<Command>,
    link: watch::Receiver<CameraLink>,
}

impl AravisCamera {
    /// Returns at once; [`Camera::link`] tells when the camera is open.
    pub fn open(config: CameraConfig) -> Self {
        let (commands, _) = mpsc::channel();
        let (_, link) = watch::channel(CameraLink::Lost {
            reason: "opening".into(),
        });
        Self {
            guid: config.guid,
            commands,
            link,
        }
    }

    fn lost(&self) -> Option<CameraError> {
        match &*self.link.borrow() {
            CameraLink::Lost { reason } => Some(CameraError::Lost {
                guid: self.guid.clone(),
                reason: reason.clone(),
            }),
            CameraLink::Open { .. } => None,
        }
    }

    fn ask<T: Send + 'static>(
        &self,
        command: impl FnOnce(Reply<T>) -> Command,
    ) -> BoxFuture<'_, Result<T, CameraError>> {
        let (reply, answer) = oneshot::channel();
        let lost = self.lost();
        if lost.is_none() {
            // A thread that is gone drops the reply, which is an answer too.
            let _ = self.commands.send(command(reply));
        }
        Box::pin(async move {
            if let Some(lost) = lost {
                return Err(lost);
            }
            answer.await.unwrap_or_else(|_| {
                Err(self.lost().unwrap_or_else(|| CameraError::Lost {
                    guid: self.guid.clone(),
                    reason: "its driver has ended".into(),
                }))
            })
        })
    }
}

impl Camera for AravisCamera {
    fn configure(&self, settings: CameraSettings) -> BoxFuture<'_, Result<AppliedSettings, CameraError>> {
        self.ask(|reply| Command::Configure(settings, reply))
    }

    fn arm(&self, count: usize) -> BoxFuture<'_, Result<Frames, CameraError>> {
        self.ask(|reply| Command::Arm(count, reply))
    }

    fn trigger(&self) -> BoxFuture<'_, Result<(), CameraError>> {
        self.ask(Command::Trigger)
    }

    fn link(&self) -> watch::Receiver<CameraLink> {
        self.link.clone()
    }
}
