"""Brings the arm to ready, moves its tool down and up over the table, and goes home.

The arm moves: on hardware, keep your hand at the emergency stop.
    python move_arm.py [--namespace /cell] [--speed 0.1]
"""

import argparse
import sys

import rclpy
from geometry_msgs.msg import Point, Pose, Quaternion
from rakelight_msgs.action import MoveTool
from rclpy.action import ActionClient
from std_srvs.srv import Trigger


def down(x, y, z):
    """The cup points down, there (metres, base frame)."""
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(x=1.0, w=0.0))


class Arm:
    def __init__(self, node, namespace):
        self.node, self.namespace = node, namespace
        self.mover = ActionClient(node, MoveTool, f"{namespace}/move_tool")

    def wait(self, future):
        rclpy.spin_until_future_complete(self.node, future, timeout_sec=60.0)
        if not future.done():
            sys.exit("the arm's node does not answer")
        return future.result()

    def call(self, service):
        client = self.node.create_client(Trigger, f"{self.namespace}/{service}")
        if not client.wait_for_service(timeout_sec=30.0):
            sys.exit(f"no service {client.srv_name}: is the cell up?")
        answer = self.wait(client.call_async(Trigger.Request()))
        print(f"{service}: {answer.message}")
        if not answer.success:
            sys.exit(1)

    def move(self, poses, speed):
        self.mover.wait_for_server(timeout_sec=30.0)
        goal = self.wait(self.mover.send_goal_async(MoveTool.Goal(poses=poses, straight=True, speed=speed)))
        result = self.wait(goal.get_result_async()).result
        print(f"move_tool: {result.reason or 'done'}")
        if not result.success:
            sys.exit(1)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--namespace", default="/cell")
    parser.add_argument("--speed", type=float, default=0.1, help="of the tool, m/s")
    arguments = parser.parse_args()
    rclpy.init()
    arm = Arm(rclpy.create_node("move_arm"), arguments.namespace)
    arm.call("recover")
    arm.call("home")
    arm.move([down(0.38, 0.0, 0.20), down(0.38, 0.0, 0.12), down(0.38, 0.0, 0.20)], arguments.speed)
    arm.call("home")


main()
