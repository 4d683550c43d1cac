"""Mechanisms of textbooks against closed forms, and laws of random mechanisms with joints of all types."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from armblocks.dynamics import (
    trace_constrained_motion,
    trace_fkine,
    trace_hybrid_dynamics,
    trace_joint_wrenches,
    trace_link_poses,
    trace_rne,
)
from armblocks.dynamics.mechanism import Mechanism
from armblocks.robot import (
    Attachment,
    Free,
    Joint,
    Link,
    NamedFrame,
    Planar,
    PointOnPlane,
    PrescribedMotion,
    Prismatic,
    PrismaticClosure,
    Revolute,
    RevoluteClosure,
    Robot,
    Rod,
    Spherical,
    SphericalClosure,
    Universal,
)
from armblocks.robot.constraints import Closure, CylindricalClosure, PlanarClosure, UniversalClosure
from armblocks.robot.joints import Cylindrical
from armblocks.spatial import Transform, rotation_about, transl
from maximal_coordinates import accelerations
from mechanisms_for_tests import bricard, random_transform, rod, slider_crank

Array = np.ndarray
Z_TO_X = Transform(rotation=((0, 0, 1), (1, 0, 0), (0, 1, 0)))
"""A frame whose z axis is x."""


def pin(name: str, first: tuple[str, float], second: tuple[str, float]) -> RevoluteClosure:
    """A hinge about z between points on the x axes of two links."""
    ends = [Attachment(link=link, pose=transl(x, 0, 0)) for link, x in (first, second)]
    return RevoluteClosure(name=name, first=ends[0], second=ends[1])


def bar(name: str, carrier: tuple[str, float, float] | None, a: Array, b: Array) -> tuple[Link, float]:
    """A bar from a to b (2,) and its angle; ``carrier``: parent, its angle, the distance of a along it."""
    angle, length = float(np.arctan2(*(b - a)[::-1])), float(np.linalg.norm(b - a))
    if carrier is None:
        return rod(name, None, (*a, 0), angle, length, 1.0), angle
    parent, parent_angle, x = carrier
    return rod(name, parent, (x, 0, 0), angle - parent_angle, length, 1.0), angle


def peaucellier() -> Robot:
    """Peaucellier's inversor: a rhombus on two arms of 1 m, driven on a circle through the pivot."""
    r, arm, side, angle = 0.3, 1.0, 0.45, 0.5
    pivot, centre = np.zeros(2), np.array([r, 0.0])
    p = centre + r * np.array([np.cos(angle), np.sin(angle)])
    u = p / np.linalg.norm(p)
    along = (p @ p + arm**2 - side**2) / (2 * np.linalg.norm(p))
    across = np.sqrt(arm**2 - along**2) * np.array([-u[1], u[0]])
    a, b, q = along * u + across, along * u - across, 2 * along * u - p
    crank, of_crank = bar("crank", None, centre, p)
    first, of_first = bar("first", None, pivot, a)
    second, of_second = bar("second", None, pivot, b)
    links = [crank, first, second]
    links += [bar(name, ("crank", of_crank, r), p, end)[0] for name, end in (("pa", a), ("pb", b))]
    links += [bar("aq", ("first", of_first, arm), a, q)[0], bar("bq", ("second", of_second, arm), b, q)[0]]
    pins = (pin("A", ("pa", side), ("first", arm)), pin("B", ("pb", side), ("second", arm)))
    return Robot(
        name="peaucellier",
        links=tuple(links),
        gravity=(0, -9.81, 0),
        constraints=(*pins, pin("Q", ("aq", side), ("bq", side))),
        frames=(NamedFrame(name="Q", link="aq", pose=transl(side, 0, 0)),),
    )


