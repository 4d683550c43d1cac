"""The reasons why targets of inverse kinematics have no solution, by further searches."""

from __future__ import annotations

import math
from typing import cast

import numpy as np
from numpy.typing import NDArray

from armblocks.face.ikine_coordinates import dependent_excess, periodic_coordinates
from armblocks.face.ikine_result import IkineResult
from armblocks.face.ikine_search import ArmSearch, Options, SearchArrays
from armblocks.inverse_kinematics.layout import Count, Number, Setting, Status
from armblocks.inverse_kinematics.solver import Solutions

Array = NDArray[np.float64]

POLISH_STEPS = 400
"""Maximum number of iterations to find the nearest pose of a target without a solution."""
CURVATURES = (0.3, 1.0, 4.0)
"""Dampings, relative to the weighted error, of the iteration to the nearest pose. The method neglects the
second derivatives of the pose, which are about 1 in units of the size of the arm. Their effect is large where
the error is large.
"""
FLAT = 1e-3
"""The nearest pose is found if the gradient, relative to error and Jacobian, is smaller than this."""
NEAR = 1e-6
"""Weighted error below which the search has ended near a solution."""
SINGULAR = 1e-3
"""Ratio of the smallest to the largest singular value of the weighted Jacobian where it is singular."""
DEPENDENT_RETRIES = 40
"""Number of starts from which solutions within the limits of dependent joints are searched."""


