//! Whether every node of a cell answers.

use std::collections::BTreeSet;
use std::time::Duration;

use futures::StreamExt;
use futures::stream::FuturesUnordered;
use interfaces::rakelight_msgs::srv::Capture;
use interfaces::rcl_interfaces::srv::{ListParameters, ListParametersRequest};
use ros::{Node, ServiceClient};

use super::console::Console;

/// A node that has just died is still in the graph, so each is asked, and asked again.
const PATIENCE: Duration = Duration::from_secs(1);

/// Asks the nodes of a cell.
pub(super) struct Readiness {
    nodes: Vec<(String, ServiceClient<ListParameters>)>,
    capture: Option<ServiceClient<Capture>>,
}

impl Readiness {
    /// For nodes with these fully qualified names; with `captures`, for the service too.
    pub(super) fn new(observer: &Node, names: &[String], captures: bool) -> Result<Self, ros::Error> {
        let client = |name: &String| {
            Ok((
                name.clone(),
                observer.service_client(&format!("{name}/list_parameters"))?,
            ))
        };
        Ok(Self {
            nodes: names.iter().map(client).collect::<Result<_, ros::Error>>()?,
            capture: captures.then(|| observer.service_client("capture")).transpose()?,
        })
    }

    /// Waits until all of them have answered.
    pub(super) async fn wait(&self, console: &Console) {
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
        console.waiting(None);
    }
}

async fn answer<'a>(name: &'a str, client: &ServiceClient<ListParameters>) -> &'a str {
    let request = ListParametersRequest::default;
    while client.call(request(), PATIENCE).await.is_err() {
        // A call that cannot even be sent fails at once.
        tokio::time::sleep(PATIENCE / 10).await;
    }
    name
}
