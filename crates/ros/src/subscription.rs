//! Typed subscriptions.

use std::sync::Arc;
use std::time::Duration;

use futures::StreamExt;
use interfaces::Message;
use tokio_util::sync::CancellationToken;

use crate::error::Error;
use crate::graph::{Graph, Reader};
use crate::handover::{Exchange, Inbox};
use crate::qos::Qos;
use crate::wire::WireTopic;

/// Where a message came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// A publisher in this process handed it over.
    Process,
    /// It arrived by DDS.
    Dds,
}

/// A message and how it came.
#[derive(Debug, Clone)]
pub struct Received<M> {
    /// The message; shared with every other subscription of this process when handed over.
    pub message: Arc<M>,
    /// Where it came from.
    pub source: Source,
}

/// Receives `M` from one topic, the last `depth` messages at most.
pub struct Subscription<M: Message> {
    topic: String,
    qos: Qos,
    exchange: Arc<Exchange<M>>,
    inbox: Arc<Inbox<M>>,
    reader: Reader<M>,
    stop: CancellationToken,
    unreadable: u64,
}

impl<M: Message> Subscription<M> {
    pub(crate) fn new(graph: &Arc<Graph>, topic: String, qos: Qos, stop: CancellationToken) -> Result<Self, Error> {
        let wire = WireTopic::message(&topic, M::TYPE_NAME);
        let exchange = Exchange::of(graph.domain_id, &wire.name);
        let inbox = exchange.open_inbox(qos, graph);
        let reader = graph.reader(&wire, qos).map_err(|reason| {
            exchange.close_inbox(&inbox);
            Error::Create {
                what: "subscription",
                name: topic.clone(),
                reason,
            }
        })?;
        Ok(Self {
            topic,
            qos,
            exchange,
            inbox,
            reader,
            stop,
            unreadable: 0,
        })
    }

    /// The next message; `None` once the node is shut down. Cancel safe.
    ///
    /// A message that cannot be decoded is counted, warned of, and skipped.
    pub async fn next(&mut self) -> Option<Received<M>> {
        let stream = self.reader.dds.as_async_stream();
        tokio::pin!(stream);
        loop {
            let arrived = tokio::select! {
                () = self.stop.cancelled() => return None,
                message = self.inbox.next() => return Some(Received { message, source: Source::Process }),
                arrived = stream.next() => arrived?,
            };
            match arrived {
                Ok(sample) => {
                    return Some(Received {
                        message: sample.into_value(),
                        source: Source::Dds,
                    });
                }
                Err(error) => {
                    self.unreadable += 1;
                    self.reader.graph.counters.count_unreadable();
                    tracing::warn!(topic = self.topic, r#type = M::TYPE_NAME, %error, "a message is not readable; skipped");
                }
            }
        }
    }

    /// Fully qualified topic.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// Publishers that are matched now, inside the process and outside.
    pub fn publisher_count(&self) -> usize {
        self.exchange.serving(self.qos).max(self.reader.matched())
    }

    /// Messages that were handed over but gave way to newer ones because `next` was not called in time.
    pub fn dropped(&self) -> u64 {
        self.inbox.dropped()
    }

    /// Messages that arrived but could not be decoded.
    pub fn unreadable(&self) -> u64 {
        self.unreadable
    }

    /// Waits until `count` publishers are matched.
    pub async fn wait_for_publishers(&self, count: usize, timeout: Duration) -> Result<(), Error> {
        self.reader
            .graph
            .wait_until(timeout, || self.publisher_count() >= count)
            .await
            .map_err(|waited| Error::NotFound {
                what: "publisher of",
                name: self.topic.clone(),
                waited,
            })
    }
}

impl<M: Message> Drop for Subscription<M> {
    fn drop(&mut self) {
        self.exchange.close_inbox(&self.inbox);
    }
}
