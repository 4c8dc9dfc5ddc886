//! What the arm does, and what it does when that goes wrong.

use super::*;

#[test]
fn a_pick_goes_step_by_step_and_is_done_when_the_object_is_gone() {
    let mut story = Story::executing();
    story.tell(Event::Done);
    assert_eq!(story.moves().dry, None);
    story.tell(moved());
    assert!(story.moves().until_held);
    story.tell(held());
    assert!(story.moves().straight && story.moves().carried == Some(CARRIED));
    story.hear(Cup::Held);
    story.tell(moved());
    assert!(!story.moves().straight && story.moves().carried == Some(CARRIED));
    story.tell(moved());
    assert_eq!(story.wants, Some(Command::Vacuum { on: false }));
    story.tell(Event::Done);
    assert_eq!(story.wants, None, "it waits for the cup");
    story.tell(Event::Arm(report(Cup::Off)));
    assert_eq!(story.wants, Some(Command::Home));
    story.tell(Event::Done);
    story.see(vec![grasp(0.43)]);
    let outcome = story.outcome();
    assert_eq!(
        (outcome.kind, outcome.reason.as_str(), outcome.failed_stage),
        (Kind::Succeeded, "", None)
    );
    assert_eq!((outcome.grasp.as_ref(), outcome.moved), (Some(&grasp(0.4)), true));
    let timings = story.cycle.view().timings;
    let stages: Vec<Stage> = timings.iter().map(|timing| timing.stage).collect();
    let look = [Stage::Capture, Stage::Solve, Stage::Plan];
    assert_eq!(stages, [&look[..], &[Stage::Execute], &look[..]].concat());
    assert!(
        timings
            .iter()
            .all(|timing| timing.succeeded && timing.ended > Some(timing.began))
    );
}

#[test]
fn what_the_message_says_of_a_plan_is_told_with_the_success() {
    let unverified = Policy {
        verify: false,
        ..policy()
    };
    let mut story = Story::begin(order(), unverified, Cup::Off);
    story.solve(&["c1", "c2"], "");
    story.tell(planned(vec![grasp(0.4)], "planned on c1 alone"));
    story.dry_run();
    for event in [Event::Done, moved(), held()] {
        story.tell(event);
    }
    story.hear(Cup::Held);
    story.tell(moved()).tell(moved()).tell(Event::Done);
    story.tell(Event::Arm(report(Cup::Off))).tell(Event::Done);
    assert_eq!(story.outcome().kind, Kind::Succeeded);
    assert_eq!(story.outcome().reason, "planned on c1 alone");
}

#[test]
fn without_a_seal_the_arm_backs_off_and_looks_again_and_takes_another_contact() {
    let mut story = Story::executing();
    for event in [Event::Done, moved(), moved()] {
        story.tell(event);
    }
    assert_eq!(story.wants, Some(Command::Vacuum { on: false }));
    story.tell(Event::Done);
    let back = story.moves();
    assert!(back.straight && back.contact && back.dry.is_none() && (back.to.position.z - 0.05).abs() < 1e-12);
    story.tell(moved());
    assert_eq!(story.wants, Some(Command::Home));
    story.tell(Event::Done);
    story.see(vec![grasp(0.402), grasp(0.43)]);
    assert!((story.moves().to.position.x - 0.43).abs() < 1e-12, "the next best");
    assert!(
        story
            .cycle
            .view()
            .timings
            .iter()
            .any(|timing| timing.stage == Stage::Execute && !timing.succeeded)
    );
}

#[test]
fn when_no_contact_is_left_it_says_what_was_tried() {
    let mut story = Story::executing();
    for event in [Event::Done, moved(), moved(), Event::Done, moved(), Event::Done] {
        story.tell(event);
    }
    story.solve(&["c1", "c2"], "");
    story.tell(planned(vec![grasp(0.4)], ""));
    story.assert_failed(
        Stage::Plan,
        &[
            "grasp at (0.400, 0.000, 0.000) m: the cup did not seal",
            "only grasps are left that have failed",
        ],
    );
}

#[test]
fn after_enough_attempts_it_gives_up_with_all_reasons() {
    let mut story = Story::executing();
    for attempt in 1..=3 {
        for event in [Event::Done, moved(), moved(), Event::Done, moved(), Event::Done] {
            story.tell(event);
        }
        if attempt < 3 {
            story.see(vec![grasp(0.4 + 0.03 * f64::from(attempt))]);
            story.dry_run();
        }
    }
    story.assert_failed(
        Stage::Execute,
        &["at (0.400", "at (0.430", "at (0.460", "gave up after 3 attempts"],
    );
}

#[test]
fn a_way_that_fails_leads_home_with_the_pump_off_and_to_another_try() {
    let mut story = Story::executing();
    story.tell(Event::Done).tell(refused("collision"));
    assert_eq!(story.wants, Some(Command::Vacuum { on: false }));
    story.tell(Event::Done);
    assert_eq!(story.wants, Some(Command::Home), "it was not near the object");
    story.tell(Event::Done);
    assert!(matches!(story.wants, Some(Command::Capture { .. })));

    let mut story = Story::executing();
    story.tell(Event::Done).tell(moved()).tell(refused("collision"));
    story.tell(Event::Done);
    assert!(story.moves().contact, "it backs off");
    story.tell(refused("still in the way"));
    assert_eq!(story.wants, Some(Command::Home), "home is planned from anywhere");
    story.tell(refused("not that either"));
    story.assert_failed(
        Stage::Execute,
        &["the way home after a failed grasp failed: not that either"],
    );
}

