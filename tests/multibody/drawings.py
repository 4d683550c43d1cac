"""Mechanisms drawn as blocks for tests: random robots, a four-bar, a pendulum."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armblocks.blocks import (
    BodyInertia,
    BrickSolid,
    Constant,
    CylindricalJoint,
    MechanismConfiguration,
    PlanarJoint,
    PrismaticJoint,
    RevoluteJoint,
    RigidTransform,
    SixDofJoint,
    SphericalJoint,
    UniversalJoint,
    WorldFrame,
)
from armblocks.diagram import Block, Diagram, DiagramBuilder, PortRef, trace_diagram
from armblocks.dynamics.mechanism import mechanism
from armblocks.equations import HybridSystem
from armblocks.robot import Attachment, Link, RevoluteClosure, Robot
from armblocks.robot.joints import (
    AxisMotion,
    Cylindrical,
    Free,
    Joint,
    Planar,
    Prismatic,
    Revolute,
    Spherical,
    Universal,
)
from armblocks.spatial import Transform

Array = NDArray[np.float64]
GRAVITY = (1.0, 2.0, -9.0)
TYPES: dict[str, tuple[Callable[[], Joint], type[Block]]] = {
    "R": (Revolute, RevoluteJoint),
    "P": (Prismatic, PrismaticJoint),
    "C": (Cylindrical, CylindricalJoint),
    "S": (Spherical, SphericalJoint),
    "U": (lambda: Universal(axis=(1, 0, 0), second_axis=(0, 1, 0)), UniversalJoint),
    "E": (Planar, PlanarJoint),
    "F": (Free, SixDofJoint),
}
"""Joint types of the robot model, and the blocks that are the same joints."""


def started(
    diagram: Diagram, tuned: Mapping[str, Array] | None = None
) -> tuple[dict[str, Array], dict[str, Array]]:
    """The states of a diagram at the start, and their rates, by path; ``tuned``: other parameters."""
    system = trace_diagram(diagram)
    p = system.parameter_values.copy()
    for name, value in (tuned or {}).items():
        p[system.parameters.ranges[name]] = np.ravel(value)
    return _by_path(system, *_rates(system, p))


def _rates(system: HybridSystem, p: Array) -> tuple[Array, Array]:
    (x,), (z,) = system.initial_states(p), system.initial_discrete(p)
    (rates,) = system.derivative(0.0, x, z, (), p)
    return x, rates


def _by_path(system: HybridSystem, *columns: Array) -> tuple[dict[str, Array], dict[str, Array]]:
    states, rates = (
        {slot: column[part] for slot, part in system.states.ranges.items()} for column in columns
    )
    return states, rates


def random_pose(random: np.random.Generator) -> Transform:
    Q = np.linalg.qr(random.normal(size=(3, 3)))[0]
    return Transform(rotation=Q * np.sign(np.linalg.det(Q)), translation=0.3 * random.normal(size=3))


def random_link(random: np.random.Generator, name: str, parent: str | None, joint: Joint) -> Link:
    points = 0.2 * random.normal(size=(6, 3))
    inertia = sum(p @ p * np.eye(3) - np.outer(p, p) for p in points - points.mean(axis=0))
    return Link(
        name=name,
        parent=parent,
        joint=joint,
        before=random_pose(random),
        after=random_pose(random),
        mass=random.uniform(0.5, 2.0),
        centre_of_mass=0.1 * random.normal(size=3),
        inertia=inertia,
    )


def rigid(pose: Transform) -> RigidTransform:
    return RigidTransform(translation=pose.translation, rotation="matrix", matrix=pose.rotation)


def rotation(quaternion: Array) -> Array:
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * K + 2 * K @ K


def exchanged(joint: Joint, q: Array, *speeds: Array) -> tuple[Array, ...]:
    """Coordinates and speeds of a joint whose base and follower are exchanged."""
    if isinstance(joint, Spherical):
        R = rotation(q)
        return np.array([q[0], *-q[1:]]), *(-R @ speed for speed in speeds)
    return -q, *(-speed for speed in speeds)


class Drawing:
    """A robot drawn as blocks in random order, with joints in random orientation."""

    def __init__(self, robot: Robot, random: np.random.Generator) -> None:
        self.robot, self.random = robot, random
        self.blocks: dict[str, Block] = {
            "world": WorldFrame(),
            "settings": MechanismConfiguration(gravity=robot.gravity, animation=False),
        }
        self.lines = [("settings/C", "world/W")]
        self.wires: list[tuple[str, str]] = []
        self.flipped: dict[str, bool] = {}

    def add(
        self, link: Link, kind: Callable[..., Block], q: Array, qd: Array, tau: Array, **more: Any
    ) -> None:
        """Draw a link with its joint at a state, driven by a constant torque."""
        name, at = link.name, "world/W" if link.parent is None else f"{link.parent} after/F"
        may_flip = isinstance(link.joint, Revolute | Prismatic | Cylindrical | Spherical)
        self.flipped[name] = flip = may_flip and bool(self.random.integers(2))
        near, far = ("F", "B") if flip else ("B", "F")
        if flip:
            q, qd, tau = exchanged(link.joint, q, qd, tau)
        values = [entry if len(entry) > 1 else float(entry[0]) for entry in (q, qd, tau)]
        (xx, xy, zx), (_, yy, yz), (_, _, zz) = link.inertia
        self.blocks |= {
            f"{name} before": rigid(link.before),
            name: kind(position_target=values[0], velocity_target=values[1], actuation="torque", **more),
            f"{name} after": rigid(link.after),
            f"{name} tau": Constant(value=values[2]),
            f"{name} body": BodyInertia(
                mass=link.mass,
                centre_of_mass=link.centre_of_mass,
                moments=(xx, yy, zz),
                products=(yz, zx, xy),
            ),
        }
        self.lines += [
            (at, f"{name} before/B"),
            (f"{name} before/F", f"{name}/{near}"),
            (f"{name}/{far}", f"{name} after/B"),
            (f"{name} after/F", f"{name} body/R"),
        ]
        self.wires.append((f"{name} tau/y", f"{name}/tau"))

    def diagram(self) -> Diagram:
        builder = DiagramBuilder("drawn")
        names = list(self.blocks)
        for k in self.random.permutation(len(names)):
            builder.add(names[k], self.blocks[names[k]])
        for k in self.random.permutation(len(self.lines)):
            ends = [PortRef(*end.split("/")) for end in self.lines[k]]
            builder.connect(*(ends if self.random.integers(2) else ends[::-1]))
        for source, target in self.wires:
            builder.connect(PortRef(*source.split("/")), PortRef(*target.split("/")))
        return builder.build()

    def accelerations(self, rates: dict[str, Array], q: dict[str, Array]) -> Array:
        """The accelerations in the order and with the signs of the robot."""
        parts: list[Array] = []
        for link in self.robot.links:
            qdd = rates[f"{link.name}/qd"]
            if self.flipped[link.name]:
                R = -rotation(q[link.name]).T if isinstance(link.joint, Spherical) else -np.eye(len(qdd))
                qdd = R @ qdd
            parts.append(qdd)
        return np.concatenate(parts)


def random_state(random: np.random.Generator, joint: Joint) -> tuple[Array, Array, Array]:
    q: list[float] = []
    for motion in joint.motions:
        values = random.normal(size=len(motion.positions))
        q += list(values if isinstance(motion, AxisMotion) else values / np.linalg.norm(values))
    return np.array(q), random.normal(size=joint.nv), random.normal(size=joint.nv)


def four_bar(random: np.random.Generator) -> tuple[Robot, Array]:
    """Three links in series, whose last one closes a loop with the base, and its assembled coordinates."""
    lengths = (0.3, 0.9, 0.7)
    links = [
        Link(
            name=f"bar{k}",
            parent=None if k == 0 else f"bar{k - 1}",
            before=Transform(translation=(0.0 if k == 0 else lengths[k - 1], 0.0, 0.0)),
            mass=random.uniform(0.5, 1.5),
            centre_of_mass=(0.5 * lengths[k], 0.1, 0.02),
            inertia=(0.01, 0.02, 0.03),
        )
        for k in range(3)
    ]
    closure = RevoluteClosure(
        name="pin",
        first=Attachment(pose=Transform(translation=(1.0, 0.0, 0.0))),
        second=Attachment(link="bar2", pose=Transform(translation=(lengths[2], 0.0, 0.0))),
    )
    robot = Robot(name="four-bar", links=links, gravity=(0.0, -9.81, 0.0), constraints=(closure,))
    return robot, mechanism(robot).assembled(np.array([1.0, -0.5, -1.5]))


def pendulum(**hinge: Any) -> DiagramBuilder:
    """A brick of 2 kg, 0.5 m below a hinge about z, in gravity along -y."""
    builder = DiagramBuilder("pendulum")
    world = builder.add("world", WorldFrame())
    builder.add("gravity", MechanismConfiguration(gravity=(0.0, -9.81, 0.0)), C=world)
    joint = builder.add("hinge", RevoluteJoint(**hinge), B=world)
    rod = builder.add("rod", RigidTransform(translation=(0.0, -0.5, 0.0)), B=joint["F"])
    brick = BrickSolid(dimensions=(0.3, 0.4, 0.1), mass_from="mass", mass=2.0)
    builder.add("brick", brick, R=rod["F"])
    return builder


INERTIA = 2.0 * ((0.3**2 + 0.4**2) / 12 + 0.25)
"""Moment of inertia of the pendulum about its hinge, kg m2."""
