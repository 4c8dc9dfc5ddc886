//! What goes wrong, and how the arm gets out of it.

use std::time::{Duration, Instant};

use interfaces::rakelight_msgs::msg::ArmState;
use ros::GoalStatus;
use scenarios::{TIMEOUT, eventually};
use sim::arm::{ArmConfig, EmergencyStop};
use xarm_protocol::{Mode, Request};

use crate::scene::{HOME, Scene, far};

#[tokio::test(flavor = "multi_thread")]
async fn a_collision_in_mid_motion_ends_it_and_recover_brings_the_arm_back() {
    let mut scene = Scene::ready(ArmConfig::default()).await;
    let goal = scene.move_tool.send_goal(far(), TIMEOUT).await.unwrap();
    scene.moving().await;
    scene.controller.raise_error(31);
    let (status, result) = goal.result(TIMEOUT).await.unwrap();
    assert_eq!(status, GoalStatus::Aborted);
    assert!(result.reason.contains("did not go to its end"), "{}", result.reason);
    let state = scene.state("the fault", |state| state.mode == ArmState::FAULT).await;
    assert_eq!(state.error_code, 31);
    assert!(state.fault.contains("collision"), "{}", state.fault);

    let refused = scene.home().await;
    assert!(!refused.success);
    let answer = scene.recover().await;
    assert!(answer.success, "{}", answer.message);
    assert!(scene.home().await.success);
    scene.assert_at(&HOME, "home");
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_emergency_stop_needs_a_person() {
    let mut scene = Scene::ready(ArmConfig::default()).await;
    let goal = scene.move_tool.send_goal(far(), TIMEOUT).await.unwrap();
    scene.moving().await;
    scene.controller.press(EmergencyStop::Button);
    assert_eq!(goal.result(TIMEOUT).await.unwrap().0, GoalStatus::Aborted);
    scene.state("the fault", |state| state.error_code == 1).await;
    let refused = scene.recover().await;
    assert!(!refused.success);
    assert!(refused.message.contains("emergency stop button"), "{}", refused.message);
    scene.controller.release();
    let answer = scene.recover().await;
    assert!(answer.success, "{}", answer.message);
    scene
        .state("the arm to be ready", |state| state.mode == ArmState::READY)
        .await;
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_controller_that_dies_in_mid_motion_is_found_again() {
    let mut scene = Scene::ready(ArmConfig::default()).await;
    let goal = scene.move_tool.send_goal(far(), TIMEOUT).await.unwrap();
    scene.moving().await;
    scene.controller.switch_off();
    assert_eq!(goal.result(TIMEOUT).await.unwrap().0, GoalStatus::Aborted);
    scene
        .state("the loss", |state| state.mode == ArmState::DISCONNECTED)
        .await;
    scene.controller.switch_on().unwrap();
    let returned = Instant::now();
    scene
        .state("its return", |state| state.mode != ArmState::DISCONNECTED)
        .await;
    assert!(returned.elapsed() < Duration::from_secs(10), "{:?}", returned.elapsed());
    let answer = scene.recover().await;
    assert!(answer.success, "{}", answer.message);
    assert!(scene.home().await.success);
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_short_pause_of_the_network_changes_nothing() {
    let scene = Scene::ready(ArmConfig::default()).await;
    let goal = scene.move_tool.send_goal(far(), TIMEOUT).await.unwrap();
    scene.moving().await;
    scene.controller.pause_network(Duration::from_millis(15));
    let (status, result) = goal.result(TIMEOUT).await.unwrap();
    assert_eq!((status, result.reason.as_str()), (GoalStatus::Succeeded, ""));
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_long_pause_of_the_network_stops_the_arm() {
    let mut scene = Scene::start_with(ArmConfig::default(), &[("state_timeout", 0.2)]).await;
    assert!(scene.recover().await.success);
    let goal = scene.move_tool.send_goal(far(), TIMEOUT).await.unwrap();
    scene.moving().await;
    scene.controller.pause_network(Duration::from_millis(500));
    let (status, result) = goal.result(TIMEOUT).await.unwrap();
    assert_eq!(status, GoalStatus::Aborted, "{}", result.reason);
    assert!(result.reason.contains("did not go to its end"), "{}", result.reason);
    scene
        .state("a named state", |state| {
            matches!(state.mode, ArmState::STOPPED | ArmState::DISCONNECTED) && !state.fault.is_empty()
        })
        .await;
    eventually("the arm to rest", || {
        scene
            .controller
            .moment()
            .velocities
            .iter()
            .all(|speed| speed.abs() < 1e-6)
    })
    .await;
    scene.state("its return", |state| state.mode == ArmState::STOPPED).await;
    let answer = scene.recover().await;
    assert!(answer.success, "{}", answer.message);
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn another_client_that_takes_the_mode_ends_the_motion() {
    let mut scene = Scene::ready(ArmConfig::default()).await;
    let goal = scene.move_tool.send_goal(far(), TIMEOUT).await.unwrap();
    scene.moving().await;
    scene.controller.request(&Request::SetMode(Mode::Position));
    assert_eq!(goal.result(TIMEOUT).await.unwrap().0, GoalStatus::Aborted);
    scene
        .state("a named state", |state| state.mode == ArmState::STOPPED)
        .await;
    let answer = scene.recover().await;
    assert!(answer.success, "{}", answer.message);
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_report_of_odd_length_is_survived() {
    let mut scene = Scene::ready(ArmConfig::default()).await;
    scene.controller.send_odd_report();
    let answer = scene.home().await;
    if !answer.success {
        // The reports were just being reconnected.
        scene
            .state("the reports", |state| state.mode != ArmState::DISCONNECTED)
            .await;
        assert!(scene.recover().await.success, "{}", answer.message);
    }
    scene.end().await;
}
