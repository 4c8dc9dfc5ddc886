//! The node of the arm: it executes trajectories, stops when told, and never moves on unchecked data.
//!
//! `home` and the actions `move_tool` and `follow_joint_trajectory` move the arm; `stop` decelerates it from the next
//! period on and keeps it stopped until `recover`, which brings it from any fault back to ready or says what a person has
//! to do. `joint_states` comes 100 times a second, `arm/state` on every change, frames on TF.
//!
//! Nothing moves unless the arm is armed, its state is fresh, and the whole trajectory was checked: that it begins where
//! the arm stands, keeps the limits of the joints and of the tool's speed, and touches nothing. Set-points leave from a
//! thread of their own ([`servo`]).
//!
//! `move_tool` knows the motions of a pick. With `contact` the cup's lip (link `vacuum_cup`, 12 mm) may touch and press
//! within 30 mm of the ends of a straight way, `press_depth` deep; all else keeps `collision_margin`. With `until_held` the
//! motion ends, and the arm stays ready, as soon as the cup holds something; where the way ends it waits `hold_settle` for
//! that. A carried cylinder is checked like the arm, and may leave what it stands on. Dry runs chained by `start_joints`
//! check a whole pick before anything moves. Where the direct motion of the joints touches something, ways around it are
//! tried: up, across, and down.
//!
//! A pump that holds nothing while the arm rests is switched off after `vacuum_timeout`: whoever wanted it may be gone.
//!
//! It is *not* the driver (`xarm_tcp`), and it is no safety function: the emergency stop and the controller's own limits
//! are.

mod convert;
mod diagnostics;
mod error;
mod executor;
mod follow;
mod goals;
mod handling;
mod held;
mod idle_pump;
mod model;
mod move_tool;
mod parameters;
mod path;
mod publish;
mod request;
mod route;
mod services;
pub mod servo;

pub use error::{Error, MotionError};
pub use path::TrajectoryPath;

use std::sync::Arc;
use std::time::Duration;

use devices::ArmCondition;
use ros::Node;
use tokio::task::JoinSet;
use tracing::Instrument;
use xarm_tcp::{VacuumHardware, XArm, XArmConfig};

use executor::{Dimensions, Executor};
use follow::Follow;
use model::{Model, ModelConfig};
use move_tool::MoveTool;
use parameters::Parameters;
use publish::Publishers;
use services::{Desk, Services};
use servo::{Servo, ServoConfig};

/// Name of the node in launch configs.
pub const NAME: &str = "trajectory_executor";

/// How long an arm that is armed at the start may take to answer.
const FIRST_CONTACT: Duration = Duration::from_secs(30);

/// Serves the arm until the node is shut down; the arm is then held by its own controller.
pub async fn run(node: Node) -> Result<(), Error> {
    let parameters = Arc::new(Parameters::declare(&node)?);
    let arm = Arc::new(XArm::open(driver_config(&parameters)));
    let executor = Arc::new(executor(&parameters, &arm)?);
    let desk = Arc::new(Desk {
        executor: Arc::clone(&executor),
        suction: Arc::<XArm>::clone(&arm),
        parameters: Arc::clone(&parameters),
    });
    let mut tasks = JoinSet::new();
    tasks.spawn(Arc::clone(&executor).attend_servo().in_current_span());
    tasks.spawn(Arc::clone(&executor).attend_arm().in_current_span());
    Publishers::new(&node, &parameters, Arc::clone(&executor), Arc::<XArm>::clone(&arm))?.spawn_into(&mut tasks);
    Services::new(&node, Arc::clone(&desk))?.spawn_into(&mut tasks);
    tasks.spawn(MoveTool::new(&node, Arc::clone(&desk))?.serve().in_current_span());
    tasks.spawn(Follow::new(&node, Arc::clone(&desk))?.serve().in_current_span());
    tasks.spawn(idle_pump::attend(Arc::clone(&desk)).in_current_span());
    if parameters.arm_at_start {
        tasks.spawn(arm_when_there(Arc::clone(&desk)).in_current_span());
    }
    diagnostics::register(node.diagnostics(), &parameters.host, &executor);
    if let Some(complaint) = executor.realtime_complaint() {
        tracing::warn!(complaint, "the servo loop may be late");
    }
    tracing::info!(host = parameters.host, "ready");
    node.stop_token().cancelled().await;
    for part in diagnostics::PARTS {
        node.diagnostics().unregister(part);
    }
    close(tasks, executor, desk, arm).await;
    Ok(())
}

fn driver_config(parameters: &Parameters) -> XArmConfig {
    XArmConfig {
        control_port: parameters.control_port,
        real_time_report_port: parameters.real_time_port,
        rich_report_port: parameters.rich_port,
        vacuum: match parameters.vacuum_hardware {
            2 => VacuumHardware::Contacts,
            _ => VacuumHardware::Cable,
        },
        ..XArmConfig::new(&parameters.host)
    }
}

fn executor(parameters: &Parameters, arm: &Arc<XArm>) -> Result<Executor, Error> {
    let home = parameters.home()?;
    let model = Model::new(ModelConfig::read(parameters)?, &home)?;
    let config = model.servo(&home).map_err(|error| Error::Value {
        name: "home",
        reason: error.to_string(),
    })?;
    let config = ServoConfig {
        watchdog: Duration::from_secs_f64(parameters.watchdog),
        priority: parameters.priority,
        ..config
    };
    Ok(Executor::new(
        Arc::<XArm>::clone(arm),
        Dimensions {
            arm: Arc::clone(arm),
            is_wanted: parameters.calibrated_kinematics,
        },
        model,
        Servo::start(config)?,
        Duration::from_secs_f64(parameters.state_timeout),
    ))
}

/// What `recover` does, once the arm has answered; an arm that needs a person is left as it is.
async fn arm_when_there(desk: Arc<Desk>) {
    let mut state = desk.executor.arm_state();
    let is_known = |condition: &ArmCondition| *condition != ArmCondition::Unknown;
    let there = state.wait_for(|state| state.joints.is_some() && is_known(&state.condition));
    match tokio::time::timeout(FIRST_CONTACT, there).await {
        Ok(Ok(_)) => {}
        Ok(Err(_)) => return,
        Err(_) => {
            tracing::warn!("the arm is not armed: it has not answered for {FIRST_CONTACT:?}; `recover` arms it");
            return;
        }
    }
    let state = desk.executor.arm_state().borrow().condition.clone();
    if let ArmCondition::Fault(fault) = state {
        tracing::warn!(
            code = fault.code,
            fault.description,
            "the arm is not armed: it has a fault; `recover` clears it"
        );
        return;
    }
    match desk.recover(false).await {
        Ok(message) => tracing::info!("{message}"),
        Err(error) => tracing::warn!(%error, "the arm is not armed; `recover` arms it"),
    }
}

/// A motion is decelerated first; then the stream ends.
async fn close(mut tasks: JoinSet<()>, executor: Arc<Executor>, desk: Arc<Desk>, arm: Arc<XArm>) {
    let is_moving = executor.standing().borrow().is_moving();
    if is_moving && let Err(error) = executor.stop("the node is being shut down").await {
        tracing::warn!(%error, "the arm was not stopped at the end");
    }
    tasks.shutdown().await;
    drop((desk, executor));
    // Somebody may still be looking at it; the connections are closed with the last handle.
    if let Some(arm) = Arc::into_inner(arm) {
        arm.close().await;
    }
}
