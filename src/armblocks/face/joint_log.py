"""Logged joint motions with torques: their columns, missing samples, filters and derivatives."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path
from typing import Any, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import InputError, UnknownNameError, counted, shortened_list
from armblocks.estimation.filtering import advised_cutoff, central_derivative, low_passed
from armblocks.formats.table_columns import ColumnFile, seconds_of, time_column
from armblocks.formats.table_files import load_columns
from armblocks.robot import Robot

Array = NDArray[np.float64]

LogSource: TypeAlias = Any
"""A mapping of arrays, a table with named columns, an object with these attributes, or the path of a file."""

_NAMES = ("q", "qd", "qdd", "tau")
_COLUMN = re.compile(r"(qdd|qd|q|tau)(?:[_\[]?(\d+)\]?)?(?:\s*[\[(]([^\d\])][^\])]*)[\])])?")
"""The quantity, the number of the joint, and the unit of a column such as ``qd_2 [deg/s]``."""
_UNITS = {
    "rad": {"rad": 1.0, "deg": math.pi / 180.0, "°": math.pi / 180.0},
    "m": {"m": 1.0, "mm": 1e-3},
    "N m": {"Nm": 1.0, "N·m": 1.0, "N m": 1.0, "N*m": 1.0, "mNm": 1e-3, "kNm": 1e3},
    "N": {"N": 1.0, "kN": 1e3},
    "": {"": 1.0},
}
"""The units of angles, lengths, torques and forces, and of the entries of quaternions, with SI factors."""
_PER = {"q": (), "qd": ("s",), "qdd": ("s2", "s²", "s^2", "s**2", "s/s"), "tau": ()}
"""The divisors that may follow the unit of a quantity."""
_FEWEST = 20
"""Segments with fewer samples are omitted, because they are too short for a filter."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Segment:
    """Samples without gaps: ``time`` (N,) s, ``q`` (N, nq), ``qd``, ``qdd``, ``tau`` (N, n)."""

    time: Array
    q: Array
    qd: Array
    qdd: Array
    tau: Array


@dataclass(frozen=True, eq=False, kw_only=True)
class JointLog:
    """A log as it was measured, in SI units, with NaN for missing values.

    - ``time`` (N,): finite, ascending times, s.
    - ``q`` (N, nq), ``tau`` (N, n): coordinates and torques or forces of the joints.
    - ``qd``, ``qdd`` (N, n): speeds and accelerations; ``None`` if they were not measured.
    - ``where``: the place of the log in messages.
    """

    time: Array
    q: Array
    qd: Array | None
    qdd: Array | None
    tau: Array
    where: str

    @property
    def step(self) -> float:
        """The time between samples, s. Raises InputError for unequal steps, which a filter cannot use."""
        steps = np.diff(self.time)
        step = float(np.median(steps)) if len(steps) else 0.0
        multiples = np.rint(steps / step) if step > 0.0 else steps
        if not step > 0.0 or (np.abs(steps - multiples * step) > 0.05 * step).any():
            raise InputError(
                "the samples are not equally spaced in time",
                where=self.where,
                allowed="a constant sample time (missing samples are allowed) where speeds or accelerations "
                "are computed from positions",
                fix="resample the log, or give q, qd, qdd and tau",
            )
        return step


def read_logs(data: LogSource, robot: Robot, where: str) -> list[JointLog]:
    """The logs of one or several experiments.

    Raises UnknownNameError for a log without q or tau, and InputError for wrong shapes, unknown units, and
    times that are missing, not finite or not ascending.
    """
    several = isinstance(data, Sequence) and not isinstance(data, str | bytes)
    sources: list[Any] = list(cast("Sequence[Any]", data)) if several else [data]
    if not sources:
        raise InputError(
            "there is no log", where=where, allowed="one or more logs", fix="give t, q, qd, qdd and tau"
        )
    logs: list[JointLog] = []
    for number, source in enumerate(sources, 1):
        place = f"{where}, log {number}" if len(sources) > 1 else where
        logs.append(_read(source, robot, place))
    return logs


def _read(source: LogSource, robot: Robot, where: str) -> JointLog:
    if isinstance(source, str | PathLike):
        path = Path(fspath(cast("str | PathLike[str]", source)))
        where = str(path)
        columns = _columns_of_file(load_columns(path), robot, where)
    else:
        columns = _columns_of_object(source, robot, where)
    time = columns.pop("t")
    n = robot.n
    widths = {"q": robot.nq, "qd": n, "qdd": n, "tau": n}
    for name in ("q", "tau"):
        if name not in columns:
            raise UnknownNameError("column", f"{name}1", sorted(columns), where=where)
    for name, values in columns.items():
        if values.shape != (len(time), widths[name]):
            raise InputError(
                f"{name} has the shape {values.shape}",
                where=where,
                allowed=f"({len(time)}, {widths[name]}): a row for each time, a column for each joint of "
                f"'{robot.name}'",
                fix="give one value for each joint and time",
            )
    order = np.diff(time)
    if len(time) < 2 or not np.isfinite(time).all() or not (order > 0.0).all():
        raise InputError(
            f"{counted(len(time), 'time')}, the times are missing, not finite or not ascending",
            where=where,
            allowed="two or more finite, ascending times in s",
            fix="sort the log by time, and remove repeated rows",
        )
    return JointLog(
        time=time,
        q=columns["q"],
        qd=columns.get("qd"),
        qdd=columns.get("qdd"),
        tau=columns["tau"],
        where=where,
    )


