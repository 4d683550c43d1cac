"""The workspace of a six-axis arm with manipulability, compared with Pinocchio and NumPy.

    python benchmarks/workspace.py

Wall time from call to result, minimum of the repetitions, after the compilation. With Pinocchio, a Python
loop evaluates each sample: pose and Jacobian of the tool, its determinant by NumPy, and the same cells by
NumPy. This loop has fewer samples, and its time is scaled.
"""

# pyright: basic
from __future__ import annotations

import os
import resource
import tempfile
import time
from pathlib import Path

import numpy as np
import pinocchio

import armblocks as ab

SAMPLES, PEER_SAMPLES, REPEATS = 10_000_000, 50_000, 3
CELL = 0.05


def least_seconds(function) -> float:
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def by_pinocchio(arm: ab.Arm, count: int) -> np.ndarray:
    """The largest manipulability of each cell."""
    with tempfile.TemporaryDirectory() as folder:
        ab.save_robot(arm, Path(folder) / "arm.urdf")
        model = pinocchio.buildModelFromUrdf(str(Path(folder) / "arm.urdf"))
    data, frame = model.createData(), model.nframes - 1
    low, high = arm.robot.qlim.T
    q = np.random.default_rng(1).uniform(low, high, (count, arm.n))
    w, points = np.empty(count), np.empty((count, 3))
    for k, row in enumerate(q):
        J = pinocchio.computeFrameJacobian(model, data, row, frame, pinocchio.LOCAL_WORLD_ALIGNED)
        w[k] = abs(np.linalg.det(J))
        points[k] = data.oMf[frame].translation
    index = np.floor(points / CELL + 0.5).astype(int)
    index -= index.min(axis=0)
    shape = tuple(index.max(axis=0) + 1)
    most = np.full(np.prod(shape), -np.inf)
    np.maximum.at(most, np.ravel_multi_index(tuple(index.T), shape), w)
    return most


def main() -> None:
    arm = ab.load_robot("puma560")
    torque = [100, 150, 80, 20, 20, 20]
    cases = {
        "manipulability": {},
        "manipulability, singularity, condition, limits, payload": {
            "measures": ("manipulability", "singularity", "condition", "limits", "payload"),
            "torque": torque,
        },
    }
    print(f"load {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores")
    for name, options in cases.items():
        for threads in (1, 2):

            def ours(count: int) -> ab.Workspace:
                return ab.workspace(arm, count, cell=CELL, threads=threads, **options)  # noqa: B023

            ours(1000)
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            seconds = least_seconds(lambda: ours(SAMPLES))
            grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
            print(f"{name}, {threads} threads: {seconds:.2f} s, peak memory + {grown:.0f} MB")
    seconds = least_seconds(lambda: by_pinocchio(arm, PEER_SAMPLES)) * SAMPLES / PEER_SAMPLES
    print(f"Pinocchio and NumPy, manipulability: {seconds:.0f} s for {SAMPLES} samples")


if __name__ == "__main__":
    main()
