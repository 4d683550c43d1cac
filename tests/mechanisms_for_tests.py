"""Mechanisms for tests: loops of published problems, and random loops."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.dynamics import trace_link_poses
from armblocks.robot import Joint, Link, Prismatic, Revolute, Robot
from armblocks.robot.constraints import (
    CONSTRAINT_TYPES,
    Attachment,
    Closure,
    PrismaticClosure,
    RevoluteClosure,
    Rod,
    UniversalClosure,
)
from armblocks.spatial import Transform, rotation_about, transl

Array = NDArray[np.float64]
CLOSURES = tuple(kind for kind in CONSTRAINT_TYPES if issubclass(kind, Closure))


def rod(name: str, parent: str | None, at: ArrayLike, angle: float, length: float, mass: float) -> Link:
    """A uniform slender rod along x of its frame, on a hinge about z at ``at`` in the parent's frame."""
    moment = mass * length**2 / 12
    return Link(
        name=name,
        parent=parent,
        before=Transform(rotation=rotation_about((0, 0, 1), angle), translation=np.asarray(at, float)),
        mass=mass,
        centre_of_mass=(length / 2, 0, 0),
        inertia=(0.02 * moment, moment, moment),
    )


def four_bar() -> Robot:
    """Ground 0.8 m, crank 0.3 m, coupler 0.9 m, rocker 0.7 m; the crank starts at 0.6 rad."""
    crank, coupler, rocker = 0.6, 0.593395771217367, 1.2903597468005
    links = (
        rod("crank", None, (0, 0, 0), crank, 0.3, 1.0),
        rod("coupler", "crank", (0.3, 0, 0), coupler - crank, 0.9, 2.0),
        rod("rocker", None, (0.8, 0, 0), rocker, 0.7, 1.5),
    )
    loop = RevoluteClosure(
        name="pin",
        first=Attachment(link="coupler", pose=transl(0.9, 0, 0)),
        second=Attachment(link="rocker", pose=transl(0.7, 0, 0)),
    )
    return Robot(name="four-bar", links=links, gravity=(0, -9.81, 0), constraints=(loop,))


def slider_crank() -> Robot:
    """Crank 0.2 m, connecting rod 0.5 m, slider along x; the crank starts at 0.5 rad."""
    crank, rod_angle = 0.5, float(-np.arcsin(0.2 * np.sin(0.5) / 0.5))
    x = 0.2 * np.cos(crank) + 0.5 * np.cos(rod_angle)
    links = (
        rod("crank", None, (0, 0, 0), crank, 0.2, 1.0),
        rod("conrod", "crank", (0.2, 0, 0), rod_angle - crank, 0.5, 2.0),
        Link(name="slider", joint=Prismatic(axis=(1, 0, 0)), before=transl(x, 0, 0), mass=3.0),
    )
    loop = RevoluteClosure(
        name="pin",
        first=Attachment(link="conrod", pose=transl(0.5, 0, 0)),
        second=Attachment(link="slider"),
    )
    return Robot(name="slider-crank", links=links, gravity=(0, -9.81, 0), constraints=(loop,))


def bricard() -> Robot:
    """Bricard's mechanism: six hinges in a loop of rods of 0.8 m. It moves, although it has six equations."""
    L, m = 0.8, 2.0
    thin, thick = m * 0.08**2 / 6, m * (L**2 + 0.08**2) / 12
    steps = (
        ((0, 0, 0), (0, 1, 0), (L / 2, 0, 0), (thin, thick, thick)),
        ((L, 0, 0), (0, 0, 1), (0, -L / 2, 0), (thick, thin, thick)),
        ((0, -L, 0), (1, 0, 0), (0, 0, L / 2), (thick, thick, thin)),
        ((0, 0, L), (0, 1, 0), (-L / 2, 0, 0), (thin, thick, thick)),
        ((-L, 0, 0), (0, 0, 1), (0, L / 2, 0), (thick, thin, thick)),
    )
    links = tuple(
        Link(
            name=f"rod{k + 1}",
            parent=f"rod{k}" if k else None,
            joint=Revolute(axis=axis),
            before=transl(*at),
            mass=m,
            centre_of_mass=centre,
            inertia=inertia,
        )
        for k, (at, axis, centre, inertia) in enumerate(steps)
    )
    hinge = Transform(rotation=((0, 0, 1), (1, 0, 0), (0, 1, 0)))  # z along x of the base
    loop = RevoluteClosure(
        name="last hinge",
        first=Attachment(pose=transl(0, 0, L) @ hinge),
        second=Attachment(link="rod5", pose=transl(0, L, 0) @ hinge),
    )
    return Robot(name="bricard", links=links, gravity=(0, -9.81, 0), constraints=(loop,))


