//! What one camera did, for `/diagnostics`.

use std::sync::Arc;

use devices::{CameraIdentity, CameraLink};
use parking_lot::Mutex;
use ros::diagnostics::{Level, Status};
use ros::{Clock, Node};
use tokio::sync::watch;

/// A camera's history. Clones are handles to the same one.
#[derive(Clone)]
pub(crate) struct CameraRecord {
    inner: Arc<Mutex<Inner>>,
    clock: Clock,
}

#[derive(Debug, Default)]
struct Inner {
    /// Times the camera was opened.
    openings: u64,
    captures: u64,
    voids: u64,
    last_capture: Option<(String, i64)>,
    /// Why the last capture was void; `None` when it was not.
    void: Option<String>,
    /// The last refused change of a parameter.
    refusal: Option<String>,
    /// Captures that were not sent out of the process because readers were slow.
    unsent: u64,
}

impl CameraRecord {
    /// Begins a record that the node reports.
    pub(crate) fn new(node: &Node, camera: &str, guid: &str, link: watch::Receiver<CameraLink>) -> Self {
        let record = Self {
            inner: Arc::default(),
            clock: node.clock().clone(),
        };
        let reported = record.clone();
        node.diagnostics()
            .register(camera, guid, move || reported.status(&link.borrow()));
        record
    }

    /// Counts the times the camera was opened; settings are lost in between.
    pub(crate) fn opening(&self) -> u64 {
        self.inner.lock().openings
    }

    pub(crate) fn opened(&self) {
        self.inner.lock().openings += 1;
    }

    pub(crate) fn captured(&self, id: &str) {
        let mut inner = self.inner.lock();
        inner.captures += 1;
        inner.last_capture = Some((id.to_owned(), self.clock.now_nanos()));
        inner.void = None;
    }

    pub(crate) fn voided(&self, reason: &str) {
        let mut inner = self.inner.lock();
        inner.voids += 1;
        inner.void = Some(reason.to_owned());
    }

    pub(crate) fn refusal(&self, reason: Option<String>) {
        self.inner.lock().refusal = reason;
    }

    pub(crate) fn unsent(&self) {
        self.inner.lock().unsent += 1;
    }

    fn status(&self, link: &CameraLink) -> Status {
        let inner = self.inner.lock();
        let status = match (link, &inner.void, &inner.refusal) {
            (CameraLink::Lost { reason }, ..) => Status::error(format!("not open: {reason}")),
            (_, Some(void), _) => Status::warn(format!("the last capture is void: {void}")),
            (_, _, Some(refusal)) => Status::warn(format!("a parameter was refused: {refusal}")),
            _ => Status::new(Level::Ok, "open"),
        };
        let status = match link {
            CameraLink::Lost { .. } => status,
            CameraLink::Open { identity, statistics } => with_link(status, identity, statistics),
        };
        let status = status
            .value("captures", inner.captures, "")
            .value("void captures", inner.voids, "")
            .value("captures not sent", inner.unsent, "");
        match &inner.last_capture {
            None => status,
            Some((id, at)) => {
                let age = (self.clock.now_nanos() - at) as f64 * 1e-9;
                status
                    .value("last capture", id, "")
                    .value("age of last capture", format!("{age:.1}"), "s")
            }
        }
    }
}

fn with_link(status: Status, identity: &CameraIdentity, statistics: &[(String, u64)]) -> Status {
    let CameraIdentity {
        vendor,
        model,
        serial,
        address,
    } = identity;
    let status = status
        .value("vendor", vendor, "")
        .value("model", model, "")
        .value("serial", serial, "")
        .value("address", address, "");
    statistics
        .iter()
        .fold(status, |status, (name, count)| status.value(name, count, ""))
}
