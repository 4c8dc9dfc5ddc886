//! Cancels, stops, time-outs, and nodes that are lost while the arm moves.

use super::*;

/// The cycle is told to end, and what ran has ended.
fn interrupted(story: &mut Story, event: Event) {
    story.tell(event);
    assert_eq!(story.wants, Some(Command::Interrupt));
    story.tell(refused("cancelled"));
}

fn unfit(reason: &str) -> Event {
    Event::Arm(ArmReport {
        unfit: Some(reason.into()),
        ..report(Cup::On)
    })
}

#[test]
fn a_cancel_before_anything_moves_just_ends_it() {
    let mut story = Story::begin(order(), policy(), Cup::Off);
    interrupted(&mut story, Event::Cancel);
    assert_eq!((story.outcome().kind, story.wants.clone()), (Kind::Cancelled, None));
    assert_eq!(story.outcome().reason, "cancelled (the capture)");

    let mut story = Story::begin(order(), policy(), Cup::Off);
    story.see(vec![grasp(0.4)]);
    interrupted(&mut story, Event::Cancel);
    assert_eq!(story.outcome().reason, "cancelled (a dry run of the way)");
    assert_eq!(story.outcome().failed_stage, Some(Stage::Plan));
}

#[test]
fn a_cancel_on_the_way_to_the_object_switches_the_pump_off() {
    let mut story = Story::executing();
    story.tell(Event::Done);
    interrupted(&mut story, Event::Cancel);
    assert_eq!(story.wants, Some(Command::Vacuum { on: false }));
    story.tell(Event::Cancel);
    assert_eq!(story.wants, None, "once is enough");
    story.tell(Event::Done);
    assert_eq!(story.outcome().kind, Kind::Cancelled);
    assert_eq!(story.cycle.on(Event::Cancel, story.now), None, "it has ended");
}

#[test]
fn a_cancel_with_an_object_on_the_cup_keeps_it_there() {
    let mut story = Story::lifting();
    interrupted(&mut story, Event::Cancel);
    assert_eq!(story.wants, None);
    let reason = &story.outcome().reason;
    assert!(
        reason.contains("cancelled (the lift)") && reason.contains("the cup still holds an object"),
        "{reason}"
    );
}

#[test]
fn a_cancel_just_when_the_cup_seals_keeps_the_object_as_well() {
    let mut story = Story::executing();
    story.tell(Event::Done).tell(moved()).tell(Event::Cancel).tell(held());
    assert_eq!((story.outcome().kind, story.wants.clone()), (Kind::Cancelled, None));
    assert!(story.outcome().reason.contains("still holds"));
}

#[test]
fn a_cancel_while_the_cup_lets_go_ends_at_once() {
    let mut story = Story::lifting();
    story.tell(moved()).tell(moved()).tell(Event::Done).tell(Event::Cancel);
    assert_eq!((story.outcome().kind, story.wants.clone()), (Kind::Cancelled, None));
}

#[test]
fn a_cancel_goes_before_another_try() {
    let mut story = Story::lifting();
    story.tell(Event::Arm(report(Cup::On)));
    assert_eq!(story.wants, Some(Command::Interrupt));
    story.tell(Event::Cancel).tell(refused("cancelled"));
    assert_eq!(story.wants, Some(Command::Vacuum { on: false }));
    story.tell(Event::Done);
    assert_eq!(story.outcome().kind, Kind::Cancelled);
}

#[test]
fn an_arm_that_is_stopped_or_has_a_fault_ends_it_in_any_stage() {
    let mut story = Story::begin(order(), policy(), Cup::Off);
    interrupted(&mut story, unfit("the arm is stopped: by the service `stop`"));
    story.assert_failed(
        Stage::Capture,
        &["the arm is stopped: by the service `stop` (the capture)"],
    );

    let mut story = Story::executing();
    story.tell(Event::Done);
    interrupted(&mut story, unfit("the arm has a fault"));
    assert_eq!(story.wants, Some(Command::Vacuum { on: false }));
    story.tell(Event::Done);
    story.assert_failed(Stage::Execute, &["the arm has a fault (the way to the object)"]);
}

