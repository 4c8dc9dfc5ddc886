//! What a network, or a controller that goes away, does to a motion.

use std::time::{Duration, Instant};

use devices::{Arm, ArmCondition, ArmError, StreamFault};
use sim::arm::ArmFaults;
use xarm_protocol::State;

use crate::rig::{PATIENCE, Rig, Sender, is_connected, lost_reason};

#[tokio::test(flavor = "multi_thread")]
async fn a_controller_that_goes_away_mid_motion_is_found_when_it_is_back() {
    let rig = Rig::connected().await;
    let sender = Sender::start(rig.armed().await, PATIENCE);
    rig.wait_for_condition(ArmCondition::Moving).await;
    rig.controller.switch_off();
    let lost = rig.wait_for(|state| !is_connected(state)).await;
    assert!(lost.joints.is_some(), "the last that was measured stays");
    assert_eq!(lost.condition, ArmCondition::Unknown);
    assert_eq!(sender.end().await.fault, Some(StreamFault::Disconnected));
    rig.wait_for(|state| lost_reason(state).is_some_and(|reason| reason.contains("cannot connect")))
        .await;
    assert!(matches!(rig.arm.stop().await, Err(ArmError::Disconnected { .. })));
    let back = Instant::now();
    rig.controller.switch_on().expect("its ports are free");
    rig.wait_for(is_connected).await;
    println!("found again within {:?}", back.elapsed());
    assert_eq!(rig.arm.statistics().reconnects(), 1);
    rig.armed().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn connections_that_are_cut_are_made_anew() {
    let rig = Rig::connected().await;
    let sender = Sender::start(rig.armed().await, PATIENCE);
    rig.wait_for_condition(ArmCondition::Moving).await;
    rig.controller.drop_clients();
    assert_eq!(sender.end().await.fault, Some(StreamFault::Disconnected));
    let mut state = rig.arm.state();
    let again = state.wait_for(|state| is_connected(state) && rig.arm.statistics().reconnects() == 1);
    tokio::time::timeout(PATIENCE, again)
        .await
        .expect("in time")
        .expect("it runs");
    rig.wait_for_condition(ArmCondition::Disarmed).await;
    rig.armed().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_pause_of_15_ms_loses_nothing() {
    let rig = Rig::connected().await;
    let sender = Sender::start(rig.armed().await, Duration::from_millis(600));
    rig.wait_for_condition(ArmCondition::Moving).await;
    rig.controller.pause_network(Duration::from_millis(15));
    let sent = sender.end().await;
    assert_eq!((sent.fault, sent.count), (None, 150));
    rig.arm.stop().await.expect("it stops");
    let trace = rig.controller.take_servo_trace();
    assert_eq!(trace.iter().filter(|point| point.taken).count(), 150);
    assert_eq!(rig.arm.statistics().report_failures, 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_pause_of_half_a_second_ends_the_stream_and_stops_the_arm() {
    let rig = Rig::connected().await;
    let sender = Sender::start(rig.armed().await, PATIENCE);
    rig.wait_for_condition(ArmCondition::Moving).await;
    let paused = Instant::now();
    rig.controller.pause_network(Duration::from_millis(500));
    let sent = sender.end().await;
    println!("silence noticed after {:?}", sent.ended_at - paused);
    assert_eq!(sent.fault, Some(StreamFault::Silent));
    let lost = rig.wait_for(|state| !is_connected(state)).await;
    assert!(
        lost_reason(&lost).is_some_and(|reason| reason.contains("real-time reports")),
        "{lost:?}"
    );
    rig.wait_for_condition(ArmCondition::Stopped).await;
    assert_eq!(rig.controller.moment().state, State::Stopped);
    assert_eq!(rig.arm.statistics().reconnects(), 0, "the control connection was kept");
    rig.armed().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_report_of_an_odd_length_closes_its_connection_only() {
    let rig = Rig::connected().await;
    let mut lost = rig.arm.state();
    rig.controller.send_odd_report();
    let lost = tokio::time::timeout(PATIENCE, lost.wait_for(|state| !is_connected(state))).await;
    let reason = lost.expect("in time").expect("it runs").clone();
    assert!(
        lost_reason(&reason).is_some_and(|reason| reason.contains("bytes")),
        "{reason:?}"
    );
    rig.wait_for(is_connected).await;
    let statistics = rig.arm.statistics();
    assert_eq!((statistics.report_failures, statistics.connections), (1, 1));
}

#[tokio::test(flavor = "multi_thread")]
async fn an_arm_that_is_not_seen_does_not_move() {
    let rig = Rig::connected().await;
    let sender = Sender::start(rig.armed().await, PATIENCE);
    rig.wait_for_condition(ArmCondition::Moving).await;
    let blind = ArmFaults {
        no_reports: true,
        ..ArmFaults::default()
    };
    rig.controller.set_faults(blind);
    assert_eq!(sender.end().await.fault, Some(StreamFault::Disconnected));
    let lost = rig.wait_for(|state| !is_connected(state)).await;
    assert!(
        lost_reason(&lost).is_some_and(|reason| reason.contains("none came within 200ms")),
        "{lost:?}"
    );
    rig.controller.set_faults(ArmFaults::default());
    rig.wait_for_condition(ArmCondition::Stopped).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_controller_that_answers_nothing_is_lost_within_two_seconds() {
    let rig = Rig::connected().await;
    let silent = ArmFaults {
        silent: true,
        ..ArmFaults::default()
    };
    rig.controller.set_faults(silent);
    let begun = Instant::now();
    let lost = rig.wait_for(|state| !is_connected(state)).await;
    println!("noticed after {:?}", begun.elapsed());
    assert!(
        lost_reason(&lost).is_some_and(|reason| reason.contains("did not answer")),
        "{lost:?}"
    );
    rig.controller.set_faults(ArmFaults::default());
    rig.wait_for(is_connected).await;
}
