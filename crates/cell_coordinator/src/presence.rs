//! Which of the cell's nodes are there.
//!
//! DDS misses a node that was killed only when its lease has run out, under a minute later. So every node is asked for
//! nothing again and again (`get_parameters` of no names), and one that is silent for `node_timeout` counts as gone.

use std::time::Duration;

use interfaces::rcl_interfaces::srv::{GetParameters, GetParametersRequest};
use ros::{Node, ServiceClient};
use tokio::sync::watch;
use tokio::task::JoinSet;
use tokio::time::MissedTickBehavior;
use tracing::Instrument;

pub(crate) const CAMERAS: &str = "camera_capture";
pub(crate) const LIGHTS: &str = "light_sequencer";
pub(crate) const SOLVER: &str = "normal_solver";
pub(crate) const PLANNER: &str = "grasp_planner";
pub(crate) const ARM: &str = "trajectory_executor";
pub(crate) const RECORDER: &str = "bag_recorder";

/// All that a cycle needs; the recorder only when it records.
const NEEDED: [&str; 5] = [LIGHTS, CAMERAS, SOLVER, PLANNER, ARM];

/// A node is asked so often within the time in which it has to answer.
const QUESTIONS: u32 = 5;

/// Who is there. Clones look at the same.
#[derive(Clone)]
pub(crate) struct Presence {
    nodes: Vec<(&'static str, watch::Receiver<Life>)>,
    timeout: Duration,
}

/// Of one node.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Life {
    is_there: bool,
    /// Counts losses and new starts.
    number: u64,
}

impl Presence {
    /// Asks until the node is shut down.
    pub(crate) fn watch(node: &Node, timeout: Duration, tasks: &mut JoinSet<()>) -> Result<Self, ros::Error> {
        let mut nodes = Vec::new();
        for name in NEEDED.into_iter().chain([RECORDER]) {
            let (life, seen) = watch::channel(Life::default());
            let asker = Asker {
                name,
                full_name: format!("{}/{name}", node.namespace().trim_end_matches('/')),
                client: node.service_client(&format!("{name}/get_parameters"))?,
                node: node.clone(),
                period: timeout / QUESTIONS,
                life,
            };
            tasks.spawn(asker.run().in_current_span());
            nodes.push((name, seen));
        }
        Ok(Self { nodes, timeout })
    }

    /// Names of the nodes that are needed and not there.
    pub(crate) fn missing(&self, records: bool) -> Vec<String> {
        let is_needed = |name: &str| records || name != RECORDER;
        let missing = self
            .nodes
            .iter()
            .filter(|(name, life)| is_needed(name) && !life.borrow().is_there);
        missing.map(|(name, _)| (*name).to_owned()).collect()
    }

    /// Waits until somebody comes or goes.
    pub(crate) async fn changed(&mut self) {
        let changes = self.nodes.iter_mut().map(|(_, life)| Box::pin(life.changed()));
        // The senders live as long as the node.
        let _ = futures::future::select_all(changes).await;
    }

    /// Waits until this node is gone, and says so; at once if it is not there.
    pub(crate) async fn lost(&self, name: &'static str) -> String {
        let Some((_, life)) = self.nodes.iter().find(|(known, _)| *known == name) else {
            return std::future::pending().await;
        };
        let mut life = life.clone();
        let before = *life.borrow_and_update();
        if before.is_there {
            // An error is the end of this node: whoever waits ends as well.
            let _ = life.wait_for(|now| *now != before).await;
        }
        let is_there = life.borrow().is_there;
        if is_there {
            format!("{name} was started anew and does not know of this any more")
        } else {
            format!(
                "{name} is gone: it has not answered for {:.1} s",
                self.timeout.as_secs_f64()
            )
        }
    }
}

/// Asks one node.
struct Asker {
    name: &'static str,
    full_name: String,
    client: ServiceClient<GetParameters>,
    node: Node,
    period: Duration,
    life: watch::Sender<Life>,
}

impl Asker {
    async fn run(self) {
        let (stop, mut ticks) = (self.node.stop_token(), tokio::time::interval(self.period));
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut namesakes = 0;
        loop {
            tokio::select! {
                () = stop.cancelled() => return,
                _ = ticks.tick() => {}
            }
            let answers = self.answers().await;
            // One that was killed is still in the graph when it is started anew.
            let now = self.namesakes();
            self.tell(answers, answers && namesakes > 0 && now > namesakes);
            namesakes = now;
        }
    }

    async fn answers(&self) -> bool {
        let patience = self.period * (QUESTIONS - 1);
        self.client.server_is_ready()
            && self
                .client
                .call(GetParametersRequest::default(), patience)
                .await
                .is_ok()
    }

    fn namesakes(&self) -> usize {
        let known = self.node.other_nodes();
        known.iter().filter(|name| **name == self.full_name).count()
    }

    fn tell(&self, is_there: bool, is_new: bool) {
        let told = self.life.send_if_modified(|life| {
            let is_restart = is_new && life.is_there;
            let is_change = is_restart || life.is_there != is_there;
            if is_change {
                *life = Life {
                    is_there,
                    number: life.number + 1,
                };
            }
            is_change
        });
        match (told, is_there) {
            (true, true) => tracing::info!(node = self.name, "is there"),
            (true, false) => tracing::warn!(node = self.name, "is gone"),
            (false, _) => {}
        }
    }
}