#[test]
fn a_dry_run_does_not_care_how_the_arm_is() {
    let mut story = Story::begin(dry_order(), policy(), Cup::Held);
    story.tell(unfit("the arm is not armed"));
    assert!(story.wants.is_none() && story.cycle.outcome().is_none());
    story.wants = Some(Command::Capture { cameras: Vec::new() });
    story.see(Vec::new());
    story.assert_failed(Stage::Plan, &["nothing to pick"]);
    assert!(!story.outcome().reason.contains("still holds"));
}

#[test]
fn every_stage_has_its_time() {
    for (stage, answers) in [
        (Stage::Capture, vec![]),
        (Stage::Solve, vec![Event::Captured { capture_id: "a".into() }]),
    ] {
        let mut story = Story::begin(order(), policy(), Cup::Off);
        for answer in answers {
            story.tell(answer);
        }
        story.tell(Event::Tick);
        assert_eq!(story.wants, None, "not yet");
        story.now = story.cycle.deadline();
        interrupted(&mut story, Event::Tick);
        story.assert_failed(
            stage,
            &[
                &format!("stage {stage} takes longer than"),
                &format!("(timeouts.{stage})"),
            ],
        );
    }
}

#[test]
fn a_motion_that_takes_too_long_is_ended_and_the_pump_goes_off() {
    let mut story = Story::executing();
    story.tell(Event::Done);
    story.now = story.cycle.deadline();
    interrupted(&mut story, Event::Tick);
    assert_eq!(story.wants, Some(Command::Vacuum { on: false }));
    story.now = story.cycle.deadline();
    story.tell(Event::Tick);
    story.assert_failed(
        Stage::Execute,
        &["stage execute takes longer than 90.0 s", "the pump did not go off"],
    );
}

#[test]
fn what_does_not_end_when_told_is_stopped_with_the_arm() {
    let mut story = Story::executing();
    story.tell(Event::Done).tell(Event::Cancel);
    story.now = story.cycle.deadline();
    story.tell(Event::Tick);
    assert_eq!(story.wants, Some(Command::Halt));
    let outcome = story.outcome();
    assert_eq!(outcome.kind, Kind::Cancelled);
    assert!(
        outcome.reason.contains("did not end within 3.0 s"),
        "{}",
        outcome.reason
    );
}

#[test]
fn a_cup_that_does_not_let_go_ends_it() {
    let mut story = Story::lifting();
    story.tell(moved()).tell(moved()).tell(Event::Done);
    story.hear(Cup::Held);
    story.now = story.cycle.deadline();
    story.tell(Event::Tick);
    story.assert_failed(
        Stage::Execute,
        &["still holds something 2.0 s after the pump was switched off"],
    );
}

#[test]
fn an_executor_that_is_lost_ends_it_and_the_pump_is_tried() {
    for steps in [vec![], vec![Event::Done], vec![Event::Done, moved()]] {
        let mut story = Story::executing();
        for step in steps {
            story.tell(step);
        }
        story.tell(lost("trajectory_executor does not answer"));
        assert_eq!(story.wants, Some(Command::Vacuum { on: false }));
        story.tell(lost("trajectory_executor does not answer"));
        story.assert_failed(Stage::Execute, &["trajectory_executor does not answer"]);
    }
    let mut story = Story::lifting();
    story.tell(moved()).tell(lost("trajectory_executor does not answer"));
    assert_eq!(story.wants, None, "what hangs there stays there");
    story.assert_failed(
        Stage::Execute,
        &["the way to the bin failed: trajectory_executor does not answer"],
    );
}

#[test]
fn an_object_that_is_dropped_while_the_arm_cannot_be_stopped_ends_it() {
    let mut story = Story::lifting();
    story.tell(Event::Arm(report(Cup::On))).tell(lost("gone"));
    assert_eq!(story.wants, Some(Command::Vacuum { on: false }));
    story.tell(lost("gone"));
    story.assert_failed(
        Stage::Execute,
        &["dropped on the way, and the arm's motion cannot be ended: gone"],
    );

    let mut story = Story::lifting();
    story.tell(Event::Arm(report(Cup::On)));
    story.now = story.cycle.deadline();
    story.tell(Event::Tick);
    assert_eq!(story.wants, Some(Command::Halt));
}

#[test]
fn an_answer_that_makes_no_sense_ends_it() {
    let mut story = Story::begin(order(), policy(), Cup::Off);
    story.tell(Event::Done);
    story.assert_failed(Stage::Capture, &["makes no sense"]);
}
