//! The whole cell that picks: simulated devices in this process, so that the truth is known and faults can be made, and
//! the real nodes in processes of their own, as `rakelight up` starts them.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, ensure};
use interfaces::rakelight_msgs::action::{PickCycle, PickCycleGoal, PickCycleResult};
use interfaces::rakelight_msgs::msg::CellState;
use interfaces::rcl_interfaces::msg::{Parameter, ParameterType, ParameterValue};
use interfaces::rcl_interfaces::srv::{SetParameters, SetParametersRequest};
use interfaces::std_srvs::srv::{SetBool, SetBoolRequest, Trigger, TriggerRequest};
use ros::{ActionClient, GoalHandle, GoalStatus, Node, Qos};
use sim::cell::{Cell, CellOptions};
use sim::world::World;
use tempfile::TempDir;
use tokio::process::Command;
use tokio::sync::watch;

use crate::{Domain, NodeProcesses, Place, repository};

/// Longer than the cell's start.
const START: Duration = Duration::from_mins(2);
/// Longer than any cycle with all its attempts.
const CYCLE: Duration = Duration::from_mins(4);
/// Of both views.
const RENDERING: Duration = Duration::from_mins(2);
const CALL: Duration = Duration::from_secs(20);

/// How the nodes are run.
#[derive(Debug, Clone)]
pub struct PickingOptions {
    /// The `rakelight` program.
    pub program: PathBuf,
    /// Nodes, by the process that they share.
    pub processes: Vec<Vec<&'static str>>,
    /// Parameters as `node:name:=value`, in place of those of `launch_configs/sim.yaml`.
    pub parameters: Vec<&'static str>,
}

/// A simulated cell and its nodes.
pub struct PickingCell {
    /// What the nodes see and move.
    pub simulated: Cell,
    /// Who asks.
    pub operator: Node,
    options: PickingOptions,
    config: PathBuf,
    /// By the first of the nodes in it.
    processes: BTreeMap<&'static str, NodeProcesses>,
    cycle: ActionClient<PickCycle>,
    states: watch::Receiver<Vec<Arc<CellState>>>,
    domain: Domain,
    _folder: TempDir,
}

impl PickingCell {
    /// A cell with these objects and lights that is ready to pick.
    ///
    /// # Errors
    ///
    /// When something does not start, or the cell does not become ready.
    pub async fn start(world: World, options: PickingOptions) -> anyhow::Result<Self> {
        let folder = tempfile::tempdir()?;
        let place = Place::new(folder.path());
        let simulated = Cell::start(place.settle(world), &CellOptions::default())?;
        simulated.wait_until_rendered(RENDERING)?;
        let (domain, config) = (Domain::claim(), place.config("sim.yaml")?);
        let operator = domain.node("operator").await;
        let cycle = operator.action_client::<PickCycle>("pick_cycle")?;
        let states = collect(&operator)?;
        let mut cell = Self {
            simulated,
            operator,
            options,
            config,
            processes: BTreeMap::new(),
            cycle,
            states,
            domain,
            _folder: folder,
        };
        for nodes in cell.options.processes.clone() {
            cell.start_process(&nodes)?;
        }
        cell.ready().await?;
        Ok(cell)
    }

