//! A capture through ROS: the player and the solver as nodes, what they publish, and what they refuse.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use calibration_files::LightsFile;
use interfaces::ByteSequence;
use interfaces::builtin_interfaces::msg::Time;
use interfaces::rakelight_msgs::msg::{CellState, Exposure};
use interfaces::rakelight_msgs::srv::{Solve, SolveRequest, SolveResponse};
use interfaces::sensor_msgs::msg::{CameraInfo, Image, PointCloud2};
use photometric::LightRig;
use ros::{Node, NodeOptions, Publisher, Qos, ServiceClient, Source};
use scenarios::{Domain, Logs, TIMEOUT, eventually, within};
use tokio::task::JoinHandle;

const SIZE: usize = 4;

fn bag() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../bags/octagon2")
}

async fn solver(options: NodeOptions) -> (Node, JoinHandle<Result<(), normal_solver::Error>>) {
    let node = Node::start(options.namespace("/cell"))
        .await
        .expect("the solver's node starts");
    (node.clone(), tokio::spawn(normal_solver::run(node)))
}

/// Normals of a map message, in rows.
fn normals(map: &Image) -> Vec<[f32; 3]> {
    let number = |bytes: &[u8]| f32::from_le_bytes(bytes.try_into().expect("four bytes"));
    let pixel = |bytes: &[u8]| [number(&bytes[..4]), number(&bytes[4..8]), number(&bytes[8..])];
    map.data.chunks_exact(12).map(pixel).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_recorded_capture_becomes_a_normal_map() {
    let domain = Domain::claim();
    let viewer = domain.node("viewer").await;
    let mut maps = viewer.subscription::<Image>("/cell/c1/normals", Qos::MAP).unwrap();
    let mut infos = viewer
        .subscription::<CameraInfo>("/cell/c1/camera_info", Qos::LATCHED)
        .unwrap();
    let (solver, _solving) = solver(domain.options("normal_solver")).await;
    let player = domain
        .options("bag_player")
        .namespace("/cell")
        .parameter("bag", bag().display().to_string())
        .parameter("enlarge", 2)
        .parameter("wait_for_subscriptions", TIMEOUT.as_secs_f64());
    let player = Node::start(player).await.unwrap();
    let played = within("the bag", bag_player::run(player.clone())).await.unwrap();
    assert_eq!((played.published, played.left_out), (64, 0));

    let received = within("a map", maps.next()).await.unwrap();
    assert_eq!(received.source, Source::Process, "nodes of one process share the map");
    let map = received.message;
    assert_eq!((map.width, map.height, map.encoding.as_str()), (1024, 1024, "32FC3"));
    assert_eq!(map.header.frame_id, "c1_optical_frame");
    assert_eq!(
        map.header.stamp,
        Time {
            sec: 1_700_000_000,
            nanosec: 0
        },
        "the stamp of the first image"
    );
    let normals = normals(&map);
    let unit = |n: &[f32; 3]| (n.iter().map(|x| x * x).sum::<f32>() - 1.0).abs() < 1e-3;
    assert!(normals.iter().filter(|n| n[0].is_finite()).all(unit));
    // The octagon's flat top, in the middle of the crop, faces up; the base frame's z axis is up.
    let top = normals[512 * 1024 + 512];
    assert!(top[2] > 0.98, "{top:?}");

    let info = within("the camera", infos.next()).await.unwrap().message;
    assert_eq!((info.width, info.header.frame_id.as_str()), (1024, "c1_optical_frame"));
    player.shutdown().await;
    solver.shutdown().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn with_calibrated_panels_the_object_alone_is_measured_and_its_faces_lean_as_they_should() {
    let domain = Domain::claim();
    let viewer = domain.node("viewer").await;
    let mut maps = viewer.subscription::<Image>("/cell/c1/normals", Qos::MAP).unwrap();
    let mut depths = viewer.subscription::<Image>("/cell/c1/depth", Qos::MAP).unwrap();
    let mut edges = viewer.subscription::<Image>("/cell/c1/edges", Qos::MAP).unwrap();
    let mut clouds = viewer.subscription::<PointCloud2>("/cell/c1/points", Qos::MAP).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lights.yaml");
    // The capture was taken with the panels where they are drawn.
    let lights = LightsFile::new(&LightRig::nominal(), "2026-11-25", Vec::new(), Vec::new());
    lights.write(&path).unwrap();
    let options = domain
        .options("normal_solver")
        .parameter("lights.file", path.display().to_string());
    let (solver, _solving) = solver(options).await;
    let player = domain
        .options("bag_player")
        .namespace("/cell")
        .parameter("bag", bag().display().to_string())
        .parameter("wait_for_subscriptions", TIMEOUT.as_secs_f64());
    let player = Node::start(player).await.unwrap();
    within("the bag", bag_player::run(player.clone())).await.unwrap();
    let map = within("a map", maps.next()).await.unwrap().message;
    let normals = normals(&map);
    let top = normals[256 * 512 + 256];
    assert!(top[2] > 0.999, "{top:?}");
    // The top lies some tens of millimetres over the table, and the camera 0.33 m.
    let depth = within("depth", depths.next()).await.unwrap().message;
    assert_eq!(
        (depth.width, depth.encoding.as_str(), depth.header.stamp),
        (512, "32FC1", map.header.stamp)
    );
    let middle = 4 * (256 * 512 + 256);
    let depth = f32::from_le_bytes(depth.data[middle..middle + 4].try_into().unwrap());
    assert!((0.27..0.33).contains(&depth), "{depth} m");
    let cloud = within("points", clouds.next()).await.unwrap().message;
    assert_eq!(
        (cloud.point_step, cloud.header.frame_id.as_str()),
        (24, "c1_optical_frame")
    );
    assert_eq!(cloud.data.len(), 24 * cloud.width as usize);
    let edges = within("edges", edges.next()).await.unwrap().message;
    assert_eq!((edges.encoding.as_str(), edges.step), ("mono8", 512));
    let known: Vec<&[f32; 3]> = normals.iter().filter(|n| n[0].is_finite()).collect();
    let share = known.len() as f64 / normals.len() as f64;
    assert!((0.2..0.6).contains(&share), "the object fills {share} of the crop");
    // Its slanted faces lean by some 45 degrees to eight sides.
    let leaning = |n: &&&[f32; 3]| (0.5..0.85).contains(&n[2]);
    let sides: std::collections::BTreeSet<i32> = known
        .iter()
        .filter(leaning)
        .map(|n| (n[1].atan2(n[0]).to_degrees() / 45.0).round() as i32)
        .collect();
    assert!(sides.len() >= 8, "{sides:?}");
    player.shutdown().await;
    solver.shutdown().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_calibration_that_cannot_be_read_ends_the_node_with_its_path() {
    let domain = Domain::claim();
    let options = domain
        .options("normal_solver")
        .parameter("lights.file", "nowhere/lights.yaml");
    let (_node, solving) = solver(options).await;
    let error = within("the end", solving).await.unwrap().unwrap_err().to_string();
    assert!(error.contains("nowhere/lights.yaml"), "{error}");
}

/// Sends captures by hand.
struct Camera {
    images: Publisher<Image>,
    exposures: Publisher<Exposure>,
}

impl Camera {
    async fn new(node: &Node) -> Self {
        let camera = Self {
            images: node.publisher("/cell/c1/image_raw", Qos::IMAGE).unwrap(),
            exposures: node.publisher("/cell/c1/exposure", Qos::STREAM).unwrap(),
        };
        camera.images.wait_for_subscriptions(1, TIMEOUT).await.unwrap();
        camera.exposures.wait_for_subscriptions(1, TIMEOUT).await.unwrap();
        camera
    }

    /// A dark frame and seven equally bright ones; `spoil` changes an image before it is sent.
    fn send(&self, capture: i32, spoil: impl Fn(u8, &mut Image)) {
        self.send_sequence(capture, &[0, 1, 2, 3, 4, 5, 6, 7], spoil);
    }

    /// `spoil` knows an image by its place in the sequence.
    fn send_sequence(&self, capture: i32, channels: &[u8], spoil: impl Fn(u8, &mut Image)) {
        for (index, &channel) in (0_u8..).zip(channels) {
            let mut exposure = Exposure {
                capture_id: format!("capture {capture}"),
                channel,
                index,
                count: channels.len() as u8,
                ..Exposure::default()
            };
            exposure.header.stamp = Time {
                sec: capture,
                nanosec: u32::from(index),
            };
            exposure.header.frame_id = "c1_optical_frame".into();
            let level: u16 = if channel == 0 { 1000 } else { 20_000 };
            let mut image = Image {
                header: exposure.header.clone(),
                width: SIZE as u32,
                height: SIZE as u32,
                encoding: "mono16".into(),
                step: 2 * SIZE as u32,
                data: ByteSequence::from(level.to_le_bytes().repeat(SIZE * SIZE)),
                ..Image::default()
            };
            spoil(index, &mut image);
            self.images.publish(Arc::new(image)).unwrap();
            self.exposures.publish(Arc::new(exposure)).unwrap();
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_spoilt_capture_is_named_and_the_next_one_solved() {
    let logs = Logs::collect();
    let domain = Domain::claim();
    let viewer = domain.node("viewer").await;
    let mut maps = viewer
        .subscription::<Image>("/cell/c1/normals", Qos::reliable(10))
        .unwrap();
    let (solver, _solving) = solver(domain.options("normal_solver")).await;
    let camera = Camera::new(&viewer).await;

    camera.send(1, |index, image| {
        if index == 3 {
            image.encoding = "rgb8".into();
        }
    });
    logs.wait_for(&["capture 1", "image 3", "rgb8", "mono16"]).await;
    camera.send(2, |index, image| {
        if index == 5 {
            image.data = vec![0; 3].into();
        }
    });
    logs.wait_for(&["capture 2", "3 bytes"]).await;
    camera.send(3, |index, image| {
        if index == 6 {
            image.header.stamp.sec = 999;
        }
    });
    camera.send(4, |_, _| {});
    logs.wait_for(&["capture 3", "void", "later capture"]).await;
    let map = within("the map of capture 4", maps.next()).await.unwrap().message;
    assert_eq!(map.header.stamp.sec, 4, "nothing of the spoilt captures is published");
    assert!(normals(&map).iter().all(|n| n[2] > 0.5), "evenly lit, so facing up");
    solver.shutdown().await;
}

async fn ask(client: &ServiceClient<Solve>, capture_id: &str, cameras: &[&str]) -> SolveResponse {
    let request = SolveRequest {
        capture_id: capture_id.into(),
        cameras: cameras.iter().map(|camera| (*camera).to_owned()).collect(),
    };
    let response = client.call(request, 2 * TIMEOUT).await.unwrap();
    assert_eq!(response.timing.stage, CellState::SOLVE);
    assert_eq!(response.timing.succeeded, response.success);
    assert_eq!(response.cameras.len(), response.valid_fractions.len());
    SolveResponse::clone(&response)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn solve_answers_for_both_cameras_of_a_recorded_capture() {
    let domain = Domain::claim();
    let operator = domain.node("operator").await;
    let lights = Path::new(env!("CARGO_MANIFEST_DIR")).join("../launch_configs/calibration/lights.yaml");
    let options = domain
        .options("normal_solver")
        .parameter("lights.file", lights.display().to_string())
        .parameter("solve_timeout", TIMEOUT.as_secs_f64());
    let (solver, _solving) = solver(options).await;
    let client = operator.service_client::<Solve>("/cell/solve").unwrap();
    client.wait_for_server(TIMEOUT).await.unwrap();
    let early = ask(&client, "", &[]).await;
    assert!(
        !early.success && early.message.contains("no capture has come"),
        "{early:?}"
    );

    let player = domain
        .options("bag_player")
        .parameter("bag", bag().display().to_string())
        .parameter("wait_for_subscriptions", TIMEOUT.as_secs_f64());
    let player = Node::start(player).await.unwrap();
    within("the bag", bag_player::run(player.clone())).await.unwrap();
    let both = ask(&client, "", &[]).await;
    assert!(both.success && both.message.is_empty(), "{both:?}");
    let mut cameras = both.cameras.clone();
    cameras.sort();
    assert_eq!(cameras, ["c1", "c2"]);
    assert!(
        both.valid_fractions.iter().all(|share| (0.1..0.7).contains(share)),
        "{both:?}"
    );
    assert!(
        both.timing.duration.to_nanos() > 1_000_000,
        "{:?}",
        both.timing.duration
    );
    let one = ask(&client, &both.capture_id, &["c2"]).await;
    assert!(one.success && one.capture_id == both.capture_id, "{one:?}");
    assert_eq!(one.cameras, ["c2"]);
    for (capture, cameras, expected) in [
        ("nothing", &[][..], "capture \"nothing\" is not known"),
        ("nothing", &[], both.capture_id.as_str()),
        ("", &["c9"], "camera \"c9\" is not one of those solved here: c1, c2"),
    ] {
        let refused = ask(&client, capture, cameras).await;
        assert!(!refused.success && refused.message.contains(expected), "{refused:?}");
    }
    player.shutdown().await;
    solver.shutdown().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn solve_says_why_a_capture_has_no_normals() {
    let domain = Domain::claim();
    let operator = domain.node("operator").await;
    let options = domain.options("normal_solver").parameter("capture_timeout", 0.3);
    let (solver, _solving) = solver(options).await;
    let client = operator.service_client::<Solve>("/cell/solve").unwrap();
    client.wait_for_server(TIMEOUT).await.unwrap();
    let camera = Camera::new(&operator).await;
    camera.send(1, |index, image| {
        if index == 6 {
            image.header.stamp.sec = 999;
        }
    });
    let void = ask(&client, "capture 1", &[]).await;
    let expected = "capture \"capture 1\" is not solved: c1: void: nothing more came when 7 of 8 images had arrived";
    assert_eq!((void.success, void.message.as_str()), (false, expected));
    camera.send(2, |index, image| {
        if index == 3 {
            image.encoding = "rgb8".into();
        }
    });
    let spoilt = ask(&client, "capture 2", &[]).await;
    assert!(!spoilt.success && spoilt.message.contains("image 3"), "{spoilt:?}");
    camera.send_sequence(3, &[0, 1, 2, 4, 5, 6, 7], |_, _| {});
    let unlit = ask(&client, "capture 3", &["c1"]).await;
    assert!(unlit.message.contains("light channels [3] are missing"), "{unlit:?}");
    camera.send(4, |_, _| {});
    let alone = ask(&client, "capture 4", &["c1", "c2"]).await;
    assert!(
        !alone.success && alone.message.ends_with("c2 took no part in it"),
        "{alone:?}"
    );
    assert_eq!(alone.cameras, ["c1"]);
    let any = ask(&client, "", &[]).await;
    assert!(
        any.success && any.message.is_empty() && any.capture_id == "capture 4",
        "{any:?}"
    );
    assert_eq!(any.valid_fractions, [1.0], "evenly lit");
    solver.shutdown().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn lights_in_a_frame_that_nobody_placed_are_an_error_not_an_identity() {
    let logs = Logs::collect();
    let domain = Domain::claim();
    let viewer = domain.node("viewer").await;
    let mut maps = viewer.subscription::<Image>("/cell/c1/normals", Qos::MAP).unwrap();
    let (solver, solving) = solver(domain.options("normal_solver").parameter("lights.frame_id", "nowhere")).await;
    let camera = Camera::new(&viewer).await;
    camera.send(1, |_, _| {});
    logs.wait_for(&["cannot be placed", "nowhere"]).await;
    solver.shutdown().await;
    within("the solver's end", solving).await.unwrap().unwrap();
    viewer.shutdown().await;
    assert!(maps.next().await.is_none(), "no map was published");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn start_values_that_mean_nothing_stop_the_node() {
    let domain = Domain::claim();
    for (name, value, expected) in [
        ("saturatoin", 1.into(), "saturatoin"),
        ("saturation", ros::ParameterValue::from(0), "1 to 65535"),
        ("cameras", "c1".into(), "string array"),
        ("lights.intensities", vec![1.0].into(), "lights.directions holds 21"),
    ] {
        let (node, solving) = solver(domain.options("normal_solver").parameter(name, value)).await;
        let error = within("the refusal", solving).await.unwrap().unwrap_err().to_string();
        assert!(error.contains(expected), "{name}: {error}");
        node.shutdown().await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_bag_that_cannot_be_played_says_why() {
    let domain = Domain::claim();
    for (bag, expected) in [("", "parameter bag is empty"), ("/no/such/bag", "/no/such/bag")] {
        let options = domain.options("bag_player").namespace("/cell").parameter("bag", bag);
        let player = Node::start(options).await.unwrap();
        let error = within("the refusal", bag_player::run(player.clone()))
            .await
            .unwrap_err()
            .to_string();
        assert!(error.contains(expected), "{bag:?}: {error}");
        player.shutdown().await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn topics_left_out_are_not_played() {
    let domain = Domain::claim();
    let options = domain
        .options("bag_player")
        .parameter("bag", bag().display().to_string());
    let options = options.parameter("leave_out", vec!["/cell/c2/image_raw".to_owned()]);
    let player = Node::start(options.parameter("rate", 100.0)).await.unwrap();
    let played = within("the bag", bag_player::run(player.clone())).await.unwrap();
    // Of 64 messages 8 are images of C2.
    assert_eq!((played.published, played.left_out), (56, 0));
    player.shutdown().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_player_ends_with_its_node() {
    let domain = Domain::claim();
    let options = domain.options("bag_player").namespace("/cell");
    let options = options
        .parameter("bag", bag().display().to_string())
        .parameter("loop", true);
    let player = Node::start(options).await.unwrap();
    let playing = tokio::spawn(bag_player::run(player.clone()));
    let images = domain
        .node("viewer")
        .await
        .subscription::<Image>("/cell/c1/image_raw", Qos::IMAGE)
        .unwrap();
    eventually("the player's images", || images.publisher_count() > 0).await;
    player.shutdown().await;
    within("the player's end", playing).await.unwrap().unwrap();
}
