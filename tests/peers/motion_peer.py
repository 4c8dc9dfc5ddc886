#!/usr/bin/env python3
"""Forward kinematics and Jacobians by pinocchio: the yardstick of `bench motion`.

    motion_peer.py URDF ROUNDS < joint angles

Standard input: little-endian 64-bit numbers, the angles of all joints for one configuration after the other. Prints one
JSON object: microseconds for each configuration (median of the rounds), what calling from Python alone costs, and where
the tool is in the first configurations.
"""
import json
import statistics
import sys
import time

import numpy as np
import pinocchio

TOOL = "link_tcp"
TIPS = 100


def micros(places, work):
    started = time.perf_counter()
    for angles in places:
        work(angles)
    return 1e6 * (time.perf_counter() - started) / len(places)


def tip(model, data, angles):
    pinocchio.framesForwardKinematics(model, data, angles)
    return data.oMf[model.getFrameId(TOOL)].translation.tolist()


def main():
    model = pinocchio.buildModelFromUrdf(sys.argv[1])
    data = model.createData()
    rounds = int(sys.argv[2])
    places = list(np.frombuffer(sys.stdin.buffer.read(), "<f8").reshape(-1, model.nq))

    def kinematics(angles):
        pinocchio.forwardKinematics(model, data, angles)
        pinocchio.computeJointJacobians(model, data)

    def calls(_):
        model.existFrame(TOOL)
        model.existFrame(TOOL)

    report = {
        "version": pinocchio.__version__,
        "fk_us": statistics.median(micros(places, kinematics) for _ in range(rounds)),
        "calls_us": statistics.median(micros(places, calls) for _ in range(rounds)),
        "tips": [tip(model, data, angles) for angles in places[:TIPS]],
    }
    print(json.dumps(report))


if __name__ == "__main__":
    main()
