//! Plays a capture to solver and planner and asks them what came of it.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, anyhow};
use interfaces::Message;
use interfaces::rakelight_msgs::msg::GraspArray;
use interfaces::rakelight_msgs::srv::{
    PlanGrasp, PlanGraspRequest, PlanGraspResponse, Solve, SolveRequest, SolveResponse,
};
use interfaces::sensor_msgs::msg::Image as ImageMessage;
use recording::Bag;
use ros::{Node, Qos, ServiceClient, Subscription};

use super::compare;
use super::outcome::{CameraOutcome, GraspOutcome, Outcome, PlanOutcome};
use super::recorded::{Recorded, first_stamp, is_result};
use super::settings::Settings;
use super::{Nodes, WAIT_FOR_SOLVER};
use crate::bag::captures::Capture;
use crate::bag::cut;
use crate::failure::Failure;
use crate::image_message::normal_map;
use crate::nodes::Running;

/// A little more than the nodes' own patience.
const ANSWER: Duration = Duration::from_secs(150);
/// Maps are published before the solver answers.
const MAP: Duration = Duration::from_secs(10);

/// What was recorded of a capture and what came of it today.
pub(super) struct Results {
    pub(super) recorded: Recorded,
    /// By camera, `/cell/c1`.
    pub(super) normals: BTreeMap<String, Arc<ImageMessage>>,
    pub(super) edges: BTreeMap<String, Arc<ImageMessage>>,
    pub(super) grasps: Option<GraspArray>,
}

/// Who asks the nodes.
pub(super) struct Bench<'a> {
    nodes: &'a Nodes<'a>,
    bag: &'a Bag,
    /// Whether anything can be planned.
    plans: bool,
    solve: ServiceClient<Solve>,
    plan: ServiceClient<PlanGrasp>,
    /// By topic.
    maps: BTreeMap<String, Subscription<ImageMessage>>,
}

impl<'a> Bench<'a> {
    pub(super) fn new(
        nodes: &'a Nodes<'a>,
        settings: &Settings,
        bag: &'a Bag,
        node: &Node,
        captures: &[Capture],
    ) -> Result<Self, Failure> {
        let mut maps = BTreeMap::new();
        let parts = captures.iter().flat_map(|capture| &capture.cameras);
        for topic in parts.flat_map(|part| ["normals", "edges"].map(|what| format!("{}/{what}", part.camera))) {
            if let Entry::Vacant(place) = maps.entry(topic) {
                let subscription = node.subscription(place.key(), Qos::MAP)?;
                place.insert(subscription);
            }
        }
        Ok(Self {
            nodes,
            bag,
            plans: settings.has_lights(),
            solve: node.service_client("solve")?,
            plan: node.service_client("plan_grasp")?,
            maps,
        })
    }

    pub(super) async fn resolve(
        &mut self,
        capture: &Capture,
        running: &mut Running,
    ) -> Result<(Outcome, Results), Failure> {
        let recorded = Recorded::read(self.bag, capture)?;
        self.play(capture, running).await?;
        let request = SolveRequest {
            capture_id: capture.id.clone(),
            ..SolveRequest::default()
        };
        let solved = tokio::select! {
            solved = self.solve.call(request, ANSWER) => solved?,
            outcome = running.first_to_end() => return Err(ended_early(outcome)),
        };
        let mut results = Results {
            recorded,
            normals: self.maps_of(capture, "normals", &solved.cameras).await?,
            edges: BTreeMap::new(),
            grasps: None,
        };
        let planned = if self.plans && !solved.cameras.is_empty() {
            results.edges = self.maps_of(capture, "edges", &solved.cameras).await?;
            Some(self.plan(capture, &results.recorded).await?)
        } else {
            None
        };
        results.grasps = planned.as_ref().map(|planned| planned.grasps.clone());
        let outcome = self.outcome(capture, &solved, planned.as_deref(), &results)?;
        Ok((outcome, results))
    }

    /// Plays what belongs to a capture, without recorded results.
    async fn play(&self, capture: &Capture, running: &mut Running) -> Result<(), Failure> {
        let folder = tempfile::tempdir().context("cannot make a folder for a part of the bag")?;
        let path = folder.path().join("capture");
        let topics = self.bag.topics().iter().filter(|topic| !is_result(topic));
        let topics: Vec<String> = topics.map(|topic| topic.name.clone()).collect();
        cut::one_capture(self.bag, &capture.id, &topics, &path)?;
        let player = self.nodes.player(&path);
        running
            .play(player.parameter("wait_for_subscriptions", WAIT_FOR_SOLVER))
            .await
    }

