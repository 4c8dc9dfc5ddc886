//! Capture, solve, plan and the dry run.

use super::*;

#[test]
fn the_cameras_are_asked_first() {
    let story = Story::begin(order(), policy(), Cup::Off);
    let cameras = vec!["c1".into(), "c2".into()];
    assert_eq!(story.wants, Some(Command::Capture { cameras }));
    assert_eq!(story.cycle.view().stage, Some(Stage::Capture));
}

#[test]
fn an_arm_that_is_elsewhere_goes_home_first_and_in_a_dry_run_is_not_moved() {
    let away = Order {
        at_home: false,
        ..order()
    };
    let mut story = Story::begin(away.clone(), policy(), Cup::Off);
    assert_eq!(story.wants, Some(Command::Home));
    story.tell(Event::Done);
    assert!(matches!(story.wants, Some(Command::Capture { .. })));

    let mut story = Story::begin(away.clone(), policy(), Cup::Off);
    story.tell(refused("it is busy"));
    story.assert_failed(Stage::Execute, &["did not go home: it is busy"]);

    let dry = Order { dry_run: true, ..away };
    let story = Story::begin(dry, policy(), Cup::Off);
    story.assert_failed(Stage::Capture, &["the arm is not at home"]);
}

#[test]
fn a_camera_that_is_gone_is_left_out_and_named() {
    let mut story = Story::begin(order(), policy(), Cup::Off);
    story.tell(refused("c2: it does not answer"));
    assert_eq!(
        story.wants,
        Some(Command::Capture {
            cameras: vec!["c1".into()]
        })
    );
    story.tell(Event::Captured { capture_id: "b".into() });
    story.tell(Event::Solved {
        cameras: vec!["c1".into()],
        message: String::new(),
    });
    story.tell(planned(Vec::new(), "c1: 0 object pixels"));
    story.assert_failed(
        Stage::Plan,
        &["without c2: c2: it does not answer; nothing to pick: c1: 0 object pixels"],
    );
    assert_eq!(story.outcome().capture_id, "b");
}

#[test]
fn without_any_camera_or_with_no_name_in_the_reason_it_ends() {
    for reason in ["c1 and c2 are away", "the lights do not answer"] {
        let mut story = Story::begin(order(), policy(), Cup::Off);
        story.tell(refused(reason));
        story.assert_failed(Stage::Capture, &[reason]);
        assert!(story.outcome().capture_id.is_empty() && !story.outcome().moved);
    }
}

#[test]
fn a_node_that_is_lost_ends_the_cycle_in_its_stage() {
    let mut story = Story::begin(order(), policy(), Cup::Off);
    story.tell(lost("camera_capture does not answer, c2 is gone with it"));
    story.assert_failed(Stage::Capture, &["camera_capture does not answer"]);

    let mut story = Story::begin(order(), policy(), Cup::Off);
    story.tell(Event::Captured { capture_id: "a".into() });
    story.tell(lost("normal_solver does not answer"));
    story.assert_failed(Stage::Solve, &["normal_solver"]);

    let mut story = Story::begin(order(), policy(), Cup::Off);
    story.solve(&["c1"], "");
    story.tell(lost("grasp_planner does not answer"));
    story.assert_failed(Stage::Plan, &["c2 was not solved", "grasp_planner"]);
}

#[test]
fn an_empty_table_ends_it_without_a_motion() {
    let mut story = Story::begin(order(), policy(), Cup::Off);
    story.see(Vec::new());
    story.assert_failed(Stage::Plan, &["nothing to pick: the table is empty"]);
    assert_eq!(story.wants, None);
    assert!(!story.outcome().moved);
}

#[test]
fn the_next_mode_is_tried_when_one_finds_nothing() {
    let both = Order {
        modes: vec![Mode::Solid, Mode::Thin],
        ..order()
    };
    let mut story = Story::begin(both, policy(), Cup::Off);
    story.see(Vec::new());
    let thin = Command::Plan {
        capture_id: "a".into(),
        mode: Mode::Thin,
    };
    assert_eq!(story.wants, Some(thin));
    story.tell(planned(Vec::new(), "no sheet"));
    let reason = "nothing to pick: as a solid object: the table is empty; as a thin one: no sheet";
    story.assert_failed(Stage::Plan, &[reason]);
}

#[test]
fn what_the_solver_missed_is_in_the_result_once() {
    let mut story = Story::begin(dry_order(), policy(), Cup::Off);
    story.solve(&["c1"], "c2: void; c1: solved without L3");
    story.tell(planned(vec![grasp(0.4)], ""));
    story.dry_run();
    assert_eq!(story.outcome().reason, "c2: void; c1: solved without L3");
}

#[test]
fn a_camera_that_the_solver_does_not_speak_of_is_named_all_the_same() {
    let mut story = Story::begin(dry_order(), policy(), Cup::Off);
    story.solve(&["c1"], "c1: solved without L3");
    story.tell(planned(vec![grasp(0.4)], ""));
    story.dry_run();
    assert_eq!(story.outcome().reason, "c2 was not solved; c1: solved without L3");
}

