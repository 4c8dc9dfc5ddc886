//! `stop` and cancel in mid-motion.

use std::time::Duration;

use interfaces::rakelight_msgs::msg::ArmState;
use ros::GoalStatus;
use scenarios::TIMEOUT;
use sim::arm::{ArmConfig, ServoPoint};

use crate::scene::{HOME, MEANWHILE, Scene, far};

/// A stop from the speed of these motions takes no longer, with the jerk that is allowed.
const STOPS_WITHIN: Duration = Duration::from_millis(800);

#[tokio::test(flavor = "multi_thread")]
async fn a_stop_decelerates_at_once_and_stays_until_somebody_recovers() {
    let mut scene = Scene::ready(ArmConfig::default()).await;
    let goal = scene.move_tool.send_goal(far(), TIMEOUT).await.unwrap();
    scene.moving().await;
    scene.controller.take_servo_trace();
    let answer = scene.stop().await;
    assert!(answer.success, "{}", answer.message);
    let (status, result) = goal.result(TIMEOUT).await.unwrap();
    assert_eq!(
        (status, result.reason.as_str()),
        (
            GoalStatus::Aborted,
            "the motion did not go to its end: stopped by request"
        )
    );
    let trace = scene.controller.take_servo_trace();
    assert!(at_rest_after(&trace) < STOPS_WITHIN, "{:?}", at_rest_after(&trace));
    scene.state("the stop", |state| state.mode == ArmState::STOPPED).await;
    let at = scene.angles();

    let refused = scene.home().await;
    assert!(
        refused.message.contains("it was stopped (by the service `stop`)"),
        "{}",
        refused.message
    );
    tokio::time::sleep(MEANWHILE).await;
    scene.assert_at(&at, "a stopped arm holds");

    assert!(scene.recover().await.success);
    let answer = scene.home().await;
    assert!(answer.success, "{}", answer.message);
    scene.assert_at(&HOME, "home");
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cancelled_motion_comes_to_rest_and_the_arm_stays_ready() {
    let mut scene = Scene::ready(ArmConfig::default()).await;
    let goal = scene.move_tool.send_goal(far(), TIMEOUT).await.unwrap();
    scene.moving().await;
    goal.cancel(TIMEOUT).await.unwrap();
    let (status, _) = goal.result(TIMEOUT).await.unwrap();
    assert_eq!(status, GoalStatus::Canceled);
    scene
        .state("the arm to be ready", |state| state.mode == ArmState::READY)
        .await;
    let answer = scene.home().await;
    assert!(answer.success, "{}", answer.message);
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_second_motion_is_refused_while_one_runs() {
    let scene = Scene::ready(ArmConfig::default()).await;
    let goal = scene.move_tool.send_goal(far(), TIMEOUT).await.unwrap();
    scene.moving().await;
    let answer = scene.home().await;
    assert!(!answer.success);
    assert_eq!(answer.message, "the arm is busy with another motion");
    assert!(scene.stop().await.success);
    goal.result(TIMEOUT).await.unwrap();
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_node_that_is_shut_down_stops_the_arm() {
    let scene = Scene::ready(ArmConfig::default()).await;
    let _goal = scene.move_tool.send_goal(far(), TIMEOUT).await.unwrap();
    scene.moving().await;
    scene
        .end_and(|controller| {
            let speed = controller
                .moment()
                .velocities
                .iter()
                .map(|speed| speed.abs())
                .fold(0.0, f64::max);
            assert!(speed < 1e-3, "{speed} rad/s after the node has ended");
        })
        .await;
}

/// From the first of these set-points to the last that moves.
fn at_rest_after(trace: &[ServoPoint]) -> Duration {
    let moves = |pair: &[ServoPoint]| {
        pair[0]
            .angles
            .iter()
            .zip(&pair[1].angles)
            .any(|(a, b)| (a - b).abs() > 1e-7)
    };
    let last = trace.windows(2).rposition(moves).map_or(0, |index| index + 1);
    trace.get(last).map_or(Duration::ZERO, |point| point.at - trace[0].at)
}
