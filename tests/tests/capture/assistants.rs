//! The exposure assistant and the watch on the lights.

use std::sync::Arc;

use interfaces::diagnostic_msgs::msg::{DiagnosticArray, DiagnosticStatus};
use ros::{Qos, Subscription};
use scenarios::within;

use crate::images::Reader;
use crate::rig::{Plan, Rig};

/// The next status of a part of the node that `fits`.
async fn status(
    diagnostics: &mut Subscription<DiagnosticArray>,
    part: &str,
    fits: impl Fn(&DiagnosticStatus) -> bool,
) -> DiagnosticStatus {
    let find = async {
        loop {
            let message = diagnostics.next().await.expect("the node reports").message;
            let name = format!("cell/camera_capture: {part}");
            let found = message.status.iter().find(|status| status.name == name && fits(status));
            if let Some(found) = found {
                return found.clone();
            }
        }
    };
    within(part, find).await
}

fn figure(status: &DiagnosticStatus, key: &str) -> String {
    let found = status.values.iter().find(|value| value.key == key);
    found.unwrap_or_else(|| panic!("no {key} in {status:?}")).value.clone()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_exposure_assistant_gets_to_80_per_cent_and_shows_it_in_the_parameters() {
    let Some(rig) = Rig::start(Plan {
        parameters: vec![
            ("c1.AcquisitionControl.ExposureTime", 300.0.into()),
            ("c2.AcquisitionControl.ExposureTime", 20_000.0.into()),
        ],
        ..Plan::default()
    })
    .await
    else {
        return;
    };
    let readers = [
        Reader::new(&rig.viewer, "c1").await,
        Reader::new(&rig.viewer, "c2").await,
    ];
    let answer = rig.ask("auto_exposure").await;
    println!("{}", answer.message);
    assert!(answer.success, "{}", answer.message);
    let exposure = |camera: &str| {
        let name = format!("{camera}.AcquisitionControl.ExposureTime");
        rig.camera_node
            .parameters()
            .get(&name)
            .unwrap()
            .to_string()
            .parse::<f64>()
            .unwrap()
    };
    let [first, second] = [exposure("c1"), exposure("c2")];
    assert!((first / second - 1.0).abs() < 0.05, "the same scene: {first} {second}");
    assert!(answer.message.contains("c1: 300 us -> ") && answer.message.contains("c2: 20000 us -> "));
    assert_eq!(
        (readers[0].count(), readers[1].count()),
        (0, 0),
        "its images are nobody's"
    );
    let capture = rig.capture(&[]).await;
    assert!(capture.success, "{}", capture.message);
    let taken = readers[0].taken(8).await;
    let pixels = taken.iter().flat_map(|taken| taken.image.data.chunks_exact(2));
    let brightest = pixels
        .map(|pixel| u16::from_le_bytes([pixel[0], pixel[1]]))
        .max()
        .unwrap();
    let share = f64::from(brightest) / 65_520.0;
    assert!((0.78..0.86).contains(&share), "{share}");
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_exposure_assistant_says_when_it_sees_nothing_and_changes_nothing() {
    let Some(rig) = Rig::start(Plan {
        parameters: vec![
            ("c1.AcquisitionControl.ExposureTime", 100_000.0.into()),
            ("cameras", vec!["c1".to_owned()].into()),
        ],
        only_first: true,
        ..Plan::default()
    })
    .await
    else {
        return;
    };
    (1..=7).for_each(|output| rig.wires.rewire(output, 0));
    let answer = rig.ask("auto_exposure").await;
    assert!(
        !answer.success && answer.message.contains("all dark"),
        "{}",
        answer.message
    );
    let exposure = rig
        .camera_node
        .parameters()
        .get("c1.AcquisitionControl.ExposureTime")
        .unwrap();
    assert_eq!(exposure, 100_000.0.into());
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn dead_and_swapped_panels_are_told_of() {
    let Some(rig) = Rig::start(Plan::default()).await else {
        return;
    };
    let mut diagnostics = rig
        .viewer
        .subscription::<DiagnosticArray>("/diagnostics", Qos::STREAM)
        .unwrap();
    let answer = rig.ask("set_light_reference").await;
    assert!(
        !answer.success && answer.message.contains("take one first"),
        "{answer:?}"
    );
    assert!(rig.capture(&[]).await.success);
    let good = status(&mut diagnostics, "lights", |status| status.message.contains("in order")).await;
    assert_eq!(good.level, DiagnosticStatus::OK);
    assert_eq!(figure(&good, "c1 L2 azimuth"), "90 deg");
    assert!(figure(&good, "c2 ambient").parse::<f64>().unwrap() >= 380.0);
    let answer = rig.ask("set_light_reference").await;
    assert!(
        answer.success && answer.message.contains("c1 from ") && answer.message.contains("c2 from "),
        "{answer:?}"
    );
    let reference = rig.camera_node.parameters().get("c1.light_reference").unwrap();
    assert!(matches!(reference, ros::ParameterValue::Floats(signals) if signals.len() == 7));

    rig.wires.rewire(3, 0);
    rig.wires.rewire(5, 6);
    rig.wires.rewire(6, 5);
    assert!(rig.capture(&[]).await.success);
    let bad = status(&mut diagnostics, "lights", |status| {
        status.level == DiagnosticStatus::ERROR
    })
    .await;
    for expected in [
        "c1: L3 is dark",
        "c2: L3 is dark",
        "c1: L5 shines from",
        "where L6 should be",
        "where L5 should be",
    ] {
        assert!(bad.message.contains(expected), "{expected}: {}", bad.message);
    }
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn cameras_tell_of_themselves_and_of_void_captures() {
    let Some(rig) = Rig::start(Plan {
        parameters: vec![("repeats", 0.into())],
        ..Plan::default()
    })
    .await
    else {
        return;
    };
    let mut diagnostics = rig
        .viewer
        .subscription::<DiagnosticArray>("/diagnostics", Qos::STREAM)
        .unwrap();
    let answer = rig.capture(&[]).await;
    assert!(answer.success, "{}", answer.message);
    let good = status(&mut diagnostics, "c2", |status| figure(status, "captures") == "1").await;
    assert_eq!(
        (good.level, figure(&good, "serial").as_str()),
        (DiagnosticStatus::OK, "T2")
    );
    assert_eq!(figure(&good, "last capture"), answer.capture_id);
    assert_eq!(good.hardware_id, rig.address(2).to_string());
    let wires = Arc::clone(&rig.wires);
    rig.wires.hook(|_, _| false);
    let reason = rig.failed_capture().await;
    wires.unhook();
    let void = status(&mut diagnostics, "c1", |status| status.level == DiagnosticStatus::WARN).await;
    assert_eq!(figure(&void, "void captures"), "1");
    assert!(void.message.contains(&reason), "{}", void.message);
    rig.stop().await;
}
