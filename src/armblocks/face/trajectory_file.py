"""Trajectories from files of measured or planned joint motions."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from os import PathLike, fspath

import numpy as np

from armblocks.errors import InputError, shortened_list
from armblocks.face.trajectory import JointTrajectory, curve_through, sampled
from armblocks.formats import load_table
from armblocks.trajectories.splines import cubic_spline

_COLUMN = re.compile(r"(qdd|qd|q)_?(\d+)(?:\s*[\[(].*)?")

_UNITS = {"": 1.0, "rad": 1.0, "m": 1.0, "deg": math.pi / 180.0, "°": math.pi / 180.0, "mm": 1e-3}
"""Factors to rad and m."""


def load_trajectory(path: str | PathLike[str], *, dt: float | None = None) -> JointTrajectory:
    """The joint motion in a table file (``.csv``, ``.npz``, ``.mat``, ``.parquet``).

    Columns, as :meth:`JointTrajectory.save` writes them:

    - ``t`` or ``time``: the times, s.
    - ``q1`` … ``qn``: the positions, rad or m.
    - ``qd1`` …, ``qdd1`` …, both optional: speeds and accelerations.

    Units in headers, such as ``q1 [deg]`` or ``qd2 [mm/s]``, are converted. Between rows the motion is the
    quintic with the values of both rows. Without speeds and accelerations, the motion is the cubic spline
    through the positions, at rest at both ends.

    ``dt`` (s) is the time between samples; by default the samples are the rows of the file.

    Raises ``FormatError`` and ``UnknownNameError`` as :func:`~armblocks.load_table`, and InputError for
    missing columns.
    """
    table = load_table(path)
    rows = np.asarray(table)
    found: dict[str, dict[int, int]] = {"q": {}, "qd": {}, "qdd": {}}
    for column, name in enumerate(table.names, 1):
        match = _COLUMN.fullmatch(name.strip())
        if match:
            found[match[1]][int(match[2])] = column
    n = len(found["q"])
    complete = [sorted(columns) == list(range(1, n + 1)) for columns in found.values()]
    if not n or not complete[0] or complete[1] != complete[2] or (not complete[1] and found["qd"]):
        raise InputError(
            f"the columns are {_listed(table.names)}",
            where=fspath(path),
            allowed="q1 to qn, and for all or no joints qd1 to qdn and qdd1 to qddn",
            fix="rename the columns of the table",
        )
    factors = np.array(
        [1.0, *(_factor(unit, fspath(path)) for unit in table.units or [""] * len(table.names))]
    )
    columns = [found[name][k] for name in ("q", "qd", "qdd")[: 1 + 2 * complete[1]] for k in range(1, n + 1)]
    rows = (rows * factors)[:, [0, *columns]]
    if complete[1]:
        curve = curve_through(rows)
    else:
        rest = np.zeros(n)
        curve = cubic_spline(rows[:, 0], rows[:, 1:], rest, rest)
    if dt is not None:
        return sampled(curve, dt)
    times = np.unique(rows[:, 0])
    motion = curve.at(times)
    return JointTrajectory(t=times, q=motion.q, qd=motion.qd, qdd=motion.qdd, curve=curve)


def _factor(unit: str, where: str) -> float:
    """The factor from a unit of a header to rad or m, and s."""
    position = unit.split("/")[0].strip()
    if position not in _UNITS:
        raise InputError(
            f"a column has the unit '{unit}'",
            where=where,
            allowed=f"units of {', '.join(name for name in _UNITS if name)}, per s for speeds, or no unit",
            fix="convert the column, or correct its header",
        )
    return _UNITS[position]


def _listed(names: Sequence[str]) -> str:
    return shortened_list([f"'{name}'" for name in names]) if names else "without names"
