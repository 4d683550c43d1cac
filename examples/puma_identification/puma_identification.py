"""The inertial parameters and the friction of a Puma 560 from noisy measurements.

    python puma_identification.py OUT

simulates the measurement of a motion that excites all parameters, identifies the arm, and writes into the
folder OUT: the log (``log.csv``), the identified robot (``identified.json``), and the measured and the fitted
torques (``torques.svg``). A second motion shows whether the identified robot has the torques of the arm.

The arm of the measurement is the published one with links that are up to 20 % heavier and with twice the
viscous friction. The identification uses only the published numbers.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import armblocks as ab

SEED = 1
NOISE = np.array([1.0, 2.0, 1.0, 0.1, 0.1, 0.1])  # N m, standard deviation of the torque sensors


def measured_arm(published: ab.Arm) -> ab.Arm:
    """An arm that differs from its published description, as real arms do."""
    random = np.random.default_rng(SEED)
    links = []
    for link in published.robot.links:
        factor = random.uniform(1.0, 1.2)
        motor = link.motor
        if motor is not None:
            motor = replace(motor, viscous_friction=2.0 * motor.viscous_friction)
        inertia = factor * np.array(link.inertia)
        links.append(replace(link, mass=factor * link.mass, inertia=inertia, motor=motor))
    return ab.Arm(replace(published.robot, links=tuple(links)))


def log_of(arm: ab.Arm, motion: ab.JointTrajectory, seed: int) -> dict[str, np.ndarray]:
    """Measured positions and torques of a motion: the torques have noise."""
    q, qd, qdd = motion
    noise = NOISE * np.random.default_rng(seed).normal(size=q.shape)
    return {"t": motion.t, "q": q, "qd": qd, "qdd": qdd, "tau": arm.rne(q, qd, qdd) + noise}


def main(out: Path, *, evaluations: int = 60, dt: float = 0.001) -> ab.IdentificationResult:
    """Measure, identify, compare, and write the files.

    ``evaluations``: of the search for the motion. ``dt``: the time between samples, s.
    """
    out.mkdir(parents=True, exist_ok=True)
    published = ab.load_robot("puma560")
    real = measured_arm(published)

    motion, test = (
        ab.excitation(published, 10.0, speed=2.0, acceleration=8.0, evaluations=evaluations, dt=dt, seed=seed)
        for seed in (0, 1)
    )
    print(motion)
    log = log_of(real, motion.trajectory, SEED)
    columns = [log["t"][:, None], log["q"], log["tau"]]
    names = ["t", *(f"q{k}" for k in range(1, 7)), *(f"tau{k}" for k in range(1, 7))]
    np.savetxt(out / "log.csv", np.hstack(columns), delimiter=",", header=",".join(names), comments="")

    result = ab.identify(published, log)
    print(result)
    result.plot(save=out / "torques.svg")
    ab.save_robot(result.robot, out / "identified.json")

    other_log = log_of(real, test.trajectory, SEED + 1)
    before = published.rne(other_log["q"], other_log["qd"], other_log["qdd"]) - other_log["tau"]
    print("deviation of the torques of a second motion, N m:")
    print("  published robot: ", np.sqrt(np.mean(before**2, axis=0)).round(3))
    print("  identified robot:", result.validate(other_log).round(3))
    print("  noise:           ", NOISE)
    return result


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
