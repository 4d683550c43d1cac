"""Inverse kinematics of robots with closed loops: the pose and the constraints are solved together."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.compiler.arguments import check_threads
from armblocks.dynamics.constrained import assembled_coordinates
from armblocks.dynamics.mechanism import RANK_TOLERANCE, RESIDUAL_TOLERANCE, mechanism
from armblocks.dynamics.pose_error import ErrorAxes, trace_pose_error
from armblocks.face.ikine_coordinates import dependent_excess, periodic_coordinates, random_coordinates
from armblocks.face.ikine_result import IkineResult
from armblocks.face.ikine_search import Options
from armblocks.face.ikine_targets import Target, check_distances, checked_poses, start_array
from armblocks.robot import Robot

Array = NDArray[np.float64]

MAX_STEPS = 100
"""Maximum number of iterations from one start."""
NEAREST_STEPS = 200
"""Maximum number of iterations to the nearest pose."""
LARGEST_STEP = 0.5
"""Largest change of a coordinate in one iteration, rad or m."""
STALLED = 1e-9
"""Relative decrease of the squared error below which an iteration ends; it decreases faster at solutions."""
FREE_RESTARTS = 10
"""Restarts without limits, to find whether the limits are the reason of a failure."""
FLAT = 1e-3
"""The nearest pose is found if the gradient, relative to error and Jacobian, is smaller than this."""
BORDER = 0.01
"""Smallest size of the Jacobian of permitted motions here, relative to the Jacobian of all joints."""
NEAR = 1e-6
"""Error (m, rad) below which the search has ended near a solution."""
SLACK = 1e-9
"""Distance beyond a limit, rad or m, that is attributed to rounding."""


class _Ranges(NamedTuple):
    """Lowest and highest coordinates (nq,)."""

    low: Array
    high: Array

    def excess(self, q: Array) -> Array:
        """The distances (nq,) of the coordinates beyond these limits."""
        return np.maximum(np.maximum(self.low - q, q - self.high) - SLACK, 0.0)


class ClosedLoopCall:
    """Inverse kinematics of a robot with closures, with checked options: ``call(T, q0, threads)``.

    The unknowns are all coordinates. The Levenberg-Marquardt method solves the pose error and the residuals
    of the closures together, with their exact Jacobians. The first start is ``q0``, or an assembled
    configuration; further starts are near it and, in turn, random.
    """

    def __init__(
        self, robot: Robot, near: Array | None, frame: str | None, axes: ErrorAxes, options: Options
    ) -> None:
        self._robot, self._near, self._options = robot, near, options
        self._where = f"ikine of robot '{robot.name}'"
        self._mechanism = mechanism(robot)
        self._error = trace_pose_error(robot, frame, axes).casadi_function()
        self._mask = np.array(options.mask)
        self._periodic = periodic_coordinates(robot)
        self._places = np.array([-1 if place is None else place for place in robot.position_of_speed])
        low, high = robot.qlim.T
        self._limits = _Ranges(low.copy(), high.copy())
        self._unlimited = _Ranges(np.full(robot.nq, -np.inf), np.full(robot.nq, np.inf))

    def __call__(self, T: Target, q0: ArrayLike | None, threads: int) -> IkineResult:
        """Search for configurations at the targets, see :meth:`armblocks.Arm.ikine`."""
        targets, batch = checked_poses(T, self._where)
        check_distances(targets.reshape(-1, 16), batch, self._where)
        check_threads(self._where, threads)
        count = targets.shape[0]
        given = None if q0 is None else start_array(q0, self._robot.nq, count if batch else None, self._where)
        first = assembled_coordinates(self._robot, self._near) if given is None else None
        searches = [
            _Search(self, target, first if given is None else given[k]) for k, target in enumerate(targets)
        ]
        results = [search.result() for search in searches]
        return _stacked(results, self.names) if batch else results[0]

    # ---- functions of one configuration ------------------------------------------------------------------
    @property
    def options(self) -> Options:
        """The options of the search."""
        return self._options

    @property
    def ranges(self) -> _Ranges:
        """The limits of the coordinates, infinite without limits."""
        return self._limits if self._options.limits else self._unlimited

    def error(self, q: Array, T: Array) -> tuple[Array, Array]:
        """The masked pose error (6,) and its Jacobian (6, n)."""
        e, J = self._error(q, T.ravel())
        jacobian = np.asarray(J.full()).reshape(6, self._robot.nv)
        return np.asarray(e.full()).ravel() * self._mask, jacobian * self._mask[:, np.newaxis]

    def is_assembled(self, q: Array) -> bool:
        """Whether the constraints are satisfied."""
        return self._mechanism.distance(q) <= RESIDUAL_TOLERANCE

    def is_solution(self, e: Array) -> bool:
        """Whether the pose error is within the tolerance."""
        limit = self._options.tolerance
        return float(np.linalg.norm(e[:3])) <= limit and float(np.linalg.norm(e[3:])) <= limit

    def descended(self, q: Array, T: Array, ranges: _Ranges) -> tuple[Array, int]:
        """The coordinates where the method ends if it starts at ``q``, and the number of iterations."""
        q = self._clipped(q, ranges)
        r, jacobian = self._equations(q, T)
        size, damping = float(r @ r), 1e-3
        for k in range(MAX_STEPS):
            free = ~self._held(q, jacobian.T @ r, ranges)
            U, s, Vt = np.linalg.svd(jacobian[:, free], full_matrices=False)
            largest = float(s.max(initial=0.0))
            if size == 0.0 or largest == 0.0 or damping > 1e12:
                return q, k
            factor = damping * largest * largest * min(1.0, size)
            gains = np.where(s > 1e-11 * largest, s / (s * s + factor), 0.0)
            step = np.zeros(self._robot.nv)
            step[free] = Vt.T @ (gains * (U.T @ r))
            step *= min(1.0, LARGEST_STEP / max(float(np.abs(step).max()), 1e-300))
            candidate = self._clipped(self._mechanism.moved(q, step), ranges)
            new, new_jacobian = self._equations(candidate, T)
            new_size = float(new @ new)
            if new_size < size:
                stalled = new_size > (1.0 - STALLED) * size
                q, r, jacobian, size, damping = (
                    candidate,
                    new,
                    new_jacobian,
                    new_size,
                    max(0.2 * damping, 1e-15),
                )
                if stalled:
                    return q, k + 1
            else:
                damping *= 8.0
        return q, MAX_STEPS

    def closed(self, q: Array) -> Array:
        """The configuration near ``q`` that satisfies the constraints, or the last iterate."""
        return self._mechanism.descended(q)

    def tangents(self, q: Array) -> Array:
        """A basis (n, k) of the speeds that the constraints permit."""
        _, s, Vt = np.linalg.svd(self._mechanism.jacobian(q))
        rank = int(np.sum(s > RANK_TOLERANCE * s.max(initial=0.0)))
        return Vt[rank:].T

    def moved(self, q: Array, step: Array) -> Array:
        """The coordinates after a motion."""
        return self._mechanism.moved(q, step)

    def starts(self, first: Array, limited: bool) -> Iterator[Array]:
        """The first start, then alternately starts near it and random starts."""
        random = np.random.default_rng(self._options.seed)
        yield first
        k = 0
        while True:
            k += 1
            near = random.normal(scale=min(0.1 * k, 1.0), size=self._robot.nv)
            yield self.moved(first, near)
            yield random_coordinates(self._robot, 1, random, limited=limited)[0]

    def turned(self, q: Array, first: Array, ranges: _Ranges) -> Array:
        """Angles without couplings, shifted by whole turns: into the limits, else nearest to ``first``."""
        bounded = np.isfinite(ranges.low) & np.isfinite(ranges.high)
        low, high = (np.where(bounded, bound, 0.0) for bound in ranges)
        middle = np.where(bounded, 0.5 * (low + high), first)
        nearest = q - 2.0 * math.pi * np.round((q - first) / (2.0 * math.pi)) * self._periodic
        central = q - 2.0 * math.pi * np.round((q - middle) / (2.0 * math.pi)) * self._periodic
        inside = (nearest >= ranges.low) & (nearest <= ranges.high)
        return np.where(inside, nearest, central)

    def inside(self, q: Array, ranges: _Ranges) -> bool:
        """Whether coordinates and dependent joints are within their limits."""
        if ranges is self._unlimited:
            return True
        return not ranges.excess(q).any() and not dependent_excess(self._robot, q[np.newaxis]).any()

    def limit_excess(self, q: Array) -> Array:
        """The distances of coordinates beyond the limits of their joints."""
        return self._limits.excess(q)

    @property
    def without_limits(self) -> _Ranges:
        """Infinite ranges."""
        return self._unlimited

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the coordinates."""
        return tuple(entry.name for entry in self._robot.positions)

    def _equations(self, q: Array, T: Array) -> tuple[Array, Array]:
        """Right-hand side (pose error, negative residuals of closures) of ``K dq = …``, and the matrix K."""
        e, J = self.error(q, T)
        residuals, A = self._mechanism.equations(q)
        return np.concatenate((e, -residuals)), np.vstack((J, A))

    def _held(self, q: Array, descent: Array, ranges: _Ranges) -> NDArray[np.bool_]:
        """The speeds (n,) of coordinates at a limit that the descent direction would exceed."""
        known = self._places >= 0
        place = np.where(known, self._places, 0)
        below = (q[place] <= ranges.low[place]) & (descent < 0.0)
        return known & (below | ((q[place] >= ranges.high[place]) & (descent > 0.0)))

    def _clipped(self, q: Array, ranges: _Ranges) -> Array:
        return np.clip(q, ranges.low, ranges.high)


