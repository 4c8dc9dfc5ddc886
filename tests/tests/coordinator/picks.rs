//! Picks that go well, if need be at the second try.

use interfaces::rakelight_msgs::action::PickCycleGoal;
use interfaces::rakelight_msgs::msg::CellState;
use ros::GoalStatus;
use scenarios::stand_ins::{HOME, NODES, Reply};

use crate::cell::Cell;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_object_goes_into_the_bin_and_every_stage_is_told() {
    let mut cell = Cell::start(&[0.42]).await;
    let mut goal = cell.begin().await;
    let mut told = Vec::new();
    while let Some(feedback) = goal.feedback().await {
        assert!((0.0..=1.0).contains(&feedback.progress), "{feedback:?}");
        told.push((feedback.stage, feedback.capture_id.clone()));
    }
    let (status, result) = goal.result(scenarios::TIMEOUT).await.unwrap();
    assert_eq!(
        (status, result.reason.as_str(), result.failed_stage),
        (GoalStatus::Succeeded, "", 0)
    );
    assert!(result.success && (result.grasp.contact.x - 0.42).abs() < 1e-9);
    let stages: Vec<u8> = result.timings.iter().map(|timing| timing.stage).collect();
    assert_eq!(
        stages,
        [2, 3, 4, 5, 2, 3, 4],
        "captured, solved, planned, executed, and looked again"
    );
    assert!(
        result
            .timings
            .iter()
            .all(|timing| timing.succeeded && timing.started_at.sec > 0)
    );
    assert!(
        told.iter()
            .any(|(stage, id)| *stage == CellState::EXECUTE && id == "capture 1 of c1+c2"),
        "{told:?}"
    );
    assert_eq!(result.capture_id, "capture 2 of c1+c2");
    let state = cell.state("the count", |state| state.cycles_succeeded == 1).await;
    assert_eq!(
        (state.stage, state.last_error.as_str(), state.cycles_failed),
        (CellState::IDLE, "", 0)
    );
    let legs: Vec<String> = cell.world.look().asked.clone();
    let moved: Vec<&str> = legs
        .iter()
        .map(String::as_str)
        .filter(|leg| !leg.starts_with("dry"))
        .collect();
    let look = ["capture", "solve", "plan_grasp"];
    let act = [
        "vacuum/set",
        "pregrasp",
        "approach",
        "lift",
        "bin",
        "vacuum/set",
        "home",
    ];
    assert_eq!(moved, [&look[..], &act, &look].concat());
    cell.assert_safe();
    assert_eq!((cell.world.look().binned, cell.world.look().joints), (1, HOME));
    cell.picks_again().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_dry_run_moves_nothing_and_names_the_grasp() {
    let cell = Cell::start(&[0.42]).await;
    let goal = PickCycleGoal {
        dry_run: true,
        ..PickCycleGoal::default()
    };
    let (status, result) = cell.cycle(goal).await;
    assert_eq!((status, result.reason.as_str()), (GoalStatus::Succeeded, ""));
    assert_eq!(result.grasp.pregrasp_joints.len(), 7);
    {
        let world = cell.world.look();
        assert!(world.motions.is_empty() && world.count("vacuum/set") == 0 && world.count("home") == 0);
        assert_eq!(
            ["dry pregrasp", "dry approach", "dry lift", "dry bin"].map(|leg| world.count(leg)),
            [1; 4]
        );
    }
    cell.picks_again().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_object_that_moved_away_is_found_again() {
    let mut cell = Cell::start(&[0.42]).await;
    // The cup does not seal, because the object is pushed aside.
    cell.world.change(|world| world.leaks = 1);
    let goal = cell.begin().await;
    cell.asked("approach", 1).await;
    cell.world.change(|world| world.objects = vec![0.45]);
    let (status, result) = goal.result(scenarios::TIMEOUT).await.unwrap();
    assert_eq!(status, GoalStatus::Succeeded, "{}", result.reason);
    assert!(
        result
            .reason
            .contains("at (0.420, 0.000, 0.030) m: the cup did not seal"),
        "{}",
        result.reason
    );
    assert!((result.grasp.contact.x - 0.45).abs() < 1e-9);
    let state = cell.state("the trouble", |state| state.cycles_succeeded == 1).await;
    assert_eq!(state.last_error, result.reason);
    assert_eq!((cell.world.look().binned, cell.world.look().count("back")), (1, 1));
    cell.picks_again().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_object_that_is_dropped_on_the_way_is_picked_again() {
    let cell = Cell::start(&[0.42, 0.45]).await;
    cell.world.change(|world| world.drops = true);
    let (status, result) = cell.cycle(PickCycleGoal::default()).await;
    assert_eq!(status, GoalStatus::Succeeded, "{}", result.reason);
    assert!(
        result.reason.contains("the object was dropped on the way"),
        "{}",
        result.reason
    );
    assert_eq!((cell.world.look().binned, cell.world.look().objects.len()), (1, 1));
    cell.picks_again().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn with_one_camera_gone_the_other_goes_on_and_the_result_says_so() {
    let mut cell = Cell::start(&[0.42]).await;
    cell.world.change(|world| {
        world.note = "planned on c1 alone".into();
        world.gone = vec!["c2".into()];
    });
    let (status, result) = cell.cycle(PickCycleGoal::default()).await;
    assert_eq!(status, GoalStatus::Succeeded, "{}", result.reason);
    assert_eq!(
        result.reason,
        "without c2: c2: the camera does not answer; planned on c1 alone"
    );
    assert!(result.capture_id.ends_with("of c1"), "{}", result.capture_id);
    cell.state("what was missing", |state| state.last_error == result.reason)
        .await;
    cell.world.change(|world| world.gone.clear());
    cell.picks_again().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_cycle_is_recorded_when_that_is_wanted_and_bags_of_before_are_left() {
    let nodes = [&NODES[..], &["bag_recorder"]].concat();
    let cell = Cell::start_with(&[0.42], &nodes, |options| options.parameter("record", "all".to_owned())).await;
    cell.operator
        .wait_for_node("/cell/bag_recorder", scenarios::TIMEOUT)
        .await
        .unwrap();
    cell.world
        .reply("record/start", Reply::Refuse("/bags/cycle_1 exists already".into()));
    let goal = cell.begin().await;
    cell.asked("record/start", 3).await;
    cell.world.heal();
    let (status, result) = goal.result(scenarios::TIMEOUT).await.unwrap();
    assert_eq!((status, result.reason.as_str()), (GoalStatus::Succeeded, ""));
    {
        let world = cell.world.look();
        let place = |what: &str| world.asked.iter().position(|asked| asked == what).unwrap();
        assert!(world.count("record/start") > 3 && world.count("record/stop") == 1);
        assert!(place("record/start") < place("capture") && place("home") < place("record/stop"));
    }
    cell.world
        .reply("record/start", Reply::Refuse("the disk is full".into()));
    cell.world.change(|world| world.objects = vec![0.4]);
    let (status, result) = cell.cycle(PickCycleGoal::default()).await;
    assert_eq!(status, GoalStatus::Succeeded);
    assert_eq!(result.reason, "the cycle is not recorded: the disk is full");
    cell.picks_again().await;
}
