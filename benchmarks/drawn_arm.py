"""A 6-axis arm drawn from bodies and joints, beside the same arm as a robot block.

    ARMBLOCKS_EFFORT=full python benchmarks/drawn_arm.py

5 s of free motion of the UR5 without motors, RK4 with 5000 steps, without compilation. The runs alternate;
the least time of sixty counts.
"""

# pyright: basic
from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

import armblocks as ab
from armblocks.blocks import (
    BodyInertia,
    Constant,
    ForwardDynamics,
    MechanismConfiguration,
    RevoluteJoint,
    RigidTransform,
    WorldFrame,
)
from armblocks.errors import LimitWarning
from armblocks.robot import Robot
from armblocks.spatial import Transform

START = (0.1, 0.5, -0.3, 0.2, 0.4, 0.1)
RUNS = 60


def arm() -> Robot:
    robot = ab.load_robot("ur5").robot
    return replace(robot, links=tuple(replace(link, motor=None) for link in robot.links))


def robot_block(robot: Robot) -> ab.Diagram:
    builder = ab.DiagramBuilder("robot block")
    torque = builder.add("tau", Constant(value=(0.0,) * robot.n))
    builder.add("arm", ForwardDynamics(robot=robot, q0=START), torque)
    return builder.build()


def drawn(robot: Robot) -> ab.Diagram:
    builder = ab.DiagramBuilder("drawn arm")
    world = builder.add("world", WorldFrame())
    builder.add("gravity", MechanismConfiguration(gravity=robot.gravity, animation=False), C=world)
    ends = {None: world["W"]}
    for link, q in zip(robot.links, START):
        before = builder.add(f"{link.name} before", rigid(link.before), B=ends[link.parent])
        joint = builder.add(link.name, RevoluteJoint(position_target=q), B=before["F"])
        after = builder.add(f"{link.name} after", rigid(link.after), B=joint["F"])
        (xx, xy, zx), (_, yy, yz), (_, _, zz) = link.inertia
        body = BodyInertia(
            mass=link.mass,
            centre_of_mass=link.centre_of_mass,
            moments=(xx, yy, zz),
            products=(yz, zx, xy),
        )
        builder.add(f"{link.name} body", body, R=after["F"])
        ends[link.name] = after["F"]
    return builder.build()


def rigid(pose: Transform) -> RigidTransform:
    return RigidTransform(translation=pose.translation, rotation="matrix", matrix=pose.rotation)


def main() -> None:
    warnings.simplefilter("ignore", LimitWarning)
    robot = arm()
    diagrams = {"robot block": robot_block(robot), "drawn arm": drawn(robot)}
    times: dict[str, list[float]] = {name: [] for name in diagrams}
    ends: dict[str, np.ndarray] = {}
    for _ in range(RUNS):
        for name, diagram in diagrams.items():
            result = ab.simulate(diagram, stop_time=5.0, solver="rk4", step=1e-3, sample_time=0.1)
            times[name].append(result.run.wall_time)
            paths = ["arm/q"] if name == "robot block" else [f"{link.name}/q" for link in robot.links]
            ends[name] = np.concatenate([np.atleast_1d(result[path][-1]) for path in paths])
    difference = np.abs(ends["robot block"] - ends["drawn arm"]).max()
    for name, values in times.items():
        print(f"{name}: {1e3 * min(values):.3f} ms")
    ratio = min(times["drawn arm"]) / min(times["robot block"])
    print(f"ratio {ratio:.3f}; largest difference at the end {difference:.1e} rad")


if __name__ == "__main__":
    main()
