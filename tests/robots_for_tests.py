"""Robots for tests of physical laws: published robots, and random trees with every joint type."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from math import pi
from typing import Any

import numpy as np
from casadi import Function
from numpy.typing import ArrayLike

from armblocks.dynamics import TRACES
from armblocks.formats.robot_files import shipped_robot
from armblocks.robot import (
    JOINT_TYPES,
    Fixed,
    Free,
    FrictionModel,
    Joint,
    JointLimits,
    Link,
    Motor,
    Prismatic,
    Revolute,
    Robot,
    Spherical,
    Universal,
    modified_dh,
    serial_chain,
    standard_dh,
)
from armblocks.spatial import Transform, rotation_about


def build_puma560() -> Robot:
    """Return the Robotics Toolbox's Puma 560, with Corke's parameters of August 1995 (d1 = 0.67183 m)."""
    alpha = (pi / 2, 0, -pi / 2, pi / 2, -pi / 2, 0)
    a = (0, 0.4318, 0.0203, 0, 0, 0)
    d = (0.67183, 0, 0.15005, 0.4318, 0, 0)
    mass = (0, 17.4, 4.8, 0.82, 0.34, 0.09)
    centre = (
        (0, 0, 0),
        (-0.3638, 0.006, 0.2275),
        (-0.0203, -0.0141, 0.070),
        (0, 0.019, 0),
        (0, 0, 0),
        (0, 0, 0.032),
    )
    inertia = (
        (0, 0.35, 0),
        (0.13, 0.524, 0.539),
        (0.066, 0.086, 0.0125),
        (1.8e-3, 1.3e-3, 1.8e-3),
        (0.3e-3, 0.4e-3, 0.3e-3),
        (0.15e-3, 0.15e-3, 0.04e-3),
    )
    motors = _puma_motors()
    low = np.radians((-160, -45, -225, -110, -100, -266))
    high = np.radians((160, 225, 45, 170, 100, 266))
    return Robot(
        name="puma560",
        manufacturer="Unimation",
        comment="params of 8/95",
        links=serial_chain(
            [
                standard_dh(
                    f"link{i + 1}",
                    alpha=alpha[i],
                    a=a[i],
                    d=d[i],
                    mass=mass[i],
                    centre_of_mass=centre[i],
                    inertia=inertia[i],
                    motor=motors[i],
                    limits=JointLimits(position=(low[i], high[i])),
                )
                for i in range(6)
            ]
        ),
    )


def build_kr180() -> Robot:
    """Return the palletising arm of the paper, with the parameters printed there."""
    alpha = (pi / 2, 0, pi / 2, 0)
    a = (0.35, 0, 1.6, 0)
    d = (0.75, 1.25, 0, 2.6)
    mass = (0, 150, 100, 50)
    centre = ((0, 0, 0.3), (-0.1, -0.1, 0), (0.1, 0.05, 0), (0, 0, 0.18))
    inertia = ((0, 0.35, 0), (0.13, 0.524, 0.539), (0.066, 0.086, 0.0125), (1.8e-3, 1.3e-3, 1.8e-3))
    motors = _puma_motors()
    ranges = ((-185, 185), (-39, 90), (-71, 109), (-270, 270))
    speeds = (105, 105, 95, 300)
    return Robot(
        name="KR180",
        manufacturer="KUKA Robotics",
        links=serial_chain(
            [
                standard_dh(
                    f"link{i + 1}",
                    alpha=alpha[i],
                    a=a[i],
                    d=d[i],
                    mass=mass[i],
                    centre_of_mass=centre[i],
                    inertia=inertia[i],
                    motor=motors[i],
                    limits=JointLimits(
                        position=(np.radians(ranges[i][0]), np.radians(ranges[i][1])),
                        speed=np.radians(speeds[i]),
                    ),
                )
                for i in range(4)
            ]
        ),
    )


def _puma_motors() -> tuple[Motor, ...]:
    Jm = (200e-6, 200e-6, 200e-6, 33e-6, 33e-6, 33e-6)
    G = (-62.6111, 107.815, -53.7063, 76.0364, 71.923, 76.686)
    B = (1.48e-3, 0.817e-3, 1.38e-3, 71.2e-6, 82.6e-6, 36.7e-6)
    Tc = (
        (0.395, -0.435),
        (0.126, -0.071),
        (0.132, -0.105),
        (11.2e-3, -16.9e-3),
        (9.26e-3, -14.5e-3),
        (3.96e-3, -10.5e-3),
    )
    return tuple(
        Motor(inertia=Jm[i], gear_ratio=G[i], viscous_friction=B[i], coulomb_friction=Tc[i]) for i in range(6)
    )


def random_rotation(random: np.random.Generator) -> np.ndarray:
    axis = random.normal(size=3)
    axis /= np.linalg.norm(axis)
    return np.array(rotation_about(tuple(axis), random.uniform(-pi, pi)))


def random_transform(random: np.random.Generator) -> Transform:
    return Transform(rotation=random_rotation(random), translation=random.uniform(-0.5, 0.5, 3))


def random_inertia(random: np.random.Generator) -> np.ndarray:
    """Return the inertia of random point masses, which is always physically consistent."""
    points = random.normal(size=(6, 3)) * 0.2
    points -= points.mean(axis=0)
    scatter = points.T @ points / 6
    return np.trace(scatter) * np.eye(3) - scatter


def build_random_tree(seed: int, count: int = 7, *, chain: bool = False) -> Robot:
    """Return a random tree or chain of ``count`` links, listed in random order.

    The joints have all types and random axes; the robot has a rotated base, a tool and motors.
    """
    random = np.random.default_rng(seed)
    links: list[Link] = []
    kinds = (Revolute, Prismatic, Revolute, Fixed, Revolute, Revolute, Prismatic)
    for i in range(count):
        kind = kinds[i % len(kinds)] if chain else kinds[random.integers(len(kinds))]
        parent = None if i == 0 else f"link{i if chain else random.integers(1, i + 1)}"
        axes = ((1, 0, 0), (0, 1, 0), (0, 0, -1), tuple(random.normal(size=3)))
        links.append(
            Link(
                name=f"link{i + 1}",
                parent=parent,
                joint=kind(axis=axes[random.integers(4)], offset=random.uniform(-1, 1)),
                before=random_transform(random),
                after=random_transform(random),
                mass=random.uniform(0.5, 3),
                centre_of_mass=random.uniform(-0.3, 0.3, 3),
                inertia=random_inertia(random),
                motor=Motor(
                    inertia=random.uniform(1e-4, 1e-3),
                    gear_ratio=random.choice((-1, 1)) * random.uniform(5, 20),
                    viscous_friction=random.uniform(0, 1e-2),
                    coulomb_friction=(random.uniform(0, 0.1), -random.uniform(0, 0.1)),
                )
                if random.random() < 0.7
                else None,
            )
        )
    if not any(link.joint.moves for link in links):
        links[0] = Link(name="link1", joint=Revolute(), mass=1.0, inertia=np.eye(3) * 0.1)
    tip = links[-1]
    rest = links[:-1]
    shuffled = [rest[i] for i in random.permutation(len(rest))] if not chain else rest
    return Robot(
        name=f"random{seed}{'chain' if chain else 'tree'}",
        links=(*shuffled, tip),
        base=random_transform(random),
        tool=random_transform(random),
        gravity=tuple(random.uniform(-10, 10, 3)),
        friction_model=FrictionModel.SQUARED_GEAR,
    )


MOVING_TYPES = tuple(kind for kind in JOINT_TYPES if kind is not Fixed)


def random_joint(kind: type[Joint], random: np.random.Generator) -> Joint:
    """Return a joint of a type with random parameters."""
    values = {
        "axis": tuple(random.normal(size=3)),
        "second_axis": tuple(random.normal(size=3)),
        "offset": random.uniform(-1, 1),
        "pitch": random.uniform(0.2, 0.6),
    }
    return kind(**{name: values[name] for name in kind.parameters})


def build_mixed_tree(seed: int, kinds: Sequence[type[Joint]]) -> Robot:
    """Return a random tree with one joint of each type in random order, with motors, base and tool."""
    random = np.random.default_rng(seed)
    links: list[Link] = []
    for i, k in enumerate(random.permutation(len(kinds))):
        links.append(
            Link(
                name=f"link{i + 1}",
                parent=None if i == 0 else f"link{random.integers(max(1, i - 2), i + 1)}",
                joint=random_joint(kinds[k], random),
                before=random_transform(random),
                after=random_transform(random),
                mass=random.uniform(0.5, 3),
                centre_of_mass=random.uniform(-0.3, 0.3, 3),
                inertia=random_inertia(random),
                motor=Motor(
                    inertia=2e-4, gear_ratio=12.0, viscous_friction=1e-3, coulomb_friction=(0.05, -0.04)
                )
                if random.random() < 0.5
                else None,
            )
        )
    return Robot(
        name=f"mixed{seed}",
        links=tuple(links),
        base=random_transform(random),
        tool=random_transform(random),
        gravity=tuple(random.uniform(-10, 10, 3)),
    )


def build_unusual_robot(seed: int) -> Robot:
    """Return a random tree with values that are legal but rare.

    Links of zero length or without mass, quarter turns, reversed axes, offsets, negative gear ratios and
    pitches, rows of both D-H conventions, joints with quaternions in the middle, and gravity along any axis.
    """
    random = np.random.default_rng(seed)
    count = int(random.integers(3, 6))
    links: list[Link] = []
    for k in range(count):
        massless = k < count - 1 and random.random() < 0.2
        ratio = float(random.choice([-50.0, -1.0, 1.0]))
        common: dict[str, Any] = {
            "parent": None if k == 0 else f"link{random.integers(max(1, k - 1), k + 1)}",
            "mass": 0.0 if massless else random.uniform(0.2, 3),
            "centre_of_mass": random.choice([0.0, 0.2]) * random.normal(size=3),
            "inertia": np.zeros((3, 3)) if massless else random_inertia(random),
            "motor": Motor(inertia=1e-3, gear_ratio=ratio, coulomb_friction=(0.1, -0.2))
            if random.random() < 0.5
            else None,
        }
        if random.random() < 0.4:
            make = modified_dh if random.random() < 0.6 else standard_dh
            numbers: dict[str, Any] = {
                "alpha": float(random.choice([0.0, pi / 2, -pi / 2, pi, 0.3])),
                "a": float(random.choice([0.0, 0.4, -0.2])),
                "d": float(random.choice([0.0, 0.3])),
                "theta": float(random.choice([0.0, pi / 2])),
                "offset": float(random.choice([0.0, pi / 2, -pi, 0.7])),
                "sigma": int(random.integers(2)),
            }
            links.append(make(f"link{k + 1}", **numbers, **common))
            continue
        kind = MOVING_TYPES[random.integers(len(MOVING_TYPES))]
        axis = tuple(float(random.choice([-1.0, 1.0])) * np.eye(3)[random.integers(3)])
        values: dict[str, Any] = {"axis": axis, "offset": float(random.choice([0.0, pi / 2])), "pitch": -0.05}
        joint = kind(
            **{
                name: value
                for name, value in values.items()
                if name in kind.parameters and kind is not Universal
            }
        )
        quarters = [
            Transform(
                rotation=rotation_about(tuple(np.eye(3)[random.integers(3)]), random.integers(-2, 3) * pi / 2)
            )
            for _ in range(2)
        ]
        links.append(Link(name=f"link{k + 1}", joint=joint, before=quarters[0], after=quarters[1], **common))
    return Robot(
        name=f"unusual{seed}",
        links=tuple(links),
        base=random_transform(random),
        gravity=(0.0, 9.81, 0.0) if seed % 2 else (-7.0, 3.0, 2.0),
    )


RANDOM_ROBOTS: tuple[Robot, ...] = (
    build_random_tree(1),
    build_random_tree(2),
    build_random_tree(3, chain=True),
    build_random_tree(4, 9),
)

MIXED_ROBOTS: tuple[Robot, ...] = (
    build_mixed_tree(5, MOVING_TYPES),
    build_mixed_tree(6, (Spherical, Fixed, Revolute, Universal, Free, Spherical)),
)
"""Trees of all joint types. The first one has too many joints for a factorisation of its inertia matrix.
"""

LAW_NAMES = ("kr180", "kr180_cell", "panda", "planar3r", "puma560", "stanford", "twolink")
"""Shipped robots of different kinds. ``tests/shipped/test_catalogue.py`` checks a few laws for all robots.
"""

LAW_ROBOTS: dict[str, Robot] = {
    robot.name: robot
    for robot in (*(shipped_robot(name) for name in LAW_NAMES), *RANDOM_ROBOTS, *MIXED_ROBOTS)
}
"""Robots for tests of physical laws: shipped robots, and random trees."""


def law_robots_of(types: Sequence[type[Joint]]) -> list[Robot]:
    """Return the robots for laws that have joints of some types only, for formats without the other types."""
    return [
        robot
        for robot in LAW_ROBOTS.values()
        if all(isinstance(link.joint, tuple(types)) for link in robot.links)
    ]


CONSISTENT_ROBOTS: dict[str, Robot] = {robot.name: robot for robot in RANDOM_ROBOTS}
"""Random trees: all their inertias are physically consistent, unlike those of some shipped robots."""


@cache
def _function(robot: Robot, name: str) -> tuple[Function, tuple[int, ...]]:
    traced = TRACES[name](robot)
    return traced.casadi_function(), traced.outputs.slots[0].shape


def evaluate(robot: Robot, name: str, *values: ArrayLike) -> np.ndarray:
    """Evaluate one function of TRACES with CasADi's interpreter; each is traced once per robot."""
    function, shape = _function(robot, name)
    return np.asarray(function(*(np.asarray(value, dtype=float).ravel() for value in values))).reshape(shape)


def random_states(robot: Robot, count: int = 4, seed: int = 7) -> list[tuple[np.ndarray, ...]]:
    """Return ``count`` triples: joint positions (nq,), speeds (n,), and accelerations or torques (n,).

    Quaternions have random lengths: all functions depend on their directions only.
    """
    random = np.random.default_rng(seed)
    scales = ((np.pi, robot.nq), (2.0, robot.n), (5.0, robot.n))
    return [tuple(random.uniform(-s, s, size) for s, size in scales) for _ in range(count)]


def along(robot: Robot, q: np.ndarray, qd: np.ndarray, dt: float) -> np.ndarray:
    """Return the coordinates after a time at constant speeds."""
    return evaluate(robot, "integrate", q, qd, dt).ravel()
