"""The class ``JointTrajectory``: samples of a joint motion, and the motion at any time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike, fspath
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.equations import Slot
from armblocks.errors import InputError, counted
from armblocks.face.trajectory_arguments import positive
from armblocks.files import write_atomically
from armblocks.simulation.csv_rows import csv_rows
from armblocks.simulation.notebook_view import STYLE, panels_html
from armblocks.trajectories import Motion, PiecewisePolynomial
from armblocks.trajectories.piecewise import extremes, hermite

if TYPE_CHECKING:
    from armblocks.blocks import Trajectory

Array = NDArray[np.float64]

_JUMP = 1e-9
"""Difference of the derivatives of two pieces, relative to the largest derivative, below which the derivative
counts as continuous."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class JointTrajectory(metaclass=ArgumentErrors):
    """Samples of a joint motion: ``t`` (N,) s, ``q`` (N, n) rad or m, derivatives ``qd`` and ``qdd`` (N, n).

    ``trajectory(t)`` is the motion at any time. A function such as ``jtraj`` gives the exact ``curve``.
    Without it, the motion between two samples is the quintic with the positions, speeds and accelerations of
    both samples.
    """

    t: Array
    q: Array
    qd: Array
    qdd: Array
    curve: PiecewisePolynomial | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        shapes = [np.shape(self.t), *(np.shape(part) for part in self)]
        n = shapes[1][-1] if len(shapes[1]) == 2 else 0
        expected = [shapes[0], *[(*shapes[0], n)] * 3]
        if len(shapes[0]) != 1 or not shapes[0][0] or not n or shapes != expected:
            raise InputError(
                f"t, q, qd, qdd have the shapes {', '.join(map(str, shapes))}",
                where="JointTrajectory",
                allowed="(N,) and three times (N, n)",
                fix="give one row of joint values for each time",
            )

    def __repr__(self) -> str:
        joints = counted(self.q.shape[1], "joint")
        samples = counted(len(self.t), "sample")
        return f"<JointTrajectory: {joints}, {samples} from {self.t[0]:g} s to {self.t[-1]:g} s>"

    def __len__(self) -> int:
        return len(self.t)

    def __iter__(self) -> Iterator[Array]:
        """``q``, ``qd``, ``qdd``, in the order of the toolbox: ``q, qd, qdd = jtraj(…)``."""
        return iter((self.q, self.qd, self.qdd))

    def __call__(self, t: ArrayLike) -> Motion[Array]:
        """The motion at ``t`` (s), a number or (N,): the tuple ``q, qd, qdd`` of arrays (n,) or (N, n).

        Before the start and after the end the joints are at rest. Where an acceleration jumps, the result has
        the value after the jump.
        """
        return self._curve.at(t)

    @property
    def duration(self) -> float:
        """Time from the start to the end, s."""
        return self._curve.duration

    @property
    def n(self) -> int:
        """Number of joints."""
        return self._curve.width

    @cached_property
    def _curve(self) -> PiecewisePolynomial:
        return self.curve or curve_through(np.column_stack([self.t, self.q, self.qd, self.qdd]))

    def sampled(self, dt: float | None = None, *, t: ArrayLike | None = None) -> JointTrajectory:
        """The same motion with samples every ``dt`` (s) and at the end, or at the times ``t`` (N,)."""
        if t is None:
            step = positive("dt", 0.01 if dt is None else dt, "s", "JointTrajectory.sampled")
            return sampled(self._curve, step)
        times = np.atleast_1d(np.asarray(t, dtype=np.float64))
        motion = self._curve.at(times)
        return JointTrajectory(t=times, q=motion.q, qd=motion.qd, qdd=motion.qdd, curve=self._curve)

    def stretched(self, duration: float) -> JointTrajectory:
        """The same path in another ``duration`` (s): speeds and accelerations scale with it."""
        new = positive("duration", duration, "s", "JointTrajectory.stretched")
        factor = new / self.duration if self.duration else 1.0
        curve = self._curve.stretched(factor)
        times = curve.times[0] + (self.t - self._curve.times[0]) * factor
        motion = curve.at(times)
        return JointTrajectory(t=times, q=motion.q, qd=motion.qd, qdd=motion.qdd, curve=curve)

    def peaks(self) -> Motion[Array]:
        """Smallest and largest values (2, n) of q, qd and qdd of each joint over all times, exact."""
        return Motion(*(np.array(extremes(self._curve, order)) for order in range(3)))

    def rows(self) -> Array:
        """The motion as a table (M, 1 + 3 n) of t, q, qd, qdd: the ends of quintic polynomials.

        Two rows with
        one time are a jump of a derivative. The table is the parameter of the block
        :class:`~armblocks.blocks.Trajectory`, and is exact for all trajectories up to the fifth degree.
        """
        starts, ends = self._curve.pieces()
        times = self._curve.times
        first, last = np.hstack(starts), np.hstack(ends)
        scale = np.maximum(np.abs(first).max(axis=0), np.abs(last).max(axis=0))
        rows = [np.append(times[0], first[0])]
        for k in range(1, len(first)):
            rows.append(np.append(times[k], last[k - 1]))
            if (np.abs(first[k] - last[k - 1]) > _JUMP * scale).any():
                rows.append(np.append(times[k], first[k]))
        rows.append(np.append(times[-1], last[-1]))
        return np.array(rows)

    def save(self, path: str | PathLike[str]) -> None:
        """Write the samples and :meth:`rows` as a CSV file with the columns t, q1 …, qd1 …, qdd1 ….

        :func:`~armblocks.load_trajectory` and the block :class:`~armblocks.blocks.Trajectory` read it.
        """
        knots = self.rows()
        gaps = np.abs(self.t[:, None] - knots[:, 0]).min(axis=1)
        more = np.column_stack([self.t, *self])[gaps > _JUMP * max(self.duration, 1e-3)]
        rows = np.vstack([knots, more])
        rows = rows[np.argsort(rows[:, 0], kind="stable")]
        names = [f"{name}{k + 1}" for name in ("q", "qd", "qdd") for k in range(self.n)]
        text = f"{','.join(['t', *names])}\n{csv_rows(list(rows.T))}"
        write_atomically(fspath(path), text.encode())

    def block(self) -> Trajectory:
        """The block that plays this motion in a diagram: outputs q, qd, qdd."""
        from armblocks.blocks import Trajectory

        return Trajectory(data=self.rows())

    def _repr_html_(self) -> str:
        """The notebook view: q, qd and qdd over time, in their units."""
        head = f"{counted(self.q.shape[1], 'joint')}, {counted(len(self), 'sample')} to {self.t[-1]:g} s"
        shape = self.q.shape[1:]
        rows = [(Slot(name, shape), values) for name, values in zip(("q", "qd", "qdd"), self)]
        return (
            f'<div class="ab-result"><style>{STYLE}</style><h3>Joint trajectory</h3><p>{head}</p>'
            f"{panels_html(self.t, rows)}</div>"
        )


