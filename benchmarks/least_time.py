"""Time-optimal motions along paths under speed, acceleration and torque limits, compared with toppra.

    python benchmarks/least_time.py

Needs ``toppra`` (extra ``benchmark``) and Pinocchio. Both programs have the same path (natural cubic spline),
grid and limits. toppra evaluates torques in Python, by Pinocchio's ``rnea`` or by ``arm.rne``. Its
constraints are interpolated (both ends of each segment), as those of armblocks. The robot is the Panda
without friction, because toppra's torques have no viscous friction. Processor time of this process, minimum
of the repetitions.
"""

# pyright: basic
from __future__ import annotations

import logging
import os
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pinocchio
import toppra
import toppra.algorithm
import toppra.constraint

import armblocks as ab
from armblocks.face.least_time import MotionLimits, grid_of, path_through

POINTS, REPEATS = 7, 40


def least_seconds(function: Callable[[], object]) -> float:
    function()
    best = np.inf
    for _ in range(REPEATS):
        start = time.process_time()
        function()
        best = min(best, time.process_time() - start)
    return float(best)


def main() -> None:
    logging.disable(logging.WARNING)
    arm = ab.load_robot("panda").nofriction("all")
    n, random = arm.n, np.random.default_rng(3)
    points = arm.robot.qlim.mean(axis=1) + random.uniform(-0.5, 0.5, (POINTS, n))
    torque = 2.5 * np.abs(arm.gravload(points)).max(axis=0) + 5.0
    limits = MotionLimits(speed=np.full(n, 3.0), acceleration=np.full(n, 30.0), torque=torque)
    with tempfile.TemporaryDirectory() as folder:
        ab.save_robot(arm, Path(folder) / "arm.urdf")
        model = pinocchio.buildModelFromUrdf(str(Path(folder) / "arm.urdf"))
    data = model.createData()
    check = arm.rne(points[0], points[1], points[2])
    assert np.allclose(pinocchio.rnea(model, data, points[0], points[1], points[2]), check, atol=1e-6)

    def ours(grid: int) -> ab.JointTrajectory:
        return ab.least_time(
            arm,
            points,
            speed=limits.speed,
            acceleration=limits.acceleration,
            torque=torque,
            grid=grid,
            dt=1.0,
        )

    def theirs(grid: int, torques: Callable[..., np.ndarray]) -> float:
        path = path_through(points, limits, None)
        spline = toppra.SplineInterpolator(path.times, points, bc_type="natural")
        interpolation = toppra.constraint.DiscretizationType.Interpolation
        constraints = [
            toppra.constraint.JointVelocityConstraint(np.column_stack([-limits.speed, limits.speed])),
            toppra.constraint.JointAccelerationConstraint(
                np.column_stack([-limits.acceleration, limits.acceleration])
            ),
            toppra.constraint.JointTorqueConstraint(
                torques, np.column_stack([-torque, torque]), np.zeros(n), interpolation
            ),
        ]
        solver = toppra.algorithm.TOPPRA(
            constraints, spline, gridpoints=grid_of(arm, path, grid), parametrizer="ParametrizeConstAccel"
        )
        return solver.compute_trajectory(0, 0).duration

    def by_pinocchio(q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
        return pinocchio.rnea(model, data, q, qd, qdd)

    heads = ("segments", "armblocks, s of motion", "toppra, s of motion", "armblocks", "toppra, Pinocchio")
    heads = (*heads, "toppra, arm.rne", "speed-up")
    print("| " + " | ".join(heads) + " |\n" + "|---" * len(heads) + "|")
    for grid in (100, 200, 400, 1000):
        seconds = [
            least_seconds(function)
            for function in (
                partial(ours, grid),
                partial(theirs, grid, by_pinocchio),
                partial(theirs, grid, arm.rne),
            )
        ]
        times = " | ".join(f"{1e3 * s:.2f} ms" for s in seconds)
        durations = f"{ours(grid).duration:.5f} | {theirs(grid, arm.rne):.5f}"
        faster = ", ".join(f"{s / seconds[0]:.1f} x" for s in seconds[1:])
        print(f"| {grid} | {durations} | {times} | {faster} |")
    print("load average:", os.getloadavg())


if __name__ == "__main__":
    main()
