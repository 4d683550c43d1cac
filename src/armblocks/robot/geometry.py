"""The geometry of a robot: shapes of the links, or castings derived from the kinematics.

A link without ``geometry`` gets a body that follows its joint axes. The body begins at the joint of the link.
It follows the axis to the common normal of this axis and the next axis, then the normal, then the next axis
to the next joint. For a standard D-H row these are the lengths d and a, so the drawing shows the D-H table.
Each revolute joint gets a motor drum, each prismatic joint a rail and a carriage, the tip a flange.

The sizes affect the appearance only, not the dynamics.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from armblocks.robot.link import Link
from armblocks.robot.linkage_points import LinkPoints, closure_points, configurations, rod_points
from armblocks.robot.robot import Robot
from armblocks.robot.rod_bars import RodBar, rod_bars
from armblocks.robot.shapes import Box, Cylinder, Housing, Material, Pose, Shape, Sphere
from armblocks.robot.triangles import TriangleMesh, triangles
from armblocks.spatial import Transform

_Array = NDArray[np.float64]

_BASE_RADIUS = 0.06  # radius of the first joint's drum, relative to the reach
_TAPER = 0.82  # radius of each joint's drum, relative to the drum before
_MIN_RADIUS = 0.45  # minimum radius, relative to the first drum, so that wrists are visible
_NEGLIGIBLE = 0.02  # shorter parts, relative to a drum's radius, are not drawn


@dataclass(frozen=True, eq=False, kw_only=True)
class Body:
    """One mesh, and the ``row`` of ``link_poses`` with its frame (0 the base, then the links).

    The rows after the tool are those of the bars of rods, see :func:`armblocks.robot.rod_bars.with_bars`.
    """

    row: int
    mesh: TriangleMesh


def robot_bodies(robot: Robot) -> tuple[Body, ...]:
    """All meshes of a robot, each in the frame of its row of ``link_poses`` or of a bar."""
    rows = [*robot_shapes(robot), *((_bar_shape(robot, bar),) for bar in rod_bars(robot))]
    return tuple(Body(row=row, mesh=triangles(shape)) for row, shapes in enumerate(rows) for shape in shapes)


def _bar_shape(robot: Robot, bar: RodBar) -> Shape:
    """The bar of a rod, along z from the origin."""
    radius = 0.45 * min(_Plan.of(robot).radius.values())
    middle = _aligned(np.array([0.0, 0.0, bar.length / 2]), np.array([0.0, 0.0, 1.0]))
    return Cylinder(
        radius=radius, length=bar.length, bevel=0.1 * radius, material=Material.FLANGE, pose=middle
    )


@lru_cache(maxsize=32)
def robot_shapes(robot: Robot) -> tuple[tuple[Shape, ...], ...]:
    """The shapes of the base, every link, and the tool, with one row for each row of ``link_poses``."""
    plan = _Plan.of(robot)
    rows: list[list[Shape]] = [_base_shapes(robot, plan)]
    for link in robot.links:
        link_shapes = _link_shapes(robot, link, plan)
        rows.append(list(link.geometry) if link.geometry is not None else link_shapes)
    rows.append([])
    _add_linkages(robot, rows, plan)
    # The rail of a prismatic joint belongs to the body that carries the joint.
    row_of = {link.name: row for row, link in enumerate(robot.links, start=1)}
    for link in robot.links:
        carrier = row_of[link.parent] if link.parent is not None else 0
        if link.joint.translations == 1 and link.geometry is None:
            rows[carrier].append(_rail(link, plan))
    return tuple(tuple(shapes) for shapes in rows)


def _add_linkages(robot: Robot, rows: list[list[Shape]], plan: _Plan) -> None:
    """Extend the links to the ends of closed loops, and by brackets to the ends of parallel rods."""
    loops = closure_points(robot)
    rods: LinkPoints = {}
    if robot.couplings and any(link.geometry for link in robot.links):
        frames = [link_frames(robot, q.tolist()) for q in configurations(robot)]
        rods = rod_points(robot, frames, plan.reach)
    thickest = max(plan.radius.values())
    all_given = all(link.geometry is not None for link in robot.links)
    for row, link in enumerate((None, *robot.links)):
        name = link.name if link is not None else None
        r = plan.radius[link.name] if link is not None else 0.7 * thickest
        for points, part in ((loops, 0.6), (rods, 0.3)):
            if points is loops and (all_given if link is None else link.geometry is not None):
                continue
            for point, axis in points.get(name, []):
                rows[row] += _branch(link, point, axis, part * r)


def _branch(link: Link | None, point: _Array, axis: _Array, r: float) -> list[Shape]:
    """A bar from the joint of a link to a point, with a pin there; for the base, the pin only."""
    shapes: list[Shape] = []
    start = link.after.inverse().matrix[:3, 3] if link is not None else point
    length = float(np.linalg.norm(point - start))
    if length > _NEGLIGIBLE * r:
        pose = _aligned(start, point - start, axis)
        shapes.append(Housing(start=(r, r), end=(0.9 * r, 0.9 * r), length=length, roundness=0.55, pose=pose))
    pin = _aligned(point, axis)
    shapes.append(Cylinder(radius=1.3 * r, length=2.6 * r, bevel=0.1 * r, material=Material.JOINT, pose=pin))
    return shapes


def drum_radii(robot: Robot) -> dict[str, float]:
    """The radius (m) of the drum on each link's joint, by the link's name."""
    return _Plan.of(robot).radius


@lru_cache(maxsize=32)
def reach(robot: Robot) -> float:
    """An upper bound of the distance from base to tip with prismatic joints at 0, m; at least 0.1."""
    length: dict[str, float] = {}
    for link in _parents_first(robot):
        link_length = math.hypot(*link.before.translation) + math.hypot(*link.after.translation)
        link_length += max(map(abs, link.joint.travel or (0.0,)))
        length[link.name] = link_length + (length[link.parent] if link.parent is not None else 0.0)
    return max(0.1, *length.values()) + math.hypot(*robot.tool.translation)


def _parents_first(robot: Robot) -> tuple[Link, ...]:
    """The links sorted so that each follows its parent; a description may list them in any order."""
    placed: set[str | None] = {None}
    ordered: list[Link] = []
    remaining = list(robot.links)
    while remaining:  # Robot has checked that there is no cycle, so every iteration places a link
        ready = [link for link in remaining if link.parent in placed]
        ordered += ready
        placed.update(link.name for link in ready)
        remaining = [link for link in remaining if link.name not in placed]
    return tuple(ordered)


def link_frames(robot: Robot, q: Sequence[float]) -> NDArray[np.float64]:
    """Poses of base, every link and tool in the world, (L+2, 4, 4), at coordinates ``q`` (nq,), rad and m.

    The same poses as ``dynamics.trace_link_poses``, computed without compilation, for drawings.
    ``q`` is not checked.
    """
    frames: dict[str | None, Transform] = {None: robot.base}
    coordinates: dict[str, Sequence[float]] = {}
    first = 0
    if robot.couplings:
        q = (robot.coordinate_map.positions @ np.asarray(q)).tolist()
        robot = robot.uncoupled
    for link in robot.moving_links:
        coordinates[link.name] = q[first : first + link.joint.nq]
        first += link.joint.nq
    for link in _parents_first(robot):
        frames[link.name] = frames[link.parent] @ link.pose(coordinates.get(link.name))
    tip = frames[robot.links[-1].name] @ robot.tool
    rows = [robot.base, *(frames[link.name] for link in robot.links), tip]
    return np.stack([row.matrix for row in rows])


@dataclass(frozen=True, eq=False)
class _Plan:
    """Sizes that several links share: the drum radius of every joint, and the children of each link."""

    radius: dict[str, float]
    children: dict[str | None, list[Link]]
    links: dict[str, Link]
    reach: float

    @classmethod
    def of(cls, robot: Robot) -> _Plan:
        size = reach(robot)
        first = _BASE_RADIUS * size
        children: dict[str | None, list[Link]] = {}
        depth: dict[str | None, int] = {None: 0}
        radius: dict[str, float] = {}
        for link in _parents_first(robot):
            children.setdefault(link.parent, []).append(link)
            depth[link.name] = depth[link.parent] + (1 if link.joint.moves else 0)
            joints_before = depth[link.parent] if link.joint.moves else max(depth[link.parent] - 1, 0)
            radius[link.name] = first * max(_TAPER**joints_before, _MIN_RADIUS)
        return cls(radius, children, {link.name: link for link in robot.links}, size)

    def is_column(self, link: Link) -> bool:
        """Whether the link is a column on the base: a vertical joint and a body that begins upwards."""
        upright = link.before.R @ np.array(link.joint.axis)
        if (
            link.parent is not None
            or not link.joint.rotates
            or link.joint.translations > 1
            or upright[2] < 0.99
        ):
            return False
        T = link.after.inverse().matrix
        axis = T[:3, :3] @ np.array(link.joint.axis)
        ends = [
            (np.array(c.before.translation), c.before.R @ np.array(c.joint.axis))
            for c in self.children.get(link.name, [])
        ] or [(np.zeros(3), np.array([0.0, 0.0, 1.0]))]
        rises = [
            float((_body_path(T[:3, 3], axis, end, end_axis)[1] - T[:3, 3]) @ axis) for end, end_axis in ends
        ]
        return min(rises) > 1.8 * self.radius[link.name]

    def shares_centre(self, link: Link) -> bool:
        """Whether the link's joint and its parent's joint have the same centre and different axes."""
        parent = self.links.get(link.parent) if link.parent is not None else None
        if parent is None or not (parent.joint.rotates and link.joint.rotates):
            return False
        T = parent.after.inverse()
        distance = np.array(link.before.translation) - T.p
        normal = (T.R @ np.array(parent.joint.axis)) @ (link.before.R @ np.array(link.joint.axis))
        return float(np.linalg.norm(distance)) < 0.5 * self.radius[link.name] and abs(float(normal)) < 0.5


def _unit(vector: _Array) -> _Array:
    return vector / max(float(np.linalg.norm(vector)), 1e-300)


def _aligned(origin: _Array, z: _Array, x_hint: _Array | None = None) -> Pose:
    """A frame at ``origin`` with its z axis along ``z`` and its x axis as close as possible to ``x_hint``."""
    z = _unit(z)
    hint = np.zeros(3) if x_hint is None else x_hint - (x_hint @ z) * z
    if np.linalg.norm(hint) < 1e-6:
        hint = np.eye(3)[int(np.argmin(np.abs(z)))]
        hint = hint - (hint @ z) * z
    x = _unit(hint)
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = x, np.cross(z, x), z, origin
    a, b, c, d = ((float(r[0]), float(r[1]), float(r[2]), float(r[3])) for r in T)
    return (a, b, c, d)


def _body_path(start: _Array, start_axis: _Array, end: _Array, end_axis: _Array) -> list[_Array]:
    """Corner points from joint to joint: along the first axis, the common normal, the second axis."""
    normal = np.cross(start_axis, end_axis)
    between = end - start
    square = float(normal @ normal)
    if square < 1e-9:  # parallel axes: the common normal is not unique; follow the first axis first
        foot = start + (between @ start_axis) * start_axis
        return [start, foot, end, end]
    s = float(np.cross(between, end_axis) @ normal) / square
    t = float(np.cross(between, start_axis) @ normal) / square
    return [start, start + s * start_axis, end + t * end_axis, end]


def _link_shapes(robot: Robot, link: Link, plan: _Plan) -> list[Shape]:
    """The casting of one link, with the drum of the joint that carries it."""
    T = link.after.inverse().matrix
    start, axis = T[:3, 3], T[:3, :3] @ np.array(link.joint.axis)
    r = plan.radius[link.name]
    shapes: list[Shape] = []
    if plan.is_column(link):
        # The column rises from the base plate: the drum is a ring in the column, above the floor.
        shapes += _drum(start + 1.35 * r * axis, axis, r, length=1.5 * r)
    elif link.joint.translations > 1:
        pass  # a floating body has no joint to draw
    elif link.joint.rotates:
        # If two joints share their centre (shoulder, wrist), the inner drum passes through the outer collar.
        inside = plan.shares_centre(link)
        shapes += _drum(start, axis, r, length=2.15 * plan.radius[link.parent or ""] if inside else 2.0 * r)
    elif link.joint.translations:
        side = 1.7 * r
        shapes.append(Box(size=(side, side, 1.3 * side), pose=_aligned(start, axis)))
    children = plan.children.get(link.name, [])
    for child in children:
        end = np.array(child.before.translation)
        end_axis = child.before.R @ np.array(child.joint.axis)
        shapes += _casting(start, axis, r, end, end_axis, plan.radius[child.name])
    ends_at_closure = any(link.name in (c.first.link, c.second.link) for c in robot.closures)
    if not children and not (ends_at_closure and link is not robot.links[-1]):
        shapes += _tip(robot, link, start, axis, r)
    return shapes


def _drum(centre: _Array, axis: _Array, r: float, *, length: float) -> list[Shape]:
    """A motor drum on a joint axis: painted collar, graphite drum, steel cap on both ends."""
    pose = _aligned(centre, axis)
    return [
        Cylinder(radius=r, length=1.25 * r, bevel=0.08 * r, pose=pose),
        Cylinder(radius=0.86 * r, length=length, bevel=0.14 * r, material=Material.JOINT, pose=pose),
        Cylinder(radius=0.38 * r, length=1.06 * length, bevel=0.05 * r, material=Material.FLANGE, pose=pose),
    ]


def _casting(
    start: _Array, start_axis: _Array, r0: float, end: _Array, end_axis: _Array, r1: float
) -> list[Shape]:
    """Tapered housings along the body path, a rounded elbow at each corner."""
    corners = _body_path(start, start_axis, end, end_axis)
    lengths = [float(np.linalg.norm(b - a)) for a, b in pairwise(corners)]
    total = sum(lengths)
    shapes: list[Shape] = []
    done = 0.0
    for index, (a, b, length) in enumerate(zip(corners, corners[1:], lengths)):
        if length <= _NEGLIGIBLE * r1:
            continue
        w0 = r0 + (r1 - r0) * done / total
        done += length
        w1 = r0 + (r1 - r0) * done / total
        along_axis = index != 1
        thick0, thick1 = 0.74 * w0, 0.74 * w1
        shapes.append(
            Housing(
                start=(0.62 * w0, 0.9 * w0) if not along_axis else (thick0, thick0),
                end=(0.62 * w1, 0.86 * w1) if not along_axis else (thick1, thick1),
                length=length,
                roundness=1.0 if along_axis else 0.55,
                pose=_aligned(a, b - a, start_axis),
            )
        )
        if done < total - _NEGLIGIBLE * r1:
            shapes.append(Sphere(radius=0.8 * w1, pose=_aligned(b, b - a)))
    return shapes


def _tip(robot: Robot, link: Link, start: _Array, axis: _Array, r: float) -> list[Shape]:
    """The last casting of a branch with its flange, and the shaft of the tool at the robot's tip."""
    end = np.zeros(3)
    outward = np.array([0.0, 0.0, 1.0])
    shapes = _casting(start, axis, r, end, outward, 0.8 * r)
    if np.linalg.norm(end - start) < r:
        # All axes meet in the wrist and would hide the flange, so it is shifted outwards.
        shapes.append(
            Housing(
                start=(0.6 * r, 0.6 * r),
                end=(0.5 * r, 0.5 * r),
                length=1.5 * r,
                roundness=1.0,
                material=Material.JOINT,
                pose=_aligned(end, outward),
            )
        )
        end = end + 1.5 * r * outward
    # If the last body is along the flange's axis, the drum is its end; otherwise the drum is a hub.
    shapes += [
        Cylinder(
            radius=0.72 * r,
            length=0.5 * r,
            bevel=0.08 * r,
            material=Material.JOINT,
            pose=_aligned(end, outward),
        ),
        Cylinder(
            radius=0.56 * r,
            length=0.72 * r,
            bevel=0.05 * r,
            material=Material.FLANGE,
            pose=_aligned(end, outward),
        ),
    ]
    tool = np.array(robot.tool.translation)
    length = float(np.linalg.norm(tool - end))
    if link is robot.links[-1] and np.linalg.norm(tool) > 0 and length > 0:
        shapes.append(
            Housing(
                start=(0.26 * r, 0.26 * r),
                end=(0.14 * r, 0.14 * r),
                length=length,
                roundness=1.0,
                material=Material.FLANGE,
                pose=_aligned(end, tool - end),
            )
        )
    return shapes