    /// As the capture was planned on when it was recorded.
    async fn plan(&self, capture: &Capture, recorded: &Recorded) -> Result<Arc<PlanGraspResponse>, Failure> {
        let first = recorded.grasps.iter().flat_map(|array| &array.grasps).next();
        let request = PlanGraspRequest {
            capture_id: capture.id.clone(),
            mode: first.map(|grasp| grasp.mode).unwrap_or_default(),
            ..PlanGraspRequest::default()
        };
        Ok(self.plan.call(request, ANSWER).await?)
    }

    /// The maps that were just published of the cameras that were solved.
    async fn maps_of(
        &mut self,
        capture: &Capture,
        what: &str,
        solved: &[String],
    ) -> Result<BTreeMap<String, Arc<ImageMessage>>, Failure> {
        let mut found = BTreeMap::new();
        for camera in capture.cameras.iter().map(|part| &part.camera) {
            let topic = format!("{camera}/{what}");
            let is_solved = solved.iter().any(|name| name == name_of(camera));
            let Some(maps) = self.maps.get_mut(&topic).filter(|_| is_solved) else {
                continue;
            };
            let stamp = first_stamp(capture, camera);
            let own = async {
                loop {
                    let map = maps.next().await.context("the node is shut down")?.message;
                    if Some(map.header.stamp.to_nanos()) == stamp {
                        return anyhow::Ok(map);
                    }
                }
            };
            let map = tokio::time::timeout(MAP, own)
                .await
                .map_err(|_| anyhow!("no {} on {topic} within {MAP:?}", ImageMessage::TYPE_NAME))??;
            found.insert(camera.clone(), map);
        }
        Ok(found)
    }

    fn outcome(
        &self,
        capture: &Capture,
        solved: &SolveResponse,
        planned: Option<&PlanGraspResponse>,
        results: &Results,
    ) -> Result<Outcome, Failure> {
        let shares = solved.cameras.iter().zip(&solved.valid_fractions);
        let cameras = shares.map(|(name, &valid_fraction)| self.camera(name, valid_fraction, results));
        let recorded = results.recorded.grasps.as_ref();
        let plan = planned.map(|planned| PlanOutcome {
            message: planned.message.clone(),
            planned_in_s: planned.timing.duration.to_nanos() as f64 * 1e-9,
            grasps: GraspOutcome::all(&planned.grasps),
            compared: recorded.map(|recorded| compare::grasps(recorded, &planned.grasps)),
        });
        let problem = (!solved.message.is_empty()).then(|| solved.message.clone());
        let unplanned = (plan.is_none() && recorded.is_some()).then(|| "recorded grasps are not compared".into());
        Ok(Outcome {
            number: capture.number,
            id: capture.id.clone(),
            problem: problem.or(unplanned),
            solved_in_s: solved.timing.duration.to_nanos() as f64 * 1e-9,
            cameras: cameras.collect::<anyhow::Result<_>>()?,
            plan,
        })
    }

    fn camera(&self, name: &str, valid_fraction: f32, results: &Results) -> anyhow::Result<CameraOutcome> {
        let new = results.normals.iter().find(|(camera, _)| name_of(camera) == name);
        let recorded = new.and_then(|(camera, _)| results.recorded.normals.get(camera));
        let mut outcome = CameraOutcome {
            camera: name.to_owned(),
            valid_fraction,
            normals: None,
            not_compared: None,
        };
        let (Some((_, new)), Some(recorded)) = (new, recorded) else {
            return Ok(outcome);
        };
        if self.nodes.arguments.enlarge == 1 {
            outcome.normals = compare::normals(&normal_map(recorded)?, &normal_map(new)?);
            outcome.not_compared = outcome.normals.is_none().then(|| {
                let (width, height) = (recorded.width, recorded.height);
                format!("recorded are {width} x {height}, new {} x {}", new.width, new.height)
            });
        }
        Ok(outcome)
    }
}

fn ended_early(outcome: Result<(), Failure>) -> Failure {
    outcome
        .err()
        .unwrap_or_else(|| anyhow!("a node ended by itself").into())
}

/// `c1` of `/cell/c1`.
fn name_of(camera: &str) -> &str {
    camera.rsplit('/').next().unwrap_or(camera)
}
