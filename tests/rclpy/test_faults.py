"""Peers that die without a word, in the middle of large messages."""

import pathlib
import sys

from sensor_msgs.msg import Image
from std_srvs.srv import Trigger

SHOW_NORMALS = pathlib.Path(__file__).parent / "examples/show_normals.py"


def test_a_killed_reader_costs_the_others_nothing(probe, start, peer, tmp_path):
    child = probe("--map-size", "1536", "--rate", "2")
    received = peer.collect(Image, "/cell/c1/normals", qos=1)
    reader = start(sys.executable, SHOW_NORMALS, "--png", tmp_path / "normals.png")
    peer.spin_until(lambda: "normals.png" in reader.stdout() and received, "a map at both readers")
    reader.kill()
    before = len(received)
    peer.spin_until(lambda: len(received) >= before + 3, "maps after the other reader was killed")
    assert peer.call(Trigger, "/cell/probe/status", Trigger.Request()).success
    child.check_alive()


def test_a_killed_publisher_is_replaced_by_the_next(probe, peer):
    first = probe("--name", "first", "--map-size", "1536", "--rate", "10")
    received = peer.collect(Image, "/cell/c1/normals", qos=1)
    peer.spin_until(lambda: received, "a map of the first publisher")
    first.kill()
    probe("--name", "second", "--map-size", "640", "--rate", "2")
    of_second = lambda: [message for message in received if message.width == 640]
    peer.spin_until(lambda: len(of_second()) >= 3, "maps of the second publisher")
    assert {len(message.data) for message in of_second()} == {640 * 640 * 12}