#[test]
fn a_contact_whose_way_was_cut_short_is_tried_once_more_and_not_twice() {
    let mut story = Story::executing();
    for attempt in 1..=2 {
        for event in [Event::Done, moved(), refused("the servo loop was late")] {
            story.tell(event);
        }
        for event in [Event::Done, moved(), Event::Done] {
            story.tell(event);
        }
        if attempt == 1 {
            story.see(vec![grasp(0.401)]);
            story.dry_run();
        }
    }
    story.solve(&["c1", "c2"], "");
    story.tell(planned(vec![grasp(0.4)], ""));
    story.assert_failed(
        Stage::Plan,
        &[
            "at (0.400",
            "at (0.401",
            "was late",
            "only grasps are left that have failed",
        ],
    );
}

#[test]
fn an_object_that_is_dropped_ends_the_motion_and_is_looked_for_again() {
    let mut story = Story::lifting();
    story.tell(moved()).tell(Event::Arm(report(Cup::On)));
    assert_eq!(story.wants, Some(Command::Interrupt));
    story.tell(refused("cancelled"));
    assert_eq!(story.wants, Some(Command::Vacuum { on: false }));
    story.tell(Event::Done);
    assert_eq!(story.wants, Some(Command::Home));
    story.tell(Event::Done);
    story.see(vec![grasp(0.38)]);
    assert!(story.moves().dry.is_some());
}

#[test]
fn an_arm_that_says_late_that_it_holds_is_believed_and_one_that_never_does_is_not() {
    let mut story = Story::executing();
    story.hear(Cup::On);
    for event in [Event::Done, moved(), held()] {
        story.tell(event);
    }
    story.hear(Cup::On);
    story.hear(Cup::Held);
    story.tell(moved());
    assert!(!story.moves().straight, "to the bin");

    let mut story = Story::executing();
    for event in [Event::Done, moved(), held()] {
        story.tell(event);
    }
    story.hear(Cup::On);
    story.tell(moved());
    assert_eq!(
        story.wants,
        Some(Command::Vacuum { on: false }),
        "dropped while it was lifted"
    );
}

#[test]
fn a_lift_that_fails_keeps_the_object_on_the_cup() {
    let mut story = Story::lifting();
    story.tell(refused("the controller reports an error"));
    assert_eq!(story.wants, None, "the pump stays on");
    story.assert_failed(
        Stage::Execute,
        &["the lift failed: the controller", "the cup still holds an object"],
    );
}

#[test]
fn an_object_that_is_still_there_is_tried_again_on_what_was_just_seen() {
    let mut story = Story::lifting();
    story.tell(moved()).tell(moved()).tell(Event::Done);
    story.tell(Event::Arm(report(Cup::Off))).tell(Event::Done);
    story.see(vec![grasp(0.401), grasp(0.412)]);
    assert!((story.moves().to.position.x - 0.412).abs() < 1e-12 && story.moves().dry.is_some());
}

#[test]
fn a_cycle_that_cannot_look_again_says_that_it_does_not_know() {
    let mut story = Story::lifting();
    story.tell(moved()).tell(moved()).tell(Event::Done);
    story.tell(Event::Arm(report(Cup::Off))).tell(Event::Done);
    story.tell(lost("camera_capture does not answer"));
    story.assert_failed(
        Stage::Capture,
        &["released over the bin, but whether it is gone is not known: camera_capture"],
    );

    let mut story = Story::lifting();
    story.tell(moved()).tell(moved()).tell(Event::Done);
    story.tell(Event::Arm(report(Cup::Off))).tell(Event::Done);
    story.solve(&["c1", "c2"], "");
    story.tell(Event::Planned(Planned {
        message: "results did not come".into(),
        ..Planned::default()
    }));
    story.assert_failed(Stage::Plan, &["is not known: results did not come"]);
}

#[test]
fn what_the_cup_holds_at_the_beginning_is_put_into_the_bin_first() {
    let holding = Order {
        held: Some(CARRIED),
        at_home: false,
        ..order()
    };
    let mut story = Story::begin(holding.clone(), policy(), Cup::Held);
    let lift = story.moves().clone();
    assert!((lift.to.position.z - 0.45).abs() < 1e-12 && lift.contact && lift.dry.is_some());
    story.tell(moved()).tell(moved());
    assert_eq!((story.moves().dry.clone(), story.moves().straight), (None, true));
    story.tell(moved()).tell(moved());
    assert_eq!(story.wants, Some(Command::Vacuum { on: false }));
    story.tell(Event::Done).tell(Event::Arm(report(Cup::Off)));
    assert_eq!(story.wants, Some(Command::Home));
    story.tell(Event::Done);
    story.see(Vec::new());
    story.assert_failed(
        Stage::Plan,
        &["what the cup held before was put into the bin first; nothing to pick"],
    );

    let mut story = Story::begin(holding.clone(), policy(), Cup::Held);
    story.tell(refused("beyond the arm's reach")).tell(moved());
    assert!(
        !story.moves().straight && story.moves().dry.is_none(),
        "straight to the bin"
    );

    let mut story = Story::begin(holding, policy(), Cup::Held);
    story.tell(moved());
    for _ in 0..12 {
        story.tell(refused("collision"));
    }
    story.assert_failed(
        Stage::Execute,
        &["cannot be put into the bin: collision", "the cup still holds"],
    );
    assert_eq!(story.wants, None);
}

#[test]
fn a_pump_that_is_not_switched_ends_it() {
    let mut story = Story::executing();
    story.tell(refused("no answer of the gripper"));
    assert_eq!(story.wants, Some(Command::Vacuum { on: false }), "off again, in case");
    story.tell(refused("no answer of the gripper"));
    story.assert_failed(Stage::Execute, &["the pump was not switched: no answer"]);

    let mut story = Story::lifting();
    story
        .tell(moved())
        .tell(moved())
        .tell(refused("no answer of the gripper"));
    story.assert_failed(Stage::Execute, &["the pump was not switched"]);
}
