//! Nodes that are killed, each in the middle of what it was asked for.

use interfaces::rakelight_msgs::action::PickCycleGoal;
use interfaces::rakelight_msgs::msg::CellState;
use ros::GoalStatus;

use crate::{BLOCK, assert_failed, assert_picks_again, assert_safe, cell, stage};

/// Freezes the node in stage `before`, so that it does not answer, and kills it in the stage that waits for it.
async fn kill(node: &'static str, text: &str, before: u8, during: u8) {
    let Some(mut cell) = cell(BLOCK).await else { return };
    let goal = cell.begin(PickCycleGoal::default()).await.unwrap();
    stage(&cell, before).await;
    if before != during {
        cell.freeze(node).unwrap();
        stage(&cell, during).await;
    }
    cell.kill(node).unwrap();
    let (status, result) = cell.end_of(&goal).await.unwrap();
    assert_eq!(status, GoalStatus::Aborted);
    assert_failed(&result, during, &[text]);
    let waits = |state: &CellState| state.waiting_for == [node] && state.stage == CellState::STARTING;
    cell.state("waiting for the node", waits).await.unwrap();
    cell.restart(node).unwrap();
    assert_safe(&cell).await;
    assert_picks_again(&cell).await;
    cell.stop().await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_lights_node_is_killed_in_a_capture() {
    kill("light_sequencer", "lights", CellState::CAPTURE, CellState::CAPTURE).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_cameras_node_is_killed_in_a_capture() {
    kill(
        "camera_capture",
        "camera_capture is gone",
        CellState::CAPTURE,
        CellState::CAPTURE,
    )
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_solver_is_killed_while_it_solves() {
    kill(
        "normal_solver",
        "normal_solver is gone",
        CellState::CAPTURE,
        CellState::SOLVE,
    )
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_planner_is_killed_while_it_plans() {
    kill(
        "grasp_planner",
        "grasp_planner is gone",
        CellState::SOLVE,
        CellState::PLAN,
    )
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_arms_node_is_killed_in_mid_motion() {
    kill(
        "trajectory_executor",
        "trajectory_executor is gone",
        CellState::EXECUTE,
        CellState::EXECUTE,
    )
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_coordinator_is_killed_in_mid_motion() {
    let Some(mut cell) = cell(BLOCK).await else { return };
    let _goal = cell.begin(PickCycleGoal::default()).await.unwrap();
    stage(&cell, CellState::EXECUTE).await;
    cell.kill("cell_coordinator").unwrap();
    assert_safe(&cell).await;
    cell.restart("cell_coordinator").unwrap();
    assert_picks_again(&cell).await;
    cell.stop().await.unwrap();
}
