//! Typed publishers.

use std::sync::Arc;
use std::time::Duration;

use interfaces::Message;
use rustdds::Timestamp;

use crate::error::Error;
use crate::graph::{Graph, Writer};
use crate::handover::Exchange;
use crate::qos::{Durability, Qos};
use crate::wire::WireTopic;

/// Publishes `M` on one topic. Subscriptions of this process get the `Arc` itself; DDS gets the message only while a
/// reader outside the process is matched (or when it has to be kept for late joiners).
pub struct Publisher<M: Message> {
    topic: String,
    qos: Qos,
    exchange: Arc<Exchange<M>>,
    offer: u64,
    writer: Writer<M>,
}

impl<M: Message> Publisher<M> {
    pub(crate) fn new(graph: &Arc<Graph>, topic: String, qos: Qos) -> Result<Self, Error> {
        let wire = WireTopic::message(&topic, M::TYPE_NAME);
        let exchange = Exchange::of(graph.domain_id, &wire.name);
        let offer = exchange.offer(qos, graph);
        let writer = graph.writer(&wire, qos).map_err(|reason| {
            exchange.withdraw(offer);
            Error::Create {
                what: "publisher",
                name: topic.clone(),
                reason,
            }
        })?;
        Ok(Self {
            topic,
            qos,
            exchange,
            offer,
            writer,
        })
    }

    /// Publishes a message without copying it.
    ///
    /// Blocks for up to two seconds when a reliable reader outside the process is so slow that the writer's history is
    /// full of what it has not acknowledged.
    pub fn publish(&self, message: impl Into<Arc<M>>) -> Result<(), Error> {
        let message = message.into();
        self.hand_over(&message);
        self.send(message)
    }

    /// The half of [`Self::publish`] that never blocks: subscriptions of this process get the message. A publisher that
    /// must not wait for slow readers calls this at once, and [`Self::send`] from a thread that may wait.
    pub fn hand_over(&self, message: &Arc<M>) {
        self.exchange.hand_over(self.offer, message);
    }

    /// The other half of [`Self::publish`]: readers outside the process get the message, and those that come late.
    pub fn send(&self, message: Arc<M>) -> Result<(), Error> {
        if self.qos.durability == Durability::Volatile && self.writer.matched() == 0 {
            return Ok(());
        }
        self.writer
            .dds
            .write(message, Some(Timestamp::now()))
            .map_err(|e| Error::Publish {
                topic: self.topic.clone(),
                reason: e.to_string(),
            })
    }

    /// Waits until every reader outside the process has acknowledged what was published; `false` when that takes longer
    /// than `timeout`. A publisher that is dropped earlier takes with it what a reader still misses.
    pub async fn wait_for_acknowledgements(&self, timeout: Duration) -> bool {
        if self.writer.matched() == 0 {
            return true;
        }
        let acknowledged = self.writer.dds.async_wait_for_acknowledgments();
        matches!(tokio::time::timeout(timeout, acknowledged).await, Ok(Ok(true)))
    }

    /// Fully qualified topic.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// Subscriptions that are served now, inside the process and outside.
    pub fn subscription_count(&self) -> usize {
        self.exchange.served(self.qos) + self.writer.matched()
    }

    /// Waits until `count` subscriptions are served.
    pub async fn wait_for_subscriptions(&self, count: usize, timeout: Duration) -> Result<(), Error> {
        self.writer
            .graph
            .wait_until(timeout, || self.subscription_count() >= count)
            .await
            .map_err(|waited| Error::NotFound {
                what: "subscription of",
                name: self.topic.clone(),
                waited,
            })
    }
}

impl<M: Message> Drop for Publisher<M> {
    fn drop(&mut self) {
        self.exchange.withdraw(self.offer);
    }
}