#[test]
fn what_is_out_of_reach_is_not_tried() {
    let mut far = grasp(0.9);
    far.grasp_joints.clear();
    let mut story = Story::begin(order(), policy(), Cup::Off);
    story.solve(&["c1", "c2"], "");
    story.tell(planned(vec![far], "all grasps lie beyond the arm's reach"));
    story.assert_failed(Stage::Plan, &["nothing to pick: all grasps lie beyond the arm's reach"]);
}

#[test]
fn the_whole_way_is_a_dry_run_first_each_leg_from_the_end_of_the_last() {
    let mut story = Story::begin(order(), policy(), Cup::Off);
    story.see(vec![grasp(0.4)]);
    let heights = [0.05, -0.003, 0.1, 0.13];
    let mut starts = Vec::new();
    for (leg, height) in heights.iter().enumerate() {
        let way = story.moves().clone();
        assert!((way.to.position.z - height).abs() < 1e-12, "{way:?}");
        assert_eq!(
            (way.straight, way.contact),
            (leg == 1 || leg == 2, leg == 1 || leg == 2)
        );
        assert_eq!(way.carried.is_some(), leg >= 2);
        assert_eq!((way.speed > 0.0, way.until_held), (leg == 1, leg == 1));
        starts.push(way.dry.expect("a dry run").start_joints);
        story.tell(Event::Moved {
            held: false,
            joints: vec![leg as f64; 7],
            duration: Duration::from_secs(1),
        });
    }
    let expected: [Vec<f64>; 4] = [vec![], vec![0.0; 7], vec![1.0; 7], vec![2.0; 7]];
    assert_eq!(starts, expected);
    assert_eq!(story.wants, Some(Command::Vacuum { on: true }));
}

#[test]
fn a_grasp_whose_way_is_refused_at_every_turn_of_the_tool_gives_way_to_the_next_and_nothing_moves() {
    let mut story = Story::begin(order(), policy(), Cup::Off);
    story.see(vec![grasp(0.4), grasp(0.43)]);
    story.tell(moved()).tell(refused("collision with panel_l1"));
    for turn in 1..6 {
        assert!((story.moves().to.position.x - 0.4).abs() < 1e-12);
        story.tell(refused(&format!("collision at turn {turn}")));
    }
    for _ in 0..6 {
        assert!((story.moves().to.position.x - 0.43).abs() < 1e-12);
        story.tell(refused("not reachable"));
    }
    let reason = "grasp at (0.400, 0.000, 0.000) m: the approach is refused: collision with panel_l1; \
                  grasp at (0.430, 0.000, 0.000) m: the way to it is refused: not reachable; \
                  none of the grasps can be executed";
    story.assert_failed(Stage::Plan, &[reason]);
    assert!(!story.outcome().moved);
}

#[test]
fn a_leg_that_takes_too_long_is_gone_with_the_tool_turned() {
    let mut story = Story::begin(order(), policy(), Cup::Off);
    story.see(vec![grasp(0.4)]);
    let first = story.moves().clone();
    story.tell(Event::Moved {
        held: false,
        joints: vec![0.5; 7],
        duration: Duration::from_secs(21),
    });
    let second = story.moves().clone();
    assert!(first.to.position == second.to.position && first.to.orientation != second.to.orientation);
    story.dry_run();
    assert_eq!(story.wants, Some(Command::Vacuum { on: true }));
    for event in [Event::Done, moved()] {
        story.tell(event);
    }
    assert_eq!(story.moves().to.orientation, second.to.orientation);
}

#[test]
fn over_the_bin_every_turn_of_the_tool_is_tried_and_the_one_that_goes_is_taken() {
    let mut story = Story::begin(order(), policy(), Cup::Off);
    story.see(vec![grasp(0.4)]);
    story.tell(moved()).tell(moved()).tell(moved());
    let first = story.moves().to;
    story.tell(refused("collision with the wall")).tell(refused("limits"));
    let third = story.moves().to;
    assert!(first != third && first.position == third.position);
    story.tell(moved());
    for event in [Event::Done, moved(), held()] {
        story.tell(event);
    }
    story.hear(Cup::Held);
    story.tell(moved());
    assert_eq!((&story.moves().to, &story.moves().dry), (&third, &None));

    let mut story = Story::begin(order(), policy(), Cup::Off);
    story.see(vec![grasp(0.4)]);
    story.tell(moved()).tell(moved()).tell(moved());
    for turn in 0..12 {
        story.tell(refused(&format!("reason {turn}")));
    }
    story.assert_failed(Stage::Plan, &["the way to the bin is refused: reason 0; none of"]);
}

#[test]
fn a_dry_run_ends_with_the_grasp_that_would_be_used() {
    let mut story = Story::begin(dry_order(), policy(), Cup::Off);
    story.see(vec![grasp(0.4)]);
    story.dry_run();
    assert_eq!((story.outcome().kind, story.wants.clone()), (Kind::Succeeded, None));
    assert_eq!(story.outcome().grasp, Some(grasp(0.4)));
    assert!(!story.outcome().moved);
}

#[test]
fn an_executor_that_does_not_answer_a_dry_run_ends_the_cycle() {
    let mut story = Story::begin(order(), policy(), Cup::Off);
    story.see(vec![grasp(0.4), grasp(0.43)]);
    story.tell(lost("trajectory_executor does not answer"));
    story.assert_failed(Stage::Plan, &["trajectory_executor"]);
}
