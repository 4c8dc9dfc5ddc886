"""The recorder as an operator uses it, with rclpy as the cell and as the one who asks; bags are read by others' readers."""

import json
import pathlib
import shutil
import subprocess

import mcap.reader
import mcap_ros2.decoder
import numpy as np
import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from harness import latched, program_path
from rakelight_msgs.msg import Exposure
from rakelight_msgs.srv import StartRecording
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import CameraInfo, Image
from std_srvs.srv import Trigger

IMAGES = 8


class Camera:
    """Publishes captures as the cell's cameras do."""

    def __init__(self, peer, name, size=256):
        self.peer, self.name, self.size = peer, name, size
        self.noise = np.random.default_rng(3)
        create = peer.node.create_publisher
        self.infos = create(CameraInfo, f"/cell/{name}/camera_info", latched())
        self.images = create(Image, f"/cell/{name}/image_raw", 10)
        self.exposures = create(Exposure, f"/cell/{name}/exposure", 10)
        self.infos.publish(CameraInfo(width=size, height=size))

    def frame(self, capture, index):
        stamp = Time(sec=1_700_000_000 + capture, nanosec=index * 15_000_000)
        pixels = self.noise.integers(0, 4096, (self.size, self.size), np.uint16) * 16
        image = Image(height=self.size, width=self.size, encoding="mono16", step=2 * self.size)
        image.data.frombytes(pixels.tobytes())
        exposure = Exposure(capture_id=f"capture_{capture}", channel=index, index=index, count=IMAGES)
        image.header.stamp = exposure.header.stamp = stamp
        self.images.publish(image)
        self.exposures.publish(exposure)
        return pixels

    def capture(self, capture):
        return [self.frame(capture, index) for index in range(IMAGES)]


@pytest.fixture
def recorder(start, tmp_path):
    """`recorder()` is a running recorder whose bags are in `tmp_path`."""
    arguments = ("node", "bag_recorder", "--ros-args", "-p", f"folder:={tmp_path}")
    return lambda: start("rakelight", *arguments)


def start_recording(peer, **request):
    answer = peer.call(StartRecording, "/cell/record/start", StartRecording.Request(**request))
    assert answer.success, answer.message
    return pathlib.Path(answer.path)


def stop_recording(peer):
    return peer.call(Trigger, "/cell/record/stop", Trigger.Request())


def bag(command, path):
    """What `rakelight bag COMMAND` says, and its exit code."""
    done = subprocess.run([program_path("rakelight"), "bag", command, path, "--json"], capture_output=True, timeout=30)
    return json.loads(done.stdout), done.returncode


def file_of(folder):
    return folder / f"{folder.name}.mcap"


