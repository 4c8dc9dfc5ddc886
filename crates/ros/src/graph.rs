//! A node's part of the ROS graph: its readers and writers, who is matched with them, and which nodes exist.
//!
//! Every node has its own participant, and one task per node takes that participant's discovery events. (Two takers on
//! one participant would steal each other's events.)

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use futures::StreamExt;
use interfaces::Message;
use parking_lot::Mutex;
use ros2_client::builtin_topics::ros_discovery;
use ros2_client::entities_info::{NodeEntitiesInfo, ParticipantEntitiesInfo};
use ros2_client::{Gid, NodeName};
use rustdds::no_key::{DataWriter, DataWriterCdr, SimpleDataReader, SimpleDataReaderCdr};
use rustdds::{
    DomainParticipant, DomainParticipantStatusEvent, GUID, QosPolicies, RTPSEntity, StatusEvented, TopicKind,
};
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;

use crate::error::Error;
use crate::names::NodeNames;
use crate::options::DiscoveryRange;
use crate::participant;
use crate::qos::{Durability, Qos};
use crate::transport_counters::TransportCounters;
use crate::wire::{self, Cdr, WireTopic};

/// How often a waiting caller looks again without an event.
const RECHECK: Duration = Duration::from_millis(50);

/// All participants share this topic, so a burst of them must fit.
const DISCOVERY_INFO: Qos = Qos {
    durability: Durability::TransientLocal,
    ..Qos::reliable(200)
};

pub(crate) struct Graph {
    pub(crate) domain_id: u16,
    pub(crate) participant: DomainParticipant,
    publisher: rustdds::Publisher,
    subscriber: rustdds::Subscriber,
    own: Mutex<Own>,
    seen: Mutex<Seen>,
    changed: watch::Sender<u64>,
    pub(crate) counters: Arc<TransportCounters>,
}

/// What this node announces on `ros_discovery_info`.
struct Own {
    name: NodeName,
    announcer: DataWriterCdr<ParticipantEntitiesInfo>,
    readers: BTreeSet<GUID>,
    writers: BTreeSet<GUID>,
    left: bool,
}

/// What discovery told.
#[derive(Default)]
struct Seen {
    /// Remote endpoints matched with each of our readers and writers.
    matched: BTreeMap<GUID, BTreeSet<GUID>>,
    /// Fully qualified node names of each other participant.
    nodes: BTreeMap<Gid, Vec<String>>,
}

impl Graph {
    pub(crate) fn join(names: &NodeNames, domain_id: u16, range: DiscoveryRange) -> Result<Arc<Self>, Error> {
        let failed = |reason: String| Error::Participant { domain_id, reason };
        let participant = participant::join(domain_id, range)?;
        let name = NodeName::new(&names.namespace, &names.base).map_err(|e| failed(e.to_string()))?;
        let publisher = participant
            .create_publisher(&QosPolicies::default())
            .map_err(|e| failed(e.to_string()))?;
        let subscriber = participant
            .create_subscriber(&QosPolicies::default())
            .map_err(|e| failed(e.to_string()))?;
        let topic = participant
            .create_topic(
                ros_discovery::TOPIC_NAME.into(),
                ros_discovery::TYPE_NAME.into(),
                &ros_discovery::QOS_PUB,
                TopicKind::NoKey,
            )
            .map_err(|e| failed(e.to_string()))?;
        let announcer = publisher
            .create_datawriter_no_key(&topic, None)
            .map_err(|e| failed(e.to_string()))?;
        let writers = BTreeSet::from([announcer.guid()]);
        let own = Own {
            name,
            announcer,
            readers: BTreeSet::new(),
            writers,
            left: false,
        };
        own.announce(&participant);
        Ok(Arc::new(Self {
            domain_id,
            participant,
            publisher,
            subscriber,
            own: Mutex::new(own),
            seen: Mutex::new(Seen::default()),
            changed: watch::Sender::new(0),
            counters: Arc::default(),
        }))
    }

    pub(crate) fn writer<M: Message>(self: &Arc<Self>, topic: &WireTopic, qos: Qos) -> Result<Writer<M>, String> {
        let topic = self.topic(topic, qos)?;
        let dds = self
            .publisher
            .create_datawriter_no_key(&topic, None)
            .map_err(|e| e.to_string())?;
        self.own
            .lock()
            .update(&self.participant, |own| own.writers.insert(dds.guid()));
        Ok(Writer {
            dds,
            graph: Arc::clone(self),
        })
    }

