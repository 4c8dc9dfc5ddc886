//! Captures that succeed.

use std::sync::Arc;
use std::time::{Duration, Instant};

use interfaces::builtin_interfaces::msg::Time;
use interfaces::rakelight_msgs::srv::CaptureRequest;
use interfaces::tf2_msgs::msg::TFMessage;
use ros::Qos;
use scenarios::{TIMEOUT, within};

use crate::images::{Reader, Taken};
use crate::rig::{POSE, Plan, Rig, SHORT};

/// Whether an image shows what its exposure says: dark, from above, or brighter towards the panel.
fn shows_its_light(taken: &Taken) -> bool {
    let [right, down] = taken.slopes();
    let steepness = right.hypot(down);
    match taken.exposure.channel {
        0 => taken.pixel(3, 3) < 1000,
        7 => taken.pixel(3, 3) > 5000 && steepness < 0.05,
        channel => {
            // Image x is base y: the angle from the downward axis is the azimuth.
            let azimuth = right.atan2(down).to_degrees().rem_euclid(360.0);
            let expected = 30.0 + 60.0 * f64::from(channel - 1);
            steepness > 0.5 && (azimuth - expected).abs() < 10.0
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_capture_is_eight_images_of_each_camera_under_the_light_they_name() {
    let Some(rig) = Rig::start(Plan::default()).await else {
        return;
    };
    let readers = [
        Reader::new(&rig.viewer, "c1").await,
        Reader::new(&rig.viewer, "c2").await,
    ];
    let answer = rig.capture(&[]).await;
    assert!(answer.success, "{}", answer.message);
    assert_eq!((answer.count, answer.repeats, answer.timing.succeeded), (8, 0, true));
    let mut stamps = Vec::new();
    for (reader, frame_id) in readers.iter().zip(["c1_optical_frame", "c2_optical_frame"]) {
        let taken = reader.taken(8).await;
        for (index, taken) in taken.iter().enumerate() {
            let exposure = &taken.exposure;
            assert_eq!(
                (exposure.index as usize, exposure.channel as usize, exposure.count),
                (index, index, 8)
            );
            assert_eq!(
                (&exposure.capture_id, exposure.header.frame_id.as_str()),
                (&answer.capture_id, frame_id)
            );
            assert_eq!(exposure.exposure_time.nanosec, 2_500_000);
            assert_eq!(
                (taken.image.encoding.as_str(), taken.image.width, taken.info.width),
                ("mono16", 96, 96)
            );
            assert!(shows_its_light(taken), "{exposure:?}: {:?}", taken.slopes());
        }
        stamps.push(taken.iter().map(|taken| taken.image.header.stamp).collect::<Vec<_>>());
    }
    assert_eq!(stamps[0], stamps[1], "equal exposures at the same time");
    assert_eq!(stamps[0][0], answer.stamp);
    let age = rig.viewer.clock().now_nanos() - answer.stamp.to_nanos();
    assert!((0..30_000_000_000).contains(&age), "{age}");
    let gap = |pair: &[Time]| pair[1].to_nanos() - pair[0].to_nanos();
    // 2.5 ms of exposure, 1 ms of margin, 10 ms of gap.
    assert!(
        stamps[0]
            .windows(2)
            .all(|pair| (gap(pair) - 13_500_000).abs() < 100_000),
        "{stamps:?}"
    );
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn one_camera_may_be_asked_for_and_unknown_ones_are_named() {
    let Some(rig) = Rig::start(Plan::default()).await else {
        return;
    };
    let readers = [
        Reader::new(&rig.viewer, "c1").await,
        Reader::new(&rig.viewer, "c2").await,
    ];
    let answer = rig.capture(&["c1", "c3"]).await;
    assert_eq!(answer.message, "there is no camera \"c3\"; known: c1, c2");
    let answer = rig.capture(&["c2", "c2"]).await;
    assert!(answer.success, "{}", answer.message);
    readers[1].taken(8).await;
    assert_eq!(readers[0].count(), 0);
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn callers_wait_for_their_turn_and_get_captures_of_their_own() {
    let Some(rig) = Rig::start(Plan::default()).await else {
        return;
    };
    let (first, second) = tokio::join!(rig.capture(&[]), rig.capture(&["c1"]));
    assert!(first.success && second.success, "{first:?} {second:?}");
    assert_ne!(first.capture_id, second.capture_id);
    let captures = futures::future::join_all((0..8).map(|_| rig.capture(&["c2"]))).await;
    let refused: Vec<_> = captures.iter().filter(|answer| !answer.success).collect();
    assert!(captures.len() - refused.len() >= 5, "{refused:?}");
    assert!(
        refused
            .iter()
            .all(|answer| answer.message.contains("4 callers are waiting")),
        "{refused:?}"
    );
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn software_triggers_give_the_same_images_one_at_a_time() {
    let plan = Plan {
        parameters: vec![("trigger", "software".into())],
        ..Plan::default()
    };
    let Some(rig) = Rig::start(plan).await else { return };
    let reader = Reader::new(&rig.viewer, "c1").await;
    let answer = rig.capture(&[]).await;
    assert!(answer.success, "{}", answer.message);
    let taken = reader.taken(8).await;
    for (index, taken) in taken.iter().enumerate() {
        assert_eq!(taken.exposure.channel as usize, index);
        assert!(shows_its_light(taken), "{:?}: {:?}", taken.exposure, taken.slopes());
    }
    // The board's answers and its pins' edges come by different ways.
    assert!(rig.board.wait_until(Instant::now(), TIMEOUT), "the board keeps up");
    assert_eq!(rig.wires.lit(), [false; 7]);
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_cameras_places_are_told_to_who_comes_late() {
    let Some(rig) = Rig::start(Plan::default()).await else {
        return;
    };
    let late = rig.domain.node("late").await;
    let mut places = late.subscription::<TFMessage>("/tf_static", Qos::TF_STATIC).unwrap();
    let message = within("the cameras' places", places.next()).await.unwrap().message;
    let frames: Vec<_> = message
        .transforms
        .iter()
        .map(|place| (place.header.frame_id.as_str(), place.child_frame_id.as_str()))
        .collect();
    assert_eq!(
        frames,
        [("link_base", "c1_optical_frame"), ("link_base", "c2_optical_frame")]
    );
    let place = &message.transforms[0].transform;
    assert!((place.translation.z - POSE[2]).abs() < 1e-9 && (place.rotation.x - POSE[3]).abs() < 1e-9);
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_that_stops_in_mid_capture_leaves_the_lights_off() {
    let Some(mut rig) = Rig::start(Plan {
        parameters: vec![("trigger", "software".into()), ("frame_timeout", 5.0.into())],
        ..Plan::default()
    })
    .await
    else {
        return;
    };
    // A frame that does not come keeps its panel lit.
    rig.set_faults(
        1,
        gige_vision::Faults {
            frame_delay: Duration::from_secs(3),
            ..gige_vision::Faults::default()
        },
    );
    let captures = rig.captures.clone();
    let asked = tokio::spawn(async move { captures.call(CaptureRequest::default(), SHORT).await });
    scenarios::eventually("a lit panel", || rig.wires.lit() != [false; 7]).await;
    let (stopped, wires) = (Instant::now(), Arc::clone(&rig.wires));
    let dark = async {
        scenarios::eventually("dark panels", || wires.lit() == [false; 7]).await;
        stopped.elapsed()
    };
    // The node itself takes a while to end: only the lights are timed.
    let ((), took) = tokio::join!(rig.stop_cameras(), dark);
    println!("dark {took:?} after the node was told to stop");
    assert!(took < Duration::from_secs(3), "before the light's own time is over");
    assert!(asked.await.unwrap().is_err());
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn captures_of_whole_sensors_are_answered_quickly() {
    const CAPTURES: usize = 10;
    let Some(rig) = Rig::start(Plan {
        size: [1536, 1536],
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
    // The first one draws the pictures.
    let first = rig.recovered_capture().await;
    let (mut times, mut voids) = (Vec::new(), u32::from(first.repeats));
    for _ in 0..CAPTURES {
        let started = Instant::now();
        let answer = rig.recovered_capture().await;
        times.push(started.elapsed());
        voids += u32::from(answer.repeats);
    }
    times.sort();
    println!(
        "capture service, 2 x 8 images of 1536 x 1536 by UDP: median {:?}, slowest {:?}, {voids} void of {}",
        times[CAPTURES / 2],
        times[CAPTURES - 1],
        CAPTURES + 1
    );
    assert!(times[CAPTURES / 2] < Duration::from_secs(2), "{times:?}");
    for reader in &readers {
        scenarios::eventually("all images", || reader.count() == 8 * (CAPTURES + 1)).await;
    }
    rig.stop().await;
}