def parallelograms(count: int) -> Robot:
    """``count`` squares of rods of 1 m and 1 kg in a row, upright. When flat, all rods are in line."""
    links = [rod(f"post{k}", None, (k, 0, 0), np.pi / 2, 1.0, 1.0) for k in range(count + 1)]
    loops: list[Closure] = []
    for k in range(count):
        links.append(rod(f"bar{k}", f"post{k}", (1, 0, 0), -np.pi / 2, 1.0, 1.0))
        loops.append(
            RevoluteClosure(
                name=f"pin{k}",
                first=Attachment(link=f"bar{k}", pose=transl(1, 0, 0)),
                second=Attachment(link=f"post{k + 1}", pose=transl(1, 0, 0)),
            )
        )
    return Robot(name="parallelograms", links=tuple(links), gravity=(0, -9.81, 0), constraints=tuple(loops))


def random_transform(random: np.random.Generator, size: float = 0.4) -> Transform:
    """A random rotation, and a translation of up to ``size`` m along each axis."""
    axis = random.normal(size=3)
    return Transform(
        rotation=rotation_about(tuple(axis / np.linalg.norm(axis)), random.uniform(-3, 3)),
        translation=random.uniform(-size, size, 3),
    )


def random_mechanism(seed: int) -> tuple[Robot, Array]:
    """A random tree of hinges and sliders with one to three closures, and coordinates that satisfy them.

    The first closure has the type with the number ``seed`` of ``CLOSURES``.
    """
    random = np.random.default_rng(seed)
    count = int(random.integers(5, 10))
    links: list[Link] = []
    for k in range(count):
        kind: type[Joint] = Prismatic if random.random() < 0.3 else Revolute
        A = random.normal(size=(3, 3))
        links.append(
            Link(
                name=f"link{k}",
                parent=f"link{random.integers(max(0, k - 2), k)}" if k and random.random() < 0.8 else None,
                joint=kind(axis=tuple(random.normal(size=3))),
                before=random_transform(random),
                after=random_transform(random),
                mass=random.uniform(0.5, 3),
                centre_of_mass=random.normal(size=3) * 0.1,
                inertia=0.05 * A @ A.T + 0.02 * np.eye(3),
            )
        )
    tree = Robot(name="tree", links=tuple(links), base=random_transform(random), gravity=(1, -2, -9))
    q = random.uniform(-1, 1, tree.n)
    (poses,) = trace_link_poses(tree)(q)
    loops: list[Closure] = []
    for k in range(int(random.integers(1, 4))):
        first, second = random.choice(count, 2, replace=False)
        on_base = random.random() < 0.2
        kind = CLOSURES[seed % len(CLOSURES) if k == 0 else random.integers(len(CLOSURES))]
        frame = random_transform(random)
        other, more = frame, {}
        if kind is Rod:
            other = random_transform(random)
            more = {"length": float(np.linalg.norm(np.subtract(frame.translation, other.translation)))}
        elif kind is UniversalClosure:
            other = frame @ Transform(rotation=rotation_about((0, 0, 1), random.uniform(-3, 3)))
        elif kind is PrismaticClosure:
            other = frame @ transl(0, 0, 0.2)
        ends = [
            Attachment(link=link, pose=np.linalg.inv(poses[index]) @ pose.matrix)
            for link, index, pose in (
                (None if on_base else f"link{first}", 0 if on_base else first + 1, frame),
                (f"link{second}", second + 1, other),
            )
        ]
        loops.append(kind(name=f"loop{k}", first=ends[0], second=ends[1], **more))
    robot = Robot(
        name="mechanism", links=tree.links, base=tree.base, gravity=tree.gravity, constraints=tuple(loops)
    )
    return robot, q
