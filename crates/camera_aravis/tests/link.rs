//! Cameras that are refused, held by others, lost and found again.

mod common;

use std::time::{Duration, Instant};

use camera_aravis::{AravisCamera, CameraConfig, probe};
use common::{
    Rival, address, config, device, is_picture, next, next_frame, open, pulse, serve, settings, wait_for, wait_lost,
    wait_open,
};
use devices::{Camera, CameraError, CameraLink, CameraSettings, Region, TriggerMode};
use gige_vision::{Faults, Register};

async fn refused(camera: &AravisCamera, settings: CameraSettings) -> String {
    match camera.configure(settings).await {
        Err(error @ CameraError::Setting { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    }
}

#[tokio::test]
async fn what_the_camera_cannot_do_is_refused_with_its_range_and_changes_nothing() {
    let Some(server) = serve(1) else { return };
    let (camera, before) = open(config(1), TriggerMode::Line).await;
    let good = settings(TriggerMode::Line);
    let exposure = refused(
        &camera,
        CameraSettings {
            exposure: Duration::from_secs(5),
            gain_db: 1.0,
            ..good
        },
    );
    assert_eq!(
        exposure.await,
        format!(
            "camera {}: ExposureTime = 5000000 is refused: the camera allows 10 to 1000000",
            address(1)
        )
    );
    let gain = CameraSettings {
        gain_db: f64::NAN,
        ..good
    };
    assert!(
        refused(&camera, gain)
            .await
            .contains("Gain = NaN is refused: the camera allows 0 to 24")
    );
    let outside = CameraSettings {
        region: Some(Region {
            x: 100,
            y: 0,
            width: 64,
            height: 64,
        }),
        ..good
    };
    assert!(
        refused(&camera, outside)
            .await
            .contains("OffsetX = 100 is refused: the camera allows 0 to 64")
    );
    let odd = CameraSettings {
        region: Some(Region {
            x: 0,
            y: 0,
            width: 127,
            height: 64,
        }),
        ..good
    };
    assert!(refused(&camera, odd).await.contains("in steps of 4"));
    assert_eq!(server.register(Register::ExposureTime), 500_000);
    assert_eq!(server.register(Register::Width), before.width);
    let mut frames = camera.arm(1).await.unwrap();
    pulse(&[&server], 1);
    next_frame(&mut frames).await;
}

#[tokio::test]
async fn a_trigger_line_that_the_camera_lacks_is_named_with_those_it_has() {
    let Some(_server) = serve(2) else { return };
    let camera = AravisCamera::open(CameraConfig {
        trigger_line: "Line7".into(),
        ..config(2)
    });
    wait_open(&camera).await;
    let reason = refused(&camera, settings(TriggerMode::Line)).await;
    assert!(
        reason.contains("TriggerSource = Line7 is refused: the camera knows Software, Line0"),
        "{reason}"
    );
    let unset = camera.arm(1).await.unwrap_err().to_string();
    assert!(unset.contains("has not been configured"), "{unset}");
}

#[tokio::test]
async fn a_camera_that_falls_silent_is_lost_and_comes_back_as_it_was() {
    let Some(server) = serve(3) else { return };
    let (camera, _) = open(config(3), TriggerMode::Line).await;
    let mut frames = camera.arm(8).await.unwrap();
    pulse(&[&server], 2);
    assert!(is_picture(&next_frame(&mut frames).await, 0));
    assert!(is_picture(&next_frame(&mut frames).await, 1));
    server.set_faults(Faults {
        muted: true,
        ..Faults::default()
    });
    assert!(next(&mut frames).await.is_none(), "frames of a camera that is gone");
    let reason = wait_lost(&camera).await;
    assert!(reason.contains("control of the camera is lost"), "{reason}");
    let refused = camera.arm(1).await.unwrap_err();
    assert!(matches!(refused, CameraError::Lost { .. }), "{refused}");
    server.set_faults(Faults::default());
    let back = Instant::now();
    wait_open(&camera).await;
    let took = back.elapsed();
    println!("open again after {took:?}");
    assert!(took < Duration::from_secs(10), "{took:?}");
    let mut frames = camera.arm(1).await.unwrap();
    pulse(&[&server], 1);
    next_frame(&mut frames).await;
}

#[tokio::test]
async fn a_camera_that_dies_is_found_again_when_it_is_switched_on() {
    let Some(server) = serve(4) else { return };
    let (camera, _) = open(config(4), TriggerMode::Line).await;
    let mut frames = camera.arm(8).await.unwrap();
    server.die();
    assert!(next(&mut frames).await.is_none());
    wait_lost(&camera).await;
    let Some(server) = serve(4) else { return };
    let back = Instant::now();
    wait_open(&camera).await;
    println!("open again after {:?}", back.elapsed());
    assert!(back.elapsed() < Duration::from_secs(10));
    assert_eq!(
        server.register(Register::ExposureTime),
        500_000,
        "the settings are set again"
    );
    let mut frames = camera.arm(1).await.unwrap();
    pulse(&[&server], 1);
    next_frame(&mut frames).await;
}

#[tokio::test]
async fn a_camera_that_another_client_holds_opens_when_it_is_let_go() {
    let Some(server) = serve(5) else { return };
    let rival = Rival::take(server.address());
    let camera = AravisCamera::open(config(5));
    let reason = wait_lost(&camera).await;
    assert_eq!(
        reason,
        format!("another client holds control of the camera at {}", address(5))
    );
    assert!(probe(address(5)).unwrap().in_use);
    rival.let_go();
    wait_open(&camera).await;
}

#[tokio::test]
async fn an_absent_camera_is_lost_with_its_address() {
    let camera = AravisCamera::open(config(6));
    let reason = wait_lost(&camera).await;
    assert_eq!(reason, format!("no camera answers at {}", address(6)));
    let silent = probe(address(6)).unwrap_err().to_string();
    assert!(silent.contains("no GigE Vision camera answers"), "{silent}");
}

#[tokio::test]
async fn dropping_the_driver_releases_the_camera_at_once() {
    let Some(server) = serve(7) else { return };
    let (camera, _) = open(config(7), TriggerMode::Line).await;
    assert!(server.controller().is_some() && server.is_acquiring());
    let mut frames = camera.arm(1).await.unwrap();
    drop(camera);
    assert!(server.controller().is_none(), "control was kept");
    assert!(!server.is_acquiring());
    assert!(next(&mut frames).await.is_none());
}

#[tokio::test]
async fn a_camera_is_found_by_its_serial_number_and_tells_who_it_is() {
    let Some(_server) = serve(8) else { return };
    let serial = device(8).serial;
    let camera = AravisCamera::open(CameraConfig::new(serial.as_str()));
    let link = wait_for(&camera, "it is not found", |link| {
        matches!(link, CameraLink::Open { .. })
    })
    .await;
    let CameraLink::Open { identity, .. } = link else {
        unreachable!()
    };
    assert_eq!(
        (identity.serial.as_str(), identity.address),
        (serial.as_str(), address(8).to_string())
    );
    let sighting = probe(address(8)).unwrap();
    assert_eq!((sighting.identity.serial, sighting.in_use), (serial, true));
}

#[tokio::test]
async fn a_bad_configuration_is_said_and_not_tried() {
    let camera = AravisCamera::open(CameraConfig {
        packet_size: 10,
        ..config(9)
    });
    let reason = wait_lost(&camera).await;
    assert!(
        reason.contains("packet_size = 10 is not allowed; allowed: 576 to 65000"),
        "{reason}"
    );
}