    pub(crate) fn reader<M: Message>(self: &Arc<Self>, topic: &WireTopic, qos: Qos) -> Result<Reader<M>, String> {
        let topic = self.topic(topic, qos)?;
        let dds = self
            .subscriber
            .create_simple_datareader_no_key(&topic, None)
            .map_err(|e| e.to_string())?;
        self.own
            .lock()
            .update(&self.participant, |own| own.readers.insert(dds.guid()));
        Ok(Reader {
            dds,
            graph: Arc::clone(self),
        })
    }

    fn topic(&self, topic: &WireTopic, qos: Qos) -> Result<rustdds::Topic, String> {
        let policies = QosPolicies::from(qos.profile());
        self.participant
            .create_topic(topic.name.clone(), topic.type_name.clone(), &policies, TopicKind::NoKey)
            .map_err(|e| e.to_string())
    }

    /// Remote endpoints matched with `endpoint` now.
    pub(crate) fn matched(&self, endpoint: GUID) -> usize {
        self.seen.lock().matched.get(&endpoint).map_or(0, BTreeSet::len)
    }

    /// A receiver that wakes after every change of the graph.
    pub(crate) fn changes(&self) -> watch::Receiver<u64> {
        self.changed.subscribe()
    }

    /// Waits until the graph makes `condition` true; gives back `timeout` when it does not in time.
    pub(crate) async fn wait_until(&self, timeout: Duration, condition: impl Fn() -> bool) -> Result<(), Duration> {
        let mut changes = self.changes();
        let met = async {
            while !condition() {
                // Changes inside the process are not discovery events: look again soon in any case.
                let _ = tokio::time::timeout(RECHECK, changes.changed()).await;
            }
        };
        tokio::time::timeout(timeout, met).await.map_err(|_| timeout)
    }

    /// Fully qualified names of the nodes of other participants, sorted.
    pub(crate) fn other_nodes(&self) -> Vec<String> {
        let mut names: Vec<String> = self.seen.lock().nodes.values().flatten().cloned().collect();
        names.sort();
        names
    }

    /// The ROS type of a topic, of anybody's endpoints on it.
    pub(crate) fn topic_type(&self, topic: &str) -> Option<String> {
        let known = self.participant.discovered_topics();
        let types = known
            .iter()
            .filter_map(|known| wire::ros_topic(known.topic_name(), known.type_name()));
        types.filter(|(name, _)| name == topic).map(|(_, kind)| kind).min()
    }

    /// Announces that the node is gone. Its endpoints leave when they are dropped.
    pub(crate) fn leave(&self) {
        self.own.lock().update(&self.participant, |own| own.left = true);
    }

    /// Takes discovery events until `stop`.
    pub(crate) async fn watch(self: Arc<Self>, stop: CancellationToken) {
        let infos: SimpleDataReaderCdr<ParticipantEntitiesInfo> = match self.discovery_reader() {
            Ok(reader) => reader,
            Err(reason) => return tracing::error!(reason, "cannot read ros_discovery_info: other nodes stay unknown"),
        };
        let infos = infos.as_async_stream();
        let listener = self.participant.status_listener();
        let events = listener.as_async_status_stream();
        tokio::pin!(infos, events);
        loop {
            tokio::select! {
                () = stop.cancelled() => return,
                Some(event) = events.next() => self.on_status(event),
                Some(info) = infos.next() => match info {
                    Ok(info) => self.on_nodes(&info.into_value()),
                    Err(error) => tracing::warn!(%error, "a ros_discovery_info message is not readable"),
                },
            }
            self.changed.send_modify(|n| *n += 1);
        }
    }

    fn discovery_reader(&self) -> Result<SimpleDataReaderCdr<ParticipantEntitiesInfo>, String> {
        let topic = WireTopic {
            name: ros_discovery::TOPIC_NAME.into(),
            type_name: ros_discovery::TYPE_NAME.into(),
        };
        let topic = self.topic(&topic, DISCOVERY_INFO)?;
        self.subscriber
            .create_simple_datareader_no_key(&topic, None)
            .map_err(|e| e.to_string())
    }