def test_a_recorded_session_reads_the_same_for_everybody(recorder, peer):
    cameras = [Camera(peer, name) for name in ("c1", "c2")]
    recorder()
    folder = start_recording(peer)
    # Nothing is waited for: when record/start has answered, the publishers know the recorder.
    pixels = {camera.name: camera.capture(1) + camera.capture(2) for camera in cameras}
    stopped = stop_recording(peer)
    assert stopped.success and "66 messages" in stopped.message, stopped.message

    check, code = bag("check", folder)
    assert (code, check["captures"], check["problems"]) == (0, 2, [])
    with open(file_of(folder), "rb") as stream:
        reader = mcap.reader.make_reader(stream, validate_crcs=True, decoder_factories=[mcap_ros2.decoder.DecoderFactory()])
        with_mcap = [(channel.topic, message) for _, channel, _, message in reader.iter_decoded_messages()]
    with AnyReader([folder], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        with_rosbags = [(c.topic, reader.deserialize(data, c.msgtype)) for c, _, data in reader.messages()]
    for messages in (with_mcap, with_rosbags):
        assert len(messages) == 66
        for name, sent in pixels.items():
            images = [message for topic, message in messages if topic == f"/cell/{name}/image_raw"]
            received = [np.frombuffer(bytes(image.data), "<u2").reshape(256, 256) for image in images]
            assert len(received) == len(sent) and all(map(np.array_equal, received, sent))
            exposures = [message for topic, message in messages if topic == f"/cell/{name}/exposure"]
            assert [e.header.stamp.nanosec for e in exposures] == [i.header.stamp.nanosec for i in images]


def test_a_second_recording_holds_nothing_of_the_first(recorder, peer):
    camera = Camera(peer, "c1")
    recorder()
    for capture in (1, 2):
        folder = start_recording(peer)
        camera.capture(capture)
        assert stop_recording(peer).success
        info, _ = bag("info", folder)
        assert [c["id"] for c in info["captures"]] == [f"capture_{capture}"]
        assert info["messages"] == 17, "the latched camera_info once, and eight images with their exposures"


@pytest.mark.parametrize("end", ["interrupt", "terminate"])
def test_a_recorder_that_is_asked_to_end_finishes_its_bag(recorder, peer, end):
    camera = Camera(peer, "c1")
    program = recorder()
    folder = start_recording(peer)
    camera.capture(1)
    peer.spin_until(lambda: file_of(folder).stat().st_size > 500_000, "the images on the disk")
    assert getattr(program, end)() == 0
    info, _ = bag("info", folder)
    assert info["damage"] == [] and info["messages"] == 17


def test_a_killed_recorder_leaves_everything_up_to_the_last_second(recorder, peer):
    camera = Camera(peer, "c1")
    program = recorder()
    folder = start_recording(peer)
    camera.capture(1)
    # Small ones are gathered for a second at most; then they are in the file, whatever becomes of the process.
    peer.spin_until(lambda: bag("info", folder)[0]["messages"] == 17, "the capture in the file", timeout=5)
    camera.capture(2)
    program.kill()
    info, _ = bag("info", folder)
    assert 17 <= info["messages"] <= 33
    assert info["captures"][0]["id"] == "capture_1" and all(e["has_image"] for e in info["captures"][0]["cameras"][0]["exposures"])
    check, code = bag("check", folder)
    assert code == 1 and "metadata.yaml is missing" in check["problems"][0]["message"]


def small_disk(folder):
    """A command prefix under which `folder` is a disk of 6 MB, which only that process sees."""
    mount = f'mount -t tmpfs -o size=6m none {folder} && exec "$@"'
    return ["unshare", "-m", "sh", "-c", mount, "sh"]


def small_files(_):
    """A command prefix under which no file may be longer than 6 or 12 MB (shells count in different blocks)."""
    return ["sh", "-c", 'trap "" XFSZ; ulimit -f 12000; exec "$@"', "sh"]


@pytest.mark.parametrize(("limit", "reason"), [(small_disk, "No space left"), (small_files, "File too large")])
def test_a_full_disk_ends_the_recording_and_nothing_else(start, peer, tmp_path, limit, reason):
    prefix = limit(tmp_path)
    if subprocess.run([*prefix, "true"], capture_output=True).returncode != 0:
        pytest.skip("SKIPPED: this user may not mount a small disk (run as root)")
    camera = Camera(peer, "c1", size=512)
    command = [shutil.which(prefix[0]), *prefix[1:], program_path("rakelight"), "node", "bag_recorder"]
    program = start(*command, "--ros-args", "-p", f"folder:={tmp_path}")
    reports = peer.collect(DiagnosticArray, "/diagnostics")
    path = start_recording(peer)

    def failed():
        statuses = [status for report in reports for status in report.status]
        return any(reason in status.message and status.level == b"\x02" for status in statuses)

    captures = iter(range(1, 100))
    peer.act_until(lambda: camera.capture(next(captures)), failed, "the failure on /diagnostics")
    stopped = stop_recording(peer)
    assert not stopped.success and reason in stopped.message and "messages are in" in stopped.message, stopped.message
    # The other disk is visible below the process.
    folder = pathlib.Path(f"/proc/{program.process.pid}/root") / path.relative_to("/")
    info, _ = bag("info", folder)
    assert info["damage"] == [] and info["messages"] > IMAGES, info["damage"]
    with open(file_of(folder), "rb") as stream:
        read = list(mcap.reader.make_reader(stream, validate_crcs=True).iter_messages())
    assert len(read) == info["messages"]
    assert "not recording" in stop_recording(peer).message
    program.check_alive()


def test_what_stands_in_the_way_is_told(recorder, peer, tmp_path):
    recorder()
    (tmp_path / "there").mkdir()
    call = lambda **request: peer.call(StartRecording, "/cell/record/start", StartRecording.Request(**request))
    there = call(path="there")
    assert not there.success and "exists already" in there.message and there.path == ""
    unknown = call(topics=["c1/nonsense"])
    assert not unknown.success and "/cell/c1/nonsense" in unknown.message and "arm/state" in unknown.message
    absolute = call(path=str(tmp_path / "absolute"))
    assert absolute.success and absolute.path == str(tmp_path / "absolute")
    again = call()
    assert not again.success and f"already recording {absolute.path}" in again.message
    assert stop_recording(peer).success
