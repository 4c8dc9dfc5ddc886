"""What rclpy sees of a Rust node in the graph, and how soon it is gone."""

import pytest
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy


def names(peer):
    return [f"{namespace.rstrip('/')}/{name}" for name, namespace in peer.node.get_node_names_and_namespaces()]


def test_the_node_and_its_interfaces_are_seen(probe, peer):
    probe()
    peer.spin_until(lambda: "/cell/probe" in names(peer), "the node")
    topics = peer.spin_until(lambda: dict(peer.node.get_publisher_names_and_types_by_node("probe", "/cell")), "topics")
    assert topics["/cell/c1/image_raw"] == ["sensor_msgs/msg/Image"]
    assert topics["/cell/c1/camera_info"] == ["sensor_msgs/msg/CameraInfo"]
    services = dict(peer.node.get_service_names_and_types_by_node("probe", "/cell"))
    assert services["/cell/probe/status"] == ["std_srvs/srv/Trigger"]


def test_quality_of_service_is_seen_with_its_node(probe, peer):
    probe()

    def offered(topic):
        """The publisher of a topic, once its node is known too: endpoints are discovered apart from nodes."""
        publishers = peer.node.get_publishers_info_by_topic(topic)
        return [info for info in publishers if (info.node_namespace, info.node_name) == ("/cell", "probe")]

    (maps,) = peer.spin_until(lambda: offered("/cell/c1/normals"), "the maps' publisher")
    assert maps.qos_profile.reliability == ReliabilityPolicy.RELIABLE
    assert maps.qos_profile.durability == DurabilityPolicy.VOLATILE
    (info,) = peer.spin_until(lambda: offered("/cell/c1/camera_info"), "the calibration's publisher")
    assert info.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL


# A peer that vanishes is dropped after its lease; a node that ends in order says so, far sooner than that.
LEASE_IS_LONGER_THAN_S = 10.0


@pytest.mark.parametrize("end", ["interrupt", "terminate"])
def test_a_node_that_ends_leaves_the_graph_at_once(probe, peer, end):
    child = probe()
    peer.spin_until(lambda: "/cell/probe" in names(peer), "the node")
    peer.spin_until(lambda: peer.node.count_publishers("/cell/c1/normals") == 1, "its publisher")
    assert getattr(child, end)() == 0
    gone = lambda: "/cell/probe" not in names(peer) and peer.node.count_publishers("/cell/c1/normals") == 0
    peer.spin_until(gone, "the node's leaving", timeout=LEASE_IS_LONGER_THAN_S)
