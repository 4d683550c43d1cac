"""Identification of an arm from logged motions and torques: inertial parameters, friction, rotor inertia."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from os import PathLike
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from armblocks import interrupts
from armblocks.errors import InputError, UnknownNameError, counted
from armblocks.estimation.base_columns import BaseColumns
from armblocks.estimation.consistency import consistent_fit
from armblocks.estimation.filtering import low_passed
from armblocks.estimation.linear import LinearFit, Rows, stacked, weighted_fit
from armblocks.estimation.robust import huber_weights, robust_deviations, sandwich_factors
from armblocks.face.arm import Arm
from armblocks.face.identification_result import IdentificationResult
from armblocks.face.joint_log import LogSource, PreparedLogs, Segment, prepared, read_logs
from armblocks.face.payload import Payload
from armblocks.face.robots import given_arm
from armblocks.face.torque_model import FRICTION, TorqueModel
from armblocks.robot import Robot

Array = NDArray[np.float64]

_PART = 20_000
"""Samples that are evaluated at once."""
_ROBUST_ROUNDS = 30
_KEPT = 1.12
"""Cut-off frequency before decimation, in units of half the new sample rate: neighbouring samples of white
noise are then independent. Torques and regressor have the same aliasing, so that the estimate has no bias."""

_COULOMB = ("asymmetric", "coulomb")
"""Kinds of friction with unknown Coulomb friction."""


@interrupts.kept()
def identify(
    arm: Arm | Robot | str | PathLike[str],
    data: LogSource,
    *,
    links: str | Sequence[str] | None = None,
    friction: Literal["asymmetric", "coulomb", "viscous", "none"] = "asymmetric",
    rotor_inertia: bool = True,
    payload: Payload | float | None = None,
    cutoff: float | None = None,
    decimate: int = 1,
    min_speed: float = 0.0,
    robust: bool = False,
) -> IdentificationResult:
    """Estimate the parameters of an arm from logged motions and torques.

    The estimates are *base parameters*: the combinations of the parameters that have an effect on the
    torques. Springs and gravity are taken from the description. The torque of each joint has its own unknown
    noise, from which the weights follow (iterated weighted least squares).

    - ``data``: a log, or a list of logs of several experiments. A log is a dictionary with ``t`` (N,) s,
      ``q`` (N, nq) rad or m, ``qd``, ``qdd`` (N, n) and ``tau`` (N, n) N m or N at the joints, or the result
      of ``arm.fdyn``. It may also be a data frame or a file (``.csv``, ``.npz``, ``.mat``, ``.parquet``) with
      the columns t, q1 …, qd1 …, qdd1 …, tau1 …. NaN are missing values; their rows are omitted. ``qd`` and
      ``qdd`` may be missing: they are computed from equally spaced positions by a low-pass filter without
      phase shift and central differences.
    - ``cutoff`` (Hz): the filter of the motion. By default complete logs are not filtered, and for other logs
      the cut-off follows from the spectrum.
    - ``decimate=k`` filters torques and regressor alike and keeps every k-th sample, so that the noise of the
      kept samples is independent and the standard errors are correct.
    - ``links``: only these links have unknown mass, centre and inertia (all links by default).
    - ``friction``: ``"asymmetric"`` estimates viscous friction B and Coulomb friction Tc+ and Tc- of each
      joint, ``"coulomb"`` B and a symmetric Tc, ``"viscous"`` B; ``"none"`` keeps the friction of the
      description.
    - ``rotor_inertia``: whether the inertia of the rotors is estimated.
    - ``payload``: a known body at the tool during the measurement, as a :class:`Payload` or its mass in kg.
    - ``min_speed`` (rad/s or m/s): slower samples of a joint have no effect, because static friction is not
      in the model. If Coulomb friction is estimated, samples at rest (speed 0) of a joint that also moves
      have no effect either.
    - ``robust``: Huber's weights, for torques with outliers.

    Raises InputError for unsuitable data, UnknownNameError for unknown links and columns, RobotError for
    robots with closed loops.
    """
    arm = given_arm(arm, "identify")
    where = "identify"
    robot = arm.robot
    chosen = _links(robot, links)
    if friction not in FRICTION:
        raise UnknownNameError("kind of friction", str(friction), FRICTION, where=where)
    _check_numbers(cutoff, decimate, min_speed, where)
    model = TorqueModel(robot, chosen, friction, rotor_inertia=rotor_inertia)
    if not model.names:
        raise InputError(
            "no parameter is selected for estimation",
            where=where,
            allowed="links, friction or rotor inertia",
            fix="name a link, or choose a kind of friction",
        )
    base, effect = model.base()
    logs = prepared(read_logs(data, robot, where), robot, cutoff, whole=decimate > 1)
    rows = _Rows(model, base, effect, arm, logs, payload, decimate, min_speed, friction in _COULOMB)
    rows.check_count(where)
    start = base.combined(model.prior)
    sensors, fit = _robust_fit(rows, start) if robust else _plain_fit(rows, start)
    A, y = stacked(sensors, len(start), fit.deviations)
    errors = np.sqrt(np.diag(fit.covariance))
    estimates = (np.where(fit.unknown, 0.0, array) for array in (fit.values, errors))
    constraints = model.constraints(base, *estimates)
    theta = consistent_fit(A @ base.expansion(len(model.names)), y, model.prior, constraints)
    notes = [*logs.notes]
    if decimate > 1:
        notes.append(f"torques and regressor filtered and decimated by {decimate}")
    if robust:
        notes.append("Huber's weights")
    return _result(rows, fit, sum(entry.count for entry in sensors), theta, notes)


def _result(
    rows: _Rows, fit: LinearFit, count: int, theta: Array, notes: Sequence[str]
) -> IdentificationResult:
    """The result of ``count`` torques; ``theta``: the physically consistent parameters."""
    model, base = rows.model, rows.base
    indices: list[int] = base.base.tolist()
    time, tau, fitted = rows.predictions(fit.values)
    unknown = fit.unknown | fit.unknown[:, None]
    return IdentificationResult(
        parameters=tuple(model.names[k] for k in indices),
        groupings=tuple(_grouping(model, base, row) for row in range(len(indices))),
        values=np.where(fit.unknown, np.nan, fit.values),
        prior=base.combined(model.prior),
        covariance=np.where(unknown, np.nan, fit.covariance),
        condition=fit.condition,
        noise=fit.deviations,
        degrees_of_freedom=count - fit.rank,
        robot=model.robot_with(theta),
        consistent_values=base.combined(theta),
        time=time,
        tau=tau,
        fitted=fitted,
        dropped=rows.logs.dropped,
        notes=tuple(notes),
    )


def _links(robot: Robot, links: str | Sequence[str] | None) -> tuple[str, ...]:
    """The links with unknown inertial parameters: by default all links with a joint."""
    if links is None:
        return tuple(link.name for link in robot.tree_links)
    names = (links,) if isinstance(links, str) else tuple(links)
    for name in names:
        robot.link(name)
    return tuple(dict.fromkeys(names))


def _check_numbers(cutoff: float | None, decimate: int, min_speed: float, where: str) -> None:
    if cutoff is not None and not 0.0 < cutoff < math.inf:
        raise InputError(
            f"cutoff = {cutoff!r}",
            where=where,
            allowed="a frequency in Hz above 0",
            fix="use about five times the highest frequency of the motion",
        )
    if isinstance(decimate, bool) or not (1 <= decimate < math.inf and int(decimate) == decimate):
        raise InputError(
            f"decimate = {decimate!r}",
            where=where,
            allowed="an integer, 1 or more",
            fix="give the number of samples of which one is kept",
        )
    if not 0.0 <= min_speed < math.inf:
        raise InputError(
            f"min_speed = {min_speed!r}",
            where=where,
            allowed="a speed in rad/s or m/s, 0 or more",
            fix="use the speed below which static friction acts",
        )


@dataclass(frozen=True, eq=False)
class _Rows:
    """The rows of the regression, evaluated in parts."""

    model: TorqueModel
    base: BaseColumns
    effect: NDArray[np.bool_]
    arm: Arm
    logs: PreparedLogs
    payload: Payload | float | None
    decimate: int
    min_speed: float
    has_unknown_coulomb: bool

    def check_count(self, where: str) -> None:
        """Raise InputError for fewer torques than parameters."""
        samples, torques = 0, 0
        for segment in self.logs.segments:
            speeds = np.abs(segment.qd[:: self.decimate])
            samples += len(speeds)
            torques += sum(int(np.sum(self._counts(speeds[:, j], j))) for j in range(speeds.shape[1]))
        needed = len(self.base.base)
        if torques <= needed:
            raise InputError(
                f"{counted(samples, 'complete sample')} for {counted(needed, 'base parameter')}",
                where=where,
                allowed="more torques than parameters",
                fix="give a longer log, or choose fewer links; rows with missing values and samples below "
                "min_speed do not count",
            )

    def _counts(self, qd: Array, j: int) -> NDArray[np.bool_]:
        """Which samples of joint ``j`` have an effect, by their speeds (N,)."""
        speed = np.abs(qd)
        if self._rest_is_unknown[j]:
            return (speed >= self.min_speed) & (speed > 0.0)
        return speed >= self.min_speed

    @cached_property
    def _rest_is_unknown(self) -> NDArray[np.bool_]:
        """The joints (n,) whose samples at rest have no effect: they also move, and have unknown friction.

        The Coulomb friction at rest is unknown, and a base parameter may contain it.
        """
        moves = np.any([np.any(segment.qd != 0.0, axis=0) for segment in self.logs.segments], axis=0)
        return moves & self.has_unknown_coulomb

    def parts(self) -> Sequence[tuple[Segment, Array, Array]]:
        """Samples with the regressor X (n, b, N) and the torques y (n, N) of unknown parameters; cached."""
        total = sum(len(segment.time) for segment in self.logs.segments)
        if "_parts" not in self.__dict__:
            evaluated = self._evaluated()
            if total > 5 * _PART:
                return evaluated
            object.__setattr__(self, "_parts", evaluated)
        return self.__dict__["_parts"]

    def _evaluated(self) -> list[tuple[Segment, Array, Array]]:
        found: list[tuple[Segment, Array, Array]] = []
        for segment, step in zip(self.logs.segments, self.logs.steps):
            size = len(segment.time) if self.decimate > 1 else _PART
            for begin in range(0, len(segment.time), size):
                part = _slice(segment, slice(begin, begin + size))
                X, rest = self.model.columns(part.q, part.qd, part.qdd, self.base.base.tolist())
                y, filtered = part.tau.T - rest - self._load(part), X
                if self.decimate > 1:
                    cut = _KEPT / (2.0 * self.decimate * step)
                    every = slice(None, None, self.decimate)
                    y = low_passed(np.ascontiguousarray(y.T), step, cut)[every].T
                    parts = [low_passed(np.ascontiguousarray(x.T), step, cut)[every].T for x in X]
                    filtered = np.stack(parts)
                    tau = low_passed(part.tau, step, cut)[every]
                    part = replace(_slice(part, every), tau=tau)
                found.append((part, filtered, y))
        return found

    def _load(self, part: Segment) -> Array | float:
        """The torque (n, N) of the known payload."""
        if self.payload is None:
            return 0.0
        motion = (part.q, part.qd, part.qdd)
        return (self.arm.rne(*motion, payload=self.payload) - self.arm.rne(*motion)).T

    def sensors(self, weights: Array | None = None) -> list[Rows]:
        """The compressed rows of each joint; ``weights`` (N, n) of the squared residuals."""
        sensors = [Rows.without_rows(np.flatnonzero(row)) for row in self.effect]
        begin = 0
        for part, X, y in self.parts():
            count = len(part.time)
            for j, rows in enumerate(sensors):
                counts = self._counts(part.qd[:, j], j)
                used = slice(None) if counts.all() else counts
                columns = X[j][rows.columns].T[used]
                values = y[j][used]
                if weights is not None:
                    root = np.sqrt(weights[begin : begin + count, j][used])
                    columns, values = columns * root[:, None], values * root
                rows.add(columns, values)
            begin += count
        return sensors

    def residuals(self, values: Array) -> Array:
        """Measured minus fitted torques (N, n)."""
        return np.concatenate([(y - np.einsum("b,jbN->jN", values, X)).T for _, X, y in self.parts()])

    def predictions(self, values: Array) -> tuple[Array, Array, Array]:
        """Times (N,), measured and fitted torques (N, n), decimated like the rows of the regression."""
        time = np.concatenate([part.time for part, _, _ in self.parts()])
        residuals = self.residuals(values)
        tau = np.concatenate([part.tau for part, _, _ in self.parts()])
        return time, tau, tau - residuals


def _slice(segment: Segment, rows: slice) -> Segment:
    return Segment(
        time=segment.time[rows],
        q=segment.q[rows],
        qd=segment.qd[rows],
        qdd=segment.qdd[rows],
        tau=segment.tau[rows],
    )


def _plain_fit(rows: _Rows, start: Array) -> tuple[list[Rows], LinearFit]:
    sensors = rows.sensors()
    return sensors, weighted_fit(sensors, start)


def _robust_fit(rows: _Rows, start: Array) -> tuple[list[Rows], LinearFit]:
    """Huber's estimate by iterated weights, with the covariance of the sandwich formula."""
    plain = rows.sensors()
    fit = weighted_fit(plain, start)
    sensors = plain
    for _ in range(_ROBUST_ROUNDS):
        residuals = rows.residuals(fit.values)
        deviations = robust_deviations(residuals)
        sensors = rows.sensors(huber_weights(residuals, deviations))
        new = weighted_fit(sensors, start, deviations)
        errors = np.sqrt(np.maximum(np.diag(new.covariance), 1e-300))
        converged = bool((np.abs(new.values - fit.values) <= 1e-3 * errors).all())
        fit = new
        if converged:
            break
    residuals = rows.residuals(fit.values)
    inliers, squares = sandwich_factors(residuals, fit.deviations)
    outer = weighted_fit(plain, start, fit.deviations / np.sqrt(np.maximum(inliers, 1e-3)))
    A, _ = stacked(plain, len(start), fit.deviations / np.sqrt(squares))
    half = A @ outer.covariance
    covariance = half.T @ half
    return sensors, LinearFit(
        values=fit.values,
        covariance=covariance,
        unknown=outer.unknown,
        deviations=fit.deviations,
        condition=outer.condition,
        rank=outer.rank,
    )


def _grouping(model: TorqueModel, base: BaseColumns, row: int) -> str:
    """A base parameter as a sum of parameters of links and motors."""
    terms = [model.names[int(base.base[row])]]
    for index, factor in zip(base.dependent.tolist(), base.K[row].tolist()):
        if factor == 0.0:
            continue
        size = abs(factor)
        number = "" if abs(size - 1.0) < 1e-9 else f"{size:.4g} "
        terms.append(f"{'-' if factor < 0.0 else '+'} {number}{model.names[index]}")
    return " ".join(terms)