def sampled(curve: PiecewisePolynomial, dt: float) -> JointTrajectory:
    """A trajectory with samples every ``dt`` and at the end."""
    count = max(int(np.ceil(curve.duration / dt - 1e-9)), 1)
    times = curve.times[0] + np.append(dt * np.arange(count), curve.duration)
    motion = curve.at(times)
    return JointTrajectory(t=times, q=motion.q, qd=motion.qd, qdd=motion.qdd, curve=curve)


def curve_through(rows: Array) -> PiecewisePolynomial:
    """Quintic pieces through rows (M, 1 + 3 n) of t, q, qd, qdd; two rows with one time are a jump."""
    times, (q, qd, qdd) = rows[:, 0], np.split(rows[:, 1:], 3, axis=1)
    invalid = not np.isfinite(rows).all() or (np.diff(times) < 0.0).any()
    # The first time of a jump may be the next smaller number, as in a TimeTable.
    begins = np.flatnonzero(np.diff(times) > 4.0 * np.spacing(np.abs(times[1:])))
    if invalid or (not begins.size and len(times) > 1):
        raise InputError(
            "the times of the samples do not ascend, or a sample is not finite",
            where="JointTrajectory",
            allowed="finite samples at ascending times; a time twice for a jump of an acceleration",
            fix="sort the samples by time and remove those without values",
        )
    end = np.array([q[-1], qd[-1], qdd[-1]])
    if len(times) == 1:
        return PiecewisePolynomial(times=times[[0, 0]], coefficients=q[None], end=end)
    ends = begins + 1
    knots = np.append(times[begins], times[-1])
    knots[1:] = times[ends]
    return hermite(knots, (q[begins], qd[begins], qdd[begins]), (q[ends], qd[ends], qdd[ends]), end=end)
