//! Grasps through ROS: player, solver and planner as nodes, what they answer and publish, and what they refuse.

use std::path::{Path, PathBuf};
use std::time::Duration;

use geometry::nalgebra::{Point3, UnitQuaternion, Vector3};
use interfaces::ByteSequence;
use interfaces::geometry_msgs::msg::{Point, PoseStamped, Quaternion, Vector3 as Vector3Message};
use interfaces::rakelight_msgs::msg::{CellState, Exposure, Grasp, GraspArray};
use interfaces::rakelight_msgs::srv::{PlanGrasp, PlanGraspRequest, PlanGraspResponse};
use interfaces::rcl_interfaces::msg::{Parameter as WireParameter, ParameterType, ParameterValue};
use interfaces::rcl_interfaces::srv::{SetParameters, SetParametersRequest};
use interfaces::sensor_msgs::msg::{CameraInfo, CompressedImage, Image};
use kinematics::Chain;
use nalgebra::SVector;
use ros::{Node, NodeOptions, Publisher, Qos, ServiceClient, Subscription};
use scenarios::{Domain, TIMEOUT, within};
use tokio::task::JoinHandle;

/// The octagon's top as it was path-traced: its middle and the radius of the circle within it, metres, base frame.
const TOP: [f64; 3] = [0.434, 0.001, 0.029];
const TOP_RADIUS: f64 = 0.017;

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Solver and planner, and somebody who asks.
struct Vision {
    domain: Domain,
    nodes: Vec<Node>,
    operator: Node,
    client: ServiceClient<PlanGrasp>,
}

impl Vision {
    /// `adapt_solver` and `adapt_planner` change how the nodes start.
    async fn start(
        adapt_solver: impl FnOnce(NodeOptions) -> NodeOptions,
        adapt_planner: impl FnOnce(NodeOptions) -> NodeOptions,
    ) -> Self {
        let domain = Domain::claim();
        let operator = domain.node("operator").await;
        let solver = Node::start(adapt_solver(domain.options("normal_solver")))
            .await
            .unwrap();
        tokio::spawn(normal_solver::run(solver.clone()));
        let (planner, _) = planner(adapt_planner(domain.options("grasp_planner"))).await;
        let client = operator.service_client("/cell/plan_grasp").unwrap();
        client.wait_for_server(TIMEOUT).await.unwrap();
        Self {
            domain,
            nodes: vec![solver, planner],
            operator,
            client,
        }
    }

    /// Plays the recorded capture of the octagon until all normals of `cameras` are there.
    async fn play(&self, cameras: &[&str]) {
        let normals = |camera: &&str| self.operator.subscription(&format!("/cell/{camera}/normals"), Qos::MAP);
        let normals: Vec<Subscription<Image>> = cameras.iter().map(normals).collect::<Result<_, _>>().unwrap();
        let options = self
            .domain
            .options("bag_player")
            .parameter("bag", repository().join("bags/octagon2").display().to_string())
            .parameter("wait_for_subscriptions", TIMEOUT.as_secs_f64());
        let player = Node::start(options).await.unwrap();
        within("the bag", bag_player::run(player.clone())).await.unwrap();
        for mut normals in normals {
            within("normals", normals.next()).await.unwrap();
        }
        player.shutdown().await;
    }

    async fn plan(&self, request: PlanGraspRequest) -> PlanGraspResponse {
        let response = self.client.call(request, 2 * TIMEOUT).await.unwrap();
        PlanGraspResponse::clone(&response)
    }

    /// Why there is no grasp.
    async fn refusal(&self, request: PlanGraspRequest) -> String {
        let response = self.plan(request).await;
        assert!(
            !response.success && response.timing.stage == CellState::PLAN,
            "{response:?}"
        );
        response.message
    }

    async fn set(&self, name: &str, value: f64) {
        let client = self
            .operator
            .service_client::<SetParameters>("/cell/grasp_planner/set_parameters")
            .unwrap();
        let value = ParameterValue {
            type_: ParameterType::PARAMETER_DOUBLE,
            double_value: value,
            ..ParameterValue::default()
        };
        let parameters = vec![WireParameter {
            name: name.into(),
            value,
        }];
        let set = client.call(SetParametersRequest { parameters }, TIMEOUT).await.unwrap();
        assert!(set.results[0].successful, "{set:?}");
    }

    async fn shut_down(self) {
        for node in self.nodes {
            node.shutdown().await;
        }
    }
}

