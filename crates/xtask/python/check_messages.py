"""Loads rclpy and the type support of every interface that set-up built; fails with the name of one that is broken."""

import inspect

import control_msgs.action
import control_msgs.msg
import rakelight_msgs.action
import rakelight_msgs.msg
import rakelight_msgs.srv
import rclpy
import tf2_msgs.msg
from rclpy.type_support import check_for_type_support

interfaces = [
    interface
    for module in (rakelight_msgs.msg, rakelight_msgs.srv, rakelight_msgs.action, tf2_msgs.msg,
                   control_msgs.msg, control_msgs.action)
    for _, interface in inspect.getmembers(module, inspect.isclass)
]
for interface in interfaces:
    check_for_type_support(interface)

rclpy.init()
rclpy.create_node("rakelight_setup_check").destroy_node()
rclpy.shutdown()
named = [interface.__name__ for interface in interfaces if "_" not in interface.__name__]
print(f"rclpy works; built: {', '.join(named)}")
