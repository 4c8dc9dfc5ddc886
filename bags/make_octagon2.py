#!/usr/bin/env python3
"""Makes bags/octagon2 from the path-traced capture of the same name; see README.md beside it.

    bags/make_octagon2.py [--shared ../shared]

Crops both cameras' images to 512 x 512 around the object, moves the principal point with them, writes the capture with
tools/scene_to_bag.py and repacks it with our own writer. bags/octagon2 must not exist.
Needs: pip install rosbags numpy opencv-python-headless
"""
import argparse, json, pathlib, subprocess, sys, tempfile
import cv2
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
SIZE = 512


def corner(mask):
    """Upper left corner of the crop: the object's bounding box in its middle, as far as the image reaches."""
    def start(used, limit):
        middle = (used[0] + used[-1] + 1) // 2
        return int(np.clip(middle - SIZE // 2, 0, limit - SIZE))
    return start(np.flatnonzero(mask.any(0)), mask.shape[1]), start(np.flatnonzero(mask.any(1)), mask.shape[0])


def crop_view(view, source, target):
    camera = view["camera"]
    x, y = corner(cv2.imread(str(source / camera / "mask.png"), cv2.IMREAD_UNCHANGED) > 0)
    (target / camera).mkdir(parents=True)
    for name in view["image_order"]:
        image = cv2.imread(str(source / camera / f"{name}.png"), cv2.IMREAD_UNCHANGED)
        cv2.imwrite(str(target / camera / f"{name}.png"), image[y:y + SIZE, x:x + SIZE])
    view["K"][0][2] -= x
    view["K"][1][2] -= y
    view["size"] = [SIZE, SIZE]
    print(f"{camera}: crop of {SIZE} x {SIZE} at ({x}, {y})")


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("--shared", type=pathlib.Path, default=ROOT.parent / "shared")
    a = a.parse_args()
    source = a.shared / "data/rig/objects/octagon2"
    with tempfile.TemporaryDirectory() as scratch:
        scene, plain = pathlib.Path(scratch) / "scene", pathlib.Path(scratch) / "plain"
        j = json.loads((source / "scene.json").read_text())
        for view in j["views"]:
            crop_view(view, source, scene)
        (scene / "scene.json").write_text(json.dumps(j))
        msgs = ROOT / "msgs/rakelight_msgs"
        subprocess.run([sys.executable, a.shared / "tools/scene_to_bag.py", "--msgs", msgs, plain, scene], check=True)
        repack = ["cargo", "run", "--quiet", "-p", "recording", "--example", "01_recompress", "--"]
        subprocess.run([*repack, plain, ROOT / "bags/octagon2"], check=True, cwd=ROOT)


if __name__ == "__main__":
    main()
