//! The report ports.

use std::time::{Duration, Instant};

use client::{Client, Reports, of_firmware, start};
use sim::arm::{ArmController, ArmFaults};
use xarm_protocol::{Mode, ReportKind, Request, State};

use crate::client;

#[test]
fn reports_of_every_firmware_are_read() {
    for version in ["v1.8.4", "v1.12.10", "v2.5.5", "v2.8.1"] {
        let arm = ArmController::start(of_firmware(version)).expect("an arm");
        for kind in [ReportKind::Normal, ReportKind::Rich, ReportKind::Real] {
            let report = Reports::connect(&arm, kind).next();
            assert_eq!((report.state, report.mode), (State::Stopped, Mode::Position));
            for (joint, angle) in report.joints.iter().zip([0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0]) {
                assert!((joint - angle).abs() < 1e-6);
            }
            assert!((report.pose[0] - 350.6483).abs() < 1e-3 && (report.pose[2] - 374.0272).abs() < 1e-3);
            assert_eq!(report.condition.is_some(), kind != ReportKind::Real);
            if let Some(details) = report.details {
                assert_eq!((details.version.as_str(), details.axes), (version, 7));
            }
        }
    }
}

#[test]
fn ports_have_their_rates() {
    let arm = start();
    let begin = Instant::now();
    let mut ports = [ReportKind::Real, ReportKind::Rich, ReportKind::Normal].map(|kind| Reports::connect(&arm, kind));
    for reports in &mut ports {
        reports.next();
    }
    for _ in 0..100 {
        ports[0].next();
    }
    let took = begin.elapsed();
    println!("100 real-time reports in {took:.2?}");
    // A busy machine is slower, none is faster; what has come before the first was read counts little.
    assert!(took > Duration::from_millis(900), "{took:?}");
    arm.switch_off();
    let [rest, rich, normal] = ports.map(|mut reports| std::iter::from_fn(|| reports.read()).count());
    // All ports keep the same time, so that their shares are exact.
    let real = (100 + rest) as f64 / 20.0;
    assert!(
        (rich as f64 - real).abs() <= 1.5,
        "{rich} rich reports, {real} expected"
    );
    assert!(
        (normal as f64 - real).abs() <= 1.5,
        "{normal} normal reports, {real} expected"
    );
}

#[test]
fn reports_tell_of_errors_settings_and_motors() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.enable(Mode::Servo);
    client.call(&Request::SetTcpOffset([0.0, 0.0, 126.0, 0.0, 0.0, 0.0]));
    client.call(&Request::SetTcpLoad {
        mass: 0.61,
        centre: [0.0, 0.0, 53.0],
    });
    let mut reports = Reports::connect(&arm, ReportKind::Rich);
    let report = reports.next();
    let condition = report.condition.expect("rich");
    assert_eq!((report.state, report.mode), (State::Changed, Mode::Servo));
    assert_eq!((condition.brakes, condition.enabled), (0x7F, 0x7F));
    assert_eq!(
        (condition.tcp_offset[2], condition.load),
        (126.0, [0.61, 0.0, 0.0, 53.0])
    );
    // The tool looks down.
    assert!((report.pose[2] - (374.0272 - 126.0)).abs() < 1e-2);
    arm.raise_error(13);
    arm.raise_warning(11);
    let condition = loop {
        let report = reports.next();
        let condition = report.condition.expect("rich");
        if condition.error != 0 {
            assert_eq!(report.details.expect("rich").servos[2], [3, 23]);
            break condition;
        }
    };
    assert_eq!((condition.error, condition.warning, condition.enabled), (13, 11, 0));
}

#[test]
fn a_client_that_hangs_up_leaves_the_others() {
    let arm = start();
    let mut reports = Reports::connect(&arm, ReportKind::Real);
    for _ in 0..5 {
        drop(Reports::connect(&arm, ReportKind::Real));
        reports.next();
    }
    reports.next();
}

#[test]
fn reports_can_be_odd_or_missing() {
    let arm = start();
    let mut reports = Reports::connect(&arm, ReportKind::Real);
    reports.next();
    arm.send_odd_report();
    let odd = std::iter::repeat_with(|| reports.read().expect("open")).find_map(Result::err);
    assert!(odd.expect("it comes").to_string().contains("88 bytes"));
    arm.set_faults(ArmFaults {
        no_reports: true,
        ..ArmFaults::default()
    });
    let mut reports = Reports::connect(&arm, ReportKind::Real);
    let micros = arm.moment().micros;
    arm.set_faults(ArmFaults::default());
    reports.next();
    assert!(arm.moment().micros >= micros);
}

#[test]
fn load_on_the_cup_is_felt() {
    let torque = |mass: f32| {
        let arm = start();
        let mut client = Client::connect(&arm);
        client.call(&Request::SetTcpLoad { mass, centre: [0.0; 3] });
        client
            .call(&Request::GetJointTorques)
            .read_floats::<7>()
            .expect("seven")[1]
    };
    // 1 kg at 0.3506 m before the shoulder.
    assert!(((torque(1.0) - torque(0.0)).abs() - 0.350_648 * 9.80665).abs() < 1e-3);
}
