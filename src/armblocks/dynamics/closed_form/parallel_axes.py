"""Arms with three parallel axes: Universal Robots (six joints), SCARA and planar arms, palletisers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from casadi import SX, dot

from armblocks.dynamics.closed_form.axes import Array, Axis, Chain
from armblocks.dynamics.closed_form.branches import Branch, Solver, perpendicular, placed
from armblocks.dynamics.closed_form.subproblems import angle_between, distance, height, rotated


def three_parallel_axes(chain: Chain) -> Solver | None:
    """Six revolute joints: axes 2, 3, 4 are parallel, axes 5 and 6 intersect.

    The intersection of axes 5 and 6 is fixed to the tool, and joints 2 to 4 do not change its component along
    their axes. This condition determines joint 1, the orientation determines joints 5 and 6, and joints 2 to
    4 are a planar arm.
    """
    if len(chain.axes) != 6 or any(axis.prismatic for axis in chain.axes):
        return None
    first, second, third, fourth, fifth, sixth = chain.axes
    centre = chain.common_point(fifth, sixth)
    if centre is None or not (second.parallel(third) and second.parallel(fourth)):
        return None
    if first.parallel(second) or fourth.parallel(fifth):
        return None
    h, p1 = second.direction, first.point
    h5, h6 = fifth.direction, sixth.direction
    normal = perpendicular(h)

    def branches(T: SX) -> Iterator[Branch]:
        y = placed(chain, T, centre)
        M = SX(T[:3, :3] @ chain.tool[:3, :3].T)
        shoulder = height(h, SX(y - p1), -first.direction, float(h @ (centre - p1)))
        for s in (1.0, -1.0):
            one = shoulder.angle(s)
            x = SX(p1 + rotated(-first.direction, one, SX(y - p1)))
            axis = SX(M.T @ rotated(first.direction, one, h))  # h in the axes after joint 6
            d = SX(dot(axis, SX(h6)))
            sideways = SX(axis - d * h6)
            along = float((h @ h5) * (h5 @ h6))
            wrist = height(h, h6, h5, d, _square(h, h5, h6, along, d, sideways))
            for w in (1.0, -1.0):
                five = wrist.angle(w)
                six = angle_between(axis, rotated(-h5, five, h), h6)
                # The total rotation of joints 2 to 4 takes ``normal`` to this vector.
                before = rotated(-h6, six, rotated(-h5, five, normal))
                total = angle_between(normal, rotated(-first.direction, one, SX(M @ before)), h)
                for angles, root in _planar(second, third, fourth, centre, x, total):
                    yield Branch([one, *angles, five, six], [shoulder.root, wrist.root, root])

    return Solver("three parallel axes", 8, ("shoulder", "wrist", "elbow"), branches)


def _square(h: Array, h5: Array, h6: Array, along: float, d: SX, sideways: SX) -> SX:
    """``A² + B² - c²`` of the equation of joint 5, where ``1 - d²`` is the square of ``sideways``."""
    amplitude = float(np.linalg.norm(h - (h @ h5) * h5) * np.linalg.norm(h6 - (h6 @ h5) * h5))
    constant = amplitude**2 - 1.0 - along**2
    constant = 0.0 if abs(constant) < 1e-14 else constant
    return SX(dot(sideways, sideways) + 2.0 * along * d + constant)


def _planar(
    one: Axis, two: Axis, three: Axis, point: Array, x: SX, total: SX
) -> Iterator[tuple[list[SX], SX]]:
    """The angles of three parallel joints that take ``point`` to ``x`` with the ``total`` rotation.

    All angles are about the direction of the first axis, and are converted to angles about the other axes.
    """
    h = one.direction
    p1, p2, p3 = one.point, two.point, three.point
    target = SX(x - p1 - rotated(h, total, point - p3))
    target = SX(target - dot(SX(h), target) * h)
    upper, lower = _flat(p2 - p1, h), _flat(p3 - p2, h)
    elbow = distance(-upper, lower, h, SX(dot(target, target)))
    for e in (1.0, -1.0):
        middle = elbow.angle(e)
        first = angle_between(SX(upper + rotated(h, middle, lower)), target, h)
        rest = SX(total - first - middle)
        signs = (float(np.sign(h @ axis.direction)) for axis in (one, two, three))
        yield [SX(s * a) for s, a in zip(signs, (first, middle, rest))], elbow.root


def all_parallel(chain: Chain) -> Solver | None:
    """SCARA and planar arms: all axes are parallel, three or two revolute and at most one prismatic."""
    revolute = [axis for axis in chain.axes if not axis.prismatic]
    sliding = [axis for axis in chain.axes if axis.prismatic]
    if len(revolute) not in (2, 3) or len(sliding) > 1:
        return None
    if not all(axis.parallel(chain.axes[0]) for axis in chain.axes):
        return None
    h, tool = revolute[0].direction, chain.tool[:3, 3]
    p1, p2 = revolute[0].point, revolute[1].point
    # The point that only the first two rotations move: on the third axis, or the origin of the tool.
    point = revolute[2].point if len(revolute) == 3 else tool
    normal = perpendicular(h)

    def branches(T: SX) -> Iterator[Branch]:
        y = placed(chain, T, point)
        total = angle_between(normal, SX(T[:3, :3] @ (chain.tool[:3, :3].T @ normal)), h)
        target = SX(y - p1)
        target = SX(target - dot(SX(h), target) * h)
        upper, lower = _flat(p2 - p1, h), _flat(point - p2, h)
        elbow = distance(-upper, lower, h, SX(dot(target, target)))
        for e in (1.0, -1.0):
            middle = elbow.angle(e)
            first = angle_between(SX(upper + rotated(h, middle, lower)), target, h)
            turns = [first, middle, SX(total - first - middle)][: len(revolute)]
            values = {id(axis): SX(np.sign(h @ axis.direction) * turn) for axis, turn in zip(revolute, turns)}
            for axis in sliding:
                values[id(axis)] = SX(dot(SX(axis.direction), SX(y - point)))
            yield Branch([values[id(axis)] for axis in chain.axes], [elbow.root])

    return Solver("parallel axes", 2, ("elbow",), branches)


def arm_of_parallel_axes(chain: Chain) -> Solver | None:
    """Three to five joints: a first axis, then three parallel axes, then at most one more axis.

    In palletisers, couplings keep the sum of the angles of the parallel axes constant, so that the last axis
    keeps its inclination. In other arms, the orientation of the tool gives this sum. These arms reach only
    some poses. For other poses, a solution satisfies only a part of the pose, and the check by forward
    kinematics rejects it.
    """
    if len(chain.axes) not in (4, 5) or any(axis.prismatic for axis in chain.axes):
        return None
    first, second, third, fourth, *more = chain.axes
    if not (second.parallel(third) and second.parallel(fourth)) or first.parallel(second):
        return None
    last = more[0] if more else None
    h, p1 = second.direction, first.point
    constant = _constant_sum(chain)
    if last is not None and constant is None and last.parallel(second):
        return None
    point = chain.tool[:3, 3] if last is None else last.point
    fixed = perpendicular(h) if last is None else last.direction
    normal = fixed if last is None else perpendicular(last.direction)

    def branches(T: SX) -> Iterator[Branch]:
        y = placed(chain, T, point)
        M = SX(T[:3, :3] @ chain.tool[:3, :3].T)
        shoulder = height(h, SX(y - p1), -first.direction, float(h @ (point - p1)))
        for s in (1.0, -1.0):
            one = shoulder.angle(s)
            x = SX(p1 + rotated(-first.direction, one, SX(y - p1)))
            total = angle_between(fixed, rotated(-first.direction, one, SX(M @ fixed)), h)
            total = total if constant is None else SX(constant)
            turned = rotated(-h, total, rotated(-first.direction, one, SX(M @ normal)))
            end = [] if last is None else [angle_between(normal, turned, last.direction)]
            for angles, root in _planar(second, third, fourth, point, x, total):
                yield Branch([one, *angles, *end], [shoulder.root, root])

    name = "parallel axes after the first axis" if constant is None else "the coupled axes of a palletiser"
    return Solver(name, 4, ("shoulder", "elbow"), branches)


def _constant_sum(chain: Chain) -> float | None:
    """The sum of the angles of axes 2 to 4, if couplings keep it constant."""
    h, parallel = chain.axes[1].direction, chain.axes[1:4]
    factors = [axis.factor * float(np.sign(h @ axis.direction)) for axis in parallel]
    rows = [f * chain.to_tree[axis.position] for f, axis in zip(factors, parallel)]
    if np.abs(np.sum(rows, axis=0)).max() > 1e-12:
        return None
    return float(sum(f * axis.offset for f, axis in zip(factors, parallel)))


def _flat(p: Array, h: Array) -> Array:
    """The part of a vector perpendicular to ``h``."""
    return p - (h @ p) * h
