"""The ground the other tests stand on: the messages that set-up built, the isolation of domains, failing in time."""

import pytest
from geometry_msgs.msg import TransformStamped
from harness import Domain, HarnessError, Peer, Program
from rakelight_msgs.msg import Exposure
from tf2_msgs.msg import TFMessage


def exposure():
    message = Exposure(capture_id="c-1", channel=7, index=3, count=8, gain_db=1.5)
    message.header.frame_id = "c1_optical_frame"
    return message


def transform():
    placed = TransformStamped(child_frame_id="link_eef")
    placed.transform.translation.z = 0.4
    return TFMessage(transforms=[placed])


@pytest.mark.parametrize("sent", [exposure(), transform()], ids=["rakelight_msgs", "tf2_msgs"])
def test_built_messages_travel_between_rclpy_nodes(make_peer, sent):
    sender, receiver = make_peer(name="sender"), make_peer(name="receiver")
    received = receiver.collect(type(sent), "topic")
    sender.publisher(type(sent), "topic").publish(sent)
    receiver.spin_until(lambda: received, "the message")
    assert received == [sent]


def test_two_tests_never_share_a_domain(domain, peer):
    other = Domain()
    assert other.number != domain.number
    stranger = Peer(other, [])
    received = stranger.collect(Exposure, "exposure")
    heard = peer.collect(Exposure, "exposure")
    publisher = peer.publisher(Exposure, "exposure")
    publisher.publish(Exposure())
    peer.spin_until(lambda: heard, "the exposure in its own domain")
    with pytest.raises(HarnessError, match="waited"):
        stranger.spin_until(lambda: received, "a message from another domain", timeout=0.5)
    assert stranger.node.count_publishers("exposure") == 0
    stranger.close()
    other.close()


def test_a_program_that_dies_ends_the_wait_with_what_it_said(start, peer):
    start("/bin/sh", "-c", "echo the reason >&2; exit 3")
    with pytest.raises(HarnessError, match=r"(?s)sh ended with code 3.*the reason"):
        peer.spin_until(lambda: False, "something that never comes")


def test_a_program_gets_the_domain_of_its_test(start, domain):
    child = start("/bin/sh", "-c", "echo $ROS_DOMAIN_ID $ROS_AUTOMATIC_DISCOVERY_RANGE")
    assert child.wait() == 0
    assert child.stdout().split() == [str(domain.number), "LOCALHOST"]


def test_the_end_of_a_test_ends_its_programs(domain):
    child = Program(["/bin/sleep", "1000"], domain.environment())
    child.check_alive()
    child.close()
    assert child.process.returncode == -9
