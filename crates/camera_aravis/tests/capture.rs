//! Frames of a served camera, through the real library and real sockets.

mod common;

use std::time::{Duration, Instant};

use common::{
    PERIOD, SIDE, config, is_picture, next, next_fault, next_frame, open, packet_socket, pulse, serve, settings,
    statistic, wait_for,
};
use devices::{Camera, CameraError, CameraLink, CameraSettings, FrameEvent, FrameFault, Region, TriggerMode};
use gige_vision::{Faults, Register};

#[tokio::test]
async fn two_cameras_deliver_eight_frames_each_of_one_line() {
    let (Some(first), Some(second)) = (serve(1), serve(2)) else {
        return;
    };
    let (c1, applied) = open(packet_socket(1), TriggerMode::Line).await;
    let (c2, _) = open(config(2), TriggerMode::Line).await;
    assert_eq!((applied.width, applied.height), (SIDE, SIDE));
    let (mut frames_1, mut frames_2) = (c1.arm(8).await.unwrap(), c2.arm(8).await.unwrap());
    let armed_at = Instant::now();
    pulse(&[&first, &second], 8);
    for frames in [&mut frames_1, &mut frames_2] {
        let mut before = None;
        for index in 0..8 {
            let frame = next_frame(frames).await;
            assert_eq!(frame.index, index);
            assert!(is_picture(&frame, index as u32), "frame {index} has other pixels");
            assert!(frame.received_at > armed_at);
            if let Some(before) = before {
                assert_eq!(frame.exposed_at, before + PERIOD, "the line was pulsed by a timer");
            }
            before = Some(frame.exposed_at);
        }
        assert!(next(frames).await.is_none(), "more frames than were asked for");
    }
}

#[tokio::test]
async fn a_software_trigger_gives_a_frame() {
    let Some(_server) = serve(3) else { return };
    let (camera, _) = open(config(3), TriggerMode::Software).await;
    let mut frames = camera.arm(3).await.unwrap();
    for index in 0..3 {
        camera.trigger().await.unwrap();
        let frame = next_frame(&mut frames).await;
        assert_eq!(frame.index, index);
        assert!(is_picture(&frame, index as u32));
    }
    assert!(next(&mut frames).await.is_none());
}

#[tokio::test]
async fn a_software_trigger_is_refused_while_the_line_is_listened_to() {
    let Some(_server) = serve(4) else { return };
    let (camera, _) = open(config(4), TriggerMode::Line).await;
    let refused = camera.trigger().await.unwrap_err();
    assert!(
        refused.to_string().contains("allowed with TriggerSource = Software"),
        "{refused}"
    );
}

#[tokio::test]
async fn lost_packets_come_again() {
    let Some(server) = serve(5) else { return };
    // Small packets, so that there are many to lose.
    let many = camera_aravis::CameraConfig {
        packet_size: 576,
        ..config(5)
    };
    let (camera, _) = open(many, TriggerMode::Line).await;
    server.set_faults(Faults {
        drop_ratio: 0.02,
        drop_seed: 11,
        ..Faults::default()
    });
    let mut frames = camera.arm(8).await.unwrap();
    pulse(&[&server], 8);
    for index in 0..8 {
        let frame = next_frame(&mut frames).await;
        assert!(is_picture(&frame, index), "frame {index} was not made whole");
    }
    assert!(server.counters().packets_dropped > 0, "nothing was lost");
    let resent = |link: &CameraLink| match link {
        CameraLink::Open { statistics, .. } => statistics.iter().any(|(name, n)| name == "packets_resent" && *n > 0),
        CameraLink::Lost { .. } => false,
    };
    wait_for(&camera, "the statistics do not tell", resent).await;
    assert_eq!(statistic(&camera, "packet_socket"), 0);
}

