"""The arm as rclpy users see it: the real node and driver, the simulated controller behind its sockets."""

import os
import pathlib
import signal
import sys
import time

import numpy as np
import pytest
from action_msgs.msg import GoalStatus
from builtin_interfaces.msg import Duration
from control_msgs.action import FollowJointTrajectory
from geometry_msgs.msg import Point, Pose, Quaternion
from harness import TIMEOUT, latched
from rakelight_msgs.action import MoveTool
from rakelight_msgs.msg import ArmState
from rclpy.action import ActionClient
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

HOME = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0]
JOINTS = [f"joint{number}" for number in range(1, 8)]
counter = iter(range(1, 255))


def down(x, y, z):
    """The cup points down, there (metres, base frame)."""
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(x=1.0, w=0.0))


class Arm:
    """What a script has of the arm."""

    def __init__(self, peer, controller):
        self.peer, self.controller = peer, controller
        self.states = peer.collect(ArmState, "/cell/arm/state")
        self.joints = peer.collect(JointState, "/cell/joint_states")
        self.mover = ActionClient(peer.node, MoveTool, "/cell/move_tool")

    def call(self, name, kind=Trigger, **request):
        client = self.peer.node.create_client(kind, f"/cell/{name}")
        self.peer.spin_until(client.service_is_ready, name)
        return self.peer.result(client.call_async(kind.Request(**request)), name)

    def wait(self, condition, what):
        """The first state from now on that is as wanted."""
        seen = len(self.states)
        return self.peer.spin_until(lambda: next(filter(condition, self.states[seen:]), None), what)

    def send(self, poses, **options):
        self.peer.spin_until(self.mover.server_is_ready, "move_tool")
        return self.peer.result(self.mover.send_goal_async(MoveTool.Goal(poses=poses, **options)), "the goal")

    def result(self, goal):
        outcome = self.peer.result(goal.get_result_async(), "the result")
        return outcome.status, outcome.result

    def position(self):
        seen = len(self.joints)
        self.peer.spin_until(lambda: len(self.joints) > seen, "joint states")
        assert list(self.joints[-1].name) == JOINTS
        return np.array(self.joints[-1].position)

    def collide(self):
        """The simulated controller feels a collision."""
        self.controller.process.send_signal(signal.SIGUSR1)

    def moving(self):
        self.peer.spin_until(lambda: self.joints and max(map(abs, self.joints[-1].velocity)) > 0.05, "the arm to move")


@pytest.fixture
def arm(start, peer):
    process = os.getpid()
    address = f"127.{process // 250 % 250 + 1}.{process % 250 + 1}.{next(counter) + 100}"
    controller = start("arm_controller", "--address", address, "--firmware", "v2.5.5", "--table", "0.1")
    peer.spin_until(lambda: "ready\n" in controller.stdout(), "the controller")
    port = int(controller.stdout().split()[1])
    start("rakelight", "node", "trajectory_executor", "--ros-args", "-p", f"host:={address}", "-p", f"control_port:={port}",
          "-p", "watchdog:=0.4", "-p", "state_timeout:=0.8")
    arm = Arm(peer, controller)
    arm.wait(lambda state: state.mode == ArmState.DISABLED, "the controller")
    return arm


def ready(arm):
    answer = arm.call("recover")
    assert answer.success, answer.message
    arm.wait(lambda state: state.mode == ArmState.READY, "the arm to be ready")
    return arm


def matrix(transform):
    """4 x 4, parent from child."""
    x, y, z, w = (getattr(transform.rotation, name) for name in "xyzw")
    rotation = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    result = np.eye(4)
    result[:3, :3] = rotation
    result[:3, 3] = [getattr(transform.translation, name) for name in "xyz"]
    return result


def tool_in_base(messages):
    """From the frames on TF, or none while some are missing."""
    frames = {frame.child_frame_id: frame for message in messages for frame in message.transforms}
    link, base_from_link = "link_tcp", np.eye(4)
    while link != "link_base":
        if link not in frames:
            return None
        base_from_link = matrix(frames[link].transform) @ base_from_link
        link = frames[link].header.frame_id
    return base_from_link


def test_home_and_ten_poses(arm):
    ready(arm)
    answer = arm.call("home")
    assert answer.success, answer.message
    np.testing.assert_allclose(arm.position(), HOME, atol=2e-3)
    poses = [down(0.36 + 0.02 * (i % 3), 0.03 * (i - 5), 0.16 + 0.01 * (i % 2)) for i in range(10)]
    status, result = arm.result(arm.send(poses))
    assert (status, result.reason) == (GoalStatus.STATUS_SUCCEEDED, "")
    np.testing.assert_allclose(arm.position(), result.joints, atol=2e-3)

    moving, fixed = arm.peer.collect(TFMessage, "/tf"), arm.peer.collect(TFMessage, "/tf_static", qos=latched())
    tool = arm.peer.spin_until(lambda: (found := tool_in_base(moving + fixed)) is not None and [found], "the frames")[0]
    asked = poses[-1].position
    np.testing.assert_allclose(tool[:3, 3], [asked.x, asked.y, asked.z], atol=1e-3)
    np.testing.assert_allclose(tool[:3, 2], [0, 0, -1], atol=2e-3)
    state = arm.wait(lambda state: state.mode == ArmState.READY, "a state")
    np.testing.assert_allclose([state.tcp.position.x, state.tcp.position.y, state.tcp.position.z], tool[:3, 3], atol=1e-4)


