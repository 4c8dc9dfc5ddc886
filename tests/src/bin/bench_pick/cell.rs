//! The cell that picks.

use std::time::Duration;

use anyhow::{Context, ensure};
use interfaces::rakelight_msgs::action::{PickCycle, PickCycleGoal, PickCycleResult};
use interfaces::rakelight_msgs::msg::CellState;
use interfaces::rcl_interfaces::msg::{Parameter, ParameterType, ParameterValue};
use interfaces::rcl_interfaces::srv::{SetParameters, SetParametersRequest};
use interfaces::std_srvs::srv::{SetBool, SetBoolRequest, Trigger, TriggerRequest};
use ros::{ActionClient, Node};
use scenarios::{Domain, NodeProcesses, Place, rakelight, repository};
use sim::cell::{Cell, CellOptions};
use sim::world::{Scatter, World};
use tempfile::TempDir;
use tokio::process::Command;

use crate::Arguments;

/// Longer than the cell's start.
const START: Duration = Duration::from_mins(2);
/// Longer than any cycle with all its attempts.
const CYCLE: Duration = Duration::from_mins(4);
/// Of both views.
const RENDERING: Duration = Duration::from_mins(2);
const CALL: Duration = Duration::from_secs(20);

/// Processes, as in `launch_configs/sim.yaml`.
const GROUPS: [&[&str]; 4] = [
    &["light_sequencer"],
    &["camera_capture", "normal_solver", "grasp_planner"],
    &["trajectory_executor"],
    &["cell_coordinator"],
];

pub(crate) struct PickCell {
    pub(crate) simulated: Cell,
    nodes: NodeProcesses,
    operator: Node,
    cycle: ActionClient<PickCycle>,
    _domain: Domain,
    _folder: TempDir,
}

impl PickCell {
    /// Simulated, with its nodes up and an empty table.
    pub(crate) async fn start(arguments: &Arguments) -> anyhow::Result<Self> {
        let folder = tempfile::tempdir()?;
        let place = Place::new(folder.path());
        let simulated = Cell::start(place.settle(world(arguments, arguments.seed)?), &CellOptions::default())?;
        simulated.wait_until_rendered(RENDERING)?;
        let (domain, config) = (Domain::claim(), place.config("sim.yaml")?);
        let mut nodes = NodeProcesses::default();
        for group in GROUPS {
            nodes.start(&domain, Command::new(rakelight()?), group, &config)?;
        }
        let operator = domain.node("operator").await;
        let cycle = operator.action_client::<PickCycle>("pick_cycle")?;
        cycle.wait_for_server(START).await?;
        let cell = Self {
            simulated,
            nodes,
            operator,
            cycle,
            _domain: domain,
            _folder: folder,
        };
        cell.wait_until_ready().await?;
        Ok(cell)
    }

    /// Once every node is found, a dry run gets as far as planning.
    async fn wait_until_ready(&self) -> anyhow::Result<()> {
        let dry = PickCycleGoal {
            dry_run: true,
            ..PickCycleGoal::default()
        };
        let deadline = tokio::time::Instant::now() + START;
        loop {
            let answer = self.pick(dry.clone()).await?;
            if answer.success || answer.failed_stage == CellState::PLAN {
                return Ok(());
            }
            ensure!(
                tokio::time::Instant::now() < deadline,
                "the cell is not ready after {START:?}: {}",
                answer.reason
            );
            tokio::time::sleep(Duration::from_millis(500)).await;
        }
    }

    pub(crate) async fn stop(self) -> anyhow::Result<()> {
        self.operator.shutdown().await;
        self.nodes.stop().await
    }

    /// One cycle to its end.
    pub(crate) async fn pick(&self, goal: PickCycleGoal) -> anyhow::Result<std::sync::Arc<PickCycleResult>> {
        let goal = self.cycle.send_goal(goal, CALL).await?;
        let (_, result) = goal.result(CYCLE).await?;
        Ok(result)
    }

    /// Out of whatever fault it is in, without what it holds, and home: nobody can be hurt by a simulated arm.
    pub(crate) async fn recover(&self) -> anyhow::Result<()> {
        self.call("recover").await?;
        let vacuum = self.operator.service_client::<SetBool>("vacuum/set")?;
        let answer = vacuum.call(SetBoolRequest { data: false }, CALL).await?;
        ensure!(answer.success, "the pump is not switched off: {}", answer.message);
        self.call("home").await
    }

    async fn call(&self, name: &str) -> anyhow::Result<()> {
        let client = self.operator.service_client::<Trigger>(name)?;
        let answer = client.call(TriggerRequest::default(), CALL).await?;
        ensure!(answer.success, "{name}: {}", answer.message);
        Ok(())
    }

    /// Other objects on the table; the arm and the devices stay.
    pub(crate) fn scatter(&self, arguments: &Arguments, seed: u64) -> anyhow::Result<()> {
        let mut scattered = world(arguments, seed)?;
        let now = self.simulated.world();
        scattered.lights.clone_from(&now.lights);
        scattered.cameras.clone_from(&now.cameras);
        scattered.arm.clone_from(&now.arm);
        self.simulated.set_world(scattered)?;
        self.simulated.wait_until_rendered(RENDERING)?;
        Ok(())
    }

    /// Most speed of the tool from now on, m/s.
    pub(crate) async fn set_tool_speed(&self, speed: f64) -> anyhow::Result<()> {
        let client = self
            .operator
            .service_client::<SetParameters>("trajectory_executor/set_parameters")?;
        let value = ParameterValue {
            type_: ParameterType::PARAMETER_DOUBLE,
            double_value: speed,
            ..ParameterValue::default()
        };
        let parameters = vec![Parameter {
            name: "tool_speed".into(),
            value,
        }];
        let answer = client.call(SetParametersRequest { parameters }, CALL).await?;
        let result = answer.results.first().context("no answer to a parameter")?;
        ensure!(result.successful, "tool_speed {speed}: {}", result.reason);
        Ok(())
    }
}

/// Clutter in place of the default world's objects.
fn world(arguments: &Arguments, seed: u64) -> anyhow::Result<World> {
    let mut world = World::read(&repository().join("launch_configs/worlds/table.yaml"))?;
    let scatter = Scatter {
        seed,
        count: arguments.objects,
        shapes: arguments.shapes.clone(),
        ..Scatter::default()
    };
    world.scene.bodies = scatter.bodies(&[])?;
    Ok(world)
}
