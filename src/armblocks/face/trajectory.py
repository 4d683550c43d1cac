"""Joint-space trajectories as arrays: the toolbox's ``jtraj``."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.equations import Slot
from armblocks.errors import InputError, counted
from armblocks.robot.plausibility import warn_of_degrees
from armblocks.simulation.notebook_view import STYLE, panels_html
from armblocks.trajectories import Quintic


@dataclass(frozen=True, eq=False, kw_only=True)
class JointTrajectory(metaclass=ArgumentErrors):
    """Samples of a joint motion: ``t`` (N,) s, ``q`` (N, n) rad or m, ``qd`` and ``qdd`` (N, n) its rates."""

    t: NDArray[np.float64]
    q: NDArray[np.float64]
    qd: NDArray[np.float64]
    qdd: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.t)

    def __iter__(self) -> Iterator[NDArray[np.float64]]:
        """``q``, ``qd``, ``qdd``, in the order of the toolbox: ``q, qd, qdd = jtraj(…)``."""
        return iter((self.q, self.qd, self.qdd))

    def _repr_html_(self) -> str:
        """The notebook view: q, qd and qdd over time, in their units."""
        head = f"{counted(self.q.shape[1], 'joint')}, {counted(len(self), 'sample')} to {self.t[-1]:g} s"
        shape = self.q.shape[1:]
        rows = [(Slot(name, shape), values) for name, values in zip(("q", "qd", "qdd"), self)]
        return (
            f'<div class="ab-result"><style>{STYLE}</style><h3>Joint trajectory</h3><p>{head}</p>'
            f"{panels_html(self.t, rows)}</div>"
        )


def jtraj(
    q0: ArrayLike,
    qf: ArrayLike,
    t: ArrayLike | int,
    qd0: ArrayLike | None = None,
    qd1: ArrayLike | None = None,
) -> JointTrajectory:
    """Quintic motion from ``q0`` to ``qf`` (n,), zero acceleration at both ends.

    ``t`` is either the times (N,) in s, from 0 to the end of the motion, or a number of samples N: then the
    time is normalised as in the toolbox, ``linspace(0, 1, N)``, and rates are per unit of this time. ``qd0``,
    ``qd1`` (n,): speeds at the ends, zero by default. Same polynomial as the toolbox's ``jtraj``. ``q, qd,
    qdd = jtraj(…)`` unpacks the motion. Warns of angles that look like degrees.
    """
    start, goal = _joint_vector("q0", q0), _joint_vector("qf", qf)
    first = None if qd0 is None else _joint_vector("qd0", qd0)
    last = None if qd1 is None else _joint_vector("qd1", qd1)
    for name, vector in (("qf", goal), ("qd0", first), ("qd1", last)):
        if vector is not None and vector.shape != start.shape:
            raise InputError(
                f"{name} has {counted(vector.size, 'joint')}",
                where="jtraj",
                allowed=f"{start.size}, as q0",
                fix=f"give {name} as many numbers as q0",
            )
    for name, angles in (("q0", start), ("qf", goal)):
        warn_of_degrees(angles, f"jtraj, {name}")
    times = _times(t)
    motion = Quintic(q0=start, qf=goal, tmax=times[-1:], qd0=first, qd1=last).at(times)
    return JointTrajectory(t=times, q=motion.q, qd=motion.qd, qdd=motion.qdd)


def _joint_vector(name: str, value: ArrayLike) -> NDArray[np.float64]:
    try:
        vector = np.atleast_1d(np.asarray(value, dtype=np.float64))
    except (TypeError, ValueError):
        vector = np.empty((0, 0))
    if vector.ndim != 1 or not np.isfinite(vector).all():
        raise InputError(
            f"{name} = {value!r}",
            where="jtraj",
            allowed="a vector of finite joint values, one per joint",
            fix="give one finite number for each joint",
        )
    return vector


def _times(t: ArrayLike | int) -> NDArray[np.float64]:
    if isinstance(t, int):
        if t < 2:
            raise InputError(
                f"t = {counted(t, 'sample')}",
                where="jtraj",
                allowed="2 or more, or a vector of times",
                fix="use np.linspace(0, T, N) for times in s",
            )
        return np.linspace(0.0, 1.0, t)
    times = np.asarray(t, dtype=np.float64)
    is_ascending = times.ndim == 1 and times.size >= 2 and bool((np.diff(times) > 0).all())
    if not (is_ascending and np.isfinite(times).all() and times[0] == 0.0):
        raise InputError(
            f"t of shape {times.shape}",
            where="jtraj",
            allowed="finite ascending times that start at 0, or a number of samples",
            fix="use np.linspace(0, T, N)",
        )
    return times
