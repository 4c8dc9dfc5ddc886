//! Hand-over inside a process: publisher and subscription share an `Arc` instead of 28 MB of CDR.
//!
//! One [`Exchange`] per domain, topic and message type joins the endpoints of this process, whatever node they belong
//! to. Where two of them meet, the publisher's participant is told to ignore the subscription's, so that DDS neither
//! counts that reader as matched nor sends to it; readers in other processes are served as ever.

use std::any::{Any, TypeId};
use std::collections::{HashMap, VecDeque};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, LazyLock, Weak};

use parking_lot::Mutex;
use rustdds::RTPSEntity;
use tokio::sync::Notify;

use crate::graph::Graph;
use crate::qos::{Durability, Qos};
use crate::transport_counters::TransportCounters;

type Key = (u16, String, TypeId);

/// Exchanges live as long as an endpoint uses them.
static EXCHANGES: LazyLock<Mutex<HashMap<Key, Weak<dyn Any + Send + Sync>>>> = LazyLock::new(Mutex::default);

/// The endpoints of this process on one topic.
pub(crate) struct Exchange<M> {
    /// The topic's name on the wire.
    dds_topic: String,
    endpoints: Mutex<Endpoints<M>>,
}

struct Endpoints<M> {
    offers: Vec<Offer<M>>,
    inboxes: Vec<(Arc<Inbox<M>>, Arc<Graph>)>,
}

struct Offer<M> {
    id: u64,
    qos: Qos,
    graph: Arc<Graph>,
    /// The last messages, for late joiners; empty unless transient local.
    latched: VecDeque<Arc<M>>,
}

/// A subscription's queue: bounded, the oldest message gives way.
pub(crate) struct Inbox<M> {
    qos: Qos,
    /// Those of the whole node.
    counters: Arc<TransportCounters>,
    messages: Mutex<VecDeque<Arc<M>>>,
    arrived: Notify,
    dropped: AtomicU64,
}

impl<M: Send + Sync + 'static> Exchange<M> {
    /// The exchange of a topic, made when the first endpoint asks.
    pub(crate) fn of(domain_id: u16, dds_topic: &str) -> Arc<Self> {
        let key = (domain_id, dds_topic.to_owned(), TypeId::of::<M>());
        let mut exchanges = EXCHANGES.lock();
        let known = exchanges
            .get(&key)
            .and_then(Weak::upgrade)
            .and_then(|any| any.downcast::<Self>().ok());
        known.unwrap_or_else(|| {
            exchanges.retain(|_, exchange| exchange.strong_count() > 0);
            let endpoints = Mutex::new(Endpoints {
                offers: Vec::new(),
                inboxes: Vec::new(),
            });
            let exchange = Arc::new(Self {
                dds_topic: dds_topic.to_owned(),
                endpoints,
            });
            let weak: Weak<Self> = Arc::downgrade(&exchange);
            exchanges.insert(key, weak);
            exchange
        })
    }

    /// Registers a publisher. To be called before its DDS writer exists, so that no match is made and undone.
    pub(crate) fn offer(&self, qos: Qos, graph: &Arc<Graph>) -> u64 {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let id = NEXT.fetch_add(1, Ordering::Relaxed);
        let mut endpoints = self.endpoints.lock();
        for (_, reader) in endpoints.inboxes.iter().filter(|(inbox, _)| qos.satisfies(&inbox.qos)) {
            self.keep_off_dds(graph, reader);
        }
        endpoints.offers.push(Offer {
            id,
            qos,
            graph: Arc::clone(graph),
            latched: VecDeque::new(),
        });
        id
    }

    pub(crate) fn withdraw(&self, id: u64) {
        self.endpoints.lock().offers.retain(|offer| offer.id != id);
    }

    /// Registers a subscription and gives it what is latched. To be called before its DDS reader exists.
    pub(crate) fn open_inbox(&self, qos: Qos, graph: &Arc<Graph>) -> Arc<Inbox<M>> {
        let inbox = Arc::new(Inbox::new(qos, Arc::clone(&graph.counters)));
        let mut endpoints = self.endpoints.lock();
        for offer in endpoints.offers.iter().filter(|offer| offer.qos.satisfies(&qos)) {
            self.keep_off_dds(&offer.graph, graph);
            if qos.durability == Durability::TransientLocal {
                offer.latched.iter().for_each(|message| inbox.push(Arc::clone(message)));
            }
        }
        endpoints.inboxes.push((Arc::clone(&inbox), Arc::clone(graph)));
        inbox
    }

    pub(crate) fn close_inbox(&self, inbox: &Arc<Inbox<M>>) {
        self.endpoints
            .lock()
            .inboxes
            .retain(|(other, _)| !Arc::ptr_eq(other, inbox));
    }

    /// Hands `message` to every subscription of this process that the publisher's QoS satisfies.
    pub(crate) fn hand_over(&self, id: u64, message: &Arc<M>) {
        let mut endpoints = self.endpoints.lock();
        let Endpoints { offers, inboxes } = &mut *endpoints;
        let Some(offer) = offers.iter_mut().find(|offer| offer.id == id) else {
            return;
        };
        if offer.qos.durability == Durability::TransientLocal {
            offer.latched.push_back(Arc::clone(message));
            while offer.latched.len() > offer.qos.depth {
                offer.latched.pop_front();
            }
        }
        for (inbox, _) in inboxes.iter().filter(|(inbox, _)| offer.qos.satisfies(&inbox.qos)) {
            inbox.push(Arc::clone(message));
        }
    }

    /// Subscriptions of this process that a publisher with `qos` serves.
    pub(crate) fn served(&self, qos: Qos) -> usize {
        self.endpoints
            .lock()
            .inboxes
            .iter()
            .filter(|(inbox, _)| qos.satisfies(&inbox.qos))
            .count()
    }

    /// Publishers of this process that serve a subscription with `qos`.
    pub(crate) fn serving(&self, qos: Qos) -> usize {
        self.endpoints
            .lock()
            .offers
            .iter()
            .filter(|offer| offer.qos.satisfies(&qos))
            .count()
    }

    fn keep_off_dds(&self, writer: &Graph, reader: &Graph) {
        writer
            .participant
            .ignore_subscriptions_of(reader.participant.guid().prefix, &self.dds_topic);
    }
}

