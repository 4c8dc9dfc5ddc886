//! A node: one participant, one place in the graph, and the tasks that serve it.

use std::sync::Arc;
use std::time::Duration;

use interfaces::{Action, Message, Service};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use tracing::Instrument;

use crate::action::{ActionClient, ActionServer};
use crate::clock::Clock;
use crate::diagnostics::Diagnostics;
use crate::error::Error;
use crate::graph::Graph;
use crate::names::NodeNames;
use crate::options::NodeOptions;
use crate::parameters::Parameters;
use crate::publisher::Publisher;
use crate::qos::Qos;
use crate::service::{ServiceClient, ServiceServer};
use crate::standard_interfaces::{self, StandardInterfaces};
use crate::subscription::Subscription;

/// How long [`Node::shutdown`] waits for the node's own tasks.
const SHUTDOWN_PATIENCE: Duration = Duration::from_secs(2);

/// A ROS 2 node. Clones are handles to the same node.
#[derive(Clone)]
pub struct Node {
    inner: Arc<Inner>,
}

struct Inner {
    names: NodeNames,
    graph: Arc<Graph>,
    standard: StandardInterfaces,
    stop: CancellationToken,
    tasks: TaskTracker,
}

impl Node {
    /// Joins the graph.
    ///
    /// Must be called within a tokio runtime, which drives the node until [`Self::shutdown`].
    pub async fn start(options: NodeOptions) -> Result<Self, Error> {
        let names = NodeNames::new(&options.name, &options.namespace, &options.remaps)?;
        let (domain_id, range) = (options.resolved_domain_id()?, options.resolved_discovery_range()?);
        let (standard, changes) = StandardInterfaces::new(options.resolved_overrides(&names.fully_qualified())?);
        // Opening a participant's sockets and threads takes milliseconds.
        let joining = names.clone();
        let graph = tokio::task::spawn_blocking(move || Graph::join(&joining, domain_id, range))
            .await
            .map_err(|e| Error::Participant {
                domain_id,
                reason: e.to_string(),
            })??;
        let inner = Inner {
            names,
            graph,
            standard,
            stop: CancellationToken::new(),
            tasks: TaskTracker::new(),
        };
        let node = Self { inner: Arc::new(inner) };
        node.spawn(Arc::clone(node.graph()).watch(node.stop_token()));
        standard_interfaces::serve(&node, changes)?;
        Ok(node)
    }

    /// Base name.
    pub fn name(&self) -> &str {
        &self.inner.names.base
    }

    /// Absolute namespace.
    pub fn namespace(&self) -> &str {
        &self.inner.names.namespace
    }

    /// Namespace and name.
    pub fn fully_qualified_name(&self) -> String {
        self.inner.names.fully_qualified()
    }

    /// The ROS domain that the node is in.
    pub fn domain_id(&self) -> u16 {
        self.inner.graph.domain_id
    }

    /// Fully qualified names of the other nodes that are known now, sorted.
    pub fn other_nodes(&self) -> Vec<String> {
        self.inner.graph.other_nodes()
    }

    /// The type that others have given to `topic` (relative, private or absolute; remapped), as in
    /// `sensor_msgs/msg/Image`; `None` while nobody publishes or subscribes to it. With several types, the first one
    /// in the alphabet.
    pub fn topic_type(&self, topic: &str) -> Result<Option<String>, Error> {
        Ok(self.inner.graph.topic_type(&self.resolve_topic(topic)?))
    }

    /// Waits until a node of this fully qualified name is known.
    pub async fn wait_for_node(&self, name: &str, timeout: Duration) -> Result<(), Error> {
        self.inner
            .graph
            .wait_until(timeout, || self.other_nodes().iter().any(|known| known == name))
            .await
            .map_err(|waited| Error::NotFound {
                what: "node",
                name: name.to_owned(),
                waited,
            })
    }

    /// A publisher on `topic` (relative, private `~/x` or absolute; remapped).
    pub fn publisher<M: Message>(&self, topic: &str, qos: Qos) -> Result<Publisher<M>, Error> {
        Publisher::new(&self.inner.graph, self.inner.names.resolve("topic", topic)?, qos)
    }

