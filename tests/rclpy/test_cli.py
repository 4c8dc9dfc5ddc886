"""The command line as a person uses it, with rclpy as the one who watches."""

import pathlib

import cv2
import numpy as np
import pytest
from sensor_msgs.msg import Image

ROOT = pathlib.Path(__file__).parents[2]
BAG = ROOT / "bags" / "octagon2"
FOOTBALL = ROOT.parent / "shared" / "data" / "white_football"


def picture(path):
    """The normals that a picture shows, H x W x 3."""
    return cv2.imread(str(path))[..., ::-1].astype(float) / 127.5 - 1


def test_demo_writes_the_normal_map_of_each_camera(start, tmp_path):
    demo = start("rakelight", "demo", "--bag", BAG, "--output", tmp_path)
    assert demo.wait() == 0, demo.stderr()
    for camera in ("c1", "c2"):
        path = tmp_path / f"octagon2_{camera}_normals.png"
        assert str(path) in demo.stdout()
        normals = picture(path)
        assert normals.shape == (512, 512, 3)
        assert normals[256, 256, 2] > 0.95, "the octagon's top faces up"


def test_demo_solves_the_football(start, tmp_path):
    if not FOOTBALL.is_dir():
        pytest.skip(f"SKIPPED: no photographs at {FOOTBALL}")
    demo = start("rakelight", "demo", "--football", FOOTBALL, "--output", tmp_path)
    assert demo.wait() == 0, demo.stderr()
    normals = picture(tmp_path / "football_c1_normals.png")
    # The ball's outline is a circle about (986, 988); x is to the right, y up, z towards the camera.
    assert normals[988, 986, 2] > 0.8
    assert normals[988, 300, 0] < -0.4 < 0.4 < normals[988, 1700, 0]
    assert normals[300, 986, 1] > 0.4 > -0.4 > normals[1700, 986, 1]


def test_replay_resolves_at_full_size_for_rclpy(start, peer):
    replay = start("rakelight", "replay", BAG, "--resolve", "--loop", "--enlarge", "3", "--rate", "0.5")
    (first, second) = peer.messages(Image, "/cell/c1/normals", count=2, qos=1)[:2]
    assert (first.width, first.height, first.encoding) == (1536, 1536, "32FC3")
    normals = np.frombuffer(second.data, np.float32).reshape(1536, 1536, 3)
    lengths = np.linalg.norm(normals[np.isfinite(normals[..., 0])], axis=-1)
    np.testing.assert_allclose(lengths, 1, atol=1e-3)
    assert replay.interrupt() == 0


def test_nodes_take_ros_arguments(start, peer):
    start("rakelight", "node", "normal_solver", "--ros-args", "-r", "__ns:=/other", "-r", "__node:=renamed")
    seen = lambda: ("renamed", "/other") in peer.node.get_node_names_and_namespaces()
    peer.spin_until(seen, "the node under its new name")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["demo", "--bag", "no_such_bag"], "no_such_bag"),
        (["demo", "--football", "no_such_folder"], "no_such_folder"),
        (["replay", "no_such_bag"], "no_such_bag"),
        (["replay", str(BAG), "--rate", "1000"], "0.01 to 100"),
        (["node", "no_such_node"], "normal_solver"),
        (["node", "normal_solver", "--ros-args", "-p", "saturatoin:=5"], "saturatoin"),
        (["node", "normal_solver", "--ros-args", "-x"], "-x"),
    ],
)
def test_bad_usage_is_named(start, arguments, named):
    program = start("rakelight", *arguments)
    assert program.wait() == 2, program.stderr()
    assert named in program.stderr()


def test_an_unknown_key_of_a_launch_config_is_named_with_its_line(start, tmp_path):
    config = tmp_path / "cell.yaml"
    config.write_text("cell:\n  processes:\n    vision: [normal_solver]\n  names_pace: /cell\n")
    program = start("rakelight", "node", "normal_solver", "--config", config)
    assert program.wait() == 2
    assert "names_pace" in program.stderr() and "cell.yaml:4" in program.stderr(), program.stderr()