async fn planner(options: NodeOptions) -> (Node, JoinHandle<Result<(), grasp_planner::Error>>) {
    let node = Node::start(options).await.unwrap();
    (node.clone(), tokio::spawn(grasp_planner::run(node)))
}

/// With calibrated panels.
fn calibrated(options: NodeOptions) -> NodeOptions {
    let lights = repository().join("launch_configs/calibration/lights.yaml");
    options.parameter("lights.file", lights.display().to_string())
}

/// Solving may take long on a loaded machine.
fn patient(options: NodeOptions) -> NodeOptions {
    options.parameter("result_timeout", TIMEOUT.as_secs_f64())
}

fn point(at: &Point) -> Point3<f64> {
    Point3::new(at.x, at.y, at.z)
}

fn vector(vector: &Vector3Message) -> Vector3<f64> {
    Vector3::new(vector.x, vector.y, vector.z)
}

fn rotation(of: &Quaternion) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(geometry::nalgebra::Quaternion::new(of.w, of.x, of.y, of.z))
}

/// The contact lies on the octagon's top, a cup of `diameter` whole on it.
fn assert_on_top(grasp: &Grasp, diameter: f64, tolerance: f64) {
    let (contact, normal) = (point(&grasp.contact), vector(&grasp.normal));
    let off = contact - Point3::from(TOP);
    let tilt = normal.angle(&Vector3::z()).to_degrees();
    println!(
        "contact off by {:.2?} mm, normal by {tilt:.2} degrees",
        (off * 1e3).as_slice()
    );
    assert!(off.z.abs() < tolerance, "{off:?}");
    assert!(off.xy().norm() + diameter / 2.0 < TOP_RADIUS + 0.001, "{off:?}");
    assert!(tilt < 2.0, "{tilt} degrees");
}

