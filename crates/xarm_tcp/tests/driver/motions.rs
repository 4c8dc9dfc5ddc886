//! Arming, streaming, stopping.

use std::time::{Duration, Instant};

use devices::{Arm, ArmCondition, ArmError, JointValues, StreamFault};
use sim::arm::{ArmFaults, ArmMoment};
use xarm_protocol::{Mode, State};

use crate::rig::{HOME, PATIENCE, Rig, SWING_SPEED, Sender, swing};

/// So far a set-point sent as a single-precision number may be off, radians.
const ROUNDING: f64 = 1e-6;

fn apart(one: &JointValues, other: &JointValues) -> f64 {
    let differences = one.iter().zip(other).map(|(one, other)| (one - other).abs());
    differences.fold(0.0, f64::max)
}

#[tokio::test(flavor = "multi_thread")]
async fn two_seconds_at_250_hz_all_arrive_in_order() {
    let rig = Rig::connected().await;
    let begun = Instant::now();
    let stream = rig.armed().await;
    println!("armed within {:?}", begun.elapsed());
    rig.wait_for_condition(ArmCondition::Armed).await;
    let sender = Sender::start(stream, Duration::from_secs(2));
    let fast = |state: &devices::ArmState| {
        let reading = state.joints.filter(|_| state.condition == ArmCondition::Moving);
        reading.is_some_and(|reading| reading.velocities[6].abs() > 0.9 * SWING_SPEED)
    };
    let state = rig.wait_for(fast).await;
    let speed = state.joints.expect("it moves").velocities[6].abs();
    println!("fastest is {SWING_SPEED:.3} rad/s, seen {speed:.3} rad/s");
    let sent = sender.end().await;
    assert_eq!((sent.fault, sent.count), (None, 500));
    rig.arm.stop().await.expect("it stops");
    let trace = rig.controller.take_servo_trace();
    assert_eq!(trace.len(), 500);
    for (number, point) in trace.iter().enumerate() {
        assert!(point.taken, "set-point {number}");
        assert!(apart(&point.angles, &swing(number as f64 * 0.004)) < ROUNDING);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stop_ends_the_stream_and_is_confirmed() {
    let rig = Rig::connected().await;
    let sender = Sender::start(rig.armed().await, PATIENCE);
    rig.wait_for_condition(ArmCondition::Moving).await;
    let asked = Instant::now();
    rig.arm.stop().await.expect("it stops");
    println!("stopped, and confirmed, within {:?}", asked.elapsed());
    assert_eq!(rig.controller.moment().state, State::Stopped);
    assert_eq!(rig.arm.state().borrow().condition, ArmCondition::Stopped);
    let sent = sender.end().await;
    assert_eq!(sent.fault, Some(StreamFault::NotReady));
    println!(
        "the stream ended {:?} after the stop was asked for",
        sent.ended_at - asked
    );
    rig.arm.stop().await.expect("an arm that stands can be stopped");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stop_comes_before_an_arming_that_is_under_way() {
    let rig = Rig::connected().await;
    let slow = ArmFaults {
        delay: Duration::from_millis(100),
        ..ArmFaults::default()
    };
    rig.controller.set_faults(slow);
    let (armed, stopped) = tokio::join!(rig.arm.arm(), rig.arm.stop());
    assert!(matches!(armed.err(), Some(ArmError::Refused { .. })));
    stopped.expect("it stops");
    rig.wait_for_condition(ArmCondition::Stopped).await;
    assert_eq!(rig.controller.moment().state, State::Stopped);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_arm_that_is_armed_anew_has_one_stream() {
    let rig = Rig::connected().await;
    let mut old = rig.armed().await;
    old.send(&HOME).expect("it is armed");
    let mut new = rig.armed().await;
    assert_eq!(old.send(&HOME), Err(StreamFault::NotReady));
    new.send(&HOME).expect("it is armed");
    drop(new);
    rig.wait_for_condition(ArmCondition::Disarmed).await;
    assert_eq!(rig.arm.statistics().streams, 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn jumps_and_what_is_no_number_never_leave() {
    let rig = Rig::connected().await;
    for wrong in [f64::NAN, f64::INFINITY, 1e300, HOME[3] + 0.2] {
        let mut stream = rig.armed().await;
        let mut angles = HOME;
        angles[3] = wrong;
        assert_eq!(stream.send(&angles), Err(StreamFault::Refused));
        assert_eq!(stream.send(&HOME), Err(StreamFault::Refused), "it has ended");
        rig.wait_for_condition(ArmCondition::Stopped).await;
    }
    assert!(rig.controller.take_servo_trace().is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn closing_stops_an_arm_that_follows() {
    let Rig { arm, controller } = Rig::connected().await;
    let stream = arm.arm().await.expect("it can be armed");
    assert_eq!(controller.moment().mode, Mode::Servo);
    let mut stream = stream;
    arm.close().await;
    let ArmMoment { state, velocities, .. } = controller.moment();
    assert_eq!((state, velocities), (State::Stopped, [0.0; 7]));
    assert_eq!(stream.send(&HOME), Err(StreamFault::NotReady));
}
