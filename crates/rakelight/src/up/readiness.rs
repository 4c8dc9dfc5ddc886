//! Whether every node of a cell answers and has its devices.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use futures::stream::FuturesUnordered;
use futures::{FutureExt, StreamExt};
use interfaces::diagnostic_msgs::msg::{DiagnosticArray, DiagnosticStatus};
use interfaces::rakelight_msgs::msg::CellState;
use interfaces::rakelight_msgs::srv::Capture;
use interfaces::rcl_interfaces::srv::{ListParameters, ListParametersRequest};
use ros::{Node, Qos, ServiceClient, Subscription};
use tokio::sync::Mutex;

use super::console::Console;
use super::{ARM, CAPTURER, COORDINATOR, LIGHTS};

/// A node that has just died is still in the graph, so each is asked, and asked again.
const PATIENCE: Duration = Duration::from_secs(1);

/// Asks the nodes of a cell.
pub(super) struct Readiness {
    nodes: Vec<(String, ServiceClient<ListParameters>)>,
    capture: Option<ServiceClient<Capture>>,
    /// Of the cell, if somebody publishes them, and the last one.
    states: Option<Mutex<(Subscription<CellState>, Option<u8>)>>,
    diagnostics: Mutex<Subscription<DiagnosticArray>>,
    /// What the statuses of nodes with devices begin with: "`cell/camera_capture`: ".
    with_devices: Vec<String>,
}

impl Readiness {
    /// For nodes with these fully qualified names.
    pub(super) fn new(observer: &Node, names: &[String]) -> Result<Self, ros::Error> {
        let is = |name: &&String, node: &str| name.rsplit('/').next() == Some(node);
        let has = |node| names.iter().any(|name| is(&name, node));
        let has_devices = |name: &&String| [CAPTURER, LIGHTS, ARM].iter().any(|node| is(name, node));
        let devices = names.iter().filter(has_devices);
        let client = |name: &String| {
            Ok((
                name.clone(),
                observer.service_client(&format!("{name}/list_parameters"))?,
            ))
        };
        Ok(Self {
            nodes: names.iter().map(client).collect::<Result<_, ros::Error>>()?,
            capture: has(CAPTURER).then(|| observer.service_client("capture")).transpose()?,
            states: has(COORDINATOR)
                .then(|| observer.subscription("state", Qos::LATCHED))
                .transpose()?
                .map(|states| Mutex::new((states, None))),
            diagnostics: Mutex::new(observer.subscription("/diagnostics", Qos::STREAM)?),
            with_devices: devices
                .map(|name| format!("{}: ", name.trim_start_matches('/')))
                .collect(),
        })
    }

    /// Waits until all of them have answered, and, if they are to be `idle`, until the cell takes a pick.
    pub(super) async fn wait(&self, console: &Console, idle: bool) {
        let mut missing: BTreeSet<&str> = self.nodes.iter().map(|(name, _)| name.as_str()).collect();
        let mut answers: FuturesUnordered<_> = self.nodes.iter().map(|(name, client)| answer(name, client)).collect();
        loop {
            let names: Vec<&str> = missing.iter().copied().collect();
            console.waiting(Some(&names.join(", ")));
            match answers.next().await {
                Some(name) => missing.remove(name),
                None => break,
            };
        }
        if let Some(capture) = &self.capture {
            console.waiting(Some("the service capture"));
            while capture.wait_for_server(PATIENCE).await.is_err() {}
        }
        self.devices(console).await;
        if let Some(states) = &self.states {
            console.waiting(Some("the cell to be idle"));
            await_stage(&mut *states.lock().await, idle).await;
        }
    }

    /// Waits until every node with devices has told of them, and of no error.
    async fn devices(&self, console: &Console) {
        let mut statuses = BTreeMap::new();
        let mut diagnostics = self.diagnostics.lock().await;
        // What came before may be of a process that is dead.
        while let Some(Some(_)) = diagnostics.next().now_or_never() {}
        while let Some(problem) = problem(&self.with_devices, &statuses) {
            console.waiting(Some(&problem));
            let Some(received) = diagnostics.next().await else {
                return;
            };
            let told = received.message.status.iter();
            statuses.extend(told.map(|status| (status.name.clone(), (status.level, status.message.clone()))));
        }
    }
}

/// Waits until the cell is idle, or if it need not be, at least not starting.
async fn await_stage((states, last): &mut (Subscription<CellState>, Option<u8>), idle: bool) {
    while let Some(Some(received)) = states.next().now_or_never() {
        *last = Some(received.message.stage);
    }
    let is_there = |stage: u8| stage == CellState::IDLE || !idle && stage != CellState::STARTING;
    while !last.is_some_and(is_there) {
        let Some(received) = states.next().await else {
            return;
        };
        *last = Some(received.message.stage);
    }
}

type Statuses = BTreeMap<String, (u8, String)>;

/// The first device that is not well, or is not known to be.
fn problem(nodes: &[String], statuses: &Statuses) -> Option<String> {
    nodes.iter().find_map(|node| {
        let mut own = statuses.iter().filter(|(name, _)| name.starts_with(node)).peekable();
        if own.peek().is_none() {
            return Some(format!("word from {}", node.trim_end_matches(": ")));
        }
        own.find(|(_, (level, _))| *level == DiagnosticStatus::ERROR)
            .map(|(name, (_, message))| format!("{name}: {message}"))
    })
}

async fn answer<'a>(name: &'a str, client: &ServiceClient<ListParameters>) -> &'a str {
    let request = ListParametersRequest::default;
    while client.call(request(), PATIENCE).await.is_err() {
        // A call that cannot even be sent fails at once.
        tokio::time::sleep(PATIENCE / 10).await;
    }
    name
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_that_is_not_well_is_named() {
        let nodes = ["cell/camera_capture: ".to_owned()];
        let of = |statuses: &[(&str, u8)]| {
            let status = |(name, level): &(&str, u8)| ((*name).to_owned(), (*level, "as it is".to_owned()));
            problem(&nodes, &statuses.iter().map(status).collect())
        };
        assert_eq!(
            of(&[("cell/other: c1", DiagnosticStatus::ERROR)]).as_deref(),
            Some("word from cell/camera_capture")
        );
        let well = ("cell/camera_capture: c1", DiagnosticStatus::WARN);
        assert_eq!(of(&[well]), None);
        assert_eq!(
            of(&[well, ("cell/camera_capture: c2", DiagnosticStatus::ERROR)]).as_deref(),
            Some("cell/camera_capture: c2: as it is")
        );
    }
}
