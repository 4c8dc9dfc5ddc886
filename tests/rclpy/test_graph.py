"""What rclpy sees of a Rust node in the graph, and how soon it is gone."""

import pytest
from harness import HarnessError
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from std_srvs.srv import Trigger


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


STARTED_AT_ONCE = 4
"""With one node a repair of its first endpoints cannot mix with those of another."""


@pytest.mark.parametrize("attempt", range(4))
def test_nodes_that_start_together_are_known_completely(start, peer, attempt):
    """Endpoints arrive pushed and repaired, of several participants in turn; none may be passed over for that."""
    nodes = [f"probe_{number}" for number in range(STARTED_AT_ONCE)]
    for node in nodes:
        start("probe_node", "--name", node, "--mute")
    expected = {f"/cell/{node}/{service}" for node in nodes for service in ("status", "slow", "get_parameters")}

    def unknown():
        """What of each node is not known yet: its name, its services, a publisher and a subscription."""
        services = {name for name, _ in peer.node.get_service_names_and_types()}
        missing = (expected - services) | ({f"/cell/{node}" for node in nodes} - set(names(peer)))
        for topic, count in (
            ("/cell/c1/image_raw", peer.node.count_publishers),
            ("/cell/echo/in", peer.node.count_subscribers),
        ):
            if count(topic) != STARTED_AT_ONCE:
                missing.add(f"{topic} x {count(topic)}")
        return missing

    # A service that a client can call needs the reader and the writer of it.
    clients = [peer.node.create_client(Trigger, f"/cell/{node}/status") for node in nodes]
    complete = lambda: not unknown() and all(client.service_is_ready() for client in clients)
    try:
        peer.spin_until(complete, "all of the nodes", timeout=10.0)
    except HarnessError as error:
        raise HarnessError(f"{error}; unknown: {sorted(unknown())}") from None
