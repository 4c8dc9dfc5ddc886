#!/usr/bin/env python3
"""Normals by the best light triple in plain numpy: the yardstick of `bench photometric`.

Standard input: little-endian 64-bit numbers: lights, pixels, a vector per light, samples light by light. For every triple
of lights it solves the scaled normal of every pixel, predicts all lights, charges predictions that are darker than the
sample in full and brighter ones (shadows) a little, and keeps the cheapest. Prints the milliseconds that took.
"""
import itertools
import sys
import time

import numpy as np


def best_triples(lights, samples):
    count = samples.shape[1]
    best, normals = np.full(count, np.inf), np.zeros((3, count))
    scale = samples.max(axis=0)
    for triple in itertools.combinations(range(len(lights)), 3):
        matrix = lights[list(triple)]
        if abs(np.linalg.det(matrix / np.linalg.norm(matrix, axis=1, keepdims=True))) < 0.03:
            continue
        scaled = np.linalg.inv(matrix) @ samples[list(triple)]
        misfit = (samples - np.maximum(lights @ scaled, 0)) / scale
        cost = np.where(misfit > 0, misfit**2, np.minimum(misfit**2, 0.01)).sum(axis=0)
        better = cost < best
        best[better], normals[:, better] = cost[better], scaled[:, better]
    return normals / np.linalg.norm(normals, axis=0)


def main():
    numbers = np.frombuffer(sys.stdin.buffer.read(), "<f8")
    lights, pixels = int(numbers[0]), int(numbers[1])
    vectors = numbers[2 : 2 + 3 * lights].reshape(lights, 3)
    samples = numbers[2 + 3 * lights :].reshape(lights, pixels)
    started = time.perf_counter()
    normals = best_triples(vectors, samples)
    seconds = time.perf_counter() - started
    assert np.isfinite(normals).mean() > 0.9
    print(1e3 * seconds)


if __name__ == "__main__":
    main()
