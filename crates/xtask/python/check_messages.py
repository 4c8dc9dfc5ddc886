"""Loads rclpy and the type support of every message that set-up built; fails with the name of one that is broken."""

import inspect

import rakelight_msgs.msg
import rclpy
import tf2_msgs.msg
from rclpy.type_support import check_for_type_support


def classes(module):
    return [member for _, member in inspect.getmembers(module, inspect.isclass) if hasattr(member, "SLOT_TYPES")]


messages = classes(rakelight_msgs.msg) + classes(tf2_msgs.msg)
for message in messages:
    check_for_type_support(message)

rclpy.init()
rclpy.create_node("rakelight_setup_check").destroy_node()
rclpy.shutdown()
print(f"rclpy works; {len(messages)} messages built")
