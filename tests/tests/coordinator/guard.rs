//! When there is no cycle at all.

use interfaces::rakelight_msgs::action::PickCycleGoal;
use interfaces::rakelight_msgs::msg::{ArmState, CellState};
use ros::{GoalStatus, Node};
use scenarios::stand_ins::{Reply, StandIn};
use scenarios::{Domain, TIMEOUT, eventually, within};

use crate::cell::Cell;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_second_pick_is_refused_at_once_with_what_runs() {
    let cell = Cell::start(&[0.42]).await;
    cell.world.reply("solve", Reply::Hang);
    let first = cell.begin().await;
    cell.asked("solve", 1).await;
    let answer = cell.pick().await;
    let expected =
        "the cell is busy: a cycle that was asked for by the action `pick_cycle` runs (stage solve: solving)";
    assert_eq!((answer.success, answer.message.as_str()), (false, expected));
    let (status, result) = cell.cycle(PickCycleGoal::default()).await;
    assert_eq!(
        (status, result.reason.as_str(), result.failed_stage),
        (GoalStatus::Aborted, expected, 0)
    );
    first.cancel(TIMEOUT).await.unwrap();
    assert_eq!(first.result(TIMEOUT).await.unwrap().0, GoalStatus::Canceled);
    cell.picks_again().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nodes_that_are_missing_are_named_until_they_are_there() {
    let there = ["light_sequencer", "camera_capture", "trajectory_executor"];
    let mut cell = Cell::start_with(&[0.42], &there, |options| options).await;
    let missing = ["normal_solver", "grasp_planner"];
    let state = cell
        .state("those that are missing", |state| state.waiting_for == missing)
        .await;
    assert_eq!(state.stage, CellState::STARTING);
    let answer = cell.pick().await;
    let expected = "the cell is not ready: waiting for normal_solver, grasp_planner";
    assert_eq!((answer.success, answer.message.as_str()), (false, expected));
    for name in missing {
        let stand_in = StandIn::start(&cell.domain, name, &cell.world).await;
        cell.stand_ins.insert(name, stand_in);
    }
    let state = cell.stage(CellState::IDLE).await;
    assert!(state.waiting_for.is_empty());
    cell.picks_again().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_arm_that_is_not_ready_is_not_asked_to_move() {
    let mut cell = Cell::start(&[0.42]).await;
    for (mode, stage, text) in [
        (ArmState::DISABLED, CellState::STOPPED, "the arm is not armed"),
        (ArmState::FAULT, CellState::FAULT, "the arm has a fault: it hurts"),
        (ArmState::DISCONNECTED, CellState::FAULT, "controller does not answer"),
    ] {
        cell.world.change(|world| {
            world.mode = mode;
            world.fault = "it hurts".into();
        });
        cell.stage(stage).await;
        let answer = cell.pick().await;
        assert!(!answer.success && answer.message.contains(text), "{}", answer.message);
        cell.recover().await;
        cell.stage(CellState::IDLE).await;
    }
    assert!(cell.world.look().motions.is_empty() && cell.world.look().count("capture") == 0);
    cell.picks_again().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_arm_that_stands_elsewhere_goes_home_before_the_capture() {
    let cell = Cell::start(&[0.42]).await;
    cell.world.change(|world| world.joints = [0.3; 7]);
    let dry = PickCycleGoal {
        dry_run: true,
        ..PickCycleGoal::default()
    };
    let (status, result) = cell.cycle(dry).await;
    assert!(
        status == GoalStatus::Aborted && result.reason.contains("the arm is not at home"),
        "{}",
        result.reason
    );
    assert_eq!(cell.world.look().count("home"), 0);
    assert!(cell.pick().await.success);
    assert_eq!(
        cell.world
            .look()
            .asked
            .iter()
            .find(|what| !what.starts_with("dry"))
            .map(String::as_str),
        Some("home")
    );
    cell.picks_again().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_mode_that_does_not_exist_is_refused() {
    let cell = Cell::start(&[0.42]).await;
    let goal = PickCycleGoal {
        mode: 9,
        ..PickCycleGoal::default()
    };
    let (status, result) = cell.cycle(goal).await;
    assert_eq!(status, GoalStatus::Aborted);
    assert_eq!(result.reason, "mode is 9, allowed: 0 (SOLID) and 1 (THIN)");
    assert!(cell.world.look().asked.is_empty());
    cell.picks_again().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_coordinator_that_is_shut_down_in_mid_motion_stops_the_arm() {
    let mut cell = Cell::start(&[0.42]).await;
    cell.world.reply("pregrasp", Reply::Hang);
    let _goal = cell.begin().await;
    cell.asked("pregrasp", 1).await;
    cell.shut_down_coordinator().await;
    eventually("the arm to be stopped", || {
        let world = cell.world.look();
        world.moving == 0 && world.mode == ArmState::STOPPED
    })
    .await;
    cell.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn parameters_that_cannot_be_are_refused_at_the_start() {
    let domain = Domain::claim();
    let start = async |name: &str, value: ros::ParameterValue| {
        let options = domain.options(cell_coordinator::NAME).parameter(name, value);
        let node = Node::start(options).await.unwrap();
        let error = within("the refusal", cell_coordinator::run(node.clone()))
            .await
            .unwrap_err()
            .to_string();
        node.shutdown().await;
        error
    };
    let error = start("bin.position", vec![0.1, 0.2].into()).await;
    assert_eq!(error, "parameter bin.position: [0.1, 0.2], allowed: three numbers");
    let error = start("cameras", Vec::<String>::new().into()).await;
    assert_eq!(error, "parameter cameras: no camera, allowed: at least 1");
    let error = start("record", "failures".to_owned().into()).await;
    assert!(
        error.contains("record") && error.contains("none") && error.contains("all"),
        "{error}"
    );
}
