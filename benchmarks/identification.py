"""Identification of a Puma 560 from noisy samples: time, and deviations from the true parameters.

    python benchmarks/identification.py

Needs Pinocchio (extra ``test``). The motion is that of ``ab.excitation``; the torques have noise of 1 N m at
the first three joints and 0.1 N m at the others. The second row is plain least squares of NumPy with the
regressor of Pinocchio for the rigid bodies and the columns of friction and rotors, called for each sample;
it has neither standard errors nor a physically consistent robot. Wall time and processor time, minimum of
the repetitions.
"""

# pyright: basic
from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pinocchio

import armblocks as ab

SAMPLES, REPEATS = 10_000, 5


def least_seconds(function: Callable[[], object]) -> tuple[float, float]:
    """Wall and processor time."""
    function()
    best = [np.inf, np.inf]
    for _ in range(REPEATS):
        wall, used = time.perf_counter(), time.process_time()
        function()
        taken = time.perf_counter() - wall, time.process_time() - used
        best = [min(pair) for pair in zip(best, taken)]
    return best[0], best[1]


def pinocchio_model(robot: ab.Robot) -> pinocchio.Model:
    """A serial arm with revolute joints in Pinocchio."""
    model, parent, place = pinocchio.Model(), 0, pinocchio.SE3(robot.base.matrix)
    for link in robot.links:
        place = place * pinocchio.SE3(link.before.matrix) * pinocchio.SE3(link.joint.motion([0.0]).matrix)
        kind = pinocchio.JointModelRevoluteUnaligned(np.array(link.joint.axis))
        parent = model.addJoint(parent, kind, place, link.name)
        place = pinocchio.SE3(link.after.matrix)
    model.gravity.linear = np.array(robot.gravity)
    return model


def plain_least_squares(model: pinocchio.Model, log: dict[str, np.ndarray]) -> np.ndarray:
    """The torques that the minimum-norm solution predicts."""
    data = model.createData()
    rows: list[np.ndarray] = []
    for q, qd, qdd in zip(log["q"], log["qd"], log["qdd"]):
        rigid = pinocchio.computeJointTorqueRegressor(model, data, q, qd, qdd).copy()
        rows.append(np.hstack([rigid, np.diag(qdd), np.diag(qd), np.diag(qd > 0.0), np.diag(qd < 0.0)]))
    W = np.concatenate(rows)
    return W @ np.linalg.lstsq(W, log["tau"].ravel(), rcond=1e-10)[0]


def main() -> None:
    """Print the table."""
    puma = ab.load_robot("puma560")
    motion = ab.excitation(puma, 10.0, speed=2.0, acceleration=8.0, dt=10.0 / (SAMPLES - 1))
    q, qd, qdd = motion.trajectory
    noise = np.array([1.0, 1.0, 1.0, 0.1, 0.1, 0.1])
    exact = puma.rne(q, qd, qdd)
    log = {"t": motion.trajectory.t, "q": q, "qd": qd, "qdd": qdd}
    log["tau"] = exact + noise * np.random.default_rng(1).normal(size=q.shape)
    result = ab.identify(puma, log)
    deviation = np.abs(result.values - result.prior) / result.standard_errors
    print(f"{len(q)} samples, {len(result.values)} base parameters, {motion}")
    print(f"within 2 standard errors: {100 * np.mean(deviation < 2):.1f} %, largest {deviation.max():.2f}")
    rms = np.sqrt(np.mean((result.arm.rne(q, qd, qdd) - exact) ** 2, axis=0))
    print("RMS torque error of the identified robot, N m:", np.array2string(rms, precision=4))
    wall, used = least_seconds(lambda: ab.identify(puma, log))
    print(f"armblocks: {wall:.2f} s, processor time {used:.2f} s")
    model = pinocchio_model(puma.robot)
    wall, used = least_seconds(lambda: plain_least_squares(model, log))
    print(f"NumPy with Pinocchio's regressor: {wall:.2f} s, processor time {used:.2f} s")
    fitted = plain_least_squares(model, log).reshape(q.shape)
    print(
        "RMS torque error of NumPy's solution, N m:", np.sqrt(np.mean((fitted - exact) ** 2, axis=0)).round(4)
    )


if __name__ == "__main__":
    main()
