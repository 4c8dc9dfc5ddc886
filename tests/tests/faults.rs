//! What the wire and its peers can do to a node: garbage, sudden death, messages that are not what they say.

use std::net::{Ipv4Addr, UdpSocket};
use std::sync::Arc;

use interfaces::Message;
use interfaces::sensor_msgs::msg::Image;
use ros::Qos;
use scenarios::{Domain, Logs, Program, TIMEOUT, eventually, patterns, within};
use serde::{Deserialize, Serialize};

const PROBE: &str = env!("CARGO_BIN_EXE_probe_node");

/// Something that is sent as an image but is none.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
struct NoImage {
    text: String,
}

impl Message for NoImage {
    const TYPE_NAME: &'static str = Image::TYPE_NAME;
    const DEFINITION: &'static str = Image::DEFINITION;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_unreadable_message_is_skipped_counted_and_told() {
    let logs = Logs::collect();
    let domain = Domain::claim();
    let (honest, liar, reader) = (
        domain.node("honest").await,
        domain.node("liar").await,
        domain.node("reader").await,
    );
    let mut images = reader.subscription::<Image>("misread", Qos::reliable(10)).unwrap();
    let good = honest.publisher::<Image>("misread", Qos::reliable(10)).unwrap();
    let bad = liar.publisher::<NoImage>("misread", Qos::reliable(10)).unwrap();
    bad.wait_for_subscriptions(1, TIMEOUT).await.unwrap();
    bad.publish(NoImage {
        text: "a text of some length, which no image begins with".into(),
    })
    .unwrap();
    bad.publish(NoImage::default()).unwrap();
    read_until_both_are_met(logs, &mut images, &good).await;
    assert_eq!(images.unreadable(), 2);
}

/// Reads on until both bad messages were met and told of; each good one in between must come through.
async fn read_until_both_are_met(logs: &Logs, images: &mut ros::Subscription<Image>, good: &ros::Publisher<Image>) {
    let mut sent = 0;
    while images.unreadable() < 2 {
        assert!(sent < 1000, "the bad messages never came");
        let image = Arc::new(patterns::image(
            8,
            sent,
            interfaces::builtin_interfaces::msg::Time::default(),
        ));
        good.publish(Arc::clone(&image)).unwrap();
        let received = within("a good image", images.next()).await.unwrap();
        assert!(Arc::ptr_eq(&received.message, &image));
        sent += 1;
        tokio::time::sleep(std::time::Duration::from_millis(10)).await;
    }
    logs.wait_for(&["not readable", "/cell/misread", "sensor_msgs/msg/Image"])
        .await;
}

/// Packets of noise; every second one begins as an RTPS message, and every fourth has a plausible submessage header.
fn garbage(random: &mut fastrand::Rng) -> Vec<u8> {
    let length = random.usize(0..1400);
    let mut packet: Vec<u8> = std::iter::repeat_with(|| random.u8(..)).take(length).collect();
    if random.bool() && packet.len() >= 24 {
        packet[..8].copy_from_slice(b"RTPS\x02\x03\x01\x10");
        if random.bool() {
            // DATA, DATA_FRAG, HEARTBEAT, ACKNACK, GAP, ...
            packet[20] = *random
                .choice(&[0x15, 0x16, 0x07, 0x06, 0x08, 0x12, 0x13, 0x0c, 0x0e])
                .unwrap_or(&0x15);
        }
    }
    packet
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn two_thousand_packets_of_garbage_change_nothing() {
    let domain = Domain::claim();
    let node = domain.node("reader").await;
    let mut images = node.subscription::<Image>("echo/out", Qos::IMAGE).unwrap();
    let publisher = node.publisher::<Image>("echo/in", Qos::IMAGE).unwrap();
    let mut probe = Program::start(&domain, PROBE, &["--mute", "--end-with-stdin"]);
    publisher.wait_for_subscriptions(1, TIMEOUT).await.unwrap();
    images.wait_for_publishers(1, TIMEOUT).await.unwrap();
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let (mut random, ports) = (fastrand::Rng::with_seed(7), domain.ports(2));
    // Those of this node and of the probe, behind the two that all participants share.
    for port in &ports[2..] {
        assert!(
            UdpSocket::bind((Ipv4Addr::LOCALHOST, *port)).is_err(),
            "nobody listens on {port}"
        );
    }
    for n in 0..50_u16 {
        for _ in 0..40 {
            let port = *random.choice(&ports).unwrap_or(&7400);
            // Refused where nobody listens.
            let _ = socket.send_to(&garbage(&mut random), (Ipv4Addr::LOCALHOST, port));
        }
        let sent = patterns::image(200, n, node.clock().now());
        publisher.publish(sent.clone()).unwrap();
        let received = within(&format!("image {n}"), images.next()).await.unwrap();
        assert!(*received.message == sent, "image {n} differs");
    }
    assert!(probe.has_ended().is_none());
    node.wait_for_node("/cell/probe", TIMEOUT).await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_reader_killed_in_mid_message_harms_nobody_else() {
    let domain = Domain::claim();
    let node = domain.node("publisher").await;
    let maps = node.publisher::<Image>("c1/normals", Qos::MAP).unwrap();
    let watch = ["--mute", "--watch", "--end-with-stdin", "--name"];
    let mut victim = Program::start(&domain, PROBE, &[&watch[..], &["victim"]].concat());
    let survivor = Program::start(&domain, PROBE, &[&watch[..], &["survivor"]].concat());
    maps.wait_for_subscriptions(2, TIMEOUT).await.unwrap();
    let map = patterns::normal_map(1536, node.clock().now());
    for n in 1..=5_usize {
        let mut next = map.clone();
        next.header.stamp = node.clock().now();
        maps.publish(next).unwrap();
        if n == 2 {
            // `publish` only queues: the fragments of this map are on their way now.
            victim.kill();
        }
        eventually(&format!("map {n} at the survivor"), || {
            survivor.count_lines("map 1536") == n
        })
        .await;
    }
    assert_eq!(survivor.count_lines("damaged"), 0);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_publisher_killed_in_mid_message_harms_nobody_else() {
    let domain = Domain::claim();
    let node = domain.node("reader").await;
    let mut maps = node.subscription::<Image>("c1/normals", Qos::reliable(4)).unwrap();
    let whole = [
        "--map-size",
        "1536",
        "--wait-for-readers",
        "1",
        "--end-with-stdin",
        "--name",
    ];
    let mut victim = Program::start(&domain, PROBE, &[&whole[..], &["victim", "--rate", "20"]].concat());
    within("a first map", maps.next()).await.unwrap();
    victim.kill();
    let _second = Program::start(
        &domain,
        PROBE,
        &[&whole[..], &["second", "--rate", "2", "--count", "5"]].concat(),
    );
    let expected = patterns::normal_map(1536, node.clock().now());
    // Whole maps of the victim may still be waiting; the second's begin when it has met us.
    let started = node.clock().now_nanos();
    let mut of_second = 0;
    while of_second < 5 {
        let received = within("a map of the second", maps.next()).await.unwrap();
        assert!(received.message.data == expected.data, "a map is damaged");
        of_second += u32::from(received.message.header.stamp.to_nanos() > started);
    }
}