    /// A subscription to `topic`.
    pub fn subscription<M: Message>(&self, topic: &str, qos: Qos) -> Result<Subscription<M>, Error> {
        let topic = self.inner.names.resolve("topic", topic)?;
        Subscription::new(&self.inner.graph, topic, qos, self.inner.stop.clone())
    }

    /// A server for the service `name`.
    pub fn service_server<S: Service>(&self, name: &str) -> Result<ServiceServer<S>, Error> {
        let name = self.inner.names.resolve("service", name)?;
        ServiceServer::new(&self.inner.graph, name, S::TYPE_NAME, self.inner.stop.clone())
    }

    /// A client of the service `name`.
    pub fn service_client<S: Service>(&self, name: &str) -> Result<ServiceClient<S>, Error> {
        let name = self.inner.names.resolve("service", name)?;
        ServiceClient::new(
            &self.inner.graph,
            self.fully_qualified_name(),
            name,
            S::TYPE_NAME,
            &self.inner.stop,
        )
    }

    /// A server for the action `name`.
    pub fn action_server<A: Action>(&self, name: &str) -> Result<ActionServer<A>, Error> {
        ActionServer::new(self, &self.inner.names.resolve("action", name)?)
    }

    /// A client of the action `name`.
    pub fn action_client<A: Action>(&self, name: &str) -> Result<ActionClient<A>, Error> {
        ActionClient::new(self, &self.inner.names.resolve("action", name)?)
    }

    /// The node's parameters: declare them after the start, then [`Parameters::seal`].
    pub fn parameters(&self) -> &Parameters {
        &self.inner.standard.parameters
    }

    /// The node's time: the system's, or `/clock` while `use_sim_time` is true.
    pub fn clock(&self) -> &Clock {
        &self.inner.standard.clock
    }

    /// What the node reports on `/diagnostics`.
    pub fn diagnostics(&self) -> &Diagnostics {
        &self.inner.standard.diagnostics
    }

    /// A span that makes what is logged within it the node's on `/rosout`; for `tracing::Instrument::instrument`.
    pub fn span(&self) -> tracing::Span {
        // A span of a lower level would be missing where only errors are logged, and with it the name.
        tracing::error_span!("node", node = self.fully_qualified_name())
    }

    /// Runs a task of the node. [`Self::shutdown`] waits for it, so it has to end with [`Self::stop_token`].
    pub(crate) fn spawn(&self, task: impl Future<Output = ()> + Send + 'static) {
        self.inner.tasks.spawn(task.instrument(self.span()));
    }

    pub(crate) fn standard(&self) -> &StandardInterfaces {
        &self.inner.standard
    }

    pub(crate) fn resolve_topic(&self, topic: &str) -> Result<String, Error> {
        Ok(self.inner.names.resolve("topic", topic)?)
    }

    pub(crate) fn graph(&self) -> &Arc<Graph> {
        &self.inner.graph
    }

    pub(crate) fn tasks(&self) -> &TaskTracker {
        &self.inner.tasks
    }

    /// Cancelled when the node shuts down; tasks that serve the node end with it.
    pub fn stop_token(&self) -> CancellationToken {
        self.inner.stop.child_token()
    }

    /// Leaves the graph at once: the node's name is withdrawn, its tasks end, subscriptions and servers yield `None`.
    ///
    /// Publishers and subscriptions that are still held keep their own endpoint until they are dropped.
    pub async fn shutdown(self) {
        self.inner.stop.cancel();
        self.inner.graph.leave();
        self.inner.tasks.close();
        if tokio::time::timeout(SHUTDOWN_PATIENCE, self.inner.tasks.wait())
            .await
            .is_err()
        {
            tracing::warn!(node = self.fully_qualified_name(), "a task of the node does not end");
        }
    }
}

impl Drop for Inner {
    fn drop(&mut self) {
        self.stop.cancel();
    }
}