    fn start_process(&mut self, nodes: &[&'static str]) -> anyhow::Result<()> {
        let name = *nodes.first().context("a process without nodes")?;
        let mut process = NodeProcesses::default();
        let command = Command::new(&self.options.program);
        process.start(&self.domain, command, nodes, &self.config, &self.options.parameters)?;
        self.processes.insert(name, process);
        Ok(())
    }

    /// Kills the process whose first node this is, without a chance to say goodbye.
    ///
    /// # Errors
    ///
    /// When there is none.
    pub fn kill(&mut self, node: &str) -> anyhow::Result<()> {
        self.processes.remove(node).map(drop).context("no such process")
    }

    /// Stops the process whose first node this is from doing anything, as a deadlock would.
    ///
    /// # Errors
    ///
    /// When there is none.
    pub fn freeze(&self, node: &str) -> anyhow::Result<()> {
        let processes = self.processes.get(node).context("no such process")?;
        processes.signal(rustix::process::Signal::STOP)
    }

    /// Starts a process again that was killed.
    ///
    /// # Errors
    ///
    /// When it cannot be started.
    pub fn restart(&mut self, node: &'static str) -> anyhow::Result<()> {
        let mut groups = self.options.processes.iter();
        let nodes = groups.find(|nodes| nodes.first() == Some(&node)).cloned();
        self.start_process(&nodes.context("no such process")?)
    }

    /// Waits until the cell would take a pick.
    ///
    /// # Errors
    ///
    /// When it does not become so within two minutes.
    pub async fn ready(&self) -> anyhow::Result<Arc<CellState>> {
        self.state("ready", |state| {
            state.stage == CellState::IDLE && state.waiting_for.is_empty()
        })
        .await
    }

    /// Waits for a state of the cell; its present one counts.
    ///
    /// # Errors
    ///
    /// When there is none within two minutes; it says which one there was.
    pub async fn state(&self, what: &str, wanted: impl Fn(&CellState) -> bool) -> anyhow::Result<Arc<CellState>> {
        let mut states = self.states.clone();
        let first = states.borrow().len().saturating_sub(1);
        let find = |all: &Vec<Arc<CellState>>| all.iter().skip(first).find(|state| wanted(state)).cloned();
        let found = tokio::time::timeout(START, states.wait_for(|all| find(all).is_some())).await;
        let all = self.states.borrow();
        match found {
            Ok(_) => find(&all).context("the operator's node has ended"),
            Err(_) => anyhow::bail!("waited {START:?} for the cell to be {what}; it is {:?}", all.last()),
        }
    }

    /// A cycle that has begun.
    ///
    /// # Errors
    ///
    /// When it is refused.
    pub async fn begin(&self, goal: PickCycleGoal) -> anyhow::Result<GoalHandle<PickCycle>> {
        self.cycle.wait_for_server(START).await?;
        Ok(self.cycle.send_goal(goal, CALL).await?)
    }

    /// How a cycle ended.
    ///
    /// # Errors
    ///
    /// When it does not end.
    pub async fn end_of(&self, goal: &GoalHandle<PickCycle>) -> anyhow::Result<(GoalStatus, Arc<PickCycleResult>)> {
        Ok(goal.result(CYCLE).await?)
    }

    /// One cycle to its end.
    ///
    /// # Errors
    ///
    /// When it is refused or does not end.
    pub async fn pick(&self, goal: PickCycleGoal) -> anyhow::Result<Arc<PickCycleResult>> {
        let goal = self.begin(goal).await?;
        Ok(self.end_of(&goal).await?.1)
    }

    /// Out of whatever fault it is in, without what it holds, and home: nobody can be hurt by a simulated arm.
    ///
    /// # Errors
    ///
    /// When a node refuses.
    pub async fn recover(&self) -> anyhow::Result<()> {
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

    /// Another world around the same devices: its objects and its lights' wires; waits until it is rendered.
    ///
    /// # Errors
    ///
    /// When it cannot be.
    pub fn set_world(&self, mut world: World) -> anyhow::Result<()> {
        let now = self.simulated.world();
        world.lights.port.clone_from(&now.lights.port);
        world.cameras.clone_from(&now.cameras);
        world.arm.clone_from(&now.arm);
        self.simulated.set_world(world)?;
        self.simulated.wait_until_rendered(RENDERING)?;
        Ok(())
    }

    /// Sets a parameter of a node.
    ///
    /// # Errors
    ///
    /// When the node refuses it.
    pub async fn set_parameter(&self, node: &str, name: &str, value: f64) -> anyhow::Result<()> {
        let service = format!("{node}/set_parameters");
        let client = self.operator.service_client::<SetParameters>(&service)?;
        let typed = ParameterValue {
            type_: ParameterType::PARAMETER_DOUBLE,
            double_value: value,
            ..ParameterValue::default()
        };
        let parameters = vec![Parameter {
            name: name.to_owned(),
            value: typed,
        }];
        let answer = client.call(SetParametersRequest { parameters }, CALL).await?;
        let result = answer.results.first().context("no answer to a parameter")?;
        ensure!(result.successful, "{name} {value}: {}", result.reason);
        Ok(())
    }

    /// Ends all nodes.
    ///
    /// # Errors
    ///
    /// When one does not end well.
    pub async fn stop(self) -> anyhow::Result<()> {
        self.operator.shutdown().await;
        for (_, process) in self.processes {
            process.stop().await?;
        }
        Ok(())
    }
}

/// All states of the cell from now on, the newest last.
fn collect(operator: &Node) -> anyhow::Result<watch::Receiver<Vec<Arc<CellState>>>> {
    let mut states = operator.subscription::<CellState>("state", Qos::LATCHED)?;
    let (all, seen) = watch::channel(Vec::new());
    tokio::spawn(async move {
        while let Some(state) = states.next().await {
            all.send_modify(|all| all.push(state.message));
        }
    });
    Ok(seen)
}

/// The table of the default world, with other objects on it (YAML of a world file).
///
/// # Errors
///
/// When it is none.
pub fn table_with(yaml: &str) -> anyhow::Result<World> {
    let folder = repository().join("launch_configs/worlds");
    let mut world = World::read(&folder.join("table.yaml"))?;
    let other = World::from_yaml(yaml, &folder)?;
    world.scene.bodies = other.scene.bodies;
    world.lights.wiring = other.lights.wiring;
    Ok(world)
}