def sarrus(angle: float = 0.6) -> Robot:
    """Sarrus' linkage: two pairs of hinged plates at right angles, with a redundant equation."""

    def plate(name: str, parent: str | None, before: Transform, axis: tuple[int, int, int]) -> Link:
        return Link(
            name=name,
            parent=parent,
            joint=Revolute(axis=axis),
            before=before,
            mass=1.0,
            centre_of_mass=(0, 0, 0.25),
            inertia=np.diag((0.02, 0.03, 0.01)),
        )

    def turned(axis: tuple[int, int, int], by: float) -> Transform:
        return Transform(rotation=rotation_about(axis, by))

    x, y, up = (1, 0, 0), (0, 1, 0), transl(0, 0, 0.5)
    platform = Link(
        name="platform",
        parent="up1",
        joint=Revolute(axis=y),
        before=up @ turned(y, angle),
        after=transl(-1, 0, 0),
        mass=3.0,
        inertia=np.diag((0.2, 0.2, 0.3)),
    )
    links = (
        plate("low1", None, transl(1, 0, 0) @ turned(y, angle), y),
        plate("up1", "low1", up @ turned(y, -2 * angle), y),
        platform,
        plate("low2", None, transl(0, 1, 0) @ turned(x, -angle), x),
        plate("up2", "low2", up @ turned(x, 2 * angle), x),
    )
    ends = (
        Attachment(link="up2", pose=up @ Z_TO_X),
        Attachment(link="platform", pose=transl(0, 1, 0) @ Z_TO_X),
    )
    hinge = RevoluteClosure(name="hinge", first=ends[0], second=ends[1])
    return Robot(name="sarrus", links=links, constraints=(hinge,))


BENNETT = (0.5, 0.6, 0.75, float(np.arcsin(0.75 / 0.5 * np.sin(0.6))))
"""Lengths and twists a, alpha, b, beta of Bennett's mechanism: a / sin(alpha) = b / sin(beta)."""


def bennett(first: float = 1.0) -> tuple[Robot, float]:
    """Bennett's four hinges, and the constant product of the tangents of two half angles."""
    a, alpha, b, beta = BENNETT
    product = np.sin((beta + alpha) / 2) / np.sin((beta - alpha) / 2)
    second = 2 * np.arctan(product / np.tan(first / 2))
    along = [
        Transform(rotation=rotation_about((1, 0, 0), t), translation=(d, 0, 0))
        for d, t in ((a, alpha), (b, beta))
    ]
    steps = ((None, Transform(), first), ("l1", along[0], second), ("l2", along[1], -first))
    links = tuple(
        Link(
            name=f"l{k}",
            parent=parent,
            joint=Revolute(offset=offset),
            before=before,
            mass=1.0,
            centre_of_mass=(0.2, 0, 0),
            inertia=np.diag((0.01, 0.02, 0.02)),
        )
        for k, (parent, before, offset) in enumerate(steps, start=1)
    )
    last = RevoluteClosure(
        name="last", first=Attachment(pose=along[1].inverse()), second=Attachment(link="l3", pose=along[0])
    )
    return Robot(name="bennett", links=links, constraints=(last,)), float(product)


def schmidt() -> Robot:
    """Schmidt's coupling: three discs, each pair joined by three parallel bars, between parallel shafts."""
    out, length = np.array([0.5, 0.1]), 0.35
    half = out / 2
    middle = half + np.sqrt(length**2 - half @ half) * np.array([-out[1], out[0]]) / np.linalg.norm(out)
    pins = [0.2 * np.array([np.cos(t), np.sin(t)]) for t in 2 * np.pi * np.arange(3) / 3]
    disc = {"mass": 2.0, "inertia": np.diag((0.02, 0.02, 0.04))}
    links = [Link(name="in", **disc), Link(name="out", before=transl(*out, 0), **disc)]
    joints: list[Closure] = []
    angle = float(np.arctan2(middle[1], middle[0]))
    for k, p in enumerate(pins):
        links.append(rod(f"a{k}", "in", (*p, 0), angle, length, 0.5))
        if k == 0:
            before = Transform(rotation=rotation_about((0, 0, 1), -angle), translation=(length, 0, 0))
            links.append(Link(name="middle", parent="a0", before=before, after=transl(*-p, 0), **disc))
        else:
            joints.append(_pin_to(f"pin a{k}", f"a{k}", length, "middle", p))
    step = out - middle
    for k, p in enumerate(pins):
        links.append(rod(f"b{k}", "middle", (*p, 0), float(np.arctan2(step[1], step[0])), length, 0.5))
        joints.append(_pin_to(f"pin b{k}", f"b{k}", length, "out", p))
    return Robot(name="schmidt", links=tuple(links), gravity=(0, -9.81, 0), constraints=tuple(joints))