def _columns_of_object(source: object, robot: Robot, where: str) -> dict[str, Array]:
    """The arrays t, q, qd, qdd, tau of a mapping, a data frame or an object such as the result of fdyn."""
    members: dict[str, Any]
    if isinstance(source, Mapping):
        members = {str(key): value for key, value in cast("Mapping[Any, Any]", source).items()}
    elif callable(getattr(source, "items", None)):
        members = {str(key): value for key, value in cast("Any", source).items()}
    else:
        names = ("t", "time", *_NAMES)
        members = {name: getattr(source, name) for name in names if getattr(source, name, None) is not None}
    columns = {name: _array(name, members[name], where) for name in _NAMES if name in members}
    key = next((name for name in ("t", "time") if name in members), "")
    if not key:
        raise InputError(
            f"the log has {shortened_list(sorted(map(repr, members))) or 'no columns'}",
            where=where,
            allowed="t, q, tau, and qd and qdd if they were measured; or the columns t, q1 …, tau1 …",
            fix="give a dictionary of arrays, a data frame, the result of fdyn, or the path of a file",
        )
    columns = {name: value[:, None] if value.ndim == 1 else value for name, value in columns.items()}
    if not columns:
        numbered = {name: members[name] for name in members if _COLUMN.fullmatch(name.strip())}
        arrays = {name: _array(name, value, where).ravel() for name, value in numbered.items()}
        columns = _numbered(arrays, {}, robot, where)
    columns["t"] = _array(key, members[key], where).ravel()
    return columns


def _array(name: str, value: object, where: str) -> Array:
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty(0)
    if not array.size:
        raise InputError(
            f"'{name}' has no numbers",
            where=where,
            allowed="an array of numbers, NaN where a value is missing",
            fix="remove the column, or give its numbers",
        )
    return array


def _columns_of_file(file: ColumnFile, robot: Robot, where: str) -> dict[str, Array]:
    key = time_column(file)
    values = {c.name: c.values for c in file.columns if c.values is not None}
    columns = _numbered(values, {c.name: c.unit for c in file.columns}, robot, where)
    columns["t"] = seconds_of(file.column(key, where), where)
    return columns


def _numbered(
    values: Mapping[str, Array], units: Mapping[str, str], robot: Robot, where: str
) -> dict[str, Array]:
    """The matrices of columns such as ``q1`` to ``q6``, in SI units.

    ``units``: the units of columns that their names do not contain.
    """
    found: dict[str, dict[int, tuple[str, str]]] = {}
    for name in values:
        if match := _COLUMN.fullmatch(name.strip()):
            numbers, number = found.setdefault(match[1], {}), int(match[2] or 1)
            if number in numbers:
                raise InputError(
                    f"the columns '{numbers[number][0]}' and '{name}' are both {match[1]}{number}",
                    where=where,
                    allowed="one column for each quantity and joint",
                    fix="remove or rename one of them",
                )
            numbers[number] = name, units.get(name) or (match[3] or "").strip()
    matrices: dict[str, Array] = {}
    for quantity, columns in found.items():
        first = min(columns)
        if first not in (0, 1) or sorted(columns) != list(range(first, first + len(columns))):
            numbers = shortened_list([str(k) for k in sorted(columns)])
            raise InputError(
                f"the columns of {quantity} have the numbers {numbers}",
                where=where,
                allowed=f"{quantity}1, {quantity}2, … without gaps",
                fix="rename the columns of the log",
            )
        kinds = _kinds(quantity, robot)
        matrices[quantity] = np.column_stack(
            [
                values[name] * _factor(quantity, unit, kinds[k] if k < len(kinds) else "", name, where)
                for k, (name, unit) in enumerate(columns[number] for number in sorted(columns))
            ]
        )
    return matrices


def _kinds(quantity: str, robot: Robot) -> list[str]:
    """The SI units of the entries of a quantity: rad or m of a motion, N m or N; empty for quaternions."""
    entries = [entry.unit for entry in (robot.positions if quantity == "q" else robot.speeds)]
    return [{"rad": "N m", "m": "N"}.get(unit, "") for unit in entries] if quantity == "tau" else entries


def _factor(quantity: str, unit: str, kind: str, column: str, where: str) -> float:
    """The factor from a unit, or none, to the SI unit ``kind``."""
    name, _, divisor = (part.strip() for part in unit.partition("/"))
    known, divisors = _UNITS.get(kind, {}), _PER[quantity]
    if not unit:
        return 1.0
    if name not in known or ("/" in unit and divisor not in divisors):
        per = f", divided by {divisors[0]}" if divisors else ""
        names = ", ".join(filter(None, known))
        raise InputError(
            f"a column has the unit '{unit}'",
            where=f"{where}, column '{column}'",
            allowed=f"units of {names}{per}, or no unit" if names else "no unit",
            fix="convert the column, or correct its header",
        )
    return known[name]


