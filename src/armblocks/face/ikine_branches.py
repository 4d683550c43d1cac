"""All configurations of an arm for a pose, in closed form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.compiler import Kernel
from armblocks.compiler.arguments import check_threads
from armblocks.errors import InputError
from armblocks.face.ikine_coordinates import dependent_excess
from armblocks.face.ikine_result import IkineResult
from armblocks.face.ikine_targets import Target, checked_poses, start_array
from armblocks.robot import Robot

if TYPE_CHECKING:
    from armblocks.dynamics.closed_form.axes import Chain
    from armblocks.dynamics.closed_form.branches import Solver

Array = NDArray[np.float64]

SINGULAR = 1e-6
"""Measure of a choice below which both of its solutions coincide."""
CORRECTED = 1e-3
"""Largest error of a branch that iteration corrects, rad, or relative to the size of the arm."""
SLACK = 1e-9
"""Distance beyond a limit, rad or m, that is attributed to rounding."""
WRIST = "a spherical wrist after two parallel axes"
LETTERS = "lr ud nf"


@dataclass(frozen=True, kw_only=True, eq=False)
class IkineBranches(metaclass=ArgumentErrors):
    """All configurations for one pose, or for N poses (then every array has a leading axis of N).

    - ``q`` (B, nq) rad or m: the branches. Rows of branches that do not exist, or that exceed requested
      limits, are NaN.
    - ``exists`` (B,): whether a branch is a solution.
    - ``beyond_limits`` (B,): whether a branch has the pose, but exceeds limits. With ``limits=True``, such
      branches are not solutions.
    - ``position_error`` m, ``rotation_error`` rad (B,): of the pose at ``q``, computed by forward kinematics.
    - ``singular`` (B, choices): whether both solutions of a choice coincide; the arm is then singular.
    - ``geometry``: the property of the arm that the solution uses.
    - ``choices``: the choices between two solutions. The number of branches is 2 to the power of their
      number.
    """

    q: Array
    exists: NDArray[np.bool_]
    beyond_limits: NDArray[np.bool_]
    position_error: Array
    rotation_error: Array
    singular: NDArray[np.bool_]
    geometry: str
    choices: tuple[str, ...]

    def __reduce__(self) -> tuple[object, ...]:
        return partial(IkineBranches, **self.__dict__), ()

    @property
    def count(self) -> NDArray[np.intp]:
        """The number of solutions: a number, or (N,)."""
        return np.asarray(self.exists.sum(axis=-1))

    @property
    def solutions(self) -> Array:
        """The solutions of one pose, (K, nq). Raises InputError for the result of a batch."""
        if self.q.ndim != 2:
            raise InputError(
                "the poses of a batch have different numbers of solutions",
                where="IkineBranches.solutions",
                allowed="the result of one pose",
                fix="select solutions with result.q[k][result.exists[k]]",
            )
        return self.q[self.exists]

    def nearest(self, q0: ArrayLike) -> Array:
        """The solution (nq,) or (N, nq) nearest to ``q0`` (nq,) or (N, nq); NaN without a solution.

        The distance is the largest difference of a coordinate.
        """
        count = None if self.q.ndim == 2 else self.q.shape[0]
        start = start_array(q0, self.q.shape[-1], count, "IkineBranches.nearest")
        assert start is not None
        reference = start[0] if count is None else start[:, np.newaxis]
        apart = np.abs(self.q - reference).max(axis=-1)
        best = np.argmin(np.where(self.exists, apart, np.inf), axis=-1)
        chosen = np.take_along_axis(self.q, np.asarray(best)[..., np.newaxis, np.newaxis], axis=-2)[..., 0, :]
        found = np.asarray(self.exists.any(axis=-1))
        return np.where(found[..., np.newaxis], chosen, np.nan)

    def __str__(self) -> str:
        """The number of solutions, the geometry and singular choices; for one pose also the solutions."""
        if self.q.ndim == 3:
            total = int(self.exists.sum())
            return (
                f"{self.q.shape[0]} poses, {total} solutions in {self.q.shape[1]} branches: {self.geometry}"
            )
        lines = [f"{int(self.exists.sum())} solutions in {self.q.shape[0]} branches: {self.geometry}"]
        names = [name for k, name in enumerate(self.choices) if self.singular[self.exists, k].any()]
        lines += [f"singular: {', '.join(names)}"] if names else []
        lines += [f"{int(self.beyond_limits.sum())} beyond limits"] if self.beyond_limits.any() else []
        lines += ["  " + "  ".join(f"{value:9.4f}" for value in row) for row in self.solutions]
        return "\n".join(lines)


@dataclass(frozen=True, kw_only=True, eq=False)
class ClosedForm:
    """The closed-form solution of an arm: its kernel, geometry, and the limits of the coordinates.

    ``iterate``: iterative inverse kinematics without limits, from starts or from the table. It is used at
    singular poses, and for arms whose axes are parallel or intersect only approximately.
    """

    robot: Robot
    kernel: Kernel
    chain: Chain
    solver: Solver
    limits: tuple[Array, Array]
    where: str
    iterate: Callable[[Array, Array | None], IkineResult]

    @classmethod
    def of(
        cls,
        robot: Robot,
        kernel: Kernel,
        iterate: Callable[[Array, Array | None], IkineResult],
    ) -> ClosedForm:
        """The solution with the kernel of ``trace_branches``. Raises RobotError for other arms."""
        from armblocks.dynamics.closed_form.trace import closed_solver

        chain, solver = closed_solver(robot)
        low, high = robot.qlim.T
        return cls(
            robot=robot,
            kernel=kernel,
            chain=chain,
            solver=solver,
            limits=(low - SLACK, high + SLACK),
            where=f"ikine_all of robot '{robot.name}'",
            iterate=iterate,
        )

    def branches(self, T: Target, limits: object, tolerance: float, threads: int) -> IkineBranches:
        """The branches of an arm, see :meth:`armblocks.Arm.ikine_all`."""
        robot, where = self.robot, self.where
        targets, batch = checked_poses(T, where)
        q, errors, measures = self.kernel.entry(targets, threads=check_threads(where, threads))
        has_pose = (errors[..., 0] <= tolerance) & (errors[..., 1] <= tolerance)
        singular = measures < SINGULAR
        # At a pose where a choice has infinitely many solutions, the selected solution may miss the position.
        rest = np.flatnonzero(~has_pose.any(axis=1))
        if rest.size and (rest := rest[singular[rest].any(axis=(1, 2))]).size:
            found = self.iterate(targets[rest], None)
            q[rest, 0], has_pose[rest, 0] = found.q, found.success
            errors[rest, 0, 0], errors[rest, 0, 1] = found.position_error, found.rotation_error
        self._correct(targets, q, errors, has_pose)
        low, high = self.limits
        inside: NDArray[np.bool_] = has_pose.copy()
        for k, (lowest, highest) in enumerate(zip(low, high)):
            inside &= (q[..., k] >= lowest) & (q[..., k] <= highest)
        if robot.couplings:
            excess = dependent_excess(robot, q.reshape(-1, robot.nq))
            inside &= (excess <= 0.0).all(axis=-1).reshape(inside.shape)
        exists = inside if limits else has_pose
        q[~exists] = errors[~exists] = np.nan
        arrays = (q, exists, has_pose & ~inside, errors[..., 0], errors[..., 1], singular)
        values = arrays if batch else tuple(array[0] for array in arrays)
        return IkineBranches(
            q=values[0],
            exists=np.asarray(values[1]),
            beyond_limits=np.asarray(values[2]),
            position_error=values[3],
            rotation_error=values[4],
            singular=np.asarray(values[5]),
            geometry=self.solver.geometry,
            choices=self.solver.choices,
        )

    def _correct(self, targets: Array, q: Array, errors: Array, has_pose: NDArray[np.bool_]) -> None:
        """Correct approximate branches by iteration; discard branches that converge to another solution."""
        close = (errors[..., 0] <= CORRECTED * self.chain.size) & (errors[..., 1] <= CORRECTED)
        rows, columns = np.nonzero(close & ~has_pose)
        if rows.size:
            found = self.iterate(targets[rows], q[rows, columns])
            near = np.abs(found.q - q[rows, columns]).max(axis=1) <= 100.0 * CORRECTED
            success = np.asarray(found.success) & near
            rows, columns = rows[success], columns[success]
            q[rows, columns], has_pose[rows, columns] = found.q[success], True
            errors[rows, columns, 0] = np.asarray(found.position_error)[success]
            errors[rows, columns, 1] = np.asarray(found.rotation_error)[success]


def configuration_of(form: ClosedForm, letters: object) -> int:
    """The index of the branch with the toolbox's letters. Raises InputError."""
    where = f"ikine6s of robot '{form.robot.name}'"
    chain, solver = form.chain, form.solver
    if solver.geometry != WRIST:
        raise InputError(
            f"the configuration letters do not describe this arm, which has {solver.geometry}",
            where=where,
            allowed=f"arms with {WRIST}",
            fix="use arm.ikine_all(T), which gives all branches",
        )
    given = letters if isinstance(letters, str) else "?"
    chosen = [[letter for letter in given if letter in pair] for pair in LETTERS.split()]
    if len(given) != sum(map(len, chosen)) or any(len(found) > 1 for found in chosen):
        raise InputError(
            f"configuration={letters!r}",
            where=where,
            allowed="l or r (left, right), u or d (elbow up, down), n or f (wrist not flipped, flipped)",
            fix="write for example configuration='lun'; missing letters are taken from 'lun'",
        )
    side, elbow, wrist = (found[0] if found else default for found, default in zip(chosen, "lun"))
    second, third = chain.axes[1:3]
    same = float(second.direction @ third.direction) > 0.0
    left = side == "l"
    plus = (elbow == "u") != left
    # The branches are in the order of the signs + and - of shoulder, elbow and wrist.
    return 4 * (not left) + 2 * (plus != same) + (wrist == "n")


def chosen_branch(robot: Robot, branches: IkineBranches, index: int) -> IkineResult:
    """The result of the branch with an index, for one pose or N."""
    batch = branches.q.ndim == 3
    at = np.s_[:, index] if batch else np.s_[np.newaxis, index]
    q, found, beyond = branches.q[at], branches.exists[at], branches.beyond_limits[at]
    none: NDArray[np.int64] = np.zeros(found.shape, dtype=np.int64)
    result = IkineResult(
        q=q,
        success=found,
        reason=np.where(found, "converged", np.where(beyond, "limits", "out of reach")).astype("<U12"),
        position_error=branches.position_error[at],
        rotation_error=branches.rotation_error[at],
        iterations=none,
        restarts=none,
        excess=np.zeros_like(q),
        lost_direction=np.full((*found.shape, 6), np.nan),
        names=tuple(entry.name for entry in robot.positions),
    )
    return result if batch else result[0]
