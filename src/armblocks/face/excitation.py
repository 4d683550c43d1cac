"""Motions that excite all parameters of an arm, for their identification."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from os import PathLike

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks import interrupts
from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import InputError
from armblocks.face.arm import Arm
from armblocks.face.least_time import MotionLimits, check_joint_space, motion_limits
from armblocks.face.robots import given_arm
from armblocks.face.torque_model import TorqueModel
from armblocks.face.trajectory import JointTrajectory
from armblocks.face.trajectory_arguments import positive
from armblocks.robot import Robot

Array = NDArray[np.float64]

_SAMPLES_A_WAVE = 4
"""Minimum number of samples in a period of the last harmonic: fewer do not describe the motion."""
_SAMPLES = 200
"""Minimum number of samples of a motion in the search."""
_SEARCH_SAMPLES_A_WAVE = 20
"""Minimum number of samples in a period of the last harmonic, so that limits also hold between samples."""
_FILL = 0.9
"""Share of the ranges of positions, speeds and accelerations that a motion uses at most."""
_RANDOM = 0.2
"""Share of the evaluations that are independent random motions."""
_PENALTY = 20.0


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Excitation(metaclass=ArgumentErrors):
    """A periodic motion for identification, at rest at both ends.

    - ``trajectory``: the motion.
    - ``condition``: condition number of the regressor of the base parameters along the motion, with columns
      of length 1 and torques in units of their limits. Values near 10 are very good, values above 100 poor.
    - ``evaluations``: number of evaluated motions.
    - ``stopped``: whether Ctrl-C ended the search.
    """

    trajectory: JointTrajectory = field(repr=False)
    condition: float
    evaluations: int
    stopped: bool = False

    def __repr__(self) -> str:
        return f"<Excitation: condition number {self.condition:.4g} after {self.evaluations} evaluations>"


@interrupts.kept()
def excitation(
    arm: Arm | Robot | str | PathLike[str],
    duration: float = 10.0,
    *,
    harmonics: int = 5,
    speed: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    torque: ArrayLike | None = None,
    dt: float = 0.01,
    evaluations: int = 500,
    seed: int = 0,
    progress: Callable[[int, float], None] | None = None,
) -> Excitation:
    """Find a motion of ``duration`` s along which the parameters of an arm can be identified.

    Each joint moves by a Fourier series, at rest (speed and acceleration 0) at start and end. The motion is
    within the position limits of the robot. A random search minimises the condition number of the regressor
    of the base parameters, friction included. Collisions are not checked: view the motion with
    ``arm.animate`` first.

    - ``harmonics``: the number of terms of each series, 2 to 100. Their frequencies are the multiples of 1 /
      ``duration``.
    - ``speed`` (rad/s or m/s), ``acceleration`` (rad/s² or m/s²), ``torque`` (N m or N): limits of the
      motion, numbers or (n,). By default speeds and torques have the limits of the robot, and accelerations
      have none.
    - ``dt`` (s): about the time between samples, a fraction of the duration.
    - ``evaluations``: the number of evaluated motions.
    - ``seed``: the seed of the random search.
    - ``progress(evaluations, condition)`` is called at each improvement. Ctrl-C ends the search with the best
      motion so far.

    The motion has a limited spectrum, ``harmonics / duration`` Hz, so that it can be filtered exactly, and
    repeated, so that periods can be averaged. Source: Swevers et al., *Optimal robot excitation and
    identification*, IEEE Trans. Robotics and Automation 1997.

    Raises InputError for arguments out of range and if no motion within the torque limits is found,
    RobotError for robots with ball joints or closed loops.
    """
    arm = given_arm(arm, "excitation")
    where = "excitation"
    check_joint_space(arm, where)
    period, step = positive("duration", duration, "s", where), positive("dt", dt, "s", where)
    if not _is_integer(harmonics) or not 2 <= harmonics <= 100:
        raise InputError(
            f"harmonics = {harmonics!r}",
            where=where,
            allowed="an integer from 2 to 100",
            fix="use 5: a start and an end at rest need two or more terms",
        )
    if step * _SAMPLES_A_WAVE * harmonics > period * (1.0 + 1e-9):
        raise InputError(
            f"dt = {dt!r}",
            where=where,
            allowed=f"up to {period / (_SAMPLES_A_WAVE * harmonics):g} s: {_SAMPLES_A_WAVE} samples in a "
            "period of the last harmonic",
            fix="give a smaller dt, a longer duration, or fewer harmonics",
        )
    for name, value, least, usual in (("evaluations", evaluations, 1, 500), ("seed", seed, 0, 0)):
        if not _is_integer(value) or value < least:
            raise InputError(
                f"{name} = {value!r}",
                where=where,
                allowed=f"an integer, {least} or more",
                fix=f"use {usual}",
            )
    limits = motion_limits(arm, where, speed, acceleration, torque)
    search = _Search(arm, period, int(harmonics), limits)
    best, found, count, stopped = search.run(evaluations, np.random.default_rng(seed), progress)
    if search.excess(best) > 1.0:
        raise InputError(
            "no motion within the torque limits was found",
            where=where,
            allowed="torque limits with which the arm can hold its weight and accelerate",
            fix="raise the torque limits, lower the speed and acceleration limits, or try more evaluations",
        )
    times = np.linspace(0.0, period, max(round(period / step), 1) + 1, dtype=np.float64)
    q, qd, qdd = search.motion(best, times)
    qd[[0, -1]], qdd[[0, -1]] = 0.0, 0.0  # rounding errors
    path = JointTrajectory(t=times, q=q, qd=qd, qdd=qdd)
    return Excitation(trajectory=path, condition=found, evaluations=count, stopped=stopped)


def _is_integer(value: object) -> bool:
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool)


class _Search:
    """Fourier series of the joints, as vectors of shapes (n, 2 H - 1): factors of series, and a position."""

    def __init__(self, arm: Arm, period: float, harmonics: int, limits: MotionLimits) -> None:
        self._arm, self._limits = arm, limits
        robot = arm.robot
        self._model = TorqueModel(
            robot, [link.name for link in robot.tree_links], "asymmetric", rotor_inertia=True
        )
        base, _ = self._model.base()
        self._chosen: list[int] = base.base.tolist()
        self._frequencies = 2.0 * np.pi / period * np.arange(1, harmonics + 1)
        # Factors a with sum a = 0, and b with sum k b = 0: no speed and no acceleration at the start.
        ones, numbers = np.ones(harmonics), np.arange(1.0, harmonics + 1)
        self._cosines, self._sines = _complement(ones), _complement(numbers)
        self._times = np.linspace(
            0.0, period, max(_SAMPLES, _SEARCH_SAMPLES_A_WAVE * harmonics), endpoint=False
        )
        low, high = robot.qlim.T
        wide = np.array([1.0 if entry.unit == "m" else np.pi for entry in robot.positions])
        self._low = np.where(np.isfinite(low), low, np.where(np.isfinite(high), high - 2.0 * wide, -wide))
        self._high = np.where(np.isfinite(high), high, self._low + 2.0 * wide)
        self._scales = np.where(np.isfinite(limits.torque), limits.torque, 1.0)
        self.shape = (arm.n, 2 * (harmonics - 1) + 1)

    def run(
        self,
        evaluations: int,
        random: np.random.Generator,
        progress: Callable[[int, float], None] | None,
    ) -> tuple[Array, float, int, bool]:
        """The best vector, its condition number, the number of evaluations, whether Ctrl-C ended it."""
        best = random.normal(size=self.shape)
        lowest = self._objective(best)
        count, size = 1, 0.5
        try:
            while count < evaluations:
                is_global = count < _RANDOM * evaluations
                step = random.normal(size=self.shape)
                if is_global:
                    trial = step
                else:  # a part of the joints, with a step size that succeeds in a fifth of the trials
                    moved = random.random(self.shape[0]) < max(0.3, 1.5 / self.shape[0])
                    trial = best + size * step * moved[:, None]
                value = self._objective(trial)
                count += 1
                better = value < lowest
                if not is_global:
                    size = min(max(size * (1.3 if better else 0.94), 1e-3), 1.0)
                if better:
                    best, lowest = trial, value
                    if progress is not None:
                        progress(count, self._condition(best))
        except KeyboardInterrupt:
            interrupts.answered()
            return best, self._condition(best), count, True
        return best, self._condition(best), count, False

    def motion(self, vector: Array, times: Array) -> tuple[Array, Array, Array]:
        """q, qd, qdd (N, n) at times, scaled into the limits."""
        half = (self.shape[1] - 1) // 2
        a = vector[:, :half] @ self._cosines
        b = vector[:, half:-1] @ self._sines
        parts = self._series(a, b, self._times)
        low, high = parts[0].min(axis=0), parts[0].max(axis=0)
        factors = [
            (self._high - self._low) / np.maximum(high - low, 1e-12),
            self._limits.speed / np.maximum(np.abs(parts[1]).max(axis=0), 1e-12),
            self._limits.acceleration / np.maximum(np.abs(parts[2]).max(axis=0), 1e-12),
        ]
        scale = _FILL * np.minimum.reduce(factors)
        slack = self._high - self._low - scale * (high - low)
        share = 0.05 + 0.9 / (1.0 + np.exp(-vector[:, -1]))
        offset = self._low + share * slack - scale * low
        q, qd, qdd = (scale * part for part in self._series(a, b, times))
        return q + offset, qd, qdd

    def _series(self, a: Array, b: Array, times: Array) -> tuple[Array, Array, Array]:
        w = self._frequencies
        angles = np.outer(times, w)
        c, s = np.cos(angles), np.sin(angles)
        return s @ (a / w).T - c @ (b / w).T, c @ a.T + s @ b.T, c @ (b * w).T - s @ (a * w).T

    def excess(self, vector: Array) -> float:
        """The largest torque along the motion in units of its limit."""
        tau = self._arm.rne(*self.motion(vector, self._times))
        return float(np.max(np.abs(tau) / self._limits.torque, initial=0.0))

    def _condition(self, vector: Array) -> float:
        X, _ = self._model.columns(*self.motion(vector, self._times), self._chosen)
        W = np.concatenate(X.transpose(0, 2, 1) / self._scales[:, None, None])
        lengths = np.linalg.norm(W, axis=0)
        if not (lengths > 0.0).all():
            return math.inf
        s = np.linalg.svd(W / lengths, compute_uv=False)
        return float(s[0] / s[-1]) if s[-1] > 0.0 else math.inf

    def _objective(self, vector: Array) -> float:
        beyond = max(self.excess(vector) - 1.0, 0.0) if np.isfinite(self._limits.torque).any() else 0.0
        return math.log(self._condition(vector)) + _PENALTY * beyond


def _complement(direction: Array) -> Array:
    """An orthonormal basis (k - 1, k) of the vectors normal to a direction (k,)."""
    _, _, Vt = np.linalg.svd(direction[None])
    return Vt[1:]
