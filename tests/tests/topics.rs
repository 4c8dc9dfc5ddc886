//! Topics between nodes of one process and between processes.

use std::sync::Arc;
use std::time::Duration;

use interfaces::builtin_interfaces::msg::Time;
use interfaces::sensor_msgs::msg::{CameraInfo, Image};
use ros::{Qos, Source};
use scenarios::{Domain, Logs, Program, TIMEOUT, eventually, patterns, within};

const PROBE: &str = env!("CARGO_BIN_EXE_probe_node");

/// Pixels a side of a 28 MB normal map.
const WHOLE: &str = "1536";

fn stamp(nanosec: u32) -> Time {
    Time { sec: 1, nanosec }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn images_arrive_from_another_process_pixel_by_pixel() {
    let domain = Domain::claim();
    let node = domain.node("reader").await;
    let mut images = node.subscription::<Image>("c1/image_raw", Qos::IMAGE).unwrap();
    let _probe = Program::start(
        &domain,
        PROBE,
        &["--image-size", "256", "--rate", "20", "--end-with-stdin"],
    );
    for _ in 0..5 {
        let received = within("an image", images.next()).await.unwrap();
        assert_eq!(received.source, Source::Dds);
        assert!(patterns::is_image(&received.message), "a pixel is wrong");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn five_of_five_whole_maps_arrive_from_another_process() {
    let domain = Domain::claim();
    let node = domain.node("reader").await;
    let mut maps = node.subscription::<Image>("c1/normals", Qos::MAP).unwrap();
    let arguments = [
        "--map-size",
        WHOLE,
        "--rate",
        "2",
        "--count",
        "5",
        "--wait-for-readers",
        "1",
        "--end-with-stdin",
    ];
    let _probe = Program::start(&domain, PROBE, &arguments);
    let expected = patterns::normal_map(1536, Time::default());
    for n in 1..=5 {
        let received = within(&format!("map {n} of 5"), maps.next()).await.unwrap();
        assert!(received.message.data == expected.data, "map {n} is damaged");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn whole_images_come_back_from_an_echo() {
    let domain = Domain::claim();
    let node = domain.node("there_and_back").await;
    let _probe = Program::start(&domain, PROBE, &["--mute", "--end-with-stdin"]);
    let there = node.publisher::<Image>("echo/in", Qos::IMAGE).unwrap();
    let mut back = node.subscription::<Image>("echo/out", Qos::IMAGE).unwrap();
    there.wait_for_subscriptions(1, TIMEOUT).await.unwrap();
    back.wait_for_publishers(1, TIMEOUT).await.unwrap();
    for n in 0..3 {
        let sent = patterns::image(1536, n, stamp(u32::from(n)));
        there.publish(sent.clone()).unwrap();
        let received = within("the echo", back.next()).await.unwrap();
        assert!(*received.message == sent, "echo {n} differs");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_process_hands_over_the_message_itself_and_only_once() {
    let domain = Domain::claim();
    let (one, other) = (domain.node("one").await, domain.node("other").await);
    let publisher = one.publisher::<Image>("maps", Qos::MAP).unwrap();
    let mut subscription = other.subscription::<Image>("maps", Qos::reliable(8)).unwrap();
    one.wait_for_node("/cell/other", TIMEOUT).await.unwrap();
    for n in 0..4 {
        let sent = Arc::new(patterns::image(32, n, stamp(u32::from(n))));
        publisher.publish(Arc::clone(&sent)).unwrap();
        // A copy by DDS as well would come between this message and the next.
        let received = within("the hand-over", subscription.next()).await.unwrap();
        assert_eq!(received.source, Source::Process);
        assert!(Arc::ptr_eq(&received.message, &sent));
        assert_eq!(
            publisher.subscription_count(),
            1,
            "the reader counts once, not on DDS as well"
        );
    }
    assert_eq!(subscription.publisher_count(), 1);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_hands_over_to_itself() {
    let domain = Domain::claim();
    let node = domain.node("monologue").await;
    let mut subscription = node.subscription::<Image>("maps", Qos::MAP).unwrap();
    let publisher = node.publisher::<Image>("maps", Qos::MAP).unwrap();
    let sent = Arc::new(patterns::image(8, 0, stamp(0)));
    publisher.publish(Arc::clone(&sent)).unwrap();
    let received = within("the hand-over", subscription.next()).await.unwrap();
    assert!(Arc::ptr_eq(&received.message, &sent));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_outside_reader_is_served_beside_the_hand_over() {
    let domain = Domain::claim();
    let (one, other) = (domain.node("one").await, domain.node("other").await);
    let publisher = one.publisher::<Image>("c1/normals", Qos::MAP).unwrap();
    let mut subscription = other.subscription::<Image>("c1/normals", Qos::reliable(8)).unwrap();
    let watcher = Program::start(&domain, PROBE, &["--mute", "--watch", "--end-with-stdin"]);
    eventually("both readers", || publisher.subscription_count() == 2).await;
    for n in 1..=3_usize {
        let sent = Arc::new(patterns::normal_map(256, one.clock().now()));
        publisher.publish(Arc::clone(&sent)).unwrap();
        let received = within("the hand-over", subscription.next()).await.unwrap();
        assert!(Arc::ptr_eq(&received.message, &sent));
        eventually("the map outside", || watcher.count_lines("map 256") == n).await;
    }
    drop(watcher);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_late_joiner_gets_what_is_latched_inside_and_outside() {
    let domain = Domain::claim();
    let node = domain.node("early").await;
    let publisher = node.publisher::<CameraInfo>("info", Qos::LATCHED).unwrap();
    publisher.publish(patterns::camera_info(100, stamp(1))).unwrap();
    publisher.publish(patterns::camera_info(200, stamp(2))).unwrap();
    let late = domain.node("late").await;
    let mut inside = late.subscription::<CameraInfo>("info", Qos::LATCHED).unwrap();
    let received = within("the latched calibration", inside.next()).await.unwrap();
    assert_eq!((received.message.width, received.source), (200, Source::Process));

    let mut probe = Program::start(&domain, PROBE, &["--image-size", "48", "--end-with-stdin"]);
    probe.wait_for_line("ready");
    let mut outside = late.subscription::<CameraInfo>("c1/camera_info", Qos::LATCHED).unwrap();
    let received = within("the probe's calibration", outside.next()).await.unwrap();
    assert_eq!((received.message.width, received.source), (48, Source::Dds));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_was_latched_by_a_node_that_left_is_not_given_to_who_comes_after() {
    let domain = Domain::claim();
    let node = domain.node("reader").await;
    let mut first = node.subscription::<CameraInfo>("c1/camera_info", Qos::LATCHED).unwrap();
    for size in ["48", "50"] {
        let mut probe = Program::start(&domain, PROBE, &["--image-size", size, "--end-with-stdin"]);
        let received = within("the calibration", first.next()).await.unwrap();
        assert_eq!(received.message.width.to_string(), size);
        let mut later = node.subscription::<CameraInfo>("c1/camera_info", Qos::LATCHED).unwrap();
        let received = within("the calibration again", later.next()).await.unwrap();
        assert_eq!(received.message.width.to_string(), size);
        assert!(probe.finish().success());
        eventually("the leave", || node.other_nodes().is_empty()).await;
    }
    let mut late = node.subscription::<CameraInfo>("c1/camera_info", Qos::LATCHED).unwrap();
    let nothing = tokio::time::timeout(Duration::from_millis(500), late.next()).await;
    assert!(nothing.is_err(), "a calibration of nobody");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_qos_that_does_not_fit_is_told() {
    let logs = Logs::collect();
    let domain = Domain::claim();
    let mut probe = Program::start(&domain, PROBE, &["--end-with-stdin"]);
    probe.wait_for_line("ready");
    let node = domain.node("demanding").await;
    // The probe's images are volatile.
    let mut subscription = node.subscription::<Image>("c1/image_raw", Qos::LATCHED).unwrap();
    logs.wait_for(&["QoS does not fit"]).await;
    let nothing = tokio::time::timeout(Duration::from_millis(500), subscription.next()).await;
    assert!(nothing.is_err(), "an image came through a QoS that does not fit");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nothing_is_published_on_dds_while_nobody_reads() {
    let domain = Domain::claim();
    let node = domain.node("alone").await;
    let publisher = node.publisher::<Image>("c1/normals", Qos::MAP).unwrap();
    let map = patterns::normal_map(1536, node.clock().now());
    // Serialising them would hold 28 GB of history or take minutes.
    for _ in 0..1000 {
        publisher.publish(map.clone()).unwrap();
    }
    assert_eq!(publisher.subscription_count(), 0);
}