@dataclass(frozen=True, eq=False, kw_only=True)
class PreparedLogs:
    """Segments without gaps, the number of ``dropped`` samples, and the filters as ``notes``.

    ``steps``: the sample time of each segment, s; 0 where it is unknown.
    """

    segments: tuple[Segment, ...]
    steps: tuple[float, ...]
    dropped: int
    notes: tuple[str, ...]


def prepared(logs: Sequence[JointLog], robot: Robot, cutoff: float | None, *, whole: bool) -> PreparedLogs:
    """The logs with speeds and accelerations, without rows that have gaps.

    - ``cutoff``: the cut-off frequency of the filter of the motion, Hz. With ``None``, logs with speeds and
      accelerations are not filtered, and other logs are filtered with the advised cut-off frequency.
    - ``whole``: whether a missing torque is also the end of a segment, because the torques are filtered
      later. Otherwise rows without torque are removed from the segments.

    Raises InputError for logs that need a filter and have unequal time steps or quaternions.
    """
    segments: list[Segment] = []
    steps: list[float] = []
    notes: list[str] = []
    total = 0
    for log in logs:
        total += len(log.time)
        if cutoff is None and log.qd is not None and log.qdd is not None and not whole:
            used = _finite(log.q, log.qd, log.qdd, log.tau)
            segments.append(
                Segment(
                    time=log.time[used], q=log.q[used], qd=log.qd[used], qdd=log.qdd[used], tau=log.tau[used]
                )
            )
            steps.append(0.0)
            continue
        filtered = cutoff is not None or log.qd is None or log.qdd is None
        if filtered:
            _check_differentiable(log, robot)
        used = _finite(log.q, log.qd, log.qdd, log.tau if whole else None)
        at = cutoff
        for part in _runs(used, log.time, log.step):
            if filtered:
                at = cutoff if cutoff is not None else (at or advised_cutoff(log.q[part], log.step))
                segments.append(_with_derivatives(log, part, at))
            else:
                assert log.qd is not None and log.qdd is not None
                values = (log.time, log.q, log.qd, log.qdd, log.tau)
                segments.append(Segment(**dict(zip(("time", *_NAMES), (value[part] for value in values)))))
            steps.append(log.step)
        if filtered and at is not None:
            notes.append(f"motion filtered without phase shift, cut-off {at:.4g} Hz")
    complete: list[Segment] = []
    for segment in segments:
        rows = _finite(segment.tau)
        complete.append(segment if rows.all() else _rows(segment, rows))
    count = sum(len(segment.time) for segment in complete)
    return PreparedLogs(
        segments=tuple(complete),
        steps=tuple(steps),
        dropped=total - count,
        notes=tuple(dict.fromkeys(notes)),
    )


def _rows(segment: Segment, rows: NDArray[Any]) -> Segment:
    values = (segment.time, segment.q, segment.qd, segment.qdd, segment.tau)
    return Segment(**dict(zip(("time", *_NAMES), (value[rows] for value in values))))


def _finite(*arrays: Array | None) -> NDArray[np.bool_]:
    """The rows in which all values are finite."""
    rows = [np.isfinite(array).all(axis=1) for array in arrays if array is not None]
    return np.logical_and.reduce(rows)


def _runs(used: NDArray[np.bool_], time: Array, step: float) -> Iterator[slice]:
    """The ranges of consecutive usable samples, of at least ``_FEWEST``; a gap in time ends a range."""
    after_gap = np.append(True, np.diff(time) > 1.5 * step)
    begins = np.flatnonzero(used & (after_gap | ~np.append(False, used[:-1])))
    stops = np.append(np.flatnonzero(~used | after_gap), len(time))
    ends = stops[np.searchsorted(stops, begins, side="right")]
    for begin, end in zip(begins.tolist(), ends.tolist()):
        if end - begin >= _FEWEST:
            yield slice(begin, end)


def _check_differentiable(log: JointLog, robot: Robot) -> None:
    if robot.nq != robot.nv:
        raise InputError(
            f"the robot '{robot.name}' has a ball joint, and its positions are quaternions",
            where=log.where,
            allowed="q, qd and qdd without a filter for such robots",
            fix="compute speeds and accelerations with arm.difference, and filter them",
        )


def _with_derivatives(log: JointLog, part: slice, cutoff: float) -> Segment:
    """Filtered positions with their derivatives; measured speeds and accelerations have the same filter.

    The samples at both ends, about one period of the cut-off frequency, are omitted.
    """
    step = log.step
    q = low_passed(log.q[part], step, cutoff)
    qd = central_derivative(q, step) if log.qd is None else low_passed(log.qd[part], step, cutoff)
    qdd = central_derivative(qd, step) if log.qdd is None else low_passed(log.qdd[part], step, cutoff)
    margin = min(round(1.0 / (cutoff * step)), (len(q) - 1) // 4)
    inner = slice(margin, len(q) - margin)
    return Segment(
        time=log.time[part][inner], q=q[inner], qd=qd[inner], qdd=qdd[inner], tau=log.tau[part][inner]
    )
