//! Doing what a cycle asks for: the calls to the other nodes.

use std::sync::Arc;
use std::time::Duration;

use interfaces::Service;
use interfaces::geometry_msgs::msg::Vector3;
use interfaces::rakelight_msgs::action::{MoveTool, MoveToolResult};
use interfaces::rakelight_msgs::srv::{
    Capture, CaptureRequest, PlanGrasp, PlanGraspRequest, PlanGraspResponse, Solve, SolveRequest,
};
use interfaces::rcl_interfaces::srv::{GetParameters, GetParametersRequest};
use interfaces::std_srvs::srv::{SetBool, SetBoolRequest, Trigger, TriggerRequest};
use ros::{ActionClient, GoalHandle, Node, ServiceClient};
use tokio_util::sync::CancellationToken;

use crate::arm::Arm;
use crate::convert;
use crate::cycle::{Command, Event, Fault, Move, Planned};
use crate::parameters::Parameters;
use crate::presence::{ARM, CAMERAS, PLANNER, Presence, SOLVER};

/// Longer than any stage: stages have their own limits, and a node that is gone is noticed.
const PATIENCE: Duration = Duration::from_hours(1);
/// For a node that is there to say something simple.
const QUICK: Duration = Duration::from_secs(2);

/// What every command of a cycle has in common.
#[derive(Debug, Clone, Default)]
pub(crate) struct Wanted {
    /// Name of a known object; empty: whatever can be picked.
    pub(crate) target: String,
    /// Of the approach; 0: free choice.
    pub(crate) direction: Vector3,
}

pub(crate) struct Hands {
    capture: ServiceClient<Capture>,
    solve: ServiceClient<Solve>,
    plan: ServiceClient<PlanGrasp>,
    move_tool: ActionClient<MoveTool>,
    vacuum: ServiceClient<SetBool>,
    home: ServiceClient<Trigger>,
    stop: ServiceClient<Trigger>,
    arm_parameters: ServiceClient<GetParameters>,
    arm: Arm,
    presence: Presence,
    parameters: Arc<Parameters>,
}

impl Hands {
    pub(crate) fn new(
        node: &Node,
        arm: Arm,
        presence: Presence,
        parameters: Arc<Parameters>,
    ) -> Result<Self, ros::Error> {
        Ok(Self {
            capture: node.service_client("capture")?,
            solve: node.service_client("solve")?,
            plan: node.service_client("plan_grasp")?,
            move_tool: node.action_client("move_tool")?,
            vacuum: node.service_client("vacuum/set")?,
            home: node.service_client("home")?,
            stop: node.service_client("stop")?,
            arm_parameters: node.service_client(&format!("{ARM}/get_parameters"))?,
            arm,
            presence,
            parameters,
        })
    }

    /// Does it, until it is done or `interrupt` comes.
    pub(crate) async fn perform(
        self: Arc<Self>,
        command: Command,
        wanted: Wanted,
        interrupt: CancellationToken,
    ) -> Event {
        let outcome = match command {
            Command::Capture { cameras } => self.capture(cameras, &interrupt).await,
            Command::Solve { capture_id } => self.solve(capture_id, &interrupt).await,
            Command::Plan { capture_id, mode } => {
                let request = PlanGraspRequest {
                    capture_id,
                    target: wanted.target,
                    mode: convert::mode(mode),
                    direction: wanted.direction,
                };
                let asked = self.ask(PLANNER, &self.plan, request, &interrupt).await;
                asked.map(|answer| planned(&answer))
            }
            Command::Move(way) => self.moves(way, &interrupt).await,
            Command::Vacuum { on } => self.vacuum(on, &interrupt).await,
            Command::Home => self.home(&interrupt).await,
            Command::Interrupt | Command::Halt => Ok(Event::Done),
        };
        outcome.unwrap_or_else(Event::Failed)
    }

    /// Tells the arm to stop, whatever it does, and does not wait for it.
    pub(crate) async fn halt(&self) {
        if let Err(error) = self.stop.tell(TriggerRequest::default(), QUICK).await {
            tracing::warn!(%error, "the arm was not told to stop");
        }
    }

    /// Home, as the arm's node has it now, radians.
    pub(crate) async fn home_joints(&self) -> Result<Vec<f64>, String> {
        let request = GetParametersRequest {
            names: vec!["home".into()],
        };
        let answer = self.arm_parameters.call(request, QUICK).await;
        let answer = answer.map_err(|error| error.to_string())?;
        let value = answer.values.first().map(|value| value.double_array_value.clone());
        value
            .filter(|home| !home.is_empty())
            .ok_or_else(|| format!("{ARM} does not say where home is (parameter home)"))
    }

    async fn capture(&self, cameras: Vec<String>, interrupt: &CancellationToken) -> Result<Event, Fault> {
        let request = CaptureRequest { cameras };
        let answer = self.ask(CAMERAS, &self.capture, request, interrupt).await?;
        require(answer.success, &answer.message)?;
        Ok(Event::Captured {
            capture_id: answer.capture_id.clone(),
        })
    }

