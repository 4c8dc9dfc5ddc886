//! Filling a buffer from the graph.

use std::collections::HashSet;
use std::mem::{Discriminant, discriminant};
use std::time::Duration;

use interfaces::tf2_msgs::msg::TFMessage;
use tokio_util::sync::{CancellationToken, DropGuard};

use super::buffer::Buffer;
use super::error::TfError;
use super::message::StampedTransform;
use crate::clock::Jumps;
use crate::error::Error;
use crate::node::Node;
use crate::qos::Qos;
use crate::subscription::Subscription;

/// Listens to `/tf` and `/tf_static` until it is dropped or its node shuts down.
pub struct Listener {
    buffer: Buffer,
    _stop: DropGuard,
}

impl Listener {
    /// A listener of this node, with a buffer that keeps ten seconds.
    pub fn new(node: &Node) -> Result<Self, Error> {
        Self::filling(node, Buffer::default())
    }

    /// Fills a buffer that is there already.
    pub fn filling(node: &Node, buffer: Buffer) -> Result<Self, Error> {
        let stop = node.stop_token();
        let moving = node.subscription("/tf", Qos::STREAM)?;
        let fixed = node.subscription("/tf_static", Qos::TF_STATIC)?;
        let listening = listen(buffer.clone(), moving, fixed, node.clock().jumps());
        node.spawn(until(stop.clone(), listening));
        Ok(Self {
            buffer,
            _stop: stop.drop_guard(),
        })
    }

    /// What was heard so far; clone it to keep it longer than the listener.
    pub fn buffer(&self) -> &Buffer {
        &self.buffer
    }

    /// See [`Buffer::wait_for`].
    pub async fn wait_for(
        &self,
        target: &str,
        source: &str,
        time: i64,
        timeout: Duration,
    ) -> Result<geometry::RigidTransform, TfError> {
        self.buffer.wait_for(target, source, time, timeout).await
    }
}

async fn until(stop: CancellationToken, listening: impl Future<Output = ()>) {
    tokio::select! {
        () = stop.cancelled() => {}
        () = listening => {}
    }
}

async fn listen(
    buffer: Buffer,
    mut moving: Subscription<TFMessage>,
    mut fixed: Subscription<TFMessage>,
    mut jumps: Jumps,
) {
    let mut complaints = HashSet::new();
    loop {
        tokio::select! {
            Some(received) = moving.next() => take(&received.message, &mut complaints, |t| buffer.insert(t)),
            Some(received) = fixed.next() => take(&received.message, &mut complaints, |t| buffer.insert_static(t)),
            Some(_) = jumps.next() => buffer.forget_moving(),
            else => return,
        }
    }
}

/// Warns once of each child and kind of error: a publisher that errs does so many times a second.
fn take(
    message: &TFMessage,
    complaints: &mut HashSet<(String, Discriminant<TfError>)>,
    insert: impl Fn(&StampedTransform) -> Result<(), TfError>,
) {
    for transform in &message.transforms {
        let Err(error) = StampedTransform::from_message(transform).and_then(|transform| insert(&transform)) else {
            continue;
        };
        if complaints.insert((transform.child_frame_id.clone(), discriminant(&error))) {
            tracing::warn!(%error, "a transform is refused; said once for this frame");
        }
    }
}
