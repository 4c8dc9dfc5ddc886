//! What goes wrong while the whole cell picks: real nodes in processes of their own, simulated devices. After each fault
//! the cell is safe, says what happened, and picks again without a restart.

mod devices;
mod nodes;
mod objects;

use interfaces::rakelight_msgs::action::{PickCycleGoal, PickCycleResult};
use interfaces::rakelight_msgs::msg::{ArmState, CellState};
use ros::Qos;
use scenarios::{PickingCell, PickingOptions, TIMEOUT, table_with, within};
use sim::cell::Place;

/// It can be picked by one view alone, too.
const BLOCK: &str = "{shape: {kind: box, size: [0.05, 0.04, 0.025]}, pose: {x: 0.45, y: 0.02, yaw: 0.4}, albedo: 0.7}";

/// Machines that run tests are not punctual.
const SETTINGS: [&str; 7] = [
    "camera_capture:frame_timeout:=5.0",
    "trajectory_executor:tool_speed:=0.8",
    "trajectory_executor:watchdog:=0.4",
    "trajectory_executor:state_timeout:=0.8",
    "trajectory_executor:vacuum_timeout:=2.0",
    "cell_coordinator:node_timeout:=4.0",
    "cell_coordinator:arm_state_timeout:=3.0",
];

/// Each node on its own, so that it dies alone.
const NODES: [&str; 6] = [
    "light_sequencer",
    "camera_capture",
    "normal_solver",
    "grasp_planner",
    "trajectory_executor",
    "cell_coordinator",
];

fn objects(list: &str) -> String {
    format!("objects: [{list}]")
}

/// A cell with these objects (YAML) that is ready to pick; `None`, said loudly, without a simulated light controller.
async fn cell(list: &str) -> Option<PickingCell> {
    let options = PickingOptions {
        program: env!("CARGO_BIN_EXE_rakelight").into(),
        processes: NODES.map(|node| vec![node]).to_vec(),
        parameters: SETTINGS.to_vec(),
    };
    match PickingCell::start(table_with(&objects(list)).unwrap(), options).await {
        Ok(cell) => Some(cell),
        Err(error) if format!("{error:#}").contains("was not built") => {
            eprintln!("SKIPPED: no simulated light controller (cargo xtask setup)");
            None
        }
        Err(error) => panic!("{error:#}"),
    }
}

fn solid() -> PickCycleGoal {
    PickCycleGoal {
        mode: PickCycleGoal::SOLID,
        ..PickCycleGoal::default()
    }
}

/// A cycle to its end.
async fn pick(cell: &PickingCell) -> PickCycleResult {
    let result = cell.pick(PickCycleGoal::default()).await.unwrap();
    eprintln!("picked: {} ({})", result.success, result.reason);
    PickCycleResult::clone(&result)
}

/// Where each object is.
fn places(cell: &PickingCell) -> Vec<Place> {
    cell.simulated
        .objects()
        .into_iter()
        .map(|object| object.place)
        .collect()
}

/// That a result has failed in this stage, and its reason says all of this.
fn assert_failed(result: &PickCycleResult, stage: u8, texts: &[&str]) {
    let reason = &result.reason;
    assert!(!result.success && result.failed_stage == stage, "{result:?}");
    for text in texts {
        assert!(reason.contains(text), "{text:?} is not in {reason:?}");
    }
}

/// The arm comes to rest, and the pump is off or holds something.
async fn assert_safe(cell: &PickingCell) {
    let mut states = cell
        .operator
        .subscription::<ArmState>("arm/state", Qos::STREAM)
        .unwrap();
    within("the arm to rest without a pump in vain", async {
        loop {
            let state = states.next().await.expect("the node runs").message;
            let moves = [ArmState::MOVING, ArmState::STOPPING].contains(&state.mode);
            if !moves && state.vacuum != ArmState::VACUUM_ON {
                return;
            }
        }
    })
    .await;
    assert!(
        cell.simulated.collisions().is_empty(),
        "{:?}",
        cell.simulated.collisions()
    );
}

/// Once everything is in order again, a pick puts a new object into the bin.
async fn assert_picks_again(cell: &PickingCell) {
    cell.set_world(table_with(&objects(BLOCK)).unwrap()).unwrap();
    cell.ready().await.unwrap();
    let result = pick(cell).await;
    assert!(result.success, "{}", result.reason);
    assert_eq!(places(cell), [Place::InBin]);
    assert_safe(cell).await;
}

/// Waits for a stage of a cycle that has begun.
async fn stage(cell: &PickingCell, stage: u8) {
    let state = cell.state("in the stage", |state| state.stage == stage);
    tokio::time::timeout(TIMEOUT, state).await.expect("in time").unwrap();
}

/// That the cell says so of its last failure.
async fn assert_last_error(cell: &PickingCell, reason: &str) {
    let state = cell.state("sorry", |state| {
        state.last_error == reason && state.stage == CellState::IDLE
    });
    state.await.unwrap();
}
