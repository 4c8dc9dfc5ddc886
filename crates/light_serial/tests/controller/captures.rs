//! Sequences that run whole.

use std::time::Duration;

use devices::{Channel, LightBank, LightError, LightMode, LightSequence};
use sim::board::{BoardConfig, Pin};

use crate::rig::{Board, ON_TIME, Rig, TRIGGER_DELAY, capture, micros_between, pulses, sequence};

const CYCLES_PER_MICRO: f64 = 16.0;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_capture_is_reported_as_it_is_seen_on_the_pins() {
    let Some(rig) = Rig::start().await else { return };
    rig.board.forget_edges();
    let report = rig.lights.run_sequence(capture()).await.expect("it runs");
    let edges = rig.board.edges();
    let panels: Vec<_> = report.steps.iter().map(|step| step.panels).collect();
    assert_eq!(panels, Channel::all().map(Channel::panels).collect::<Vec<_>>());

    let mut on_time_error = 0.0_f64;
    let mut host_error = 0.0_f64;
    for (number, step) in (1..=7).zip(&report.steps[1..]) {
        let lit = pulses(&edges, Pin::Panel(number));
        assert_eq!(lit.len(), 1, "L{number} is lit once");
        let (on, off) = lit[0];
        let micros = (off.cycle - on.cycle) as f64 / CYCLES_PER_MICRO;
        on_time_error = on_time_error.max((micros - ON_TIME.as_secs_f64() * 1e6).abs());
        host_error = host_error
            .max(micros_between(step.on_at, on.at))
            .max(micros_between(step.off_at, off.at));
    }
    for camera in [1, 2] {
        let triggers = pulses(&edges, Pin::Trigger(camera));
        assert_eq!(triggers.len(), 8);
        for (step, (up, _)) in report.steps.iter().zip(&triggers) {
            host_error = host_error.max(micros_between(step.triggered_at, up.at));
            let delay = micros_between(step.triggered_at, step.on_at);
            assert!((delay - TRIGGER_DELAY.as_secs_f64() * 1e6).abs() < 5.0, "delay {delay}");
        }
    }
    let slips = rig.board.simulated.slips();
    println!(
        "largest error of the on-time {on_time_error:.2} us, of times on the host {host_error:.0} us, said to be \
         {:?}; {slips:?}",
        report.clock_uncertainty
    );
    assert!(on_time_error <= 2.0);
    if slips.count == 0 {
        let said = report.clock_uncertainty.as_secs_f64() * 1e6;
        assert!(host_error < 3.0 * said + 50.0, "{host_error} us, said to be {said}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn sequences_run_one_after_another() {
    let Some(rig) = Rig::start().await else { return };
    rig.board.forget_edges();
    for _ in 0..3 {
        let report = rig.lights.run_sequence(capture()).await.expect("it runs");
        assert_eq!(report.steps.len(), 8);
    }
    let edges = rig.board.edges();
    for number in 1..=7 {
        assert_eq!(pulses(&edges, Pin::Panel(number)).len(), 3);
    }
    assert!(rig.board.is_dark());
    assert_eq!(rig.lights.statistics().last_fault, None);
}

/// Longer than the firmware's patience: the driver keeps it awake.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_long_sequence_is_kept_alive() {
    let Some(rig) = Rig::start().await else { return };
    let long = sequence(Duration::from_millis(200), Duration::from_millis(10));
    let report = rig.lights.run_sequence(long).await.expect("it runs");
    let length = report.steps[7].off_at - report.steps[0].on_at;
    let expected = Duration::from_millis(8 * 200 + 7 * 10);
    assert!(length.abs_diff(expected) < Duration::from_micros(100), "{length:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_sequence_keeps_others_out_and_is_seen_in_the_state() {
    let Some(rig) = Rig::start().await else { return };
    let long = sequence(Duration::from_millis(50), Duration::from_millis(10));
    let (first, others) = tokio::join!(rig.lights.run_sequence(long), async {
        rig.state("a sequence", |state| state.mode == LightMode::Sequence).await;
        let second = rig.lights.run_sequence(capture()).await;
        let set = rig
            .lights
            .set(Channel::new(1).expect("exists").panels(), Duration::from_secs(1))
            .await;
        (second, set)
    });
    assert!(first.is_ok(), "{first:?}");
    assert_eq!(others, (Err(LightError::Busy), Err(LightError::Busy)));
    rig.state("the end", |state| state.mode == LightMode::Idle).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_sequence_that_nobody_waits_for_is_aborted_and_the_next_one_runs() {
    let Some(rig) = Rig::start().await else { return };
    let long = sequence(Duration::from_millis(500), Duration::from_millis(10));
    let dropped = tokio::time::timeout(Duration::from_millis(700), rig.lights.run_sequence(long));
    assert!(dropped.await.is_err());
    let report = rig.lights.run_sequence(capture()).await.expect("the next one runs");
    assert_eq!(report.steps.len(), 8);
    assert!(rig.board.is_dark());
    let lit = pulses(&rig.board.edges(), Pin::Panel(1));
    let (on, off) = lit[0];
    let micros = (off.cycle - on.cycle) as f64 / CYCLES_PER_MICRO;
    println!("L1 was lit for {micros} us of 500000");
    assert!(micros < 450_000.0, "it was aborted");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_out_of_range_is_refused_and_nothing_is_lit() {
    let Some(rig) = Rig::start().await else { return };
    let refusal = async |change: &dyn Fn(&mut LightSequence)| {
        let mut asked = capture();
        change(&mut asked);
        match rig.lights.run_sequence(asked).await {
            Err(LightError::Refused { reason }) => reason,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(
        refusal(&|asked| asked.steps[3].on_time = Duration::from_secs(2)).await,
        "the on-time of step 3 is 2000000 us, allowed are 200 to 1000000 us"
    );
    assert_eq!(
        refusal(&|asked| asked.steps[0].gap = Duration::ZERO).await,
        "the gap of step 0 is 0 us, allowed are 100 to 1000000 us"
    );
    assert_eq!(
        refusal(&|asked| asked.trigger_width = Duration::from_millis(3)).await,
        "the trigger's width of step 0 is 3000 us, allowed are 64 to 2436 us"
    );
    assert_eq!(
        refusal(&|asked| asked.steps.truncate(0)).await,
        "a sequence of 0 steps, allowed are 1 to 16"
    );
    assert!(rig.board.is_dark());
}

/// A real Uno resets when its port is opened, and is in its boot loader for a while.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_board_that_resets_when_its_port_is_opened_is_greeted_until_it_answers() {
    let config = BoardConfig {
        reset_on_open: Some(Duration::from_millis(1500)),
        ..BoardConfig::default()
    };
    let Some(board) = Board::start(&config) else { return };
    let Some(rig) = Rig::with_board(board).await else {
        return;
    };
    assert_eq!(
        rig.lights.run_sequence(capture()).await.expect("it runs").steps.len(),
        8
    );
}
