//! Who is in the graph, and since when not.

use std::time::Duration;

use interfaces::sensor_msgs::msg::Image;
use ros::Qos;
use scenarios::{Domain, Logs, Program, TIMEOUT, eventually};

const PROBE: &str = env!("CARGO_BIN_EXE_probe_node");

/// A node that leaves must be gone before this; the lease, which it would otherwise be missed by, is tens of seconds.
const AT_ONCE: Duration = Duration::from_secs(5);

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nodes_of_this_and_of_another_process_appear() {
    let domain = Domain::claim();
    let node = domain.node("observer").await;
    let _second = domain.node("second").await;
    let _probe = Program::start(&domain, PROBE, &["--end-with-stdin"]);
    node.wait_for_node("/cell/probe", TIMEOUT).await.unwrap();
    node.wait_for_node("/cell/second", TIMEOUT).await.unwrap();
    assert_eq!(node.other_nodes(), ["/cell/probe", "/cell/second"]);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_that_shuts_down_leaves_the_graph_at_once() {
    let domain = Domain::claim();
    let node = domain.node("observer").await;
    let mut images = node.subscription::<Image>("c1/image_raw", Qos::IMAGE).unwrap();
    let mut probe = Program::start(&domain, PROBE, &["--end-with-stdin"]);
    node.wait_for_node("/cell/probe", TIMEOUT).await.unwrap();
    images.wait_for_publishers(1, TIMEOUT).await.unwrap();
    images.next().await.unwrap();
    assert!(probe.finish().success());
    let left = tokio::time::timeout(AT_ONCE, async {
        eventually("the probe's leave", || {
            node.other_nodes().is_empty() && images.publisher_count() == 0
        })
        .await;
    });
    assert!(
        left.await.is_ok(),
        "{:?} and {} publishers remain",
        node.other_nodes(),
        images.publisher_count()
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_of_this_process_leaves_at_once_too() {
    let domain = Domain::claim();
    let (node, leaving) = (domain.node("observer").await, domain.node("leaving").await);
    node.wait_for_node("/cell/leaving", TIMEOUT).await.unwrap();
    leaving.shutdown().await;
    let left = tokio::time::timeout(AT_ONCE, eventually("the leave", || node.other_nodes().is_empty())).await;
    assert!(left.is_ok(), "{:?}", node.other_nodes());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_second_node_of_the_same_name_is_warned_of() {
    let logs = Logs::collect();
    let domain = Domain::claim();
    let _first = domain.node("twin").await;
    let probe = Program::start(&domain, PROBE, &["--name", "twin", "--end-with-stdin"]);
    logs.wait_for(&[
        "second node of the same name",
        "/cell/twin",
        &format!("domain_id={}", domain.number()),
    ])
    .await;
    eventually("the other's warning", || {
        probe.stderr().contains("second node of the same name")
    })
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn streams_end_with_their_node() {
    let domain = Domain::claim();
    let node = domain.node("short_lived").await;
    let mut images = node.subscription::<Image>("c1/image_raw", Qos::IMAGE).unwrap();
    let mut server = node
        .service_server::<interfaces::std_srvs::srv::Trigger>("pick")
        .unwrap();
    node.shutdown().await;
    assert!(
        scenarios::within("the end of the images", images.next())
            .await
            .is_none()
    );
    assert!(scenarios::within("the end of the calls", server.next()).await.is_none());
}
