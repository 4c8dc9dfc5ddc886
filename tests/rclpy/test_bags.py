"""What a Rust node publishes is recorded with Python's bag tools and read back, message by message."""

import mcap.reader
import mcap_ros2.decoder
import numpy as np
from harness import latched
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import CameraInfo, Image

TOPICS = {
    "/cell/c1/image_raw": (Image, "sensor_msgs/msg/Image", 8),
    "/cell/c1/normals": (Image, "sensor_msgs/msg/Image", 1),
    "/cell/c1/camera_info": (CameraInfo, "sensor_msgs/msg/CameraInfo", latched()),
}


def record(peer, folder, count):
    """Writes the serialised messages as they came: `count` of each stream, and the latched one."""
    received = {topic: [] for topic in TOPICS}
    for topic, (kind, _, qos) in TOPICS.items():
        peer.node.create_subscription(kind, topic, received[topic].append, qos, raw=True)
    wanted = {topic: 1 if topic.endswith("info") else count for topic in TOPICS}
    peer.spin_until(lambda: all(len(received[topic]) >= wanted[topic] for topic in TOPICS), "the recording")
    typestore = get_typestore(Stores.ROS2_JAZZY)
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for topic, (_, name, _) in TOPICS.items():
            connection = writer.add_connection(topic, name, typestore=typestore)
            for index, data in enumerate(received[topic][: wanted[topic]]):
                writer.write(connection, index, data)


def test_a_recording_reads_the_same_with_rosbags_and_mcap(probe, peer, tmp_path):
    probe("--image-size", "64", "--map-size", "64")
    folder = tmp_path / "bag"
    record(peer, folder, count=3)

    with AnyReader([folder], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        with_rosbags = [
            (connection.topic, reader.deserialize(data, connection.msgtype))
            for connection, _, data in reader.messages()
        ]
    (file,) = folder.glob("*.mcap")
    with open(file, "rb") as stream:
        reader = mcap.reader.make_reader(stream, decoder_factories=[mcap_ros2.decoder.DecoderFactory()])
        with_mcap = [(channel.topic, message) for _, channel, _, message in reader.iter_decoded_messages()]

    assert sorted(topic for topic, _ in with_rosbags) == sorted(topic for topic, _ in with_mcap)
    for messages in (with_rosbags, with_mcap):
        images = [message for topic, message in messages if topic.endswith("image_raw")]
        assert [(image.encoding, image.header.frame_id) for image in images] == [("mono16", "c1_optical_frame")] * 3
        for image in images:
            values = np.frombuffer(bytes(image.data), "<u2")
            assert np.array_equal(values, np.arange(64 * 64, dtype=np.uint16) + values[0])
        (info,) = [message for topic, message in messages if topic.endswith("camera_info")]
        assert (info.width, info.distortion_model) == (64, "plumb_bob")
