"""Picks an object with a running cell (`rakelight up`), by the service or by the action.

The arm moves: on hardware, keep your hand at the emergency stop.
    python pick.py                              # the service: one answer at the end
    python pick.py --action [--thin] [--dry-run]
    python pick.py --action --cancel-at execute # changes its mind in a stage
"""

import argparse
import sys

import rclpy
from action_msgs.msg import GoalStatus
from rakelight_msgs.action import PickCycle
from rakelight_msgs.msg import CellState
from rclpy.action import ActionClient
from std_srvs.srv import Trigger

STAGES = {CellState.CAPTURE: "capture", CellState.SOLVE: "solve", CellState.PLAN: "plan", CellState.EXECUTE: "execute"}
PATIENCE = 600.0
"""Seconds; the cell's own time-outs are shorter."""


def wait(node, future):
    rclpy.spin_until_future_complete(node, future, timeout_sec=PATIENCE)
    if not future.done():
        sys.exit("the cell does not answer")
    return future.result()


def by_service(node, namespace):
    client = node.create_client(Trigger, f"{namespace}/pick")
    if not client.wait_for_service(timeout_sec=30.0):
        sys.exit(f"no service {client.srv_name}: is the cell up?")
    answer = wait(node, client.call_async(Trigger.Request()))
    print(f"pick: {answer.message or 'the object is in the bin'}")
    return answer.success


def by_action(node, namespace, goal, cancel_at):
    client = ActionClient(node, PickCycle, f"{namespace}/pick_cycle")
    if not client.wait_for_server(timeout_sec=30.0):
        sys.exit(f"no action {namespace}/pick_cycle: is the cell up?")
    reached = rclpy.task.Future()

    def tell(message):
        feedback = message.feedback
        stage = STAGES.get(feedback.stage, "begin")
        print(f"{100 * feedback.progress:3.0f} % {stage}: {feedback.detail}", flush=True)
        if stage == cancel_at and not reached.done():
            reached.set_result(True)

    handle = wait(node, client.send_goal_async(goal, feedback_callback=tell))
    result = handle.get_result_async()
    if cancel_at:
        result.add_done_callback(lambda _: reached.done() or reached.set_result(False))
        if wait(node, reached):
            wait(node, handle.cancel_goal_async())
    outcome = wait(node, result)
    for timing in outcome.result.timings:
        seconds = timing.duration.sec + timing.duration.nanosec * 1e-9
        print(f"{STAGES[timing.stage]}: {seconds:.2f} s{'' if timing.succeeded else ', failed'}")
    print(f"pick_cycle: {outcome.result.reason or 'done'}")
    return outcome.status == GoalStatus.STATUS_SUCCEEDED


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--namespace", default="/cell")
    parser.add_argument("--action", action="store_true", help="with feedback, and what follows")
    parser.add_argument("--thin", action="store_true", help="a sheet or card instead of a body")
    parser.add_argument("--dry-run", action="store_true", help="plan everything, move nothing")
    parser.add_argument("--cancel-at", choices=STAGES.values(), help="cancel when this stage begins")
    arguments = parser.parse_args()
    rclpy.init()
    node = rclpy.create_node("pick_example")
    if arguments.action or arguments.thin or arguments.dry_run or arguments.cancel_at:
        mode = PickCycle.Goal.THIN if arguments.thin else PickCycle.Goal.SOLID
        goal = PickCycle.Goal(mode=mode, dry_run=arguments.dry_run)
        done = by_action(node, arguments.namespace, goal, arguments.cancel_at)
    else:
        done = by_service(node, arguments.namespace)
    sys.exit(0 if done else 1)


main()
