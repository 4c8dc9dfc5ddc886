"""Records captures of a running cell into a bag:

    rakelight up                                    # in another terminal
    source .setup/env.sh
    ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST python tests/rclpy/examples/record_captures.py session --count 3

The bag is a new folder below `recordings/`, where the cell was started; `rakelight bag info` looks into it.
"""

import argparse
import sys

import rclpy
from rakelight_msgs.srv import Capture, StartRecording
from std_srvs.srv import Trigger


def call(node, kind, name, **request):
    """The answer of one of the cell's services; ends the program when there is none."""
    client = node.create_client(kind, f"/cell/{name}")
    if not client.wait_for_service(timeout_sec=10.0):
        sys.exit(f"nobody serves /cell/{name}: is the cell up?")
    future = client.call_async(kind.Request(**request))
    rclpy.spin_until_future_complete(node, future, timeout_sec=30.0)
    if not future.done() or not future.result().success:
        sys.exit(f"/cell/{name}: {future.result().message if future.done() else 'no answer'}")
    return future.result()


def main():
    parser = argparse.ArgumentParser(description="Records captures of a running cell into a bag.")
    parser.add_argument("bag", help="name of the new folder")
    parser.add_argument("--count", type=int, default=1, help="captures to take")
    options = parser.parse_args()
    rclpy.init()
    node = rclpy.create_node("record_captures")
    print("recording", call(node, StartRecording, "record/start", path=options.bag).path, flush=True)
    for _ in range(options.count):
        print("capture", call(node, Capture, "capture").capture_id, flush=True)
    print(call(node, Trigger, "record/stop").message)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
