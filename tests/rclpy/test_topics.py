"""Images, normal maps and latched state from a Rust node, every byte of them, and images to one."""

import numpy as np
import pytest
from harness import latched
from sensor_msgs.msg import CameraInfo, Image


def hemisphere(size):
    """The probe's normal map, float32 H x W x 3, NaN outside."""
    coordinate = (2 * np.arange(size, dtype=np.float32) + 1) / np.float32(size) - np.float32(1)
    x, y = np.meshgrid(coordinate, coordinate)
    with np.errstate(invalid="ignore"):
        z = np.sqrt(1 - x * x - y * y)
    normals = np.dstack([x, y, z])
    normals[np.isnan(z)] = np.nan
    return normals


def pixels(image, kind, channels):
    return np.frombuffer(image.data, kind).reshape(image.height, image.width, channels)


def test_an_image_arrives_with_every_pixel(probe, peer):
    probe("--image-size", "64")
    (image,) = peer.messages(Image, "/cell/c1/image_raw", qos=8)
    assert (image.width, image.height, image.encoding, image.step) == (64, 64, "mono16", 128)
    assert image.header.frame_id == "c1_optical_frame"
    values = pixels(image, "<u2", 1).ravel()
    assert np.array_equal(values, np.arange(64 * 64, dtype=np.uint16) + values[0])


@pytest.mark.parametrize("size", [640, 1536], ids=["5 MB", "28 MB"])
def test_whole_normal_maps_arrive(probe, peer, size):
    probe("--map-size", str(size), "--rate", "1", "--wait-for-readers", "1")
    maps = peer.messages(Image, "/cell/c1/normals", count=3, qos=1)
    for message in maps:
        assert (message.width, message.height, message.encoding) == (size, size, "32FC3")
        assert message.step == size * 12
        np.testing.assert_allclose(pixels(message, "<f4", 3), hemisphere(size), atol=1e-6)
    stamps = [message.header.stamp.sec * 10**9 + message.header.stamp.nanosec for message in maps]
    assert stamps == sorted(set(stamps)), "each map has its own stamp"


def test_a_late_subscriber_gets_the_latched_camera_info(probe, peer):
    probe("--image-size", "64")
    # By now the one camera_info has been published: it came before the first image.
    peer.messages(Image, "/cell/c1/image_raw", qos=8)
    (info,) = peer.messages(CameraInfo, "/cell/c1/camera_info", qos=latched())
    assert (info.width, info.height, info.distortion_model) == (64, 64, "plumb_bob")
    assert info.k[0] == pytest.approx(64 * 1.42) and list(info.d) == [0.0] * 5


@pytest.mark.parametrize("size", [64, 1536], ids=["12 kB", "7 MB"])
def test_an_image_of_rclpy_comes_back_unchanged(probe, peer, size):
    probe("--mute")
    returned = peer.collect(Image, "/cell/echo/out", qos=8)
    peer.spin_until(lambda: peer.node.count_publishers("/cell/echo/out"), "the echo's publisher")
    publisher = peer.publisher(Image, "/cell/echo/in", qos=8)
    noise = np.random.default_rng(7).integers(0, 256, size * size * 3, dtype=np.uint8)
    sent = Image(height=size, width=size, encoding="rgb8", step=size * 3)
    sent.header.frame_id = "anything"
    sent.data.frombytes(noise.tobytes())
    peer.publish_until(publisher, sent, lambda: returned, "the echo")
    assert returned[0] == sent


def test_a_reader_that_comes_and_goes_leaves_the_others_alone(probe, peer, make_peer):
    probe("--map-size", "640", "--rate", "4")
    received = peer.collect(Image, "/cell/c1/normals", qos=1)
    peer.spin_until(lambda: received, "the first map")
    passing = make_peer(name="passing")
    passing.messages(Image, "/cell/c1/normals", qos=1)
    passing.close()
    before = len(received)
    peer.spin_until(lambda: len(received) >= before + 3, "maps after the other reader left")