def _pin_to(name: str, bar_: str, x: float, disc: str, p: Array) -> RevoluteClosure:
    ends = Attachment(link=bar_, pose=transl(x, 0, 0)), Attachment(link=disc, pose=transl(*p, 0))
    return RevoluteClosure(name=name, first=ends[0], second=ends[1])


def scotch_yoke() -> Robot:
    """A crank pin of 0.2 m slides in the slot of a yoke: x = 0.2 cos(angle) - 0.2."""
    crank = rod("crank", None, (0, 0, 0), 0.0, 0.2, 1.0)
    block = Link(
        name="block", parent="crank", before=transl(0.2, 0, 0), mass=0.3, inertia=np.diag((0.01,) * 3)
    )
    yoke = Link(name="yoke", joint=Prismatic(axis=(1, 0, 0)), before=transl(0.2, 0, 0), mass=2.0)
    slot = Transform(rotation=((1, 0, 0), (0, 0, 1), (0, -1, 0)))  # z along y
    guide = PrismaticClosure(
        name="slot", first=Attachment(link="yoke", pose=slot), second=Attachment(link="block", pose=slot)
    )
    return Robot(name="scotch yoke", links=(crank, block, yoke), gravity=(0, -9.81, 0), constraints=(guide,))


def driven_configurations(robot: Robot, step: float = 0.12, count: int = 4) -> list[Array]:
    """Assembled configurations while the first joint moves in steps."""
    functions, q = Mechanism(robot), robot.neutral
    assert np.abs(functions.residuals(q)).max() < 1e-12
    found: list[Array] = []
    for _ in range(count):
        guess = q.copy()
        guess[0] += step
        q = functions.assembled(guess, robot.joint_names[:1])
        found.append(q)
    return found


def test_straight_lines_rotations_and_products_of_textbooks() -> None:
    straight = peaucellier()
    for q in driven_configurations(straight, -0.12):
        assert trace_fkine(straight, "Q")(q)[0][0, 3] == pytest.approx((1.0 - 0.45**2) / 0.6, abs=1e-11)
    lift = sarrus()
    for k, q in enumerate(driven_configurations(lift), start=1):
        (T,) = trace_fkine(lift, "platform")(q)
        assert pytest.approx(transl(0, 0, np.cos(0.6 + 0.12 * k)).matrix, abs=1e-11) == T
    skew, product = bennett()
    second = 2 * np.arctan(product / np.tan(0.5))
    for q in driven_configurations(skew):
        assert np.tan((q[0] + 1.0) / 2) * np.tan((q[1] + second) / 2) == pytest.approx(product, abs=1e-9)
        assert q[2] == pytest.approx(-q[0], abs=1e-10)
    coupling = schmidt()
    out = coupling.joint_names.index("out")
    for q in driven_configurations(coupling):
        assert q[out] == pytest.approx(q[0], abs=1e-10)
    yoke = scotch_yoke()
    for q in driven_configurations(yoke):
        assert q[2] == pytest.approx(0.2 * np.cos(q[0]) - 0.2, abs=1e-11)


@pytest.mark.parametrize(
    ("robot", "redundant"),
    [(peaucellier(), 9), (sarrus(), 1), (bennett()[0], 3), (schmidt(), 17), (scotch_yoke(), 3)],
    ids=lambda value: getattr(value, "name", ""),
)
def test_overconstrained_mechanisms_have_one_degree_of_freedom_and_the_right_accelerations(
    robot: Robot, redundant: int
) -> None:
    """Against maximal coordinates, with the torque of the first joint from inverse dynamics."""
    functions, q = Mechanism(robot), robot.neutral
    mobility = functions.mobility(q)
    assert (mobility.degrees_of_freedom, mobility.instantaneous, len(mobility.redundant)) == (1, 1, redundant)
    first = np.eye(robot.n)[0]
    qd = functions.consistent_speeds(q, 1.3 * first, robot.joint_names[:1])
    driven = replace(
        robot, constraints=(*robot.constraints, PrescribedMotion(name="drive", joint=robot.joint_names[0]))
    )
    qdd, tau = trace_hybrid_dynamics(driven, near=q)(q, qd, np.zeros(robot.n), 0.7 * first)
    assert tau[1:].tolist() == [0.0] * (robot.n - 1)
    expected = accelerations(robot, q, qd, tau)
    assert qdd == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
    assert trace_rne(driven, near=q)(q, qd, qdd)[0] == pytest.approx(tau, abs=1e-9)