impl<M> Inbox<M> {
    fn new(qos: Qos, counters: Arc<TransportCounters>) -> Self {
        Self {
            qos,
            counters,
            messages: Mutex::default(),
            arrived: Notify::new(),
            dropped: AtomicU64::new(0),
        }
    }

    fn push(&self, message: Arc<M>) {
        let mut messages = self.messages.lock();
        messages.push_back(message);
        while messages.len() > self.qos.depth.max(1) {
            messages.pop_front();
            self.dropped.fetch_add(1, Ordering::Relaxed);
            self.counters.count_dropped();
        }
        drop(messages);
        self.arrived.notify_one();
    }

    /// The oldest message that waits. Cancel safe.
    pub(crate) async fn next(&self) -> Arc<M> {
        loop {
            let arrived = self.arrived.notified();
            if let Some(message) = self.messages.lock().pop_front() {
                return message;
            }
            arrived.await;
        }
    }

    /// Messages that gave way because the subscriber was slow.
    pub(crate) fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn an_inbox_keeps_the_newest_and_counts_the_rest() {
        let inbox = Inbox::new(Qos::reliable(2), Arc::default());
        (0..5).for_each(|n| inbox.push(Arc::new(n)));
        assert_eq!((*inbox.next().await, *inbox.next().await, inbox.dropped()), (3, 4, 3));
    }

    #[test]
    fn exchanges_are_shared_by_type_and_forgotten_when_unused() {
        let first = Exchange::<u8>::of(99, "rt/handover_test");
        assert!(Arc::ptr_eq(&first, &Exchange::<u8>::of(99, "rt/handover_test")));
        let other_type = Exchange::<u16>::of(99, "rt/handover_test");
        drop((first, other_type));
        let key = (99, "rt/handover_test".to_owned(), TypeId::of::<u8>());
        assert!(EXCHANGES.lock().get(&key).is_none_or(|weak| weak.strong_count() == 0));
    }
}
