"""The vendor's own Python client drives the simulated arm: what it takes for hardware, a driver may.

The client wants the reports at their standard ports, so every test has an address of its own; where the control port is
can be told to it. Millimetres and radians, as the client has them.
"""

import math
import os
import threading
import time

import pytest
from harness import TIMEOUT, HarnessError
from xarm.core.config.x_config import XCONF
from xarm.wrapper import XArmAPI

FIRMWARES = ["v1.8.4", "v1.12.10", "v2.5.5"]
HOME = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0]
AWAY = [0.3, -0.3, 0.1, 0.8, -0.2, 1.0, 0.4]
TABLE = 0.2
"""Metres; the cup's mouth is 126 mm before the flange, and the flange looks down at home."""

PERIOD = 0.004
counter = iter(range(1, 255))


def wait_until(condition, what, program):
    """Ends as soon as the condition holds."""
    deadline = time.monotonic() + TIMEOUT
    while not (outcome := condition()):
        program.check_alive()
        if time.monotonic() > deadline:
            raise HarnessError(f"waited {TIMEOUT} s for {what}")
        time.sleep(0.01)
    return outcome


@pytest.fixture(autouse=True)
def no_thread_outlives_its_test():
    """The client's threads end some time after it has hung up, and say so when the test is long over."""
    before = set(threading.enumerate())
    yield
    for thread in set(threading.enumerate()) - before:
        thread.join(TIMEOUT)
        assert not thread.is_alive(), thread.name


@pytest.fixture
def connect(start, monkeypatch):
    """`connect("v2.5.5", "--vacuum", "2")` is a client of a new controller."""
    clients = []

    def connect(firmware, *arguments, report_type="rich"):
        process = os.getpid()
        address = f"127.{process // 250 % 250 + 1}.{process % 250 + 1}.{next(counter)}"
        program = start("arm_controller", "--address", address, "--firmware", firmware, *arguments)
        wait_until(lambda: "ready\n" in program.stdout(), "the controller", program)
        port = int(program.stdout().split()[1])
        monkeypatch.setattr(XCONF.SocketConf, "TCP_CONTROL_PORT", port)
        client = XArmAPI(address, is_radian=True, report_type=report_type)
        clients.append(client)
        client.program = program
        assert client.connected and client.version_number == tuple(map(int, firmware[1:].split(".")))
        return client

    yield connect
    for client in clients:
        client.disconnect()


def enable(client, mode=0):
    """The sequence that every client begins with, and that leads out of an error."""
    assert client.clean_error() == 0
    assert client.clean_warn() == 0
    assert client.motion_enable(True) == 0
    assert client.set_mode(mode) == 0
    assert client.set_state(0) == 0
    assert client.get_state()[1] in (1, 2)


def close(found, wanted, tolerance):
    return all(abs(a - b) <= tolerance for a, b in zip(found, wanted, strict=False))


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_moves_end_where_they_should(connect, firmware):
    client = connect(firmware)
    assert (client.axis, client.sn[:6]) == (7, "XI1305")
    assert client.get_state() == (0, 4)
    enable(client)
    assert client.set_servo_angle(angle=AWAY, speed=1.0, mvacc=10.0, wait=True, timeout=TIMEOUT) == 0
    code, angles = client.get_servo_angle()
    assert code == 0 and close(angles, AWAY, 1e-5)
    assert client.set_servo_angle(angle=HOME, speed=1.0, mvacc=10.0, wait=True, timeout=TIMEOUT) == 0
    code, pose = client.get_position()
    assert code == 0 and close(pose, [350.648, 0.0, 374.027], 1e-2)
    goal = [pose[0] - 50.0, pose[1] + 80.0, pose[2] + 30.0, *pose[3:]]
    assert client.set_position(*goal, speed=200, mvacc=2000, wait=True, timeout=TIMEOUT) == 0
    code, pose = client.get_position()
    assert code == 0 and close(pose[:3], goal[:3], 1e-2)
    assert client.get_inverse_kinematics(pose)[0] == 0
    assert client.get_err_warn_code() == (0, [0, 0])


def test_coordinates_that_are_not_given_stay(connect):
    client = connect("v2.5.5")
    enable(client)
    _, before = client.get_position()
    assert client.set_position(z=before[2] + 40.0, speed=200, wait=True, timeout=TIMEOUT) == 0
    _, after = client.get_position()
    assert close(after[:3], [before[0], before[1], before[2] + 40.0], 1e-2)


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_settings_are_taken_and_reported(connect, firmware):
    client = connect(firmware)
    enable(client)
    assert client.set_tcp_offset([0, 0, 126, 0, 0, 0], wait=True) == 0
    assert client.get_state() == (0, 5), "another tool wants to be confirmed"
    assert client.set_state(0) == 0
    assert client.set_tcp_load(0.61, [0, 0, 53], wait=True) == 0
    assert client.set_collision_sensitivity(4, wait=True) == 0
    wait_until(lambda: client.collision_sensitivity == 4, "a report", client.program)
    assert close(client.tcp_offset, [0, 0, 126, 0, 0, 0], 1e-3)
    assert client.tcp_load[0] == pytest.approx(0.61)
    assert client.get_position()[1][2] == pytest.approx(374.027 - 126, abs=1e-2)


@pytest.mark.parametrize("report_type", ["normal", "rich", "real"])
def test_every_report_is_understood(connect, report_type):
    client = connect("v2.5.5", report_type=report_type)
    enable(client, mode=1)
    wait_until(lambda: client.mode == 1 and client.state in (1, 2), "a report of the mode", client.program)
    assert close(client.angles, HOME, 1e-5)


