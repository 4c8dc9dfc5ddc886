//! Motions that are done, and motions that are refused.

use interfaces::control_msgs::action::{FollowJointTrajectory, FollowJointTrajectoryGoal, FollowJointTrajectoryResult};
use interfaces::rakelight_msgs::action::MoveToolGoal;
use interfaces::rakelight_msgs::msg::ArmState;
use interfaces::trajectory_msgs::msg::{JointTrajectory, JointTrajectoryPoint};
use ros::GoalStatus;
use scenarios::{TIMEOUT, within};
use sim::arm::ArmConfig;

use crate::scene::{HOME, Scene, down, far};

#[tokio::test(flavor = "multi_thread")]
async fn an_arm_that_nobody_has_armed_does_not_move() {
    let scene = Scene::start(ArmConfig::default()).await;
    let answer = scene.home().await;
    assert!(!answer.success);
    assert_eq!(
        answer.message,
        "the arm is not ready: it is not armed; `recover` makes it ready"
    );
    let (status, result) = scene.move_tool(far()).await;
    assert_eq!(status, GoalStatus::Aborted, "{}", result.reason);
    scene.assert_at(&HOME, "nothing has moved");
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_tool_goes_along_a_line_and_home_again() {
    let mut scene = Scene::ready(ArmConfig::default()).await;
    let line = MoveToolGoal {
        poses: vec![down(0.40, 0.10, 0.25), down(0.40, 0.10, 0.15)],
        straight: true,
        ..MoveToolGoal::default()
    };
    let (status, result) = scene.move_tool(line).await;
    assert_eq!((status, result.reason.as_str()), (GoalStatus::Succeeded, ""));
    scene.assert_at(&result.joints, "the end of the line");
    let state = scene
        .state("the tool to rest in its place", |state| {
            state.tcp.position.z < 0.1501 && state.mode == ArmState::READY
        })
        .await;
    assert!((state.tcp.position.x - 0.40).abs() < 1e-3 && (state.tcp.position.y - 0.10).abs() < 1e-3);

    let answer = scene.home().await;
    assert!(answer.success, "{}", answer.message);
    scene.assert_at(&HOME, "home");
    let joints = within("joint states", scene.joints.next()).await.unwrap().message;
    assert_eq!(joints.name.first().map(String::as_str), Some("joint1"));
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_cannot_be_done_says_where_and_why_and_nothing_moves() {
    let scene = Scene::ready(ArmConfig::default()).await;
    let goal = |pose| MoveToolGoal {
        poses: vec![pose],
        ..MoveToolGoal::default()
    };
    let nan = down(f64::NAN, 0.0, 0.3);
    let cases = [
        (
            goal(down(1.5, 0.0, 0.3)),
            "no joint angles within the limits give the pose",
        ),
        (goal(nan), "pose 1: "),
        (goal(down(0.43, 0.0, -0.05)), "vacuum_cup with "),
        (MoveToolGoal::default(), "0 poses, allowed are 1 to 1000"),
        (
            MoveToolGoal {
                speed: 2.0,
                ..goal(down(0.4, 0.0, 0.3))
            },
            "speed is 2 m/s, allowed are 0 for the parameter's and more up to 0.25",
        ),
    ];
    for (goal, reason) in cases {
        let (status, result) = scene.move_tool(goal).await;
        assert_eq!(status, GoalStatus::Aborted);
        assert!(result.reason.contains(reason), "{}", result.reason);
        scene.assert_at(&HOME, "nothing has moved");
    }
    let (status, result) = scene.move_tool(MoveToolGoal { dry_run: true, ..far() }).await;
    assert_eq!((status, result.reason.as_str()), (GoalStatus::Succeeded, ""));
    assert!(result.duration.sec >= 1);
    scene.assert_at(&HOME, "a dry run moves nothing");
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn joint_trajectories_are_followed_or_refused_as_a_whole() {
    let scene = Scene::ready(ArmConfig::default()).await;
    let client = scene
        .viewer
        .action_client::<FollowJointTrajectory>("follow_joint_trajectory")
        .unwrap();
    let mut there = HOME;
    there[0] = 0.4;
    let follow = async |points: Vec<JointTrajectoryPoint>| {
        let goal = client.send_goal(goal(points), TIMEOUT).await.unwrap();
        goal.result(TIMEOUT).await.unwrap()
    };

    let (status, result) = follow(vec![point(&there, 4.0), point(&HOME, 8.0)]).await;
    assert_eq!((status, result.error_string.as_str()), (GoalStatus::Succeeded, ""));
    scene.assert_at(&HOME, "back again");

    let (status, result) = follow(vec![point(&there, 0.05)]).await;
    assert_eq!(
        (status, result.error_code),
        (GoalStatus::Aborted, FollowJointTrajectoryResult::INVALID_GOAL)
    );
    assert!(result.error_string.contains("joint 1"), "{}", result.error_string);

    let (_, result) = follow(vec![point(&there, 0.0), point(&HOME, 4.0)]).await;
    assert!(
        result
            .error_string
            .contains("begins elsewhere than the arm stands: joint 1"),
        "{}",
        result.error_string
    );

    let mut beyond = HOME;
    beyond[1] = 2.5;
    let (_, result) = follow(vec![point(&beyond, 20.0)]).await;
    assert!(
        result.error_string.contains("joint 2: position reaches 2.5"),
        "{}",
        result.error_string
    );
    scene.assert_at(&HOME, "what is refused moves nothing");
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn no_set_point_is_lost_and_none_jumps() {
    let scene = Scene::ready(ArmConfig::default()).await;
    scene.controller.take_servo_trace();
    let (status, result) = scene.move_tool(far()).await;
    assert_eq!((status, result.reason.as_str()), (GoalStatus::Succeeded, ""));
    let trace = scene.controller.take_servo_trace();
    assert!(trace.len() > 250, "{} set-points", trace.len());
    assert!(trace.iter().all(|point| point.taken), "every set-point is taken");
    // 0.25 m/s at the tool are far below 2 rad/s at any joint here.
    let step = |pair: &[sim::arm::ServoPoint]| {
        let ways = pair[1].angles.iter().zip(&pair[0].angles).map(|(a, b)| (a - b).abs());
        ways.fold(0.0, f64::max)
    };
    let longest = trace.windows(2).map(step).fold(0.0, f64::max);
    assert!(longest < 2.0 * 0.004, "{longest} rad in a period");
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_cup_is_switched_and_told() {
    let mut scene = Scene::ready(ArmConfig::default()).await;
    assert!(scene.vacuum(true).await.success);
    scene
        .state("the pump", |state| state.vacuum == ArmState::VACUUM_ON)
        .await;
    assert!(scene.vacuum(false).await.success);
    scene
        .state("the vent", |state| state.vacuum == ArmState::VACUUM_OFF)
        .await;
    scene.end().await;
}

fn goal(points: Vec<JointTrajectoryPoint>) -> FollowJointTrajectoryGoal {
    FollowJointTrajectoryGoal {
        trajectory: JointTrajectory {
            joint_names: (1..=7).map(|number| format!("joint{number}")).collect(),
            points,
            ..JointTrajectory::default()
        },
        ..FollowJointTrajectoryGoal::default()
    }
}

fn point(positions: &[f64; 7], seconds: f64) -> JointTrajectoryPoint {
    JointTrajectoryPoint {
        positions: positions.to_vec(),
        time_from_start: std::time::Duration::from_secs_f64(seconds).try_into().unwrap(),
        ..JointTrajectoryPoint::default()
    }
}