#[tokio::test]
async fn a_frame_beyond_help_is_a_fault_and_captures_are_whole_again_after_it() {
    let Some(server) = serve(6) else { return };
    let many = camera_aravis::CameraConfig {
        packet_size: 576,
        ..config(6)
    };
    let (camera, _) = open(many, TriggerMode::Line).await;
    // Of 63 packets a frame, so few that asking again does not help, and enough that some frame is begun.
    server.set_faults(Faults {
        drop_ratio: 0.995,
        drop_seed: 3,
        ..Faults::default()
    });
    let mut frames = camera.arm(1).await.unwrap();
    pulse(&[&server], 24);
    let fault = next_fault(&mut frames).await;
    assert!(
        matches!(&fault, FrameFault::Incomplete { .. } | FrameFault::Missing { .. }),
        "{fault:?}"
    );
    assert!(next(&mut frames).await.is_none());
    server.set_faults(Faults::default());
    // The first frame after the losses tells how many were lost before it, which may be taken for losses of its own
    // capture; never may a frame from before be taken for one of it.
    let mut frames = camera.arm(2).await.unwrap();
    pulse(&[&server], 2);
    while let Some(event) = next(&mut frames).await {
        match event {
            FrameEvent::Frame(frame) => assert!(is_picture(&frame, 24) || is_picture(&frame, 25)),
            FrameEvent::Fault(fault) => assert!(matches!(fault, FrameFault::Missing { .. }), "{fault}"),
        }
    }
    common::wait_sent(&server, 26).await;
    let mut frames = camera.arm(2).await.unwrap();
    pulse(&[&server], 2);
    for index in 0..2 {
        assert!(is_picture(&next_frame(&mut frames).await, 26 + index));
    }
}

#[tokio::test]
async fn a_short_frame_is_a_fault_of_size() {
    let Some(server) = serve(7) else { return };
    let (camera, _) = open(config(7), TriggerMode::Line).await;
    server.set_faults(Faults {
        short_frames: true,
        ..Faults::default()
    });
    let mut frames = camera.arm(1).await.unwrap();
    pulse(&[&server], 1);
    let whole = (SIDE * SIDE * 2) as usize;
    assert_eq!(
        next_fault(&mut frames).await,
        FrameFault::Size {
            found: whole / 2,
            expected: whole,
            width: SIDE,
            height: SIDE
        }
    );
}

#[tokio::test]
async fn a_frame_of_another_format_is_a_fault_of_format() {
    let Some(server) = serve(8) else { return };
    let (camera, _) = open(packet_socket(8), TriggerMode::Line).await;
    server.set_faults(Faults {
        wrong_pixel_format: true,
        ..Faults::default()
    });
    let mut frames = camera.arm(1).await.unwrap();
    pulse(&[&server], 1);
    assert_eq!(
        next_fault(&mut frames).await,
        FrameFault::Format {
            found: "Mono8".into(),
            expected: "Mono16"
        }
    );
}

#[tokio::test]
async fn frames_that_nobody_armed_for_are_never_delivered() {
    let Some(server) = serve(9) else { return };
    let (camera, _) = open(config(9), TriggerMode::Line).await;
    pulse(&[&server], 3);
    // The third leaves late, so that it is on its way while the camera is armed.
    server.set_faults(Faults {
        frame_delay: Duration::from_millis(100),
        ..Faults::default()
    });
    let exposed = Instant::now() + 4 * PERIOD;
    tokio::time::sleep_until(exposed.into()).await;
    let mut frames = camera.arm(1).await.unwrap();
    pulse(&[&server], 1);
    let frame = next_frame(&mut frames).await;
    assert_eq!(frame.index, 0);
    assert!(is_picture(&frame, 3), "a stale frame was delivered");
    assert!(next(&mut frames).await.is_none());
}

#[tokio::test]
async fn arming_again_ends_what_was_armed_before() {
    let Some(server) = serve(10) else { return };
    let (camera, _) = open(packet_socket(10), TriggerMode::Line).await;
    let mut first = camera.arm(8).await.unwrap();
    pulse(&[&server], 2);
    assert!(is_picture(&next_frame(&mut first).await, 0));
    assert!(is_picture(&next_frame(&mut first).await, 1));
    let mut second = camera.arm(1).await.unwrap();
    assert!(next(&mut first).await.is_none());
    pulse(&[&server], 1);
    assert!(is_picture(&next_frame(&mut second).await, 2));
}