def test_a_circle_comes_round(connect):
    client = connect("v2.5.5")
    enable(client)
    _, pose = client.get_position()
    through, to = [*pose], [*pose]
    through[0], through[1], to[0] = pose[0] + 40.0, pose[1] + 40.0, pose[0] + 80.0
    assert client.move_circle(through, to, 100, speed=200, mvacc=2000, wait=True, timeout=TIMEOUT) == 0
    assert close(client.get_position()[1][:3], pose[:3], 1e-2)


def wave(seconds):
    """From home and back in two seconds, all joints."""
    shift = 0.05 * (1 - math.cos(math.pi * seconds))
    return [angle + (shift if joint % 2 == 0 else -shift) for joint, angle in enumerate(HOME)]


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_a_stream_of_set_points_is_followed(connect, firmware):
    client = connect(firmware)
    enable(client, mode=1)
    for half in range(2):
        begin = time.monotonic()
        for point in range(1, 251):
            assert client.set_servo_angle_j(wave(half + point * PERIOD)) == 0
            if (left := begin + point * PERIOD - time.monotonic()) > 0:
                time.sleep(left)
        # It rests at both ends of the wave.
        end = wave(half + 1.0)
        wait_until(lambda end=end: close(client.get_servo_angle()[1], end, 1e-5), "the last set-point", client.program)
    assert client.get_err_warn_code() == (0, [0, 0])


@pytest.mark.parametrize("firmware", FIRMWARES)
@pytest.mark.parametrize("version", [1, 2])
def test_the_cup_holds_what_it_touches(connect, firmware, version):
    client = connect(firmware, "--vacuum", str(version), "--table", str(TABLE))
    enable(client)
    held = lambda: client.get_vacuum_gripper(hardware_version=version)  # noqa: E731
    # Nothing below the cup: the client gives up.
    assert client.set_vacuum_gripper(True, wait=True, timeout=0.5, hardware_version=version) == 41
    assert held() == (0, 0)
    # The wrong version is silent.
    assert client.set_vacuum_gripper(True, wait=True, timeout=0.5, hardware_version=3 - version) == 41
    _, pose = client.get_position()
    down = [*pose[:2], 1000 * TABLE + 126.0, *pose[3:]]
    assert client.set_position(*down, speed=200, mvacc=2000, wait=True, timeout=TIMEOUT) == 0
    assert client.set_vacuum_gripper(True, wait=True, timeout=3, hardware_version=version) == 0
    assert client.set_position(*pose, speed=200, mvacc=2000, wait=True, timeout=TIMEOUT) == 0
    assert held() == (0, 1), "it is carried"
    assert client.set_vacuum_gripper(False, wait=True, timeout=3, hardware_version=version) == 0
    assert held() == (0, -1), "the pump is off"


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_there_is_a_way_out_of_an_error(connect, firmware):
    client = connect(firmware)
    enable(client, mode=1)
    jump = [*HOME[:6], 0.5]
    assert client.set_servo_angle_j(jump) == 0 or client.has_err_warn
    assert client.get_err_warn_code() == (0, [24, 0])
    assert client.set_servo_angle_j(HOME) != 0
    wait_until(lambda: client.error_code == 24 and client.state == 4, "a report of it", client.program)
    wait_until(lambda: client.mode == 0, "mode 0", client.program)
    enable(client)
    wait_until(lambda: client.error_code == 0, "a report of its end", client.program)
    assert client.set_servo_angle(angle=AWAY, speed=1.0, wait=True, timeout=TIMEOUT) == 0


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_an_emergency_stop_ends_a_move(connect, firmware):
    client = connect(firmware)
    enable(client)
    assert client.set_servo_angle(angle=[2.0, *HOME[1:]], speed=0.5, wait=False) == 0
    wait_until(lambda: client.get_servo_angle()[1][0] > 0.05, "motion", client.program)
    client.emergency_stop()
    assert client.get_state() == (0, 4)
    assert client.get_servo_angle()[1][0] < 1.9
    assert client.get_cmdnum() == (0, 0)
    enable(client)
    assert client.set_servo_angle(angle=HOME, speed=1.0, wait=True, timeout=TIMEOUT) == 0


def test_velocities_end_by_themselves(connect):
    client = connect("v2.5.5")
    enable(client, mode=4)
    assert client.vc_set_joint_velocity([0.4, 0, 0, 0, 0, 0, 0], duration=0.5) == 0
    wait_until(lambda: client.get_servo_angle()[1][0] > 0.18, "motion", client.program)
    wait_until(lambda: client.get_state()[1] == 2, "rest", client.program)
    assert client.get_servo_angle()[1][0] == pytest.approx(0.2, abs=0.02)


def test_the_unix_socket_takes_the_place_of_the_control_port(start):
    """Without patching the client: it looks for this socket before it connects to port 502."""
    port = XCONF.SocketConf.TCP_CONTROL_PORT
    path = f"/tmp/xarmcontroller_uds_{port}"
    if os.path.exists(path):
        pytest.skip(f"{path} is there: another controller serves it")
    address = f"127.{os.getpid() // 250 % 250 + 1}.{os.getpid() % 250 + 1}.{next(counter)}"
    program = start("arm_controller", "--address", address, "--firmware", "v2.5.5", "--socket", path)
    wait_until(lambda: "ready\n" in program.stdout(), "the controller", program)
    client = XArmAPI(address, is_radian=True)
    try:
        enable(client)
        assert client.set_servo_angle(angle=AWAY, speed=1.0, wait=True, timeout=TIMEOUT) == 0
        assert close(client.get_servo_angle()[1], AWAY, 1e-5)
    finally:
        client.disconnect()
        program.terminate()
    assert not os.path.exists(path)
