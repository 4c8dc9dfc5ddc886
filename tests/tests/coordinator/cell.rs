//! A coordinator, stand-ins for the others, and somebody who asks for picks.

use std::collections::BTreeMap;
use std::sync::Arc;

use futures::FutureExt;
use interfaces::rakelight_msgs::action::{PickCycle, PickCycleGoal, PickCycleResult};
use interfaces::rakelight_msgs::msg::{ArmState, CellState};
use interfaces::std_srvs::srv::{Trigger, TriggerRequest, TriggerResponse};
use ros::{ActionClient, GoalHandle, GoalStatus, Node, NodeOptions, Qos, ServiceClient, Subscription};
use scenarios::stand_ins::{NODES, StandIn, World};
use scenarios::{Domain, TIMEOUT, eventually, within};
use tokio::task::JoinHandle;

pub(crate) struct Cell {
    pub(crate) world: World,
    pub(crate) stand_ins: BTreeMap<&'static str, StandIn>,
    pub(crate) states: Subscription<CellState>,
    last_stage: Option<u8>,
    pub(crate) client: ActionClient<PickCycle>,
    pub(crate) operator: Node,
    pick: ServiceClient<Trigger>,
    recover: ServiceClient<Trigger>,
    coordinator: Node,
    running: JoinHandle<Result<(), cell_coordinator::Error>>,
    pub(crate) domain: Domain,
}

impl Cell {
    /// Ready, with objects at these places.
    pub(crate) async fn start(objects: &[f64]) -> Self {
        Self::start_with(objects, &NODES, |options| options).await
    }

    /// With only these stand-ins; ready if they are all that is needed.
    pub(crate) async fn start_with(
        objects: &[f64],
        nodes: &[&'static str],
        adapt: impl FnOnce(NodeOptions) -> NodeOptions,
    ) -> Self {
        let (domain, world) = (Domain::claim(), World::new(objects));
        let operator = domain.node("operator").await;
        let mut stand_ins = BTreeMap::new();
        for name in nodes {
            stand_ins.insert(*name, StandIn::start(&domain, name, &world).await);
        }
        // Test machines are busy with other tests.
        let options = domain
            .options(cell_coordinator::NAME)
            .parameter("arm_state_timeout", 3.0)
            .parameter("interrupt_timeout", 5.0);
        let coordinator = Node::start(adapt(options)).await.unwrap();
        let mut cell = Self {
            world,
            stand_ins,
            states: operator.subscription("state", Qos::LATCHED).unwrap(),
            last_stage: None,
            client: operator.action_client("pick_cycle").unwrap(),
            pick: operator.service_client("pick").unwrap(),
            recover: operator.service_client("recover").unwrap(),
            operator,
            running: tokio::spawn(cell_coordinator::run(coordinator.clone())),
            coordinator,
            domain,
        };
        if NODES.iter().all(|node| nodes.contains(node)) {
            cell.stage(CellState::IDLE).await;
        }
        cell.client.wait_for_server(TIMEOUT).await.unwrap();
        cell
    }

    pub(crate) async fn state(&mut self, what: &str, wanted: impl Fn(&CellState) -> bool) -> Arc<CellState> {
        within(what, async {
            loop {
                let state = self.states.next().await.expect("the node runs").message;
                self.last_stage = Some(state.stage);
                if wanted(&state) {
                    return state;
                }
            }
        })
        .await
    }

    pub(crate) async fn stage(&mut self, stage: u8) -> Arc<CellState> {
        self.state(&format!("stage {stage}"), |state| state.stage == stage)
            .await
    }

    /// By the service.
    pub(crate) async fn pick(&self) -> Arc<TriggerResponse> {
        self.pick.call(TriggerRequest::default(), TIMEOUT).await.unwrap()
    }

    pub(crate) async fn begin(&self) -> GoalHandle<PickCycle> {
        self.client.send_goal(PickCycleGoal::default(), TIMEOUT).await.unwrap()
    }

    /// By the action, to its end.
    pub(crate) async fn cycle(&self, goal: PickCycleGoal) -> (GoalStatus, Arc<PickCycleResult>) {
        let goal = self.client.send_goal(goal, TIMEOUT).await.unwrap();
        goal.result(TIMEOUT).await.unwrap()
    }

    /// That it fails in this stage, and says these things.
    pub(crate) async fn fails(&mut self, stage: u8, texts: &[&str]) -> Arc<PickCycleResult> {
        let (status, result) = self.cycle(PickCycleGoal::default()).await;
        assert_eq!(
            (status, result.failed_stage),
            (GoalStatus::Aborted, stage),
            "{result:?}"
        );
        self.assert_says(&result.reason, texts).await;
        result
    }

    /// The reason has these texts, the state has it too, and the cell is at rest.
    pub(crate) async fn assert_says(&mut self, reason: &str, texts: &[&str]) {
        for text in texts {
            assert!(reason.contains(text), "{text:?} is not in {reason:?}");
        }
        self.state("the failure in the state", |state| {
            state.last_error == reason && !is_running(state)
        })
        .await;
        self.assert_safe();
    }

    /// Nothing moves, and the pump is off or holds something.
    pub(crate) fn assert_safe(&self) {
        let world = self.world.look();
        assert_eq!(world.moving, 0, "a motion is under way");
        assert!(!world.pump || world.held.is_some(), "the pump runs and holds nothing");
    }

    /// Waits for that many requests of a name.
    pub(crate) async fn asked(&self, what: &str, count: usize) {
        eventually(what, || self.world.look().count(what) >= count).await;
    }

    pub(crate) async fn recover(&self) {
        let answer = self.recover.call(TriggerRequest::default(), TIMEOUT).await.unwrap();
        assert!(answer.success, "{}", answer.message);
    }

    /// When everything works again, the next pick does too, without a restart of the coordinator.
    pub(crate) async fn picks_again(mut self) {
        self.world.heal();
        if self.world.look().mode != ArmState::READY {
            self.recover().await;
        }
        self.world.change(|world| {
            if world.objects.is_empty() {
                world.objects.push(0.46);
            }
        });
        self.idle().await;
        let binned = self.world.look().binned;
        let answer = self.pick().await;
        assert!(answer.success, "{}", answer.message);
        assert!(self.world.look().binned > binned, "nothing came into the bin");
        self.assert_safe();
        self.end().await;
    }

    /// Waits until the cell is, or sees that it is.
    pub(crate) async fn idle(&mut self) {
        while let Some(Some(received)) = self.states.next().now_or_never() {
            self.last_stage = Some(received.message.stage);
        }
        if self.last_stage != Some(CellState::IDLE) {
            self.stage(CellState::IDLE).await;
        }
    }

    pub(crate) async fn end(self) {
        self.coordinator.shutdown().await;
        within("the coordinator's end", self.running).await.unwrap().unwrap();
        for (_, stand_in) in self.stand_ins {
            stand_in.leave().await;
        }
        self.operator.shutdown().await;
    }

    /// The coordinator alone.
    pub(crate) async fn shut_down_coordinator(&mut self) {
        self.coordinator.clone().shutdown().await;
    }
}

pub(crate) fn is_running(state: &CellState) -> bool {
    (CellState::CAPTURE..=CellState::EXECUTE).contains(&state.stage)
}
