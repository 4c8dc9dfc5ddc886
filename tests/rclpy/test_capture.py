"""Captures of the simulated cell as rclpy users see them: through the real program, over DDS."""

import os
import signal
import sys
import time

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from harness import latched
from rakelight_msgs.msg import Exposure
from rakelight_msgs.srv import Capture
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.parameter import Parameter
from sensor_msgs.msg import CameraInfo, Image
from std_srvs.srv import Trigger

SIDE = 192

WORLD = """
seed: 1
lights: {{port: {port}}}
cameras:
  c1: {{serial: T1, address: {c1}, width: {side}, height: {side}}}
  c2: {{serial: T2, address: {c2}, width: {side}, height: {side}}}
objects:
  - name: pyramid
    shape: {{kind: pyramid, side: 0.06, height: 0.03}}
    pose: {{x: 0.43, y: 0.0, yaw: 0.5}}
    albedo: 0.85
"""

CONFIG = """
cell:
  processes: {{cell: [light_sequencer, camera_capture]}}
light_sequencer:
  ros__parameters: {{port: {port}}}
camera_capture:
  ros__parameters:
    cameras: [c1, c2]
    c1:
      guid: {c1}
      pose: [0.4122948, -0.0082561, 0.3314031, 0.7311041, 0.6815821, 0.0290451, 0.009433]
      TransportLayerControl: {{packet_socket: false}}
    c2:
      guid: {c2}
      pose: [0.3286905, 0.1296702, 0.4092682, 0.6898829, 0.6971379, -0.0247881, 0.1935091]
      TransportLayerControl: {{packet_socket: false}}
"""

STUCK_READER = """
import rclpy
from sensor_msgs.msg import Image
rclpy.init()
node = rclpy.create_node("stuck_reader")
node.create_subscription(Image, "/cell/c1/image_raw", lambda image: None, 10)
print("subscribed", flush=True)
rclpy.spin(node)
"""


@pytest.fixture
def cell(start, peer, tmp_path):
    """The simulated cell with small cameras, once it takes captures."""
    pid = os.getpid()
    address = f"127.{192 + (pid >> 8 & 31)}.{pid & 255}"
    values = {"port": tmp_path / "lights", "c1": f"{address}.1", "c2": f"{address}.2", "side": SIDE}
    world, config = tmp_path / "world.yaml", tmp_path / "cell.yaml"
    world.write_text(WORLD.format(**values))
    config.write_text(CONFIG.format(**values))
    start("rakelight", "sim", world)
    start("rakelight", "node", "light_sequencer", "camera_capture", "--config", config)

    def is_ready():
        return capture(peer).success

    peer.act_until(lambda: None, is_ready, "a first capture")
    return peer


def capture(peer, *cameras):
    return peer.call(Capture, "/cell/capture", Capture.Request(cameras=cameras))


def pixels(image):
    return np.frombuffer(image.data, np.uint16).reshape(image.height, image.width).astype(int)


def key(message):
    return message.header.stamp.sec, message.header.stamp.nanosec


def test_images_come_with_their_exposure_and_matching_stamps(cell):
    images = cell.collect(Image, "/cell/c2/image_raw", 16)
    exposures = cell.collect(Exposure, "/cell/c2/exposure", 16)
    infos = cell.collect(CameraInfo, "/cell/c2/camera_info", 16)
    cell.spin_until(lambda: cell.node.count_publishers("/cell/c2/image_raw"), "the camera's topics")

    def taken():
        return {key(exposure): exposure for exposure in exposures if exposure.capture_id == answer.capture_id}

    # The first ones may be sent before the publisher knows of its readers.
    for _ in range(10):
        answer = capture(cell, "c2")
        assert answer.success, answer.message
        try:
            cell.spin_until(lambda: len(taken()) == 8 and {key(i) for i in images} >= set(taken()), "images", 3.0)
            break
        except AssertionError:
            continue
    by_stamp = {key(image): image for image in images}
    lit = {}
    for stamp, exposure in taken().items():
        image = by_stamp[stamp]
        assert (image.encoding, image.width, image.height, image.step) == ("mono16", SIDE, SIDE, 2 * SIDE)
        assert image.header.frame_id == exposure.header.frame_id == "c2_optical_frame"
        assert (exposure.count, exposure.index) == (8, exposure.channel)
        lit[exposure.channel] = pixels(image)
    assert sorted(lit) == list(range(8))
    assert min(taken()) == (answer.stamp.sec, answer.stamp.nanosec)
    assert all(lit[channel].mean() > lit[0].mean() + 50 for channel in range(1, 8)), "every panel shines"
    differences = [np.abs(lit[a] - lit[b]).mean() for a in range(1, 8) for b in range(1, a)]
    assert min(differences) > 10, "and each from elsewhere"
    assert {key(info) for info in infos} & set(taken()), "camera_info of the same stamps"


