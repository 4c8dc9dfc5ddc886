"""The simulated cell as `rakelight up` brings it up: real firmware, real cameras on loopback, and rclpy as the user."""

import json
import os
import pathlib
import signal
import subprocess
import sys
import time

import cv2
import numpy as np
import pytest
from rakelight_msgs.msg import Exposure
from rakelight_msgs.srv import Capture
from rcl_interfaces.srv import GetParameters
from sensor_msgs.msg import CameraInfo, Image
from std_srvs.srv import Trigger

from harness import TIMEOUT, latched

EXAMPLES = pathlib.Path(__file__).parent / "examples"

SIDE = 128
"""Pixels of the sensors: rendered at once."""

WORLD = """
cameras:
  c1: {{address: {c1}, width: {side}, height: {side}}}
  c2: {{address: {c2}, width: {side}, height: {side}}}
objects:
  - {{shape: {{kind: pyramid, side: 0.08, height: 0.04}}, pose: {{x: 0.42}}, albedo: 0.8}}
"""

CONFIG = """
cell:
  simulator: world.yaml
  processes:
    lights: [light_sequencer]
    vision: [camera_capture]
    recorder: [bag_recorder]
light_sequencer:
  ros__parameters: {{port: $(dirname)/lights}}
camera_capture:
  ros__parameters:
    c1: {{guid: {c1}}}
    c2: {{guid: {c2}}}
bag_recorder:
  ros__parameters: {{folder: $(dirname)/recordings}}
"""


class Cell:
    """A running cell, followed by its `--json` events."""

    def __init__(self, program):
        self.program = program

    def events(self, kind):
        # The last line may be half written.
        lines = self.program.stdout().split("\n")[:-1]
        return [event for event in map(json.loads, lines) if event["event"] == kind]

    def pids(self):
        """The newest process of each name."""
        return {event["process"]: event["pid"] for event in self.events("started")}


@pytest.fixture
def config(domain, tmp_path):
    """A config with a world of its own, at addresses that no other test has."""
    places = {"side": SIDE} | {f"c{n}": f"127.{100 + domain.number}.7.{n}" for n in (1, 2)}
    (tmp_path / "world.yaml").write_text(WORLD.format(**places))
    path = tmp_path / "cell.yaml"
    path.write_text(CONFIG.format(**places))
    return path


@pytest.fixture
def cell(config, start):
    """The cell, ready. Peers join it afterwards: name this fixture before them."""
    cell = Cell(start("rakelight", "up", "--config", config, "--json"))
    deadline = time.monotonic() + TIMEOUT
    while not cell.events("ready"):
        if "was not built" in cell.program.stderr():
            pytest.skip("SKIPPED: no simulated light controller (cargo xtask setup)")
        cell.program.check_alive()
        assert time.monotonic() < deadline, "the cell does not become ready"
        time.sleep(0.02)
    yield cell
    if cell.program.process.poll() is None:
        # The next test's cameras may have the same addresses.
        assert cell.program.interrupt() == 0


def stamp(message):
    return (message.header.stamp.sec, message.header.stamp.nanosec)


def take(peer, cameras=("c1", "c2")):
    """One capture: for each camera its (image, exposure) pairs in order, joined by their stamps."""
    images = {camera: peer.collect(Image, f"/cell/{camera}/image_raw") for camera in cameras}
    exposures = {camera: peer.collect(Exposure, f"/cell/{camera}/exposure", 100) for camera in cameras}
    # An answer to a reader that is newer than those of the images says that theirs are known too.
    peer.call(GetParameters, "/cell/camera_capture/get_parameters", GetParameters.Request())
    response = peer.call(Capture, "/cell/capture", Capture.Request(cameras=list(cameras)))
    assert response.success, response.message

    def joined(camera):
        by_stamp = {stamp(image): image for image in images[camera]}
        own = [exposure for exposure in exposures[camera] if exposure.capture_id == response.capture_id]
        return [(by_stamp[stamp(e)], e) for e in own if stamp(e) in by_stamp]

    complete = lambda: all(len(joined(camera)) == response.count for camera in cameras)
    peer.spin_until(complete, f"{response.count} images of each of {cameras} with their exposures")
    return {camera: sorted(joined(camera), key=lambda pair: pair[1].index) for camera in cameras}


def pixels(image):
    return np.frombuffer(image.data, np.uint16).reshape(image.height, image.width)


def test_rclpy_gets_every_image_with_its_light(cell, peer):
    for camera, pairs in take(peer).items():
        assert [exposure.channel for _, exposure in pairs] == list(range(8))
        for image, exposure in pairs:
            assert (image.width, image.height, image.encoding) == (SIDE, SIDE, "mono16")
            assert image.header.frame_id == exposure.header.frame_id == f"{camera}_optical_frame"
        stamps = [stamp(image) for image, _ in pairs]
        assert stamps == sorted(set(stamps)), "each later than the one before"
        dark, *lit = [pixels(image).astype(float).mean() for image, _ in pairs]
        assert min(lit) > 2 * dark, (dark, lit)
        info = peer.messages(CameraInfo, f"/cell/{camera}/camera_info", qos=latched())[-1]
        assert stamp(info) in stamps
    # Opposite panels light opposite sides of the pyramid.
    first, fourth = [pixels(take(peer, ["c2"])["c2"][channel][0]).astype(float) for channel in (1, 4)]
    assert np.corrcoef(first.ravel(), fourth.ravel())[0, 1] < 0.5


