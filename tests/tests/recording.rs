//! The recorder as a node: what was published while it recorded is in the bag, and what stands in the way is named.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use interfaces::builtin_interfaces::msg::{Duration as DurationMessage, Time};
use interfaces::diagnostic_msgs::msg::{DiagnosticArray, DiagnosticStatus};
use interfaces::geometry_msgs::msg::{PoseStamped, TransformStamped};
use interfaces::rakelight_msgs::msg::{ArmState, CellState, Exposure, GraspArray, LightState};
use interfaces::rakelight_msgs::srv::{StartRecording, StartRecordingRequest, StartRecordingResponse};
use interfaces::sensor_msgs::msg::{CameraInfo, CompressedImage, Image, JointState, PointCloud2};
use interfaces::std_msgs::msg::{Bool, String as StringMessage};
use interfaces::std_srvs::srv::{Trigger, TriggerRequest, TriggerResponse};
use interfaces::tf2_msgs::msg::TFMessage;
use interfaces::{Message, MessageVisitor, cdr};
use recording::{Bag, BagWriter, OfferedQos};
use ros::{Node, Publisher, Qos, ServiceClient};
use scenarios::{Domain, TIMEOUT, eventually, patterns, within};
use tempfile::TempDir;
use tokio::task::JoinHandle;

/// A recorder, and those who talk to it.
struct Recorder {
    node: Node,
    running: JoinHandle<Result<(), bag_recorder::Error>>,
    starts: ServiceClient<StartRecording>,
    stops: ServiceClient<Trigger>,
    folder: TempDir,
}

impl Recorder {
    async fn new(domain: &Domain, operator: &Node, max_queue_bytes: i64) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let options = domain
            .options("bag_recorder")
            .parameter("folder", folder.path().display().to_string())
            .parameter("max_queue_bytes", max_queue_bytes);
        let node = Node::start(options).await.unwrap();
        let running = tokio::spawn(bag_recorder::run(node.clone()));
        let starts = operator.service_client("record/start").unwrap();
        let stops = operator.service_client("record/stop").unwrap();
        Self {
            node,
            running,
            starts,
            stops,
            folder,
        }
    }

    async fn ask(&self, request: StartRecordingRequest) -> Arc<StartRecordingResponse> {
        self.starts.call(request, TIMEOUT).await.unwrap()
    }

    async fn start(&self, request: StartRecordingRequest) -> PathBuf {
        let response = self.ask(request).await;
        assert!(response.success && response.message.is_empty(), "{response:?}");
        PathBuf::from(&response.path)
    }

    async fn stop(&self) -> Arc<TriggerResponse> {
        self.stops.call(TriggerRequest::default(), TIMEOUT).await.unwrap()
    }

    /// Gives the folder of its bags, which goes when it is dropped.
    async fn shut_down(self) -> TempDir {
        self.node.shutdown().await;
        within("the recorder's end", self.running).await.unwrap().unwrap();
        self.folder
    }
}

/// Publishes, and remembers what a bag must hold: topic to CDR, in order.
#[derive(Default)]
struct Published(BTreeMap<String, Vec<Vec<u8>>>);

impl Published {
    fn publish<M: Message>(&mut self, publisher: &Publisher<M>, message: M) {
        let bytes = cdr::to_vec(&message).unwrap();
        self.0.entry(publisher.topic().to_owned()).or_default().push(bytes);
        publisher.publish(message).unwrap();
    }

    /// The same of a bag; topics without a message are left out.
    fn of(bag: &Bag) -> Self {
        let mut found = Self::default();
        for message in bag.messages() {
            let message = message.unwrap();
            let topic = found.0.entry(message.topic.name.clone()).or_default();
            topic.push(message.cdr.to_vec());
        }
        found
    }

    fn assert_is(&self, other: &Self) {
        let counts = |of: &Self| {
            of.0.iter()
                .map(|(topic, all)| (topic.clone(), all.len()))
                .collect::<Vec<_>>()
        };
        assert_eq!(counts(self), counts(other));
        assert!(self.0 == other.0, "the messages differ");
    }
}

struct Camera {
    images: Publisher<Image>,
    exposures: Publisher<Exposure>,
    infos: Publisher<CameraInfo>,
}

impl Camera {
    fn new(node: &Node, name: &str) -> Self {
        Self {
            images: node.publisher(&format!("{name}/image_raw"), Qos::IMAGE).unwrap(),
            exposures: node.publisher(&format!("{name}/exposure"), Qos::STREAM).unwrap(),
            infos: node.publisher(&format!("{name}/camera_info"), Qos::LATCHED).unwrap(),
        }
    }

