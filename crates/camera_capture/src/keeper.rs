//! Keeps one camera as its parameters say while nobody takes captures, so that a refused value is told at once and the
//! next capture does not wait for the camera.

use std::sync::Arc;

use devices::CameraLink;
use tokio::sync::{Mutex, watch};

use crate::camera_parameters::ImageParameters;
use crate::error::CaptureFailure;
use crate::record::CameraRecord;
use crate::session::Session;

/// What is needed to keep a camera.
pub(crate) struct Keeper {
    pub(crate) name: String,
    /// Place in [`Session::cameras`].
    pub(crate) camera: usize,
    pub(crate) parameters: ImageParameters,
    pub(crate) record: CameraRecord,
    pub(crate) link: watch::Receiver<CameraLink>,
}

impl Keeper {
    /// Keeps it until its driver ends; the caller ends it with the node.
    pub(crate) async fn run(mut self, session: Arc<Mutex<Session>>) {
        let mut was_open = false;
        loop {
            let is_open = self.look(was_open);
            if is_open {
                self.settle(&session).await;
            }
            was_open = is_open;
            tokio::select! {
                () = self.parameters.changed() => {}
                changed = self.link.wait_for(|link| matches!(link, CameraLink::Open { .. }) != is_open) => {
                    // Statistics change more often than that. An error: the driver has ended.
                    if changed.is_err() {
                        return;
                    }
                }
            }
        }
    }

    /// Tells of a camera that came or went; says whether it is there.
    fn look(&mut self, was_open: bool) -> bool {
        let link = self.link.borrow_and_update();
        match &*link {
            CameraLink::Open { identity, .. } if !was_open => {
                self.record.opened();
                tracing::info!(
                    camera = self.name,
                    serial = identity.serial,
                    address = identity.address,
                    "open"
                );
            }
            CameraLink::Lost { reason } if was_open => tracing::warn!(camera = self.name, reason, "lost"),
            _ => {}
        }
        matches!(*link, CameraLink::Open { .. })
    }

    async fn settle(&self, session: &Mutex<Session>) {
        let mut session = session.lock().await;
        let trigger = session.parameters.options().trigger;
        match session.cameras[self.camera].settle(trigger).await {
            // A camera that is away is told of already, and set when it is there.
            Ok(_) | Err(CaptureFailure::Unavailable { .. }) => {}
            Err(failure) => tracing::warn!(camera = self.name, %failure, "not ready for captures"),
        }
    }
}
