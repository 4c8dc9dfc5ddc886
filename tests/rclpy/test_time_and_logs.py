"""Simulated time, `/rosout` and `/diagnostics` of a Rust node, as rclpy tools use them."""

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import Log
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock

LATCHED = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""The profile with which `ros2 topic echo /rosout` listens."""


@pytest.fixture
def client(peer, probe):
    probe("--mute")
    client = AsyncParameterClient(peer.node, "/cell/probe")
    peer.spin_until(client.services_are_ready, "the parameter services")
    return client


def use_sim_time(peer, client, value):
    (outcome,) = peer.result(client.set_parameters([Parameter("use_sim_time", value=value)]), "the outcome").results
    assert outcome.successful, outcome.reason


def test_a_node_reports_on_itself_in_the_time_that_it_is_told(peer, client):
    reports = peer.collect(DiagnosticArray, "/diagnostics", qos=10)
    status = peer.spin_until(lambda: [s for r in reports for s in r.status if s.name == "cell/probe: transport"], "a report")
    assert status[0].level == b"\x00"
    assert {"unreadable", "other nodes"} <= {value.key for value in status[0].values}
    assert reports[0].header.stamp.sec > 1_700_000_000

    use_sim_time(peer, client, True)
    publisher = peer.node.create_publisher(Clock, "/clock", 10)
    peer.spin_until(lambda: publisher.get_subscription_count() > 0, "the node's subscription to /clock")
    told = Clock()
    told.clock.sec = 77

    def reported():
        publisher.publish(told)
        return any(report.header.stamp.sec == 77 for report in reports)

    peer.spin_until(reported, "a report in simulated time")


def test_what_a_node_logs_is_on_rosout_for_who_comes_late(peer, client):
    use_sim_time(peer, client, True)
    records = peer.collect(Log, "/rosout", qos=LATCHED)
    jumps = lambda: [r for r in records if r.name == "cell.probe" and r.msg.startswith("time jumped")]
    (record, *_) = peer.spin_until(jumps, "the record of the jump")
    assert record.level == 20  # INFO
    assert record.file.endswith("clock.rs") and record.line > 0
