#!/usr/bin/env python3
"""Shows normal maps as colours: show_normals.py [TOPIC] [--png FILE] [--window]"""
import argparse, contextlib, cv2, numpy as np, rclpy
from rclpy.executors import ExternalShutdownException
from sensor_msgs.msg import Image

parser = argparse.ArgumentParser()
parser.add_argument("topic", nargs="?", default="/cell/c1/normals")
parser.add_argument("--png", default="normals.png")
parser.add_argument("--window", action="store_true", help="needs Python's tkinter")
options = parser.parse_args()
if options.window:
    import tkinter; label = tkinter.Label()

def show(message):
    shape, strides = (message.height, message.width, 3), (message.step, 12, 4)
    normals = np.ndarray(shape, np.float32, message.data, strides=strides)  # a view of the message, not a copy
    red_green_blue = np.nan_to_num((normals + 1) * 127.5).astype(np.uint8)  # no measurement (NaN) is black
    cv2.imwrite(options.png, red_green_blue[..., ::-1])
    print(f"{message.width} x {message.height} normals in {message.header.frame_id}: {options.png}", flush=True)
    if options.window:
        label.picture = tkinter.PhotoImage(file=options.png)
        label.configure(image=label.picture)
        label.pack(), label.update()

with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException), rclpy.init():
    node = rclpy.create_node("show_normals")
    node.create_subscription(Image, options.topic, show, 1)
    rclpy.spin(node)