/// Poses, joints and scores are what they have to be.
fn assert_complete(grasp: &Grasp) {
    let contact = point(&grasp.contact);
    assert!((point(&grasp.grasp.position) - contact).norm() < 1e-9);
    let away = point(&grasp.pregrasp.position) - contact;
    assert!((away - vector(&grasp.normal) * 0.05).norm() < 1e-6, "{away:?}");
    let lifted = point(&grasp.retreat.position) - contact;
    assert!((lifted - Vector3::z() * 0.1).norm() < 1e-6, "{lifted:?}");
    let tool = rotation(&grasp.grasp.orientation);
    assert!((tool * Vector3::z() - vector(&grasp.approach_axis)).norm() < 1e-6);
    for score in [grasp.score, grasp.seal_score, grasp.wrench_score] {
        assert!((0.2..=1.0).contains(&score), "{score}");
    }
    let robot = urdf_rs::read_file(repository().join("urdf/xarm7.urdf")).unwrap();
    let chain: Chain<7> = Chain::from_urdf(&robot, "link_base", "link_tcp").unwrap();
    for (joints, pose) in [
        (&grasp.pregrasp_joints, &grasp.pregrasp),
        (&grasp.grasp_joints, &grasp.grasp),
    ] {
        let joints = <[f64; 7]>::try_from(joints.as_slice()).expect("within reach");
        let reached = chain.forward(&SVector::from(joints)).unwrap();
        assert!((reached.translation() - point(&pose.position).coords).norm() < 1e-5);
        assert!(reached.rotation().angle_to(&rotation(&pose.orientation)) < 1e-5);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_octagon_is_grasped_on_its_top() {
    let vision = Vision::start(calibrated, patient).await;
    let watch = &vision.operator;
    let mut arrays = watch.subscription::<GraspArray>("/cell/grasps", Qos::STREAM).unwrap();
    let mut poses = watch
        .subscription::<PoseStamped>("/cell/grasp_pose", Qos::STREAM)
        .unwrap();
    let mut pictures = watch
        .subscription::<CompressedImage>("/cell/c2/grasps/preview", Qos::MAP)
        .unwrap();
    vision.play(&["c1", "c2"]).await;
    let answer = vision.plan(PlanGraspRequest::default()).await;
    println!(
        "{} grasps, planned in {:?}",
        answer.grasps.grasps.len(),
        answer.timing.duration
    );
    assert!(answer.success && answer.message.is_empty(), "{}", answer.message);
    assert!(answer.timing.succeeded && answer.timing.stage == CellState::PLAN);
    let best = &answer.grasps.grasps[0];
    assert_eq!(
        (best.mode, best.cameras.as_slice()),
        (Grasp::SOLID, &["c1".to_owned(), "c2".to_owned()][..])
    );
    assert_on_top(best, 0.02, 0.001);
    assert_complete(best);
    let header = &answer.grasps.header;
    assert_eq!(
        (header.frame_id.as_str(), header.stamp.sec),
        ("link_base", 1_700_000_000)
    );
    assert!(!answer.grasps.capture_id.is_empty());

    let published = within("grasps", arrays.next()).await.unwrap().message;
    assert_eq!(*published, answer.grasps);
    let pose = within("the best pose", poses.next()).await.unwrap().message;
    assert_eq!((&pose.pose, &pose.header), (&best.grasp, header));
    let picture = within("a picture", pictures.next()).await.unwrap().message;
    let decoded = imaging::decode_png(&picture.data).unwrap();
    let imaging::DecodedPng::Rgb8(picture) = decoded else {
        panic!("not in colour")
    };
    assert_eq!((picture.width(), picture.height()), (512, 512));
    assert!(picture.pixels().contains(&[60, 255, 60]), "a grasp is drawn in green");

    refusals(&vision, &answer.grasps.capture_id).await;
    vision.shut_down().await;
}

/// What is refused although everything is there.
async fn refusals(vision: &Vision, capture_id: &str) {
    let named = PlanGraspRequest {
        capture_id: capture_id.into(),
        ..PlanGraspRequest::default()
    };
    let along = |x, z| PlanGraspRequest {
        direction: Vector3Message { x, y: 0.0, z },
        ..named.clone()
    };
    let from_above = vision.plan(along(0.0, -1.0)).await;
    assert!(from_above.success, "{}", from_above.message);
    assert_on_top(&from_above.grasps.grasps[0], 0.02, 0.001);
    for (request, expected) in [
        (along(0.0, 1.0), "from below the table"),
        (
            PlanGraspRequest {
                mode: 9,
                ..named.clone()
            },
            "mode is 9, allowed: 0 (SOLID) and 1 (THIN)",
        ),
        (
            PlanGraspRequest {
                target: "mug".into(),
                ..named.clone()
            },
            "\"mug\", but named objects cannot be looked for",
        ),
    ] {
        let text = vision.refusal(request).await;
        assert!(text.contains(expected), "{text}");
    }
    // The top's inner circle is 34 mm across.
    vision.set("cup.diameter", 0.06).await;
    let text = vision.refusal(named.clone()).await;
    println!("{text}");
    assert!(text.contains("refused: ") && text.contains("patch ends"), "{text}");
    vision.set("cup.diameter", 0.02).await;
    vision.set("result_timeout", 0.1).await;
    let unknown = PlanGraspRequest {
        capture_id: "nothing".into(),
        ..PlanGraspRequest::default()
    };
    let text = vision.refusal(unknown).await;
    assert!(
        text.contains("\"nothing\" is not known") && text.contains(capture_id),
        "{text}"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn without_one_camera_the_other_goes_on_and_says_so() {
    let alone = |options| calibrated(options).parameter("cameras", vec!["c1".to_owned()]);
    let vision = Vision::start(alone, |options| options).await;
    // The player wants somebody to look at every image.
    let _images = vision
        .operator
        .subscription::<Image>("/cell/c2/image_raw", Qos::IMAGE)
        .unwrap();
    vision.play(&["c1"]).await;
    let answer = vision.plan(PlanGraspRequest::default()).await;
    assert!(answer.success, "{}", answer.message);
    let expected = "planned on c1 alone: c2: results of normal_solver did not come within 3.0 s";
    assert_eq!(answer.message, expected);
    let best = &answer.grasps.grasps[0];
    assert_eq!(best.cameras, ["c1"]);
    // One view has its integrated depth only.
    assert_on_top(best, 0.02, 0.003);
    assert_complete(best);
    vision.shut_down().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn without_calibrated_lights_there_is_nothing_to_plan_on() {
    let quick = |options: NodeOptions| options.parameter("result_timeout", 0.1);
    let vision = Vision::start(|options| options, quick).await;
    let text = vision.refusal(PlanGraspRequest::default()).await;
    assert!(text.contains("no capture has come since the start"), "{text}");
    vision.set("result_timeout", 3.0).await;
    vision.play(&["c1", "c2"]).await;
    let text = vision.refusal(PlanGraspRequest::default()).await;
    for expected in ["c1: ", "c2: ", "confidence, mask, depth, edges", "lights.file"] {
        assert!(text.contains(expected), "{text}");
    }
    vision.shut_down().await;
}

/// Sends results of one camera by hand.
struct Results {
    exposures: Publisher<Exposure>,
    infos: Publisher<CameraInfo>,
    maps: Vec<(&'static str, Publisher<Image>)>,
}

impl Results {
    async fn new(node: &Node) -> Self {
        let map = |(name, encoding): (&str, &'static str)| {
            let publisher = node.publisher::<Image>(&format!("/cell/c1/{name}"), Qos::MAP).unwrap();
            (encoding, publisher)
        };
        let maps = [
            ("normals", "32FC3"),
            ("confidence", "32FC1"),
            ("mask", "mono8"),
            ("depth", "32FC1"),
            ("edges", "mono8"),
            ("edge_confidence", "32FC1"),
        ];
        let results = Self {
            exposures: node.publisher("/cell/c1/exposure", Qos::STREAM).unwrap(),
            infos: node.publisher("/cell/c1/camera_info", Qos::LATCHED).unwrap(),
            maps: maps.into_iter().map(map).collect(),
        };
        results.exposures.wait_for_subscriptions(1, TIMEOUT).await.unwrap();
        for (_, map) in &results.maps {
            map.wait_for_subscriptions(1, TIMEOUT).await.unwrap();
        }
        results
    }

    /// One capture, all zeros.
    fn send(&self, capture: i32) {
        let mut exposure = Exposure {
            capture_id: format!("capture {capture}"),
            count: 8,
            ..Exposure::default()
        };
        exposure.header.stamp.sec = capture;
        exposure.header.frame_id = "c1_optical_frame".into();
        let header = exposure.header.clone();
        self.exposures.publish(exposure).unwrap();
        for (encoding, map) in &self.maps {
            let pixel = match *encoding {
                "32FC3" => 12,
                "32FC1" => 4,
                _ => 1,
            };
            let image = Image {
                header: header.clone(),
                width: 4,
                height: 4,
                encoding: (*encoding).into(),
                step: 4 * pixel,
                data: ByteSequence::from(vec![0; 16 * pixel as usize]),
                ..Image::default()
            };
            map.publish(image).unwrap();
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_camera_that_nobody_placed_or_described_is_named() {
    let domain = Domain::claim();
    let operator = domain.node("operator").await;
    let (planner, _planning) = planner(patient(domain.options("grasp_planner"))).await;
    let client = operator.service_client::<PlanGrasp>("/cell/plan_grasp").unwrap();
    let results = Results::new(&operator).await;
    let ask = |capture: &str| {
        let request = PlanGraspRequest {
            capture_id: capture.into(),
            ..PlanGraspRequest::default()
        };
        client.call(request, 2 * TIMEOUT)
    };
    results.send(1);
    let answer = ask("capture 1").await.unwrap();
    assert!(!answer.success);
    assert!(
        answer.message.contains("c1: no camera_info has come"),
        "{}",
        answer.message
    );
    assert!(answer.message.contains("c2 took no part in it"), "{}", answer.message);

    results.infos.publish(CameraInfo::default()).unwrap();
    results.send(2);
    let answer = ask("capture 2").await.unwrap();
    let text = &answer.message;
    assert!(
        text.contains("\"c1_optical_frame\" cannot be placed in \"link_base\""),
        "{text}"
    );
    planner.shutdown().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn start_values_that_mean_nothing_stop_the_node() {
    let domain = Domain::claim();
    for (name, value, expected) in [
        ("cup.diametre", 0.02.into(), "cup.diametre"),
        ("cup.diameter", ros::ParameterValue::from(20.0), "0.002 to 0.2"),
        ("cameras", vec!["a".to_owned(); 3].into(), "3 cameras, allowed: 1 or 2"),
        ("directions", vec![0.0, 0.0].into(), "parameter directions"),
        ("home", vec![0.0; 6].into(), "6 angles, allowed are 7"),
        ("arm_description", "/no/such/arm.urdf".into(), "/no/such/arm.urdf"),
    ] {
        let (node, planning) = planner(domain.options("grasp_planner").parameter(name, value)).await;
        let error = tokio::time::timeout(Duration::from_secs(30), planning).await;
        let error = error.expect("the node ends").unwrap().unwrap_err().to_string();
        assert!(error.contains(expected), "{name}: {error}");
        node.shutdown().await;
    }
}