def _base_shapes(robot: Robot, plan: _Plan) -> list[Shape]:
    """A foot under each joint on the base, and a beam to joints beside the base frame.

    Links with ``geometry`` have none, except a base link, such as that of a URDF file.
    """
    shapes: list[Shape] = []
    for link in plan.children.get(None, []):
        is_given = link.geometry is not None and (link.joint.moves or not plan.children.get(link.name))
        if is_given or link.joint.translations > 1:
            continue
        r = plan.radius[link.name]
        foot = np.array(link.before.translation)
        axis = link.before.R @ np.array(link.joint.axis)
        if np.linalg.norm(foot) > r:
            shapes += _casting(np.zeros(3), np.array([0.0, 0.0, 1.0]), 1.1 * r, foot, axis, r)
        upright = np.array([0.0, 0.0, 1.0])
        # A vertical column needs no foot, because it starts at the base; other joints at the origin need one.
        bottom = 0.0 if plan.is_column(link) else -1.16 * r
        shapes += [
            Housing(
                start=(1.45 * r, 1.45 * r),
                end=(1.12 * r, 1.12 * r),
                length=0.75 * r,
                roundness=1.0,
                material=Material.BASE,
                pose=_aligned((bottom + 0.16 * r) * upright, upright),
            ),
            Cylinder(
                radius=1.6 * r,
                length=0.16 * r,
                bevel=0.04 * r,
                material=Material.BASE,
                pose=_aligned((bottom + 0.08 * r) * upright, upright),
            ),
        ]
    return shapes


def _rail(link: Link, plan: _Plan) -> Shape:
    """The rail of a prismatic joint over its whole range, in the frame of the body that carries the joint."""
    r = plan.radius[link.name]
    low, high = link.joint.travel or (link.joint.offset, 0.3 * plan.reach + link.joint.offset)
    # The rail includes the joint itself for every range, so that the rail is connected to the body.
    low, high = min(low, 0.0) - 1.2 * r, high + 1.2 * r
    axis = link.before.R @ np.array(link.joint.axis)
    centre = np.array(link.before.translation) + axis * (low + high) / 2
    return Box(size=(0.9 * r, 0.9 * r, high - low), material=Material.JOINT, pose=_aligned(centre, axis))
