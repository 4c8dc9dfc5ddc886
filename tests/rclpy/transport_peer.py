#!/usr/bin/env python3
"""One end of a transport measurement: an rclpy node that sends or receives Images and prints what it saw as JSON.

    transport_peer.py publish   TOPIC BYTES COUNT INTERVAL_S TIMEOUT_S
    transport_peer.py subscribe TOPIC BYTES COUNT INTERVAL_S TIMEOUT_S

The stamp of a message is the system time just before `publish`; its latency ends when the callback runs.
"""

import array
import json
import sys
import time

import rclpy
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Image

QOS = QoSProfile(depth=2, reliability=ReliabilityPolicy.RELIABLE)


def publish(node, topic, size, count, interval, timeout):
    publisher = node.create_publisher(Image, topic, QOS)
    deadline = time.monotonic() + timeout
    while publisher.get_subscription_count() == 0 and time.monotonic() < deadline:
        rclpy.spin_once(node, timeout_sec=0.05)
    time.sleep(1.0)  # both directions of the match
    message = Image(height=1, width=size, step=size, encoding="mono8", data=array.array("B", bytes(size)))
    for _ in range(count):
        start = time.monotonic()
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(time.time_ns(), 10**9)
        publisher.publish(message)
        rclpy.spin_once(node, timeout_sec=0)
        time.sleep(max(0.0, start + interval - time.monotonic()))
    # Stay until the reader has gone: what it still misses is repaired.
    while publisher.get_subscription_count() > 0 and time.monotonic() < deadline:
        rclpy.spin_once(node, timeout_sec=0.05)
    return {"sent": count}


def subscribe(node, topic, size, count, interval, timeout):
    latencies = []

    def on_image(message):
        now = time.time_ns()
        stamp = message.header.stamp
        if len(message.data) == size:
            latencies.append((now - stamp.sec * 10**9 - stamp.nanosec) / 1e6)

    node.create_subscription(Image, topic, on_image, QOS)
    deadline = time.monotonic() + timeout
    while len(latencies) < count and time.monotonic() < deadline:
        rclpy.spin_once(node, timeout_sec=0.05)
    return {"latencies_ms": latencies}


def main():
    role, topic, size, count, interval, timeout = sys.argv[1:7]
    rclpy.init()
    node = rclpy.create_node(f"transport_{role}")
    run = {"publish": publish, "subscribe": subscribe}[role]
    print(json.dumps(run(node, topic, int(size), int(count), float(interval), float(timeout))), flush=True)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