class _Search:
    """The search for one target."""

    def __init__(self, call: ClosedLoopCall, T: Array, first: Array | None) -> None:
        assert first is not None
        self._call, self._T, self._first = call, T, first
        self._iterations = self._starts = 0
        self._best, self._cost = first, math.inf

    def result(self) -> IkineResult:
        """The solution, or the nearest pose and the reason."""
        call = self._call
        found = self._solution(call.ranges, call.options.restarts + 1)
        if found is not None:
            return self._made(found, "converged")
        excess = np.zeros_like(self._first)
        if call.options.limits:
            free = self._solution(call.without_limits, min(call.options.restarts, FREE_RESTARTS) + 1)
            if free is not None:
                excess = call.limit_excess(call.turned(free, self._first, call.ranges))
                return self._made(self._nearest()[0], "limits", excess)
        q, reason, direction = self._nearest()
        return self._made(q, reason, excess, direction)

    def _solution(self, ranges: _Ranges, attempts: int) -> Array | None:
        """A solution within ranges, or None; the best assembled configuration within the limits is kept."""
        call = self._call
        starts = call.starts(self._first, ranges is not call.without_limits)
        for _, start in zip(range(attempts), starts):
            q, steps = call.descended(start, self._T, ranges)
            self._iterations, self._starts = self._iterations + steps, self._starts + 1
            q = call.turned(call.closed(q), self._first, ranges)
            if not call.is_assembled(q) or not call.inside(q, ranges):
                continue
            e, _ = call.error(q, self._T)
            if call.is_solution(e):
                return q
            if float(e @ e) < self._cost and call.inside(q, call.ranges):
                self._best, self._cost = q, float(e @ e)
        return None

    def _nearest(self) -> tuple[Array, str, Array]:
        """The nearest pose from the best configuration by motions that the constraints permit."""
        call, ranges = self._call, self._call.ranges
        q = call.closed(self._best)
        damping, direction = 1e-2, np.full(6, np.nan)
        e, jacobian = call.error(q, self._T)
        for _ in range(NEAREST_STEPS):
            basis = call.tangents(q)
            K = jacobian @ basis
            size = float(np.linalg.norm(e))
            gradient = K.T @ e
            # At the border of the workspace, motions that the constraints permit do not move the tool.
            scale = max(float(np.linalg.norm(K)), BORDER * float(np.linalg.norm(jacobian)), 1e-300)
            if size > NEAR and float(np.linalg.norm(gradient)) <= FLAT * size * scale:
                return q, "out of reach", e / size
            values = np.linalg.svd(K, compute_uv=True)
            if size <= NEAR or damping > 1e8:
                smallest = values[1][-1] if len(values[1]) else 0.0
                if size <= NEAR and smallest <= FLAT * max(float(values[1].max(initial=0.0)), 1e-300):
                    return q, "singular", values[0][:, len(values[1]) - 1]
                break
            step = basis @ np.linalg.solve(K.T @ K + damping * scale**2 * np.eye(K.shape[1]), gradient)
            step *= min(1.0, LARGEST_STEP / max(float(np.abs(step).max(initial=0.0)), 1e-300))
            candidate = call.closed(call.moved(q, step))
            new, new_jacobian = call.error(candidate, self._T)
            if call.is_assembled(candidate) and call.inside(candidate, ranges) and new @ new < e @ e:
                q, e, jacobian, damping = candidate, new, new_jacobian, max(0.2 * damping, 1e-6)
                self._iterations += 1
            else:
                damping *= 8.0
        return q, "steps", direction

    def _made(
        self, q: Array, reason: str, excess: Array | None = None, direction: Array | None = None
    ) -> IkineResult:
        e, _ = self._call.error(q, self._T)
        return IkineResult.trusted(
            q=q,
            success=reason == "converged",
            reason=reason,
            position_error=float(np.linalg.norm(e[:3])),
            rotation_error=float(np.linalg.norm(e[3:])),
            iterations=self._iterations,
            restarts=max(self._starts - 1, 0),
            excess=np.zeros_like(q) if excess is None else excess,
            lost_direction=np.full(6, np.nan) if direction is None else direction,
            names=self._call.names,
        )


def _stacked(results: list[IkineResult], names: tuple[str, ...]) -> IkineResult:
    """The result of a batch of N targets, which may be empty."""
    N, nq = len(results), len(names)
    shapes = {"q": (N, nq), "excess": (N, nq), "lost_direction": (N, 6)}
    kinds = {"success": np.bool_, "iterations": np.int64, "restarts": np.int64, "reason": "<U12"}
    fields = ("position_error", "rotation_error", *shapes, *kinds)
    values: dict[str, object] = {
        name: np.array(
            [getattr(result, name) for result in results], dtype=kinds.get(name, np.float64)
        ).reshape(shapes.get(name, (N,)))
        for name in fields
    }
    return IkineResult.trusted(**values, names=names)