    fn send(&self, published: &mut Published, second: i32, size: u32) {
        for index in 0..8 {
            let stamp = Time {
                sec: second,
                nanosec: u32::from(index) * 15_000_000,
            };
            let image = patterns::image(size, u16::from(index) * 100, stamp);
            let exposure = Exposure {
                header: image.header.clone(),
                capture_id: format!("capture_{second}"),
                channel: index,
                index,
                count: 8,
                ..Exposure::default()
            };
            published.publish(&self.infos, patterns::camera_info(size, stamp));
            published.publish(&self.images, image);
            published.publish(&self.exposures, exposure);
        }
    }
}

const QUEUE: i64 = 512 << 20;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_message_between_start_and_stop_is_in_the_bag_and_what_was_latched_before() {
    let domain = Domain::claim();
    let cell = domain.node("cell").await;
    let cameras = ["c1", "c2"].map(|name| Camera::new(&cell, name));
    let state = cell.publisher::<CellState>("state", Qos::LATCHED).unwrap();
    let fixed = cell.publisher::<TFMessage>("/tf_static", Qos::TF_STATIC).unwrap();
    let joints = cell.publisher::<JointState>("joint_states", Qos::STREAM).unwrap();
    let moving = cell.publisher::<TFMessage>("/tf", Qos::STREAM).unwrap();
    let lights = cell.publisher::<LightState>("lights/state", Qos::STREAM).unwrap();

    let mut published = Published::default();
    // Two are latched, only the last one of the state is.
    state.publish(CellState::default()).unwrap();
    let capture_id = "capture_0".to_owned();
    published.publish(
        &state,
        CellState {
            stage: CellState::IDLE,
            capture_id,
            ..CellState::default()
        },
    );
    for child in ["tool", "table"] {
        let transform = TransformStamped {
            child_frame_id: child.into(),
            ..TransformStamped::default()
        };
        published.publish(
            &fixed,
            TFMessage {
                transforms: vec![transform],
            },
        );
    }
    cameras[0]
        .images
        .publish(patterns::image(16, 7, Time::default()))
        .unwrap();
    published.publish(&cameras[0].infos, patterns::camera_info(64, Time::default()));

    let recorder = Recorder::new(&domain, &cell, QUEUE).await;
    let path = recorder.start(StartRecordingRequest::default()).await;
    assert_eq!(path.parent(), Some(recorder.folder.path()));
    for second in 1..4 {
        for camera in &cameras {
            camera.send(&mut published, second, 256);
        }
        published.publish(
            &joints,
            JointState {
                position: vec![0.5; 7],
                ..JointState::default()
            },
        );
        published.publish(&moving, TFMessage::default());
        published.publish(
            &lights,
            LightState {
                mode: LightState::IDLE,
                ..LightState::default()
            },
        );
    }
    let stopped = recorder.stop().await;
    assert!(
        stopped.success && stopped.message.contains("157 messages"),
        "{stopped:?}"
    );
    assert!(!stopped.message.contains("dropped"), "{stopped:?}");
    let late = cell.publisher::<LightState>("lights/state", Qos::STREAM).unwrap();
    late.publish(LightState::default()).unwrap();

    let bag = Bag::open(&path).unwrap();
    assert!(bag.report().is_whole(), "{:?}", bag.report().damage);
    assert_eq!(bag.topics().len(), 11, "topics of a session, with a message or without");
    Published::of(&bag).assert_is(&published);
    assert!(stopped.message.starts_with(&path.display().to_string()), "{stopped:?}");
    recorder.shut_down().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn results_and_further_topics_are_recorded_and_everything_is_played_again() {
    let domain = Domain::claim();
    let cell = domain.node("cell").await;
    let mut published = Published::default();
    let maps = ["normals", "confidence", "mask", "depth", "edges", "edge_confidence"]
        .map(|what| cell.publisher::<Image>(&format!("c1/{what}"), Qos::MAP).unwrap());
    let points = cell.publisher::<PointCloud2>("c1/points", Qos::MAP).unwrap();
    let grasps = cell.publisher::<GraspArray>("grasps", Qos::STREAM).unwrap();
    let pose = cell.publisher::<PoseStamped>("grasp_pose", Qos::STREAM).unwrap();
    let preview = cell
        .publisher::<CompressedImage>("c1/normals/preview", Qos::MAP)
        .unwrap();
    let arm = cell.publisher::<ArmState>("arm/state", Qos::STREAM).unwrap();
    let note = cell.publisher::<StringMessage>("/somewhere/note", Qos::STREAM).unwrap();
    let description = cell
        .publisher::<StringMessage>("/robot_description", Qos::LATCHED)
        .unwrap();
    published.publish(
        &description,
        StringMessage {
            data: "<robot/>".into(),
        },
    );

    let recorder = Recorder::new(&domain, &cell, QUEUE).await;
    eventually("the note's type", || {
        recorder.node.topic_type("/somewhere/note").unwrap().is_some()
    })
    .await;
    let topics = [
        "c1/normals/preview",
        "/cell/arm/state",
        "/somewhere/note",
        "/robot_description",
    ];
    let request = StartRecordingRequest {
        path: "everything".into(),
        results: true,
        topics: topics.map(str::to_owned).into(),
        ..StartRecordingRequest::default()
    };
    let path = recorder.start(request).await;
    for map in &maps {
        published.publish(map, patterns::normal_map(64, Time::default()));
    }
    published.publish(
        &points,
        PointCloud2 {
            data: vec![1; 5000].into(),
            ..PointCloud2::default()
        },
    );
    published.publish(&grasps, GraspArray::default());
    published.publish(&pose, PoseStamped::default());
    published.publish(
        &preview,
        CompressedImage {
            data: vec![2; 500].into(),
            ..CompressedImage::default()
        },
    );
    published.publish(&arm, ArmState::default());
    published.publish(&note, StringMessage { data: "a note".into() });
    assert!(recorder.stop().await.success);
    let bag = Bag::open(&path).unwrap();
    Published::of(&bag).assert_is(&published);
    let _folder = recorder.shut_down().await;
    drop((maps, points, grasps, pose, preview, arm, note, description));

    let options = domain
        .options("bag_player")
        .parameter("bag", path.display().to_string());
    let player = Node::start(options.parameter("rate", 100.0)).await.unwrap();
    let played = within("the bag", bag_player::run(player.clone())).await.unwrap();
    assert_eq!((played.published, played.left_out), (bag.report().messages, 0));
    player.shutdown().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_cannot_be_recorded_is_refused_and_changes_nothing() {
    let domain = Domain::claim();
    let operator = domain.node("operator").await;
    let recorder = Recorder::new(&domain, &operator, QUEUE).await;
    let odd = operator.publisher::<Bool>("/odd", Qos::STREAM).unwrap();
    eventually("the odd topic's type", || {
        recorder.node.topic_type("/odd").unwrap().is_some()
    })
    .await;
    std::fs::create_dir(recorder.folder.path().join("there")).unwrap();
    let topics = |name: &str| StartRecordingRequest {
        topics: vec![name.into()],
        ..StartRecordingRequest::default()
    };
    let path = |path: &str| StartRecordingRequest {
        path: path.into(),
        ..StartRecordingRequest::default()
    };
    let negative = DurationMessage { sec: -2, nanosec: 0 };
    let refusals = [
        (
            topics("nobody/knows"),
            "topic /cell/nobody/knows is not known: nobody publishes it; topics of the cell",
        ),
        (
            topics("/odd"),
            "topic /odd is a std_msgs/msg/Bool, which is not a type of the cell; allowed: rakelight_msgs",
        ),
        (topics("a//b"), "a//b"),
        (path("there"), "there exists already; a bag is never overwritten"),
        (path("no/such/parent"), "No such file or directory"),
        (path("/proc/bag"), "/proc/bag: "),
        (
            StartRecordingRequest {
                max_duration: negative,
                ..StartRecordingRequest::default()
            },
            "max_duration is -2 s",
        ),
    ];
    for (request, expected) in refusals {
        let response = recorder.ask(request).await;
        assert!(
            !response.success && response.message.contains(expected),
            "{expected}: {response:?}"
        );
    }
    let left: Vec<_> = std::fs::read_dir(recorder.folder.path()).unwrap().collect();
    assert_eq!(left.len(), 1, "nothing was made: {left:?}");
    let idle = recorder.stop().await;
    assert!(!idle.success && idle.message.contains("not recording"), "{idle:?}");

    let first = recorder.start(StartRecordingRequest::default()).await;
    let second = recorder.ask(StartRecordingRequest::default()).await;
    let expected = format!("already recording {}", first.display());
    assert!(!second.success && second.message.contains(&expected), "{second:?}");
    assert!(recorder.stop().await.success);
    drop(odd);
    recorder.shut_down().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_recording_ends_by_itself_and_record_stop_tells_of_it_once() {
    let domain = Domain::claim();
    let operator = domain.node("operator").await;
    let recorder = Recorder::new(&domain, &operator, QUEUE).await;
    let max_duration = DurationMessage {
        sec: 0,
        nanosec: 100_000_000,
    };
    let request = StartRecordingRequest {
        max_duration,
        ..StartRecordingRequest::default()
    };
    let path = recorder.start(request).await;
    eventually("the end of the bag", || path.join("metadata.yaml").exists()).await;
    let told = recorder.stop().await;
    assert!(told.success && told.message.contains("0 messages in 0."), "{told:?}");
    let again = recorder.stop().await;
    assert!(!again.success && again.message.contains("not recording"), "{again:?}");
    assert!(Bag::open(&path).unwrap().report().is_whole());
    recorder.shut_down().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_that_is_shut_down_ends_its_bag() {
    let domain = Domain::claim();
    let cell = domain.node("cell").await;
    let camera = Camera::new(&cell, "c1");
    let recorder = Recorder::new(&domain, &cell, QUEUE).await;
    let path = recorder.start(StartRecordingRequest::default()).await;
    let mut published = Published::default();
    camera.send(&mut published, 1, 512);
    let file = path.join(format!("{}.mcap", path.file_name().unwrap().display()));
    let empty = std::fs::metadata(&file).unwrap().len();
    eventually("something on the disk", || {
        std::fs::metadata(&file).unwrap().len() > empty
    })
    .await;
    let _folder = recorder.shut_down().await;
    let bag = Bag::open(&path).unwrap();
    assert!(bag.report().is_whole(), "{:?}", bag.report().damage);
    assert_eq!(bag.report().messages, 24);
}

/// The status of the recorder in the next report that has one.
async fn diagnosis(reports: &mut ros::Subscription<DiagnosticArray>, holds: impl Fn(&DiagnosticStatus) -> bool) {
    within("the diagnosis", async {
        loop {
            let report = reports.next().await.expect("the viewer is there").message;
            if report
                .status
                .iter()
                .any(|s| s.name == "cell/bag_recorder: recording" && holds(s))
            {
                return;
            }
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_the_queue_does_not_hold_is_dropped_counted_and_never_blocks_the_publisher() {
    let domain = Domain::claim();
    let cell = domain.node("cell").await;
    let camera = Camera::new(&cell, "c1");
    let mut reports = cell
        .subscription::<DiagnosticArray>("/diagnostics", Qos::STREAM)
        .unwrap();
    // One megabyte: not even one of the images, which is taken only while nothing else waits.
    let recorder = Recorder::new(&domain, &cell, 1 << 20).await;
    let path = recorder.start(StartRecordingRequest::default()).await;
    diagnosis(&mut reports, |status| {
        status.level == DiagnosticStatus::OK && status.message.contains("recording /")
    })
    .await;
    let images: Vec<Arc<Image>> = (0..32)
        .map(|n| Arc::new(patterns::image(1536, n, Time::default())))
        .collect();
    let began = std::time::Instant::now();
    for image in images {
        camera.images.publish(image).unwrap();
    }
    let took = began.elapsed();
    assert!(took < Duration::from_millis(100), "publishing 32 images took {took:?}");
    diagnosis(&mut reports, |status| {
        status.level == DiagnosticStatus::WARN && status.message.contains("messages are lost")
    })
    .await;
    let stopped = recorder.stop().await;
    assert!(
        stopped.success && stopped.message.contains("dropped because the queue was full"),
        "{stopped:?}"
    );
    let count = |what: &str| -> usize {
        let (before, _) = stopped.message.split_once(what).expect("the count is told");
        before
            .rsplit_once(' ')
            .map_or(before, |(_, number)| number)
            .parse()
            .unwrap()
    };
    let bag = Bag::open(&path).unwrap();
    assert_eq!(bag.report().messages, count(" messages in"));
    assert_eq!(bag.report().messages + count(" dropped because"), 32);
    assert!(bag.report().is_whole());
    recorder.shut_down().await;
}

/// Writes an empty message of every type that can be recorded, each on a topic of its own.
struct OneOfEach(BagWriter);

impl MessageVisitor for OneOfEach {
    fn visit<M: Message>(&mut self) {
        if bag_recorder::RECORDED_TYPES.contains(&M::TYPE_NAME) {
            let topic = format!("/{}", M::TYPE_NAME.replace('/', "_").to_lowercase());
            let options = OfferedQos::default().into();
            let id = self.0.add_topic(&topic, M::TYPE_NAME, M::DEFINITION, &options).unwrap();
            self.0.write(id, 1, &cdr::to_vec(&M::default()).unwrap()).unwrap();
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_player_plays_every_type_that_is_recorded() {
    let domain = Domain::claim();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("one_of_each");
    let mut bag = OneOfEach(BagWriter::create(&path).unwrap());
    interfaces::visit_messages(&mut bag);
    bag.0.finish().unwrap();
    let options = domain
        .options("bag_player")
        .parameter("bag", path.display().to_string());
    let player = Node::start(options).await.unwrap();
    let played = within("the bag", bag_player::run(player.clone())).await.unwrap();
    let expected = bag_recorder::RECORDED_TYPES.len();
    assert_eq!((played.published, played.left_out), (expected, 0));
    player.shutdown().await;
}
