//! Simulated time and transforms between nodes.

use std::time::Duration;

use geometry::RigidTransform;
use interfaces::builtin_interfaces::msg::Time;
use interfaces::rosgraph_msgs::msg::Clock as ClockMessage;
use ros::clock::Woken;
use ros::tf::{Broadcaster, Listener, StampedTransform, StaticBroadcaster, TfError};
use ros::{Node, Publisher, Qos};
use scenarios::{Domain, TIMEOUT, eventually, within};

const SECOND: i64 = 1_000_000_000;

/// A node that says what time it is.
struct Timekeeper {
    publisher: Publisher<ClockMessage>,
}

impl Timekeeper {
    fn new(node: &Node) -> Self {
        Self {
            publisher: node.publisher("/clock", Qos::reliable(10)).unwrap(),
        }
    }

    fn tell(&self, nanos: i64) {
        self.publisher
            .publish(ClockMessage {
                clock: Time::from_nanos(nanos).unwrap(),
            })
            .unwrap();
    }
}

async fn simulated(domain: &Domain, name: &str) -> Node {
    Node::start(domain.options(name).parameter("use_sim_time", true))
        .await
        .expect("a node starts")
}

fn lift(z: f64) -> RigidTransform {
    RigidTransform::from_quaternion_xyzw([0.0, 0.0, z], [0.0, 0.0, 0.0, 1.0]).unwrap()
}

#[tokio::test]
async fn simulated_time_follows_clock_until_it_is_switched_off() {
    let domain = Domain::claim();
    let player = domain.node("bag_player").await;
    let timekeeper = Timekeeper::new(&player);
    let solver = simulated(&domain, "normal_solver").await;
    let clock = solver.clock();
    assert!(clock.is_simulated() && !clock.is_ready());
    assert_eq!(clock.now(), Time::default());
    timekeeper.publisher.wait_for_subscriptions(1, TIMEOUT).await.unwrap();

    timekeeper.tell(100 * SECOND);
    within("the first time", clock.wait_until_ready()).await;
    assert_eq!(clock.now_nanos(), 100 * SECOND);
    let ahead = async {
        timekeeper.tell(101 * SECOND);
        timekeeper.tell(102 * SECOND);
    };
    let (woken, ()) = tokio::join!(within("two seconds", clock.sleep(Duration::from_secs(2))), ahead);
    assert_eq!((woken, clock.now_nanos()), (Woken::Reached, 102 * SECOND));

    solver.parameters().set("use_sim_time", false).unwrap();
    eventually("system time", || !clock.is_simulated()).await;
    assert!(clock.now_nanos() > 102 * SECOND);
    eventually("the end of the subscription", || {
        timekeeper.publisher.subscription_count() == 0
    })
    .await;

    solver.parameters().set("use_sim_time", true).unwrap();
    timekeeper.publisher.wait_for_subscriptions(1, TIMEOUT).await.unwrap();
    assert!(!clock.is_ready());
    timekeeper.tell(5 * SECOND);
    eventually("the new time", || clock.now_nanos() == 5 * SECOND).await;
}

#[tokio::test]
async fn who_comes_late_still_learns_the_static_transforms() {
    let domain = Domain::claim();
    let arm = domain.node("trajectory_executor").await;
    let fixed = StaticBroadcaster::new(&arm).unwrap();
    fixed
        .send(&[StampedTransform::new("link_eef", "c1_optical_frame", 0, lift(0.05))])
        .unwrap();
    fixed
        .send(&[StampedTransform::new("link_base", "c2_optical_frame", 0, lift(0.43))])
        .unwrap();
    let moving = Broadcaster::new(&arm).unwrap();

    let planner = domain.node("grasp_planner").await;
    let listener = Listener::new(&planner).unwrap();
    for (stamp, z) in [(SECOND, 0.2), (2 * SECOND, 0.4)] {
        moving
            .send(&[StampedTransform::new("link_base", "link_eef", stamp, lift(z))])
            .unwrap();
    }
    let found = listener
        .wait_for("link_base", "c1_optical_frame", SECOND * 3 / 2, TIMEOUT)
        .await
        .unwrap();
    assert!((found.translation().z - 0.35).abs() < 1e-9, "{found:?}");
    let found = listener
        .wait_for("link_base", "c2_optical_frame", 0, TIMEOUT)
        .await
        .unwrap();
    assert!((found.translation().z - 0.43).abs() < 1e-9, "{found:?}");
}

#[tokio::test]
async fn a_missing_transform_is_an_error_that_says_what_is_known() {
    let domain = Domain::claim();
    let node = domain.node("grasp_planner").await;
    let moving = Broadcaster::new(&node).unwrap();
    let listener = Listener::new(&node).unwrap();
    moving
        .send(&[StampedTransform::new("link_base", "link_eef", SECOND, lift(0.2))])
        .unwrap();
    listener
        .wait_for("link_base", "link_eef", SECOND, TIMEOUT)
        .await
        .unwrap();

    let waited = Duration::from_millis(20);
    let error = listener
        .wait_for("link_base", "c1_optical_frame", SECOND, waited)
        .await
        .unwrap_err()
        .to_string();
    assert_eq!(
        error,
        "waited 20ms in vain: frame \"c1_optical_frame\" is unknown; known: link_base, link_eef"
    );
    let error = listener
        .buffer()
        .lookup("link_base", "link_eef", 2 * SECOND)
        .unwrap_err();
    assert!(
        matches!(
            error,
            TfError::Extrapolation {
                oldest: SECOND,
                newest: SECOND,
                ..
            }
        ),
        "{error}"
    );
}

#[tokio::test]
async fn transforms_from_before_a_jump_back_are_forgotten() {
    let domain = Domain::claim();
    let player = domain.node("bag_player").await;
    let timekeeper = Timekeeper::new(&player);
    let planner = simulated(&domain, "grasp_planner").await;
    let listener = Listener::new(&planner).unwrap();
    let moving = Broadcaster::new(&player).unwrap();
    timekeeper.publisher.wait_for_subscriptions(1, TIMEOUT).await.unwrap();
    timekeeper.tell(100 * SECOND);
    within("the first time", planner.clock().wait_until_ready()).await;
    moving
        .send(&[StampedTransform::new("link_base", "link_eef", 100 * SECOND, lift(0.2))])
        .unwrap();
    listener
        .wait_for("link_base", "link_eef", 100 * SECOND, TIMEOUT)
        .await
        .unwrap();

    timekeeper.tell(10 * SECOND);
    eventually("an empty buffer", || listener.buffer().frames().is_empty()).await;
    moving
        .send(&[StampedTransform::new("link_base", "link_eef", 10 * SECOND, lift(0.3))])
        .unwrap();
    let found = listener
        .wait_for("link_base", "link_eef", 10 * SECOND, TIMEOUT)
        .await
        .unwrap();
    assert!((found.translation().z - 0.3).abs() < 1e-9, "{found:?}");
}

#[tokio::test]
async fn a_dropped_listener_leaves_the_graph() {
    let domain = Domain::claim();
    let node = domain.node("grasp_planner").await;
    let arm = domain.node("trajectory_executor").await;
    let publisher = arm
        .publisher::<interfaces::tf2_msgs::msg::TFMessage>("/tf", Qos::STREAM)
        .unwrap();
    let listener = Listener::new(&node).unwrap();
    publisher.wait_for_subscriptions(1, TIMEOUT).await.unwrap();
    drop(listener);
    eventually("the end of the subscription", || publisher.subscription_count() == 0).await;
}