class Reasons:
    """The reasons of failures: further searches of the targets without a solution."""

    def __init__(
        self, arm: ArmSearch, targets: Array, found: Solutions, options: Options, prepared: SearchArrays
    ) -> None:
        self.arm, self.targets, self.found = arm, targets, found
        self.options, self.prepared = options, prepared
        self.success = found.counts[:, Count.STATUS] == Status.CONVERGED
        self.reason = np.where(self.success, "converged", "steps").astype("<U12")
        self.excess = np.zeros_like(found.q)
        self.lost_direction = np.full((targets.shape[0], 6), np.nan)

    def result(self) -> IkineResult:
        """The result of the batch."""
        if self.options.limits:
            self._move_dependent_joints()
        if not self.success.all():
            self._search_beyond_limits()
            self._find_nearest()
        counts, numbers = self.found.counts, self.found.numbers
        return IkineResult(
            q=self.found.q,
            success=self.success,
            reason=self.reason,
            position_error=numbers[:, Number.POSITION_ERROR].copy(),
            rotation_error=numbers[:, Number.ROTATION_ERROR].copy(),
            iterations=counts[:, Count.STEPS].copy(),
            restarts=np.maximum(counts[:, Count.ATTEMPTS] - 1, 0),
            excess=self.excess,
            lost_direction=self.lost_direction,
            names=self.arm.names,
        )

    def _open(self) -> NDArray[np.intp]:
        """The indices of the targets whose reason is not known yet."""
        return np.flatnonzero(self.reason == "steps")

    def _move_dependent_joints(self) -> None:
        """Search for other solutions where a joint that couplings determine is beyond its limits."""
        robot = self.arm.robot
        wrong = self.success & (dependent_excess(robot, self.found.q) > 0.0).any(axis=1)
        rows = np.flatnonzero(wrong)
        best = dependent_excess(robot, self.found.q)
        for k in range(DEPENDENT_RETRIES):
            if not rows.size:
                return
            starts = np.ascontiguousarray(np.broadcast_to(self.prepared.table.q[k], (rows.size, robot.nq)))
            tried = self._once(rows, starts, self.prepared)
            inside = (dependent_excess(robot, tried.q) <= 0.0).all(axis=1)
            inside &= tried.counts[:, Count.STATUS] == Status.CONVERGED
            self._accept(rows[inside], tried, inside)
            rows = rows[~inside]
        self.success[rows] = False
        self.reason[rows] = "limits"
        for row in rows:
            for joint, value in zip(robot.coupled_joints, best[row]):
                for index in joint.factors:
                    self.excess[row, self._position(index)] = max(
                        value, self.excess[row, self._position(index)]
                    )

    def _position(self, speed: int) -> int:
        return cast("int", self.arm.robot.position_of_speed[speed])

    def _once(
        self, rows: NDArray[np.intp], starts: Array, prepared: SearchArrays, damping: float = 0.0
    ) -> Solutions:
        """One attempt for each of the targets from a given start; with ``damping`` to the nearest pose."""
        settings = prepared.settings.copy()
        settings[Setting.ATTEMPTS] = 1
        if damping:
            settings[Setting.FIRST_STEPS] = settings[Setting.SLOW_STEPS] = POLISH_STEPS
            settings[Setting.FLAT], settings[Setting.ROOT_DAMPING] = (0.01 * FLAT) ** 2, damping
        targets = np.ascontiguousarray(self.targets[rows])
        return self.arm.search.solve(targets, starts, settings, prepared.bounds, prepared.table)

    def _accept(self, rows: NDArray[np.intp], new: Solutions, which: NDArray[np.bool_]) -> None:
        """Replace the results of ``rows`` by the results of another search, and add its counts."""
        self.found.q[rows] = new.q[which]
        self.found.numbers[rows] = new.numbers[which]
        self.found.counts[rows, Count.STEPS] += new.counts[which, Count.STEPS]
        self.found.counts[rows, Count.ATTEMPTS] += new.counts[which, Count.ATTEMPTS]

    def _search_beyond_limits(self) -> None:
        """Find the targets that have solutions only beyond the limits."""
        rows, arm = self._open(), self.arm
        if not self.options.limits or not rows.size or not np.isfinite(arm.robot.qlim).any():
            return
        prepared = self._free()
        starts = np.ascontiguousarray(self.found.q[rows])
        free = arm.run(np.ascontiguousarray(self.targets[rows]), starts, prepared)
        reached = free.counts[:, Count.STATUS] == Status.CONVERGED
        excess = self._excess(free.q[reached])
        inside = (excess <= 0.0).all(axis=1)
        turned = free.q[reached] - 2.0 * math.pi * self._turns(free.q[reached])
        found = rows[reached]
        self.excess[found] = excess
        self.reason[found] = np.where(inside, "converged", "limits")
        self.success[found] = inside
        self.found.q[found[inside]] = turned[inside]
        self.found.numbers[found[inside]] = free.numbers[reached][inside]

    def _free(self) -> SearchArrays:
        options = self.options._replace(limits=False)
        return self.arm.prepared(options)

    def _turns(self, q: Array) -> Array:
        """The full turns that bring periodic coordinates nearest to the middle of their limits."""
        lowest, highest = self.prepared.lowest, self.prepared.highest
        bounded = np.isfinite(lowest) & np.isfinite(highest) & periodic_coordinates(self.arm.robot)
        middle = np.where(bounded, 0.5 * (np.where(bounded, lowest, 0) + np.where(bounded, highest, 0)), q)
        return np.round((q - middle) / (2.0 * math.pi))

    def _excess(self, q: Array) -> Array:
        """The excess of coordinates over their limits, after the best shift by full turns."""
        q = q - 2.0 * math.pi * self._turns(q)
        return np.maximum(np.maximum(self.prepared.lowest - q, q - self.prepared.highest), 0.0)

    def _find_nearest(self) -> None:
        """Find the nearest poses of the remaining targets, and the reasons why these are not solutions."""
        for damping in CURVATURES:
            # Targets beyond limits already have a reason, but the result also needs their nearest pose within
            # the limits.
            rows = np.flatnonzero(~self.success) if damping == CURVATURES[0] else self._open()
            if not rows.size:
                return
            starts = np.ascontiguousarray(np.nan_to_num(self.found.q[rows]))
            nearest = self._once(rows, starts, self.prepared, damping)
            better = nearest.numbers[:, Number.COST] <= self.found.numbers[rows, Number.COST]
            self._accept(rows[better], nearest, better)
            solved = rows[nearest.counts[:, Count.STATUS] == Status.CONVERGED]
            solved = solved[self.reason[solved] == "steps"]
            self.reason[solved], self.success[solved] = "converged", True
            rows = self._open()
            if rows.size:
                self._classify(rows)

    def _classify(self, rows: NDArray[np.intp]) -> None:
        """Out of reach where the gradient vanishes; singular near a solution with a singular Jacobian."""
        weights, q = self.prepared.weights, self.found.q[rows]
        error, jacobian = self.arm.search.error(q, self.targets[rows].reshape(-1, 4, 4))
        e, weighted = error * weights, jacobian * weights[:, np.newaxis]
        size = np.linalg.norm(e, axis=1)
        gradient = np.einsum("nij,ni->nj", weighted, e)
        for k, place in enumerate(self.arm.robot.position_of_speed):
            if place is not None:
                held = (q[:, place] <= self.prepared.lowest[place]) & (gradient[:, k] < 0.0)
                held |= (q[:, place] >= self.prepared.highest[place]) & (gradient[:, k] > 0.0)
                weighted[held, :, k], gradient[held, k] = 0.0, 0.0
        norm = np.linalg.norm(weighted, axis=(1, 2))
        flat = np.linalg.norm(gradient, axis=1) <= FLAT * size * norm
        active = weights > 0.0
        U, values, _ = np.linalg.svd(weighted[:, active])
        for k, row in enumerate(rows):
            direction = np.zeros(6)
            if size[k] > NEAR and flat[k]:
                self.reason[row] = "out of reach"
                direction = error[k] * active
            elif size[k] <= NEAR and values[k, -1] <= SINGULAR * values[k, 0]:
                self.reason[row] = "singular"
                direction[active] = U[k][:, values.shape[1] - 1]
            length = float(np.linalg.norm(direction))
            self.lost_direction[row] = direction / length if length else np.nan
