//! Panels set by hand.

use std::time::{Duration, Instant};

use devices::{LightBank, LightError, LightMode, PanelSet};
use sim::board::Pin;

use crate::rig::{Rig, pulses};

const ALL: PanelSet = PanelSet([true; 7]);

fn only(number: usize) -> PanelSet {
    PanelSet(std::array::from_fn(|index| index + 1 == number))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn panels_go_off_by_themselves() {
    let Some(rig) = Rig::start().await else { return };
    // Longer than the firmware's watchdog: the driver keeps it awake.
    let duration = Duration::from_millis(900);
    let asked = Instant::now();
    rig.lights.set(only(3), duration).await.expect("it is lit");
    let state = rig.lights.state().borrow().clone();
    assert_eq!(state.on, only(3));
    let LightMode::Manual { until } = state.mode else {
        panic!("{state:?}");
    };
    let planned = until.saturating_duration_since(asked);
    assert!(
        planned >= duration && planned < duration + Duration::from_millis(500),
        "{planned:?}"
    );
    rig.state("the end", |state| {
        state.mode == LightMode::Idle && state.on == PanelSet::NONE
    })
    .await;
    let lit = pulses(&rig.board.edges(), Pin::Panel(3));
    let micros = (lit[0].1.cycle - lit[0].0.cycle) / 16;
    println!("lit for {micros} us of 900000");
    assert!(micros.abs_diff(900_000) < 500);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn panels_replace_each_other_and_off_is_at_once() {
    let Some(rig) = Rig::start().await else { return };
    rig.lights
        .set(only(1), Duration::from_secs(10))
        .await
        .expect("it is lit");
    rig.lights
        .set(only(2), Duration::from_secs(10))
        .await
        .expect("it is lit");
    assert_eq!(rig.lights.state().borrow().on, only(2));
    assert_eq!(pulses(&rig.board.edges(), Pin::Panel(1)).len(), 1);
    rig.lights.off().await.expect("it is off");
    assert!(rig.board.is_dark());
    rig.state("idle", |state| state.mode == LightMode::Idle).await;
    // Nothing on is the same as off.
    rig.lights
        .set(only(4), Duration::from_secs(10))
        .await
        .expect("it is lit");
    rig.lights
        .set(PanelSet::NONE, Duration::from_secs(10))
        .await
        .expect("it is off");
    assert!(rig.board.is_dark());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_duration_out_of_range_is_refused_and_changes_nothing() {
    let Some(rig) = Rig::start().await else { return };
    rig.lights
        .set(only(5), Duration::from_secs(10))
        .await
        .expect("it is lit");
    for wrong in [Duration::ZERO, Duration::from_secs(61)] {
        let outcome = rig.lights.set(ALL, wrong).await;
        assert!(
            matches!(&outcome, Err(LightError::Refused { reason }) if reason.contains("at most 60 s")),
            "{outcome:?}"
        );
    }
    assert_eq!(rig.lights.state().borrow().on, only(5));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_panel_that_has_been_on_for_too_long_is_refused_by_the_firmware() {
    let Some(rig) = Rig::start().await else { return };
    let half = Duration::from_secs(59);
    rig.lights.set(only(6), half).await.expect("within the budget");
    // While it is lit its whole time is spoken for, but a SET gives back what the one before it did not use.
    rig.lights.set(only(6), half).await.expect("the rest was given back");
    rig.lights.off().await.expect("off");
    assert!(rig.board.is_dark());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_dropped_driver_leaves_the_lights_off() {
    let Some(rig) = Rig::start().await else { return };
    rig.lights.set(ALL, Duration::from_secs(10)).await.expect("it is lit");
    let asked = Instant::now();
    drop(rig.lights);
    rig.board.goes_dark();
    println!("off {:?} after the drop", asked.elapsed());
    assert!(
        asked.elapsed() < Duration::from_millis(400),
        "by an OFF, not by silence"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_closed_driver_has_turned_the_lights_off() {
    let Some(rig) = Rig::start().await else { return };
    rig.lights.set(ALL, Duration::from_secs(10)).await.expect("it is lit");
    rig.lights.close().await;
    assert!(rig.board.is_dark());
}
