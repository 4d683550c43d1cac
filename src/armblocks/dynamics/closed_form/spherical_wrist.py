"""Six joints whose last three axes intersect: position and orientation are solved one after the other.

The centre of the wrist does not depend on the last three joints, so the first three follow from its position
(Pieper, 1968). Supported are two parallel axes after the first axis, and two intersecting axes before a third
joint that is revolute or prismatic.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from casadi import SX, dot, horzcat, sqrt

from armblocks.dynamics.closed_form.axes import Array, Axis, Chain
from armblocks.dynamics.closed_form.branches import Branch, Solver, perpendicular, placed
from armblocks.dynamics.closed_form.subproblems import angle_between, distance, height, rotated


def spherical_wrist(chain: Chain) -> Solver | None:
    """The solver of the chain; None for other geometries."""
    if len(chain.axes) != 6 or any(axis.prismatic for axis in (*chain.axes[:2], *chain.axes[3:])):
        return None
    first, second, third, *wrist = chain.axes
    centre = chain.common_point(*wrist)
    if centre is None or wrist[0].parallel(wrist[1]) or wrist[1].parallel(wrist[2]):
        return None
    shoulder = chain.common_point(first, second)
    parallel = not third.prismatic and second.parallel(third) and not first.parallel(second)
    if not parallel and (shoulder is None or (not third.prismatic and second.parallel(third))):
        return None

    def branches(T: SX) -> Iterator[Branch]:
        y = placed(chain, T, centre)
        M = SX(T[:3, :3] @ chain.tool[:3, :3].T)
        arm = _parallel_arm(chain, centre, y) if parallel else _intersecting_arm(chain, shoulder, centre, y)
        for angles, measures in arm:
            N = _without(chain.axes[:3], angles, M)
            for more, measure in _orientation(wrist, N):
                yield Branch([*angles, *more], [*measures, measure])

    name = "a spherical wrist after two parallel axes" if parallel else "a spherical wrist"
    return Solver(name, 8, ("shoulder", "elbow", "wrist"), branches)


def arm_with_one_wrist_axis(chain: Chain) -> Solver | None:
    """Three or four revolute joints: axes 2 and 3 are parallel, and not parallel to axis 1.

    These arms reach only some poses. The check by forward kinematics rejects the solutions of other poses.
    """
    if len(chain.axes) not in (3, 4) or any(axis.prismatic for axis in chain.axes):
        return None
    first, second, third, *last = chain.axes
    if not second.parallel(third) or first.parallel(second):
        return None
    point = last[0].point if last else chain.tool[:3, 3]

    def branches(T: SX) -> Iterator[Branch]:
        y = placed(chain, T, point)
        M = SX(T[:3, :3] @ chain.tool[:3, :3].T)
        for angles, measures in _parallel_arm(chain, point, y):
            N = _without(chain.axes[:3], angles, M)
            more: list[SX] = []
            for axis in last:
                normal = perpendicular(axis.direction)
                more.append(angle_between(normal, SX(N @ normal), axis.direction))
            yield Branch([*angles, *more], measures)

    return Solver("two parallel axes after the first axis", 4, ("shoulder", "elbow"), branches)


def _parallel_arm(chain: Chain, centre: Array, y: SX) -> Iterator[tuple[list[SX], list[SX]]]:
    """The angles of three joints that take the point ``centre`` to ``y``; axes 2 and 3 are parallel.

    Joints 2 and 3 do not change the component along their axes. This condition determines the first angle.
    The distance of the point from axis 2 gives the third angle.
    """
    first, second, third = chain.axes[:3]
    h, p1, p2, p3 = second.direction, first.point, second.point, third.point
    shoulder = height(h, SX(y - p1), -first.direction, float(h @ (centre - p1)))
    for s in (1.0, -1.0):
        one = shoulder.angle(s)
        x = SX(p1 + rotated(-first.direction, one, SX(y - p1)))
        # The first angle makes the components along the axes equal; only the other components are compared.
        target = SX(x - p2) - dot(SX(h), SX(x - p2)) * h
        elbow = distance(_flat(p2 - p3, h), _flat(centre - p3, h), third.direction, SX(dot(target, target)))
        for e in (1.0, -1.0):
            three = elbow.angle(e)
            at_elbow = SX(p3 + rotated(third.direction, three, centre - p3))
            two = angle_between(SX(at_elbow - p2), SX(x - p2), h)
            yield [one, two, three], [shoulder.root, elbow.root]


def _intersecting_arm(
    chain: Chain, shoulder: Array | None, centre: Array, y: SX
) -> Iterator[tuple[list[SX], list[SX]]]:
    """The angles where axes 1 and 2 intersect: the distance from the intersection gives the third joint."""
    assert shoulder is not None
    first, second, third = chain.axes[:3]
    target = SX(y - shoulder)
    square = SX(dot(target, target))
    for e in (1.0, -1.0):
        if third.prismatic:
            start = centre - shoulder
            b = float(third.direction @ start)
            rest = SX(square - float(start @ start) + b * b)
            root = sqrt(rest)
            three, measure = SX(e * root - b), SX(root / chain.size)
            point = SX(start + three * third.direction)
        else:
            elbow = distance(shoulder - third.point, centre - third.point, third.direction, square)
            three, measure = elbow.angle(e), elbow.root
            point = SX(third.point + rotated(third.direction, three, centre - third.point) - shoulder)
        turned = height(second.direction, target, -first.direction, SX(dot(SX(second.direction), point)))
        for s in (1.0, -1.0):
            one = turned.angle(s)
            two = angle_between(point, rotated(-first.direction, one, target), second.direction)
            yield [one, two, three], [turned.root, measure]


def _orientation(wrist: list[Axis], N: SX) -> Iterator[tuple[list[SX], SX]]:
    """The angles of three rotations whose product is ``N``.

    Where the first and the third axis coincide, only the sum of their angles is determined: the third angle
    follows from the other two in every case.
    """
    h4, h5, h6 = (axis.direction for axis in wrist)
    n = SX(N @ h6)
    d = SX(dot(SX(h4), n))
    sideways = SX(n - d * h4)
    # 1 - d² is the square of this vector, without the cancellation.
    along = float((h4 @ h5) * (h5 @ h6))
    amplitude = float(np.linalg.norm(h4 - (h4 @ h5) * h5) * np.linalg.norm(h6 - (h6 @ h5) * h5))
    constant = amplitude**2 - 1.0 - along**2
    constant = 0.0 if abs(constant) < 1e-14 else constant
    square = SX(dot(sideways, sideways) + 2.0 * along * d + constant)
    middle = height(h4, h6, h5, d, square)
    normal = perpendicular(h6)
    for s in (1.0, -1.0):
        five = middle.angle(s)
        four = angle_between(rotated(h5, five, h6), n, h4)
        turned = rotated(-h5, five, rotated(-h4, four, SX(N @ normal)))
        yield [four, five, angle_between(normal, turned, h6)], middle.root


def _without(axes: tuple[Axis, ...], angles: list[SX], M: SX) -> SX:
    """``M`` without the rotations of the first joints."""
    rest = M
    for axis, angle in zip(axes, angles):
        if not axis.prismatic:
            rest = SX(horzcat(*(rotated(-axis.direction, angle, SX(rest[:, j])) for j in range(3))))
    return rest


def _flat(p: Array, h: Array) -> Array:
    """The part of a vector perpendicular to ``h``."""
    return p - (h @ p) * h
