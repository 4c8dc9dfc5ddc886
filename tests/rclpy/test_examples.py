"""The examples are run as a person would run them."""

import pathlib
import sys

import cv2
import numpy as np
from sensor_msgs.msg import Image

EXAMPLES = pathlib.Path(__file__).parent / "examples"


def normal_map(normals, padding=0):
    """A 32FC3 image of an H x W x 3 array, with `padding` unused bytes behind each row."""
    height, width, _ = normals.shape
    rows = normals.astype("<f4").reshape(height, -1).view(np.uint8)
    rows = np.pad(rows, ((0, 0), (0, padding)), constant_values=0xFF)
    message = Image(height=height, width=width, encoding="32FC3", step=rows.shape[1])
    message.header.frame_id = "c1_optical_frame"
    message.data.frombytes(rows.tobytes())
    return message


def test_show_normals_paints_axes_and_holes(start, peer, tmp_path):
    normals = np.zeros((2, 3, 3))
    normals[0] = np.eye(3)  # along x, y, z
    normals[1, 0] = [0, 0, -1]
    normals[1, 2] = np.nan
    picture = tmp_path / "normals.png"
    child = start(sys.executable, EXAMPLES / "show_normals.py", "/cell/c1/normals", "--png", picture)
    peer.publisher(Image, "/cell/c1/normals", qos=1).publish(normal_map(normals, padding=8))
    peer.spin_until(lambda: str(picture) in child.stdout(), "the picture")
    assert "3 x 2 normals in c1_optical_frame" in child.stdout()
    red_green_blue = cv2.imread(str(picture))[..., ::-1]
    assert red_green_blue[0].tolist() == [[255, 127, 127], [127, 255, 127], [127, 127, 255]]
    assert red_green_blue[1].tolist() == [[127, 127, 0], [127, 127, 127], [0, 0, 0]]
    child.interrupt()
    assert "Traceback" not in child.stderr()


def test_show_normals_is_short():
    assert len((EXAMPLES / "show_normals.py").read_text().splitlines()) < 30
