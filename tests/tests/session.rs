//! The session of the simulated cell in `bags/`: two captures of both cameras, and what nodes make of it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use interfaces::cdr;
use interfaces::rakelight_msgs::msg::{Exposure, LightState};
use interfaces::sensor_msgs::msg::{CameraInfo, Image};
use interfaces::tf2_msgs::msg::TFMessage;
use recording::Bag;
use ros::{Node, Qos};
use scenarios::{Domain, TIMEOUT, within};

const CAMERAS: [&str; 2] = ["c1", "c2"];
const CAPTURES: usize = 2;
const SIZE: u32 = 384;

fn path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../bags/table")
}

fn messages<M: interfaces::Message>(bag: &Bag, topic: &str) -> Vec<M> {
    bag.messages_where(|candidate| candidate.name == topic)
        .map(|message| cdr::from_slice(&message.expect("the bag is whole").cdr).expect("its messages are too"))
        .collect()
}

#[test]
fn the_session_is_enough_to_work_offline() {
    let bag = Bag::open(path()).expect("the bag opens");
    assert!(bag.report().is_whole(), "{:?}", bag.report());
    for camera in CAMERAS {
        let topic = |name: &str| format!("/cell/{camera}/{name}");
        let exposures: Vec<Exposure> = messages(&bag, &topic("exposure"));
        let images: Vec<Image> = messages(&bag, &topic("image_raw"));
        let infos: Vec<CameraInfo> = messages(&bag, &topic("camera_info"));
        assert_eq!((exposures.len(), images.len(), infos.len()), (16, 16, 16));
        let mut channels: BTreeMap<String, Vec<u8>> = BTreeMap::new();
        for ((exposure, image), info) in exposures.iter().zip(&images).zip(&infos) {
            assert_eq!(exposure.header, image.header);
            assert_eq!(
                (image.width, image.height, image.encoding.as_str()),
                (SIZE, SIZE, "mono16")
            );
            assert_eq!((info.header.stamp, info.width), (image.header.stamp, SIZE));
            channels
                .entry(exposure.capture_id.clone())
                .or_default()
                .push(exposure.channel);
        }
        assert_eq!(channels.len(), CAPTURES);
        assert!(
            channels.values().all(|order| order[..] == [0, 1, 2, 3, 4, 5, 6, 7]),
            "{channels:?}"
        );
    }
    let transforms: Vec<TFMessage> = messages(&bag, "/tf_static");
    let placed = transforms.iter().flat_map(|message| &message.transforms);
    let mut frames: Vec<&str> = placed.map(|transform| transform.child_frame_id.as_str()).collect();
    frames.sort_unstable();
    assert_eq!(frames, ["c1_optical_frame", "c2_optical_frame"]);
}

/// The firmware's own times and the images' stamps agree: each exposure lies within its panel's on-time.
#[test]
fn every_image_was_exposed_while_its_panel_was_lit() {
    let nanos = |time: interfaces::builtin_interfaces::msg::Time| i128::from(time.to_nanos());
    let bag = Bag::open(path()).expect("the bag opens");
    let states: Vec<LightState> = messages(&bag, "/cell/lights/state");
    let exposures: Vec<Exposure> = messages(&bag, "/cell/c1/exposure");
    for exposure in exposures {
        let mut reports = states.iter().filter(|state| state.capture_id == exposure.capture_id);
        let step = reports
            .find_map(|state| state.steps.iter().find(|step| step.index == exposure.index))
            .unwrap_or_else(|| panic!("no report of step {} of {}", exposure.index, exposure.capture_id));
        assert_eq!(step.channel, exposure.channel);
        let (middle, half) = (
            nanos(exposure.header.stamp),
            i128::from(exposure.exposure_time.nanosec) / 2,
        );
        assert!(
            nanos(step.switched_at) <= middle - half && middle + half <= nanos(step.ended_at),
            "{step:?}"
        );
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn replaying_the_session_gives_a_normal_map_of_each_camera() {
    let domain = Domain::claim();
    let viewer = domain.node("viewer").await;
    let mut maps = Vec::new();
    for camera in CAMERAS {
        let topic = format!("/cell/{camera}/normals");
        maps.push(
            viewer
                .subscription::<Image>(&topic, Qos::reliable(CAPTURES))
                .expect("a subscription"),
        );
    }
    let solver = Node::start(domain.options("normal_solver")).await.expect("a node");
    let solving = tokio::spawn(normal_solver::run(solver.clone()));
    let player = domain
        .options("bag_player")
        .parameter("bag", path().display().to_string())
        .parameter("rate", 10.0)
        .parameter("wait_for_subscriptions", TIMEOUT.as_secs_f64());
    let player = Node::start(player).await.expect("a node");
    let played = within("the bag", bag_player::run(player.clone()))
        .await
        .expect("the bag plays");
    assert_eq!(played.left_out, 0);
    for (camera, maps) in CAMERAS.iter().zip(&mut maps) {
        let map = within("a map", maps.next()).await.expect("the solver runs").message;
        assert_eq!((map.width, map.height), (SIZE, SIZE));
        assert_eq!(map.header.frame_id, format!("{camera}_optical_frame"));
        assert!(level_share(&map) > 0.05, "the octagon's steps are level");
    }
    player.shutdown().await;
    solver.shutdown().await;
    solving
        .await
        .expect("the solver does not panic")
        .expect("the solver ends well");
}

/// Share of the pixels that face up, within 15 degrees.
fn level_share(map: &Image) -> f64 {
    let z = |pixel: &[u8]| f32::from_le_bytes(pixel[8..12].try_into().expect("four bytes"));
    let pixels = map.data.chunks_exact(12);
    let count = pixels.len();
    pixels.filter(|pixel| z(pixel) > 0.966).count() as f64 / count as f64
}