    async fn solve(&self, capture_id: String, interrupt: &CancellationToken) -> Result<Event, Fault> {
        let request = SolveRequest {
            capture_id,
            cameras: Vec::new(),
        };
        let answer = self.ask(SOLVER, &self.solve, request, interrupt).await?;
        require(answer.success, &answer.message)?;
        Ok(Event::Solved {
            cameras: answer.cameras.clone(),
            message: answer.message.clone(),
        })
    }

    async fn vacuum(&self, on: bool, interrupt: &CancellationToken) -> Result<Event, Fault> {
        let answer = self
            .ask(ARM, &self.vacuum, SetBoolRequest { data: on }, interrupt)
            .await?;
        require(answer.success, &answer.message)?;
        Ok(Event::Done)
    }

    /// A call cannot be taken back, so a way home is interrupted by stopping the arm.
    async fn home(&self, interrupt: &CancellationToken) -> Result<Event, Fault> {
        self.require_ready().await?;
        let answer = self.ask(ARM, &self.home, TriggerRequest::default(), interrupt).await;
        match answer {
            Ok(answer) => require(answer.success, &answer.message).map(|()| Event::Done),
            Err(fault) => {
                // No answer comes while this node is being shut down.
                if self.stop.call(TriggerRequest::default(), QUICK).await.is_err() {
                    self.halt().await;
                }
                Err(fault)
            }
        }
    }

    async fn moves(&self, way: Move, interrupt: &CancellationToken) -> Result<Event, Fault> {
        let is_dry = way.dry.is_some();
        if !is_dry {
            self.require_ready().await?;
        }
        let outcome = self.move_tool(way, interrupt).await;
        // Nobody knows what an arm does whose node does not answer.
        if !is_dry && matches!(outcome, Err(Fault::Lost(_))) {
            self.halt().await;
        }
        outcome
    }

    async fn move_tool(&self, way: Move, interrupt: &CancellationToken) -> Result<Event, Fault> {
        let goal = self.begin(way, interrupt).await?;
        let result = tokio::select! {
            result = goal.result(PATIENCE) => result.map_err(fault)?.1,
            reason = self.presence.lost(ARM) => return Err(Fault::Lost(reason)),
            () = interrupt.cancelled() => self.cancel(&goal).await?,
        };
        require(result.success, &result.reason)?;
        Ok(Event::Moved {
            held: result.held,
            joints: result.joints.clone(),
            duration: result.duration.try_into().unwrap_or(Duration::MAX),
        })
    }

    /// A motion that is told to end before the arm has taken it is waited for all the same: the arm may be about to move,
    /// and nothing is at rest before it has said so.
    async fn begin(&self, way: Move, interrupt: &CancellationToken) -> Result<GoalHandle<MoveTool>, Fault> {
        let patience = self.parameters.interrupt_timeout();
        let unanswered = async {
            interrupt.cancelled().await;
            tokio::time::sleep(patience).await;
        };
        tokio::select! {
            goal = self.move_tool.send_goal(convert::goal(way), PATIENCE) => goal.map_err(fault),
            reason = self.presence.lost(ARM) => Err(Fault::Lost(reason)),
            () = unanswered => Err(Fault::Lost(format!("{ARM} did not say within {patience:?} whether it moves"))),
        }
    }

    async fn cancel(&self, goal: &GoalHandle<MoveTool>) -> Result<Arc<MoveToolResult>, Fault> {
        let patience = self.parameters.interrupt_timeout();
        if let Err(error) = goal.cancel(patience).await {
            // It may just have ended, which the result tells.
            tracing::debug!(%error, "a motion was not cancelled");
        }
        let (_, result) = goal.result(patience).await.map_err(fault)?;
        Ok(result)
    }

    async fn require_ready(&self) -> Result<(), Fault> {
        let ready = self.arm.ready(self.parameters.arm_state_timeout()).await;
        ready.map_err(Fault::Lost)
    }

    /// A call that ends early when its server is gone.
    async fn ask<S: Service>(
        &self,
        node: &'static str,
        client: &ServiceClient<S>,
        request: S::Request,
        interrupt: &CancellationToken,
    ) -> Result<Arc<S::Response>, Fault> {
        tokio::select! {
            answer = client.call(request, PATIENCE) => answer.map_err(fault),
            reason = self.presence.lost(node) => Err(Fault::Lost(reason)),
            () = interrupt.cancelled() => Err(interrupted()),
        }
    }
}

fn planned(answer: &PlanGraspResponse) -> Event {
    Event::Planned(Planned {
        grasps: answer.grasps.grasps.clone(),
        looked: !answer.grasps.capture_id.is_empty(),
        message: answer.message.clone(),
    })
}

fn require(success: bool, message: &str) -> Result<(), Fault> {
    if success {
        return Ok(());
    }
    Err(Fault::Refused(match message {
        "" => "refused without a reason".into(),
        message => message.into(),
    }))
}

fn interrupted() -> Fault {
    Fault::Refused("it was told to end".into())
}

fn fault(error: ros::Error) -> Fault {
    match error {
        ros::Error::GoalRejected { .. } => Fault::Refused(error.to_string()),
        other => Fault::Lost(other.to_string()),
    }
}