#[tokio::test]
async fn images_in_use_are_not_written_to() {
    let Some(server) = serve(11) else { return };
    let few = camera_aravis::CameraConfig {
        buffers: 4,
        ..config(11)
    };
    let (camera, _) = open(few, TriggerMode::Line).await;
    let mut kept = Vec::new();
    let mut index = 0;
    for round in 0..6 {
        let mut frames = camera.arm(4).await.unwrap();
        pulse(&[&server], 4);
        for _ in 0..4 {
            let frame = next_frame(&mut frames).await;
            // Half of them are let go, so that their memory goes round.
            if index % 2 == 0 {
                kept.push((index, frame));
            }
            index += 1;
        }
        assert!(
            kept.iter().all(|(index, frame)| is_picture(frame, *index)),
            "an image changed in round {round}"
        );
    }
}

#[tokio::test]
async fn other_traffic_of_the_host_never_becomes_part_of_a_frame() {
    let Some(server) = serve(15) else { return };
    let noise = common::Noise::start(16);
    let (camera, _) = open(packet_socket(15), TriggerMode::Line).await;
    let mut frames = camera.arm(4).await.unwrap();
    pulse(&[&server], 4);
    for index in 0..4 {
        assert!(is_picture(&next_frame(&mut frames).await, index));
    }
    drop(noise);
    // On a quiet host the packet socket is used, by those who may.
    camera.configure(settings(TriggerMode::Line)).await.unwrap();
    let mut frames = camera.arm(4).await.unwrap();
    pulse(&[&server], 4);
    for index in 0..4 {
        assert!(is_picture(&next_frame(&mut frames).await, index));
    }
    println!("packet socket: {}", statistic(&camera, "packet_socket"));
}

#[tokio::test]
async fn triggers_much_slower_than_the_frame_rate_all_give_frames() {
    let Some(server) = serve(12) else { return };
    let (camera, _) = open(config(12), TriggerMode::Line).await;
    let mut frames = camera.arm(3).await.unwrap();
    for index in 0..3 {
        pulse(&[&server], 1);
        assert!(is_picture(&next_frame(&mut frames).await, index));
        // The pattern under test is the pause.
        tokio::time::sleep(Duration::from_secs(1)).await;
    }
    assert!(next(&mut frames).await.is_none());
}

#[tokio::test]
async fn settings_do_not_change_while_frames_are_awaited() {
    let Some(server) = serve(13) else { return };
    let (camera, _) = open(config(13), TriggerMode::Line).await;
    let other = CameraSettings {
        exposure: Duration::from_millis(2),
        ..settings(TriggerMode::Line)
    };
    let mut frames = camera.arm(1).await.unwrap();
    let refused = camera.configure(other).await.unwrap_err();
    assert!(matches!(refused, CameraError::Armed { .. }), "{refused}");
    assert_eq!(server.register(Register::ExposureTime), 500_000);
    pulse(&[&server], 1);
    next_frame(&mut frames).await;
    let applied = camera.configure(other).await.unwrap();
    assert_eq!(applied.settings.exposure, other.exposure);
    // Who does not listen any more does not await frames.
    drop(camera.arm(1).await.unwrap());
    camera.configure(settings(TriggerMode::Line)).await.unwrap();
}

#[tokio::test]
async fn a_region_and_a_binning_give_smaller_frames() {
    let Some(server) = serve(14) else { return };
    let (camera, _) = open(config(14), TriggerMode::Line).await;
    let region = Region {
        x: 8,
        y: 10,
        width: 32,
        height: 50,
    };
    let part = CameraSettings {
        region: Some(region),
        binning: devices::Binning {
            horizontal: 2,
            vertical: 2,
        },
        gain_db: 3.5,
        black_level: 100.0,
        ..settings(TriggerMode::Line)
    };
    let applied = camera.configure(part).await.unwrap();
    assert_eq!((applied.settings, applied.width, applied.height), (part, 32, 50));
    assert_eq!(server.register(Register::BinningHorizontal), 2);
    let mut frames = camera.arm(1).await.unwrap();
    pulse(&[&server], 1);
    let frame = next_frame(&mut frames).await;
    assert_eq!((frame.width, frame.height, frame.pixels.len()), (32, 50, 3200));
    let whole = camera.configure(settings(TriggerMode::Line)).await.unwrap();
    assert_eq!((whole.width, whole.height, whole.settings.region), (SIDE, SIDE, None));
}