def scaled(robot: Robot, size: float) -> Robot:
    """The robot with all lengths times ``size`` and the same masses."""

    def pose(T: Transform) -> Transform:
        return Transform(rotation=T.rotation, translation=size * np.array(T.translation))

    links = tuple(
        replace(
            link,
            before=pose(link.before),
            after=pose(link.after),
            centre_of_mass=size * np.array(link.centre_of_mass),
            inertia=size**2 * np.array(link.inertia),
        )
        for link in robot.links
    )
    loops = [
        replace(
            loop,
            first=replace(loop.first, pose=pose(loop.first.pose)),
            second=replace(loop.second, pose=pose(loop.second.pose)),
        )
        for loop in robot.closures
    ]
    return replace(robot, links=links, constraints=tuple(loops))


@pytest.mark.parametrize(("build", "size"), [(slider_crank, 1e-6), (sarrus, 1e4), (bricard, 1e-5)])
def test_mechanisms_of_any_size_have_similar_motions(build: Callable[[], Robot], size: float) -> None:
    """From 1 µm to 10 km: accelerations under gravity scale with the inverse size, torques with the size."""
    results: list[Array] = []
    for robot, unit in ((build(), 1.0), (scaled(build(), size), size)):
        functions = Mechanism(robot)
        q = functions.assembled(robot.neutral)
        lengths = np.array([1.0 if entry.unit == "rad" else unit for entry in robot.speeds])
        speeds = functions.consistent_speeds(q, np.eye(robot.n)[0], robot.joint_names[:1])
        still = np.zeros(robot.n)
        qdd = trace_constrained_motion(robot, near=q)(q, still, still)[2]
        drive = PrescribedMotion(name="drive", joint=robot.joint_names[0])
        driven = replace(robot, constraints=(*robot.constraints, drive))
        _, tau = trace_hybrid_dynamics(driven, near=q)(q, still, still, still)
        results.append(np.concatenate([q / lengths, speeds / lengths, qdd * unit / lengths, tau[:1] / unit]))
        assert functions.mobility(q).degrees_of_freedom == 1
    assert results[1] == pytest.approx(results[0], abs=1e-9)


JOINT_CLOSURES: dict[type[Joint], type[Closure]] = {
    Revolute: RevoluteClosure,
    Prismatic: PrismaticClosure,
    Spherical: SphericalClosure,
    Universal: UniversalClosure,
    Cylindrical: CylindricalClosure,
    Planar: PlanarClosure,
}


def mixed_mechanism(seed: int) -> tuple[Robot, Array]:
    """A random tree with joints of all types, one or two closures, and coordinates that satisfy them."""
    random = np.random.default_rng(seed)
    count = int(random.integers(3, 5))
    links: list[Link] = []
    for k in range(count):
        kind = list(JOINT_CLOSURES)[random.integers(len(JOINT_CLOSURES))]
        axis = random.normal(size=3)
        joint = kind()
        if kind is Universal:
            joint = Universal(axis=axis, second_axis=np.cross(axis, random.normal(size=3)))
        elif kind not in (Spherical, Planar):
            joint = kind(axis=axis)
        A = random.normal(size=(3, 3))
        links.append(
            Link(
                name=f"l{k}",
                parent=f"l{random.integers(0, k)}" if k and random.random() < 0.8 else None,
                joint=joint,
                before=random_transform(random),
                after=random_transform(random),
                mass=random.uniform(0.5, 3),
                centre_of_mass=0.1 * random.normal(size=3),
                inertia=0.05 * A @ A.T + 0.02 * np.eye(3),
            )
        )
    tree = Robot(name="mixed", links=tuple(links), base=random_transform(random), gravity=(1, -2, -9))
    q = Mechanism(tree).moved(tree.neutral, 0.5 * random.normal(size=tree.nv))
    (poses,) = trace_link_poses(tree)(q)
    loops: list[Closure] = []
    for k, kind in enumerate((SphericalClosure, Rod, PointOnPlane)[seed % 3 : seed % 3 + 2]):
        frames = [random_transform(random) for _ in range(2)]
        frames[1] = frames[1] if kind is Rod else frames[0]
        distance = float(np.linalg.norm(np.subtract(*(frame.translation for frame in frames))))
        rows = (k, count - k)
        ends = [
            Attachment(link=f"l{row - 1}" if row else None, pose=np.linalg.inv(poses[row]) @ frame.matrix)
            for row, frame in zip(rows, frames)
        ]
        more = {"length": distance} if kind is Rod else {}
        loops.append(kind(name=f"loop{k}", first=ends[0], second=ends[1], **more))
    return replace(tree, constraints=tuple(loops)), q


