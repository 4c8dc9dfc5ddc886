//! Nodes that are killed, each in the middle of what it was asked for. DDS itself misses them only much later.

use std::time::{Duration, Instant};

use interfaces::rakelight_msgs::msg::CellState;
use ros::GoalStatus;
use scenarios::stand_ins::{NODES, StandIn};
use scenarios::{Program, TIMEOUT};

use crate::cell::Cell;

/// The node's time-out is 2 s; the rest is for a busy machine.
const NOTICED_WITHIN: Duration = Duration::from_secs(8);

/// Kills `node` while it is busy with `what`, and looks what the cell says and does.
async fn kill(node: &'static str, what: &str, stage: u8) {
    let others: Vec<&'static str> = NODES.into_iter().filter(|name| *name != node).collect();
    let mut cell = Cell::start_with(&[0.42], &others, |options| options).await;
    let path = env!("CARGO_BIN_EXE_cell_stand_in");
    let mut program = Program::start(&cell.domain, path, &[node, "--hang", what]);
    program.wait_for_line("ready");
    cell.stage(CellState::IDLE).await;
    let goal = cell.begin().await;
    program.wait_for_line(&format!("asked {what}"));
    let killed = Instant::now();
    drop(program);
    let (status, result) = goal.result(TIMEOUT).await.unwrap();
    assert!(killed.elapsed() < NOTICED_WITHIN, "{:?}", killed.elapsed());
    assert_eq!(
        (status, result.failed_stage),
        (GoalStatus::Aborted, stage),
        "{}",
        result.reason
    );
    let text = format!("{node} is gone: it has not answered for 2.0 s");
    assert!(result.reason.contains(&text), "{}", result.reason);
    let state = cell.state("the loss", |state| state.waiting_for == [node]).await;
    assert_eq!(state.stage, CellState::STARTING);
    cell.assert_safe();
    let refused = cell.pick().await;
    assert!(
        !refused.success && refused.message.contains(node),
        "{}",
        refused.message
    );

    let stand_in = StandIn::start(&cell.domain, node, &cell.world).await;
    cell.stand_ins.insert(node, stand_in);
    cell.picks_again().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_cameras_node_is_killed_in_a_capture() {
    kill("camera_capture", "capture", CellState::CAPTURE).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_solver_is_killed_while_it_solves() {
    kill("normal_solver", "solve", CellState::SOLVE).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_planner_is_killed_while_it_plans() {
    kill("grasp_planner", "plan_grasp", CellState::PLAN).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_arms_node_is_killed_in_a_dry_run() {
    kill("trajectory_executor", "dry lift", CellState::PLAN).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_arms_node_is_killed_in_mid_motion() {
    kill("trajectory_executor", "approach", CellState::EXECUTE).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_that_leaves_in_good_order_is_missed_as_well() {
    let mut cell = Cell::start(&[0.42]).await;
    cell.world.reply("solve", scenarios::stand_ins::Reply::Hang);
    let goal = cell.begin().await;
    cell.asked("solve", 1).await;
    cell.stand_ins.remove("normal_solver").unwrap().leave().await;
    let (status, result) = goal.result(TIMEOUT).await.unwrap();
    assert_eq!((status, result.failed_stage), (GoalStatus::Aborted, CellState::SOLVE));
    assert!(result.reason.contains("normal_solver is gone"), "{}", result.reason);
    let stand_in = StandIn::start(&cell.domain, "normal_solver", &cell.world).await;
    cell.stand_ins.insert("normal_solver", stand_in);
    cell.picks_again().await;
}
