"""The choice of starts: the entries of a table in the order of the distance of their poses from the target.

The order depends only on the target and the table. All entries are compared, several at a time in lanes,
which takes less time than two steps of the iteration.
"""

from __future__ import annotations

from armblocks.inverse_kinematics.layout import POSE, Setting
from armblocks.routines.arithmetic import fma, in_all_lanes, select
from armblocks.routines.lanes import LaneArray, Lanes
from armblocks.routines.memory import Reals
from armblocks.routines.routine import Routine
from armblocks.routines.values import Integer, Real

BLOCK = POSE + 1
"""Rows of a block of the table: the numbers of the poses, then the indices of the entries."""


def nearest(
    r: Routine, target: Reals, settings: Reals, table: LaneArray, previous: Reals, lanes: Integer
) -> Integer:
    """The index of the next entry of the table in the order of distance; -1 if there is none.

    ``previous``: distance and index of the previous entry, which are overwritten; -1 and -1 for the first.
    Entries of equal distance are in the order of their indices. ``lanes``: the number of lanes of the table.
    """
    weights = [in_all_lanes(settings[Setting.POSE_WEIGHTS + k]) for k in range(POSE)]
    pose = [in_all_lanes(target[k]) for k in range(POSE)]
    after, after_index = in_all_lanes(previous[0]), in_all_lanes(previous[1])
    best = r.variable(Lanes.constant(r, float("inf")))
    best_index = r.variable(Lanes.constant(r, -1.0))
    for block in r.range(0, settings[Setting.BLOCKS].to_integer()):
        entry = table.after(block * BLOCK)
        distance = Lanes.constant(r, 0.0)
        for k in range(POSE):
            difference = entry[k] - pose[k]
            distance = fma(weights[k] * difference, difference, distance)
        index = entry[POSE]
        remains = (distance > after) | ((distance == after) & (index > after_index))
        nearer = remains & (distance < best.value)
        best.value = select(nearer, distance, best.value)
        best_index.value = select(nearer, index, best_index.value)
    found = r.local_lanes(2)
    found[0], found[1] = best.value, best_index.value
    distances, indices = found.reals, found.after(1).reals
    smallest, position = r.real(float("inf")), r.real(-1.0)
    for lane in r.range(0, lanes):
        d, i = distances[lane], indices[lane]
        first = (d < smallest.value) | ((d == smallest.value) & (i < position.value))
        smallest.value = select(first & (i >= 0.0), d, smallest.value)
        position.value = select(first & (i >= 0.0), i, position.value)
    previous[0], previous[1] = smallest.value, position.value
    return position.value.to_integer()


def is_pose(r: Routine, target: Reals) -> Real:
    """1 for a homogeneous matrix (16 numbers) of a finite pose, else 0.

    The rotation may deviate from an orthonormal matrix as much as the rotation of a ``Transform``.
    """
    is_valid = target[0].finite
    for k in range(1, POSE):
        is_valid = is_valid & target[k].finite
    for k, value in enumerate((0.0, 0.0, 0.0, 1.0)):
        is_valid = is_valid & (target[POSE + k] == value)
    rotation = [[target[4 * i + j] for j in range(3)] for i in range(3)]
    for i in range(3):
        for j in range(i, 3):
            product = sum((rotation[k][i] * rotation[k][j] for k in range(3)), start=r.constant(0.0))
            is_valid = is_valid & (abs(product - float(i == j)) <= ORTHONORMALITY)
    (a, b, c), (d, e, f), (g, h, i_) = rotation
    determinant = a * (e * i_ - f * h) - b * (d * i_ - f * g) + c * (d * h - e * g)
    return select(is_valid & (determinant > 0.0), 1.0, 0.0)


ORTHONORMALITY = 1e-8
"""Maximum deviation of ``R' R`` from the identity, as for ``armblocks.spatial.Transform``."""