def z_along(axis: Array) -> Transform:
    z = np.array(axis) / np.linalg.norm(axis)
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    return Transform(rotation=np.column_stack([x, np.cross(z, x), z]))


def with_free_links(robot: Robot, q: Array) -> Robot:
    """The same mechanism at ``q``: all links float, and closures take the places of their joints."""
    (poses,) = trace_link_poses(replace(robot, constraints=()))(q)
    links: list[Link] = []
    loops = list(robot.closures)
    for link, T in zip(robot.links, np.linalg.inv(poses[0]) @ poses[1:-1]):
        start = Transform(rotation=T[:3, :3], translation=T[:3, 3])
        links.append(replace(link, parent=None, joint=Free(), before=start, after=Transform()))
        ends = [link.before, link.after.inverse()]
        if isinstance(link.joint, Universal):
            y, z = (
                np.array(axis) / np.linalg.norm(axis) for axis in (link.joint.second_axis, link.joint.axis)
            )
            ends[0] = ends[0] @ z_along(z)
            ends[1] = ends[1] @ Transform(rotation=np.column_stack([np.cross(y, z), y, z]))
        elif isinstance(link.joint, Revolute | Prismatic | Cylindrical):
            ends = [end @ z_along(np.array(link.joint.axis)) for end in ends]
        first, second = Attachment(link=link.parent, pose=ends[0]), Attachment(link=link.name, pose=ends[1])
        loops.append(JOINT_CLOSURES[type(link.joint)](name=f"joint {link.name}", first=first, second=second))
    return replace(robot, links=tuple(links), constraints=tuple(loops))


def positions_of_links(robot: Robot, q: Array, qd: Array, qdd: Array, t: float) -> Array:
    """The poses (L, 4, 4) of the links at the time ``t`` of a motion with constant ``qdd``."""
    tree = replace(robot, constraints=())
    return trace_link_poses(tree)(Mechanism(tree).moved(q, qd * t + qdd * t * t / 2))[0][1:-1]


def body_speeds(robot: Robot, q: Array, qd: Array, h: float = 1e-6) -> Array:
    """The speeds of free joints of all links at a motion, by difference quotients."""
    before, now, after = (positions_of_links(robot, q, qd, 0 * qd, t) for t in (-h, 0.0, h))
    speeds: list[float] = []
    for a, T, b in zip(before, now, after):
        spin = T[:3, :3].T @ (b - a)[:3, :3] / (2 * h)
        speeds += (T[:3, :3].T @ (b - a)[:3, 3] / (2 * h)).tolist()
        speeds += [spin[2, 1], spin[0, 2], spin[1, 0]]
    return np.array(speeds)


@pytest.mark.parametrize("seed", [2])
def test_joints_of_all_types_move_as_closures_between_free_bodies(seed: int) -> None:
    robot, q = mixed_mechanism(seed)
    free = with_free_links(robot, q)
    functions, of_free = Mechanism(robot), Mechanism(free)
    assert np.abs(of_free.residuals(free.neutral)).max() < 1e-12
    assert of_free.mobility(free.neutral).degrees_of_freedom == functions.mobility(q).degrees_of_freedom
    qd = functions.consistent_speeds(q, np.random.default_rng(seed).normal(size=robot.nv))
    qdd = trace_constrained_motion(robot, near=q)(q, qd, np.zeros(robot.nv))[2]
    speeds = of_free.consistent_speeds(free.neutral, body_speeds(robot, q, qd))
    of_bodies = trace_constrained_motion(free, near=free.neutral)(free.neutral, speeds, np.zeros(free.nv))[2]
    h = 1e-4
    expected, found = (
        np.array([positions_of_links(*motion, t) for t in (-h, 0.0, h)])
        for motion in ((robot, q, qd, qdd), (free, free.neutral, speeds, of_bodies))
    )
    second = [(poses[2] - 2 * poses[1] + poses[0]) / h**2 for poses in (expected, found)]
    assert second[1] == pytest.approx(second[0], abs=1e-5 * max(1.0, np.abs(second[0]).max()))