    fn on_status(&self, event: DomainParticipantStatusEvent) {
        use DomainParticipantStatusEvent as Event;
        let mut seen = self.seen.lock();
        match event {
            Event::RemoteReaderMatched {
                local_writer: own,
                remote_reader: remote,
            }
            | Event::RemoteWriterMatched {
                local_reader: own,
                remote_writer: remote,
            } => {
                seen.matched.entry(own).or_default().insert(remote);
            }
            Event::ReaderLost { guid, .. } | Event::WriterLost { guid, .. } => {
                seen.matched
                    .values_mut()
                    .for_each(|remotes| remotes.retain(|remote| *remote != guid));
            }
            Event::ParticipantLost { id, .. } => {
                seen.matched
                    .values_mut()
                    .for_each(|remotes| remotes.retain(|guid| guid.prefix != id));
                seen.nodes.retain(|gid, _| GUID::from(*gid).prefix != id);
            }
            Event::RemoteReaderQosIncompatible {
                requested_qos,
                offered_qos,
                ..
            }
            | Event::RemoteWriterQosIncompatible {
                requested_qos,
                offered_qos,
                ..
            } => {
                let (requested, offered) = (promises(&requested_qos), promises(&offered_qos));
                tracing::warn!(
                    requested,
                    offered,
                    "a peer's QoS does not fit; nothing will be exchanged with it"
                );
            }
            _ => {}
        }
    }

    fn on_nodes(&self, info: &ParticipantEntitiesInfo) {
        if GUID::from(info.gid()).prefix == self.participant.guid().prefix {
            return;
        }
        let names: Vec<String> = info
            .nodes()
            .iter()
            .map(NodeEntitiesInfo::fully_qualified_name)
            .collect();
        let own = self.own.lock().name.fully_qualified_name();
        let mut seen = self.seen.lock();
        let known = seen.nodes.insert(info.gid(), names.clone()).unwrap_or_default();
        if names.contains(&own) && !known.contains(&own) {
            tracing::warn!(
                node = own,
                domain_id = self.domain_id,
                "a second node of the same name is in the domain"
            );
        }
    }

    fn forget(&self, endpoint: GUID) {
        self.seen.lock().matched.remove(&endpoint);
        self.own.lock().update(&self.participant, |own| {
            own.readers.remove(&endpoint) | own.writers.remove(&endpoint)
        });
    }
}

impl Own {
    /// Changes what the node consists of and tells the others.
    fn update<R>(&mut self, participant: &DomainParticipant, change: impl FnOnce(&mut Self) -> R) {
        change(self);
        self.announce(participant);
    }

    fn announce(&self, participant: &DomainParticipant) {
        let mut info = NodeEntitiesInfo::new(self.name.clone());
        self.readers.iter().for_each(|guid| info.add_reader(Gid::from(*guid)));
        self.writers.iter().for_each(|guid| info.add_writer(Gid::from(*guid)));
        let nodes = if self.left { Vec::new() } else { vec![info] };
        let info = ParticipantEntitiesInfo::new(Gid::from(participant.guid()), nodes);
        if let Err(error) = self.announcer.write(info, None) {
            tracing::warn!(%error, "cannot announce the node on ros_discovery_info");
        }
    }
}

fn promises(qos: &QosPolicies) -> String {
    format!("{:?} {:?}", qos.reliability(), qos.durability())
}

/// A DDS writer that leaves the node's announcement when it is dropped.
pub(crate) struct Writer<M: Message> {
    pub(crate) dds: DataWriter<Arc<M>, Cdr<M>>,
    pub(crate) graph: Arc<Graph>,
}

impl<M: Message> Writer<M> {
    /// Readers outside this process that are matched now.
    pub(crate) fn matched(&self) -> usize {
        self.graph.matched(self.dds.guid())
    }

    pub(crate) fn is_matched_with(&self, reader: GUID) -> bool {
        self.graph
            .seen
            .lock()
            .matched
            .get(&self.dds.guid())
            .is_some_and(|readers| readers.contains(&reader))
    }
}

impl<M: Message> Drop for Writer<M> {
    fn drop(&mut self) {
        self.graph.forget(self.dds.guid());
    }
}

/// A DDS reader that leaves the node's announcement when it is dropped.
pub(crate) struct Reader<M: Message> {
    pub(crate) dds: SimpleDataReader<Arc<M>, Cdr<M>>,
    pub(crate) graph: Arc<Graph>,
}

impl<M: Message> Reader<M> {
    /// Writers that are matched now.
    pub(crate) fn matched(&self) -> usize {
        self.graph.matched(self.dds.guid())
    }
}

impl<M: Message> Drop for Reader<M> {
    fn drop(&mut self) {
        self.graph.forget(self.dds.guid());
    }
}
