//! What goes wrong in each stage: refused, too slow, cancelled. Afterwards the cell is at rest, says what it was, and picks
//! again.

use std::time::Duration;

use interfaces::rakelight_msgs::msg::{ArmState, CellState};
use interfaces::std_srvs::srv::{Trigger, TriggerRequest};
use ros::GoalStatus;
use scenarios::TIMEOUT;
use scenarios::stand_ins::{NODES, Reply};
use tokio::time::sleep;

use crate::cell::Cell;

/// By request, and the stage in which it fails.
const REQUESTS: [(&str, u8); 4] = [
    ("capture", CellState::CAPTURE),
    ("solve", CellState::SOLVE),
    ("plan_grasp", CellState::PLAN),
    ("dry approach", CellState::PLAN),
];

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_stage_that_is_refused_ends_the_cycle_before_anything_moves() {
    let mut cell = Cell::start(&[0.42]).await;
    for (what, stage) in REQUESTS {
        let reason = format!("{what} cannot be");
        cell.world.reply(what, Reply::Refuse(reason.clone()));
        let result = cell.fails(stage, &[&reason]).await;
        assert_eq!(result.capture_id.is_empty(), stage == CellState::CAPTURE);
        cell.world.heal();
        assert!(cell.world.look().motions.is_empty());
    }
    let state = cell.pick().await;
    assert!(state.success, "{}", state.message);
    cell.picks_again().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_stage_that_takes_too_long_is_ended() {
    let limits = |options: ros::NodeOptions| {
        ["capture", "solve", "plan", "execute"]
            .iter()
            .fold(options, |options, stage| {
                options.parameter(&format!("timeouts.{stage}"), 2.5)
            })
    };
    let mut cell = Cell::start_with(&[0.42], &NODES, limits).await;
    let slow = [("approach", CellState::EXECUTE), ("home", CellState::EXECUTE)];
    for (what, stage) in REQUESTS.into_iter().chain(slow) {
        cell.world.reply(what, Reply::Hang);
        cell.fails(stage, &["takes longer than 2.5 s (timeouts."]).await;
        cell.world.heal();
        cell.recover().await;
        cell.world.change(|world| world.objects = vec![0.42]);
        cell.idle().await;
    }
    cell.picks_again().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_cancel_is_heard_in_every_stage() {
    let cell = Cell::start(&[0.42]).await;
    for (what, stage) in REQUESTS
        .into_iter()
        .chain([("pregrasp", CellState::EXECUTE), ("approach", CellState::EXECUTE)])
    {
        cell.world.reply(what, Reply::Hang);
        let before = cell.world.look().count(what);
        let goal = cell.begin().await;
        cell.asked(what, before + 1).await;
        goal.cancel(TIMEOUT).await.unwrap();
        let (status, result) = goal.result(TIMEOUT).await.unwrap();
        assert_eq!(
            (status, result.failed_stage),
            (GoalStatus::Canceled, stage),
            "{what}: {}",
            result.reason
        );
        assert!(result.reason.contains("cancelled"), "{}", result.reason);
        cell.assert_safe();
        assert!(!cell.world.look().pump);
        cell.world.heal();
    }
    cell.picks_again().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nothing_begins_to_move_after_a_cancel_was_answered() {
    const ACCEPTANCE: Duration = Duration::from_millis(300);
    let mut cell = Cell::start(&[0.42]).await;
    cell.world.change(|world| world.acceptance = ACCEPTANCE);
    let goal = cell.begin().await;
    cell.state("a motion asked for", |state| state.stage == CellState::EXECUTE)
        .await;
    // Asked for and not taken yet.
    sleep(ACCEPTANCE / 3).await;
    goal.cancel(TIMEOUT).await.unwrap();
    let (status, result) = goal.result(TIMEOUT).await.unwrap();
    assert_eq!(status, GoalStatus::Canceled, "{}", result.reason);
    cell.assert_safe();
    let begun = cell.world.look().motions.len();
    sleep(ACCEPTANCE * 2).await;
    assert_eq!(cell.world.look().motions.len(), begun, "a motion began later");
    cell.world.change(|world| world.acceptance = Duration::ZERO);
    cell.picks_again().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_cancel_with_an_object_on_the_cup_holds_it_and_the_next_pick_puts_it_into_the_bin() {
    let mut cell = Cell::start(&[0.42, 0.46]).await;
    cell.world.reply("bin", Reply::Hang);
    let goal = cell.begin().await;
    cell.asked("bin", 1).await;
    goal.cancel(TIMEOUT).await.unwrap();
    let (status, result) = goal.result(TIMEOUT).await.unwrap();
    assert_eq!(status, GoalStatus::Canceled);
    cell.assert_says(&result.reason, &["cancelled", "the cup still holds an object"])
        .await;
    assert_eq!(cell.world.look().held, Some(0.42));
    cell.world.heal();
    let answer = cell.pick().await;
    assert!(answer.success, "{}", answer.message);
    assert!(
        answer
            .message
            .contains("what the cup held before was put into the bin first"),
        "{}",
        answer.message
    );
    assert_eq!((cell.world.look().binned, cell.world.look().objects.len()), (2, 0));
    cell.picks_again().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_stop_ends_the_cycle_and_recover_makes_the_cell_ready() {
    let mut cell = Cell::start(&[0.42]).await;
    let stop = cell.operator.service_client::<Trigger>("stop").unwrap();
    for (what, stage) in [("solve", CellState::SOLVE), ("pregrasp", CellState::EXECUTE)] {
        cell.world.reply(what, Reply::Hang);
        let before = cell.world.look().count(what);
        let goal = cell.begin().await;
        cell.asked(what, before + 1).await;
        stop.call(TriggerRequest::default(), TIMEOUT).await.unwrap();
        let (status, result) = goal.result(TIMEOUT).await.unwrap();
        assert_eq!(
            (status, result.failed_stage),
            (GoalStatus::Aborted, stage),
            "{}",
            result.reason
        );
        assert!(result.reason.contains("stopped"), "{}", result.reason);
        cell.stage(CellState::STOPPED).await;
        cell.assert_safe();
        let refused = cell.pick().await;
        assert!(!refused.success && refused.message.contains("the arm is stopped: by the service `stop`"));
        cell.world.heal();
        cell.recover().await;
        cell.stage(CellState::IDLE).await;
    }
    cell.picks_again().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_fault_of_the_arm_ends_the_cycle_and_is_told() {
    let mut cell = Cell::start(&[0.42]).await;
    cell.world.reply("pregrasp", Reply::Hang);
    let goal = cell.begin().await;
    cell.asked("pregrasp", 1).await;
    cell.world.change(|world| {
        world.mode = ArmState::FAULT;
        world.fault = "a collision was felt".into();
    });
    let (status, result) = goal.result(TIMEOUT).await.unwrap();
    assert_eq!(status, GoalStatus::Aborted);
    assert!(
        result.reason.contains("a collision was felt") || result.reason.contains("it was stopped"),
        "{}",
        result.reason
    );
    let state = cell.stage(CellState::FAULT).await;
    assert_eq!(state.cycles_failed, 1);
    cell.assert_safe();
    cell.picks_again().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn without_a_seal_it_gives_up_after_all_contacts_with_the_pump_off() {
    let mut cell = Cell::start(&[0.40, 0.43, 0.46]).await;
    cell.world.change(|world| world.leaks = 3);
    let texts = [
        "(0.400",
        "(0.430",
        "(0.460",
        "the cup did not seal",
        "gave up after 3 attempts",
    ];
    cell.fails(CellState::EXECUTE, &texts).await;
    assert_eq!(cell.world.look().count("approach"), 3);
    cell.picks_again().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_cannot_be_picked_is_refused_with_the_planners_words_and_nothing_moves() {
    let mut cell = Cell::start(&[]).await;
    cell.fails(
        CellState::PLAN,
        &["nothing to pick: c1: 0 object pixels, a cup needs 90"],
    )
    .await;
    let answer = cell.pick().await;
    assert!(
        !answer.success && answer.message.contains("as a solid object") && answer.message.contains("as a thin one")
    );

    cell.world.change(|world| {
        world.objects = vec![0.9];
        world.out_of_reach = true;
    });
    cell.fails(
        CellState::PLAN,
        &["nothing to pick: the arm reaches none of the grasps"],
    )
    .await;
    cell.world.reply(
        "plan_grasp",
        Reply::Refuse("patch ends 6.0 mm from the contact, needed 10.5 mm".into()),
    );
    cell.fails(CellState::PLAN, &["nothing to pick: patch ends 6.0 mm"])
        .await;
    cell.world.reply("solve", Reply::Refuse("c1: L3 is dark".into()));
    cell.fails(CellState::SOLVE, &["c1: L3 is dark"]).await;
    assert!(cell.world.look().motions.is_empty() && cell.world.look().count("home") == 0);
    cell.world.change(|world| {
        world.objects = vec![0.42];
        world.out_of_reach = false;
    });
    cell.picks_again().await;
}