def test_a_killed_process_comes_back_and_captures_work_again(cell, peer):
    take(peer)
    first = cell.pids()
    os.kill(first["vision"], signal.SIGKILL)
    peer.spin_until(lambda: len(cell.events("ready")) == 2, "the cell again")
    (died,) = cell.events("died")
    assert (died["process"], died["how"]) == ("vision", "signal 9")
    assert {name for name, pid in cell.pids().items() if pid != first[name]} == {"vision"}
    take(peer)
    os.kill(first["simulator"], signal.SIGKILL)
    peer.spin_until(lambda: len(cell.events("ready")) == 3, "the cell with a new simulator")
    # The drivers find out by themselves that their devices are new ones.
    client = peer.node.create_client(Capture, "/cell/capture")
    call = lambda: peer.result(client.call_async(Capture.Request()), "a capture")
    peer.spin_until(lambda: call().success, "a capture with the new simulator")


def children(pid):
    """Process ids of all descendants."""
    direct = pathlib.Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [child for each in direct for child in (int(each), *children(int(each)))]


def is_alive(pid):
    try:
        return pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_nothing_is_left_of_a_cell(cell, peer, config, number):
    stopped = peer.call(Trigger, "/cell/record/stop", Trigger.Request())
    assert not stopped.success, "nothing is recorded yet"
    family = children(cell.program.process.pid)
    assert len(family) >= 5, "simulator, its board, and three processes of nodes"
    cell.program.expected_to_end = True
    cell.program.process.send_signal(number)
    expected = -signal.SIGKILL if number == signal.SIGKILL else 0
    assert cell.program.wait() == expected, cell.program.stderr()
    peer.spin_until(lambda: not any(map(is_alive, family)), f"the end of {family}")
    if number != signal.SIGKILL:
        assert not os.path.lexists(config.parent / "lights"), "the link to the lights is gone"


def test_capture_shows_what_the_cameras_saw(cell, start, tmp_path):
    pictures = tmp_path / "pictures"
    capture = start("rakelight", "capture", "--count", "2", "--png", pictures, "--json")
    capture.expected_to_end = True
    assert capture.wait() == 0, capture.stderr()
    reports = [json.loads(line) for line in capture.stdout().splitlines()]
    assert len(reports) == 2 and reports[0]["capture_id"] != reports[1]["capture_id"]
    for report in reports:
        assert report["cameras"].keys() == {"c1", "c2"} and len(report["pictures"]) == 2
        for path in report["pictures"]:
            assert cv2.imread(path).shape == (2 * SIDE + 4, 4 * SIDE + 12, 3)
        originals = sorted((pictures / report["capture_id"]).iterdir())
        assert len(originals) == 16 and originals[1].name == "c1_1_L1.png"
        brightest = max(cv2.imread(str(path), cv2.IMREAD_UNCHANGED).max() for path in originals[:8])
        assert brightest == report["cameras"]["c1"]["brightest"]
    only = start("rakelight", "capture", "--cameras", "c2")
    only.expected_to_end = True
    assert only.wait() == 0, only.stderr()
    _, *cameras = only.stdout().splitlines()
    assert len(cameras) == 1 and cameras[0].startswith("  c2: 8 images"), only.stdout()
    unknown = start("rakelight", "capture", "--cameras", "c9")
    unknown.expected_to_end = True
    assert unknown.wait() == 1 and "it has c1, c2" in unknown.stderr(), unknown.stderr()


def test_the_example_records_captures(cell, start, config):
    example = start(sys.executable, EXAMPLES / "record_captures.py", "session", "--count", "2")
    example.expected_to_end = True
    assert example.wait() == 0, example.stderr()
    bag = start("rakelight", "bag", "check", config.parent / "recordings" / "session")
    bag.expected_to_end = True
    assert bag.wait() == 0 and "2 captures" in bag.stdout(), bag.stdout() + bag.stderr()


def test_a_second_cell_with_the_same_cameras_says_so(cell, config):
    command = [cell.program.process.args[0], "up", "--config", config]
    # Another domain, so that only the cameras' addresses are in the way.
    environment = os.environ | {"ROS_DOMAIN_ID": "101"}
    second = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=30)
    assert second.returncode == 1
    assert "the simulator cannot start" in second.stderr and "127." in second.stderr, second.stderr


def test_doctor_says_whether_the_simulated_cell_can_run(config, start):
    doctor = start("rakelight", "doctor", "--config", config)
    doctor.expected_to_end = True
    assert doctor.wait() in (0, 1)
    assert "simulated cell" in doctor.stdout() and "can" in doctor.stdout().splitlines()[-1]