@pytest.mark.parametrize("seed", [0])
def test_reaction_wrenches_accelerate_each_link(seed: int) -> None:
    """Newton's and Euler's equations of each link, at a motion of all independent joints."""
    robot, q = mixed_mechanism(seed)
    functions, random = Mechanism(robot), np.random.default_rng(seed)
    qd = functions.consistent_speeds(q, random.normal(size=robot.nv))
    qdd = trace_constrained_motion(robot, near=q)(q, qd, random.normal(size=robot.nv))[2]
    drives = independent_drives(robot, q)
    driven = replace(robot, constraints=(*robot.constraints, *drives))
    (W,) = trace_joint_wrenches(driven, near=q)(q, qd, qdd)
    h = 1e-4
    poses = [positions_of_links(robot, q, qd, qdd, t) for t in (-h, 0.0, h)]
    base = trace_link_poses(replace(robot, constraints=()))(q)[0][0]
    at = {None: base, **{link.name: T for link, T in zip(robot.links, poses[1])}}
    total = {link.name: np.zeros(6) for link in robot.links}
    transmitted = [
        (link.parent, link.name, at[link.name] @ link.after.inverse().matrix) for link in robot.links
    ]
    transmitted += [
        (c.first.link, c.second.link, at[c.second.link] @ c.second.pose.matrix) for c in robot.closures
    ]
    for (first, second, T), wrench in zip(transmitted, W):
        force = T[:3, :3] @ wrench[:3]
        in_world = np.concatenate([force, T[:3, :3] @ wrench[3:] + np.cross(T[:3, 3], force)])
        total[second] += in_world
        if first is not None:
            total[first] -= in_world
    for k, link in enumerate(robot.links):
        centres = [T[k][:3, :3] @ link.centre_of_mass + T[k][:3, 3] for T in poses]
        force = link.mass * ((centres[2] - 2 * centres[1] + centres[0]) / h**2 - robot.gravity)
        moment = (_spin(link, poses[1][k], poses[2][k], h) - _spin(link, poses[0][k], poses[1][k], h)) / h
        expected = np.concatenate([force, moment + np.cross(centres[1], force)])
        assert total[link.name] == pytest.approx(expected, abs=1e-5 * max(1.0, np.abs(expected).max()))


def independent_drives(robot: Robot, q: Array) -> list[PrescribedMotion]:
    """Prescribed motions of joints that determine all others."""
    functions = Mechanism(robot)
    mobility = functions.mobility(q)
    J = functions.jacobian(q)[list(mobility.independent)]
    owners = [link.name for link in robot.moving_links for _ in range(link.joint.nv)]
    for mask in range(2 ** len(robot.joint_names)):
        names = [name for k, name in enumerate(robot.joint_names) if mask >> k & 1]
        passive = [k for k, owner in enumerate(owners) if owner not in names]
        if len(passive) == len(J) and np.linalg.cond(J[:, passive]) < 1e3:
            return [PrescribedMotion(name=f"drive {name}", joint=name) for name in names]
    raise AssertionError("no joints determine the mechanism; use another seed")


def _spin(link: Link, start: Array, end: Array, h: float) -> Array:
    """The angular momentum about the centre of mass in the middle of a small rotation."""
    U, _, Vt = np.linalg.svd((start + end)[:3, :3])
    R = U @ Vt
    rate = (end - start)[:3, :3] / h @ R.T
    w = np.array([rate[2, 1] - rate[1, 2], rate[0, 2] - rate[2, 0], rate[1, 0] - rate[0, 1]]) / 2
    return R @ np.array(link.inertia) @ R.T @ w
