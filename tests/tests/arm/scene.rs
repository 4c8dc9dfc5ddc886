//! A controller, the node that drives it, and another node that looks on.

use std::sync::Arc;
use std::time::Duration;

use interfaces::rakelight_msgs::action::{MoveTool, MoveToolGoal, MoveToolResult};
use interfaces::rakelight_msgs::msg::ArmState;
use interfaces::sensor_msgs::msg::JointState;
use interfaces::std_srvs::srv::{SetBool, SetBoolRequest, SetBoolResponse, Trigger, TriggerRequest, TriggerResponse};
use ros::{ActionClient, GoalStatus, Node, Qos, ServiceClient, Subscription};
use scenarios::{Domain, TIMEOUT, within};
use sim::arm::{ArmConfig, ArmController};
use tokio::task::JoinHandle;

pub(crate) const HOME: [f64; 7] = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];

pub(crate) struct Scene {
    pub(crate) controller: ArmController,
    pub(crate) viewer: Node,
    pub(crate) states: Subscription<ArmState>,
    pub(crate) joints: Subscription<JointState>,
    stop: ServiceClient<Trigger>,
    recover: ServiceClient<Trigger>,
    home: ServiceClient<Trigger>,
    vacuum: ServiceClient<SetBool>,
    pub(crate) move_tool: ActionClient<MoveTool>,
    node: Node,
    running: JoinHandle<Result<(), trajectory_executor::Error>>,
    _domain: Domain,
}

impl Scene {
    /// Connected, and not armed.
    pub(crate) async fn start(config: ArmConfig) -> Self {
        Self::start_with(config, &[]).await
    }

    pub(crate) async fn start_with(config: ArmConfig, parameters: &[(&str, f64)]) -> Self {
        let controller = ArmController::start(config).unwrap();
        let domain = Domain::claim();
        let viewer = domain.node("viewer").await;
        let states = viewer.subscription("arm/state", Qos::STREAM).unwrap();
        let joints = viewer.subscription("joint_states", Qos::STREAM).unwrap();
        let ports = controller.ports();
        let mut options = domain
            .options("trajectory_executor")
            .parameter("host", controller.address().to_string())
            .parameter("control_port", i64::from(ports.control))
            .parameter("real_time_port", i64::from(ports.real))
            .parameter("rich_port", i64::from(ports.rich))
            // Test machines are busy with other tests: what is looked at here is not how punctual they are.
            .parameter("watchdog", 0.4)
            .parameter("state_timeout", 0.8);
        for (name, value) in parameters {
            options = options.parameter(name, *value);
        }
        let node = Node::start(options).await.unwrap();
        let client = |name| viewer.service_client(name).unwrap();
        let mut scene = Self {
            running: tokio::spawn(trajectory_executor::run(node.clone())),
            node,
            stop: client("stop"),
            recover: client("recover"),
            home: client("home"),
            vacuum: viewer.service_client("vacuum/set").unwrap(),
            move_tool: viewer.action_client("move_tool").unwrap(),
            states,
            joints,
            viewer,
            controller,
            _domain: domain,
        };
        scene
            .state("the controller", |state| state.mode != ArmState::DISCONNECTED)
            .await;
        scene
    }

    /// Armed and held.
    pub(crate) async fn ready(config: ArmConfig) -> Self {
        let mut scene = Self::start(config).await;
        let answer = scene.recover().await;
        assert!(answer.success, "{}", answer.message);
        scene
            .state("the arm to be ready", |state| state.mode == ArmState::READY)
            .await;
        scene
    }

    pub(crate) async fn state(&mut self, what: &str, wanted: impl Fn(&ArmState) -> bool) -> Arc<ArmState> {
        within(what, async {
            loop {
                let state = self.states.next().await.expect("the node runs").message;
                if wanted(&state) {
                    return state;
                }
            }
        })
        .await
    }

    pub(crate) async fn stop(&self) -> Arc<TriggerResponse> {
        self.stop.call(TriggerRequest::default(), TIMEOUT).await.unwrap()
    }

    pub(crate) async fn recover(&self) -> Arc<TriggerResponse> {
        self.recover.call(TriggerRequest::default(), TIMEOUT).await.unwrap()
    }

    pub(crate) async fn home(&self) -> Arc<TriggerResponse> {
        self.home.call(TriggerRequest::default(), TIMEOUT).await.unwrap()
    }

    pub(crate) async fn vacuum(&self, on: bool) -> Arc<SetBoolResponse> {
        self.vacuum.call(SetBoolRequest { data: on }, TIMEOUT).await.unwrap()
    }

    /// To the end.
    pub(crate) async fn move_tool(&self, goal: MoveToolGoal) -> (GoalStatus, Arc<MoveToolResult>) {
        let goal = self.move_tool.send_goal(goal, TIMEOUT).await.unwrap();
        goal.result(TIMEOUT).await.unwrap()
    }

    /// As the controller has it.
    pub(crate) fn angles(&self) -> [f64; 7] {
        self.controller.moment().joints
    }

    /// The arm is at these angles (radians), by its controller.
    pub(crate) fn assert_at(&self, angles: &[f64], what: &str) {
        let off = self
            .angles()
            .iter()
            .zip(angles)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        assert!(off < 2e-3, "{what}: {:?}, expected {angles:?}", self.angles());
    }

    /// The controller has seen that the arm moves.
    pub(crate) async fn moving(&self) {
        scenarios::eventually("the arm to move", || {
            self.controller
                .moment()
                .velocities
                .iter()
                .any(|speed| speed.abs() > 0.05)
        })
        .await;
    }

    pub(crate) async fn end(self) {
        self.end_and(|_| {}).await;
    }

    /// What is left behind by the node is looked at.
    pub(crate) async fn end_and(self, look: impl FnOnce(&ArmController)) {
        self.node.shutdown().await;
        within("the node's end", self.running).await.unwrap().unwrap();
        look(&self.controller);
        self.viewer.shutdown().await;
    }
}

/// A way that takes some seconds.
pub(crate) fn far() -> MoveToolGoal {
    MoveToolGoal {
        poses: vec![down(0.35, 0.30, 0.35), down(0.35, -0.30, 0.35)],
        ..MoveToolGoal::default()
    }
}

/// The cup points down, there (metres).
pub(crate) fn down(x: f64, y: f64, z: f64) -> interfaces::geometry_msgs::msg::Pose {
    use interfaces::geometry_msgs::msg::{Point, Pose, Quaternion};
    Pose {
        position: Point { x, y, z },
        orientation: Quaternion {
            x: 1.0,
            y: 0.0,
            z: 0.0,
            w: 0.0,
        },
    }
}

/// Long enough for something that must not happen.
pub(crate) const MEANWHILE: Duration = Duration::from_millis(300);