def test_camera_info_is_latched(cell, make_peer):
    late = make_peer(name="late")
    info = late.messages(CameraInfo, "/cell/c1/camera_info", qos=latched())[0]
    assert (info.width, info.height, info.header.frame_id) == (SIDE, SIDE, "c1_optical_frame")


def test_the_exposure_assistant_answers_and_the_parameters_show_it(cell):
    answer = cell.call(Trigger, "/cell/camera_capture/auto_exposure", Trigger.Request())
    assert answer.success, answer.message
    names = ["c1.AcquisitionControl.ExposureTime", "c2.AcquisitionControl.ExposureTime"]
    values = cell.call(GetParameters, "/cell/camera_capture/get_parameters", GetParameters.Request(names=names)).values
    for camera, value in zip(("c1", "c2"), values):
        assert f"{camera}: 2500 us -> {value.double_value:.0f} us" in answer.message, answer.message


def test_rendered_panels_shine_from_where_they_stand(cell):
    reports = cell.collect(DiagnosticArray, "/diagnostics")

    def lights():
        found = [s for report in reports for s in report.status if s.name == "cell/camera_capture: lights"]
        return found[-1] if found and "no capture" not in found[-1].message else None

    status = cell.spin_until(lights, "a report on the lights")
    assert status.message == "all panels in order", status.message
    values = {value.key: value.value for value in status.values}
    for camera in ("c1", "c2"):
        for channel in range(1, 7):
            azimuth = float(values[f"{camera} L{channel} azimuth"].removesuffix(" deg"))
            assert abs(azimuth - (60 * channel - 30)) < 15, (camera, channel, azimuth)


def test_an_exposure_out_of_range_is_refused_and_the_old_one_stays(cell):
    name = "c1.AcquisitionControl.ExposureTime"
    request = SetParameters.Request(parameters=[Parameter(name, value=1e9).to_parameter_msg()])
    result = cell.call(SetParameters, "/cell/camera_capture/set_parameters", request).results[0]
    assert not result.successful and "900000" in result.reason
    request = GetParameters.Request(names=[name])
    assert cell.call(GetParameters, "/cell/camera_capture/get_parameters", request).values[0].double_value == 2500.0


def test_a_reader_that_is_stuck_does_not_delay_the_answer(cell, start):
    reader = start(sys.executable, "-c", STUCK_READER)
    cell.spin_until(lambda: "subscribed" in reader.stdout(), "the reader")
    cell.spin_until(lambda: cell.node.count_subscribers("/cell/c1/image_raw") == 1, "its subscription")
    client = cell.node.create_client(Capture, "/cell/capture")
    cell.spin_until(client.service_is_ready, "the service")

    def timed_capture():
        started = time.monotonic()
        answer = cell.result(client.call_async(Capture.Request()), "an answer")
        assert answer.success, answer.message
        return time.monotonic() - started

    timed_capture()
    os.kill(reader.process.pid, signal.SIGSTOP)
    times = [timed_capture() for _ in range(6)]
    os.kill(reader.process.pid, signal.SIGCONT)
    print("capture beside a stuck reader, s:", [round(elapsed, 3) for elapsed in times])
    assert max(times) < 1.5, times