def test_stop_in_mid_motion_and_recover_after_a_collision(arm):
    ready(arm)
    far = [down(0.35, 0.30, 0.35), down(0.35, -0.30, 0.35)]
    goal = arm.send(far)
    assert goal.accepted
    arm.moving()
    answer = arm.call("stop")
    assert answer.success, answer.message
    status, result = arm.result(goal)
    assert status == GoalStatus.STATUS_ABORTED and "stopped by request" in result.reason
    stopped = arm.position()
    refused = arm.call("home")
    assert not refused.success and "recover" in refused.message
    np.testing.assert_allclose(arm.position(), stopped, atol=1e-3)

    assert arm.call("recover").success
    goal = arm.send(far)
    arm.moving()
    arm.collide()
    status, result = arm.result(goal)
    assert status == GoalStatus.STATUS_ABORTED
    fault = arm.wait(lambda state: state.mode == ArmState.FAULT, "the fault")
    assert fault.error_code == 31 and "collision" in fault.fault
    answer = arm.call("recover")
    assert answer.success, answer.message
    assert arm.call("home").success
    np.testing.assert_allclose(arm.position(), HOME, atol=2e-3)


def test_a_trajectory_as_moveit_sends_it(arm):
    ready(arm)
    client = ActionClient(arm.peer.node, FollowJointTrajectory, "/cell/follow_joint_trajectory")
    arm.peer.spin_until(client.server_is_ready, "the action")
    away = [0.3, -0.3, 0.1, 0.8, -0.2, 1.0, 0.4]
    order = [3, 1, 0, 2, 6, 5, 4]
    points = [
        JointTrajectoryPoint(positions=[away[i] for i in order], velocities=[0.0] * 7, time_from_start=Duration(sec=3)),
        JointTrajectoryPoint(positions=[HOME[i] for i in order], velocities=[0.0] * 7, time_from_start=Duration(sec=6)),
    ]
    feedback = []
    goal = FollowJointTrajectory.Goal()
    goal.trajectory = JointTrajectory(joint_names=[JOINTS[i] for i in order], points=points)
    handle = arm.peer.result(client.send_goal_async(goal, feedback_callback=feedback.append), "the goal")
    outcome = arm.peer.result(handle.get_result_async(), "the result")
    assert (outcome.result.error_code, outcome.result.error_string) == (FollowJointTrajectory.Result.SUCCESSFUL, "")
    np.testing.assert_allclose(arm.position(), HOME, atol=2e-3)
    assert feedback and list(feedback[0].feedback.joint_names) == JOINTS

    goal.trajectory.joint_names = JOINTS[:6] + ["joint8"]
    handle = arm.peer.result(client.send_goal_async(goal), "the goal")
    outcome = arm.peer.result(handle.get_result_async(), "the result")
    assert outcome.result.error_code == FollowJointTrajectory.Result.INVALID_JOINTS
    assert "joint8" in outcome.result.error_string


def test_the_cup_holds_what_it_touches(arm):
    ready(arm)
    assert arm.call("vacuum/set", SetBool, data=True).success
    arm.wait(lambda state: state.vacuum == ArmState.VACUUM_ON, "the pump")
    line = [down(0.40, 0.0, 0.15), down(0.40, 0.0, 0.1)]
    status, result = arm.result(arm.send(line, straight=True, speed=0.2))
    assert (status, result.reason) == (GoalStatus.STATUS_SUCCEEDED, "")
    arm.wait(lambda state: state.vacuum == ArmState.VACUUM_HELD, "the seal")
    assert arm.call("vacuum/set", SetBool, data=False).success
    arm.wait(lambda state: state.vacuum == ArmState.VACUUM_OFF, "the vent")


def test_the_description_and_steady_joint_states(arm):
    description = arm.peer.messages(String, "/robot_description", qos=latched())[0].data
    assert "<robot" in description and "link_tcp" in description
    begun, seen = time.monotonic(), len(arm.joints)
    arm.peer.spin_until(lambda: len(arm.joints) - seen >= 100, "a second of joint states", timeout=TIMEOUT)
    stamps = [message.header.stamp.sec + message.header.stamp.nanosec * 1e-9 for message in arm.joints[seen:]]
    # The reports come 100 times a second; machines that run tests lose some.
    assert 0.9 < stamps[-1] - stamps[0] < 10.0 and time.monotonic() - begun < TIMEOUT


def test_the_example_moves_the_arm_and_ends_at_home(arm, start):
    example = pathlib.Path(__file__).parent / "examples" / "move_arm.py"
    script = start(sys.executable, example, "--speed", "0.25")
    script.expected_to_end = True
    assert script.wait() == 0, script.stdout() + script.stderr()
    assert script.stdout().split("\n")[-2] == "home: the arm is at home"
    np.testing.assert_allclose(arm.position(), HOME, atol=2e-3)
