"""Consistent configurations and degrees of freedom of robots with constraints, by numerical methods.

``assembled`` finds coordinates that satisfy the constraints, ``mobility`` finds the degrees of freedom and
the redundant relations.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from casadi import SX, Function, vertcat
from numpy.typing import NDArray

from armblocks.dynamics.ball_joints import difference, integrated, normalised
from armblocks.dynamics.constraint_equations import attached_frame, constraint_equations
from armblocks.dynamics.joint_motion import entries
from armblocks.dynamics.kinematics import body_poses, constant_pose, frame_pose
from armblocks.dynamics.reduction import reduced_columns, tree_coordinates
from armblocks.errors import AssemblyError, InputError, RobotError, UnknownNameError
from armblocks.robot.constraints import Closure, Distance, NoDisplacement, Perpendicular
from armblocks.robot.robot import Robot
from armblocks.robot.tree import KinematicTree
from armblocks.spatial import Transform

Array = NDArray[np.float64]

RESIDUAL_TOLERANCE = 1e-12
"""Largest residual of an assembled configuration: cosine of an angle, or displacement in the unit of
:func:`characteristic_length`, which is 1 m for most robots."""
RANK_TOLERANCE = 1e-5
"""Singular values below this fraction of the largest singular value count as zero.

Near a singular configuration a smaller tolerance would count a direction in which the mechanism can almost
move as locked. With 1e-9 Bricard's mechanism has no degree of freedom at inaccurate coordinates."""
SIZES = 0.01, 100.0
"""Sizes of robots whose Jacobian is used in metres, m."""
MAX_STEPS = 200
"""Maximum number of steps from one start."""
RESTARTS = 12
"""Number of further starts after the guess."""
WIDE_STARTS = 40
"""Number of starts anywhere within the ranges of the joints, where no guess is given."""
MOTIONS = 6
"""Number of configurations at which the rank of the Jacobian is determined."""

BRANCH_STARTS = 24
"""Number of motions in random directions by which branches are searched."""
BRANCH_STEP = 0.03
"""Length of these motions, rad or m."""
SAME_BRANCH = 0.98
"""Cosine of the angle above which two directions belong to one branch."""


@dataclass(frozen=True, eq=False)
class Mobility:
    """The degrees of freedom of a robot with constraints.

    ``degrees_of_freedom``: n minus the number of independent relations, at a generic configuration.
    ``instantaneous``: the same at the given configuration; it is larger at a singular configuration.
    ``independent``: the indices of a largest set of independent relations, in the order of the constraints.
    ``redundant``: the constraints of the other relations, by name, once for each relation.
    """

    degrees_of_freedom: int
    instantaneous: int
    independent: tuple[int, ...]
    redundant: tuple[str, ...]

    @property
    def singular(self) -> bool:
        """Whether the mechanism has more degrees of freedom here than at a generic configuration."""
        return self.instantaneous > self.degrees_of_freedom


class Mechanism:
    """Numerical functions of the constraints of a robot: residuals, Jacobian, assembly, mobility."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        tree = KinematicTree.of(robot)
        q = SX.sym("q", robot.nq)
        step = SX.sym("step", robot.nv)
        coordinates = robot.coordinate_map
        tree_q = tree_coordinates(coordinates, q)
        equations = constraint_equations(tree, tree_q)
        self.names = equations.names
        J = reduced_columns(coordinates, equations.jacobian)
        self._evaluate = Function("closures", [q], [equations.residual_vector, J])
        moved = vertcat(*integrated(robot, entries(q), entries(step), 1.0))
        self._move = Function("move", [q, step], [moved])
        q1 = SX.sym("q1", robot.nq)
        between = vertcat(*difference(robot, entries(q), entries(q1)))
        self._difference = Function("difference", [q, q1], [between])
        self._normalise = Function("normalise", [q], [vertcat(*normalised(robot, entries(q)))])
        ground = constant_pose(Transform())
        bodies = body_poses(tree, entries(tree_q), ground)
        self._closures = robot.closures
        poses = [
            frame_pose(attached_frame(tree, end), bodies, ground).matrix()
            for closure in self._closures
            for end in (closure.first, closure.second)
        ]
        self._poses = Function("poses", [q], poses)
        self._length = characteristic_length(robot)
        relations = [relation for closure in self._closures for relation in closure.relations]
        self._rows = np.array([1.0 if isinstance(r, Perpendicular) else self._length for r in relations])
        self._columns = np.array([1.0 if entry.unit == "rad" else self._length for entry in robot.speeds])

    def residuals(self, q: Array) -> Array:
        """The residuals (m,) at ``q`` (nq,)."""
        return np.asarray(self._evaluate(q)[0].full())[:, 0]

    def equations(self, q: Array) -> tuple[Array, Array]:
        """The residuals (m,) and their Jacobian J (m, n) at ``q`` (nq,)."""
        residuals, J = self._evaluate(q)
        return np.asarray(residuals.full())[:, 0], np.asarray(J.full())

    def jacobian(self, q: Array) -> Array:
        """J (m, n) at ``q`` (nq,)."""
        return np.asarray(self._evaluate(q)[1].full())

    def balanced(self, q: Array) -> Array:
        """J (m, n) at ``q`` for ranks: lengths of very small and very large robots in their own unit.

        The unit is :func:`characteristic_length`.
        """
        return self._balanced(self.jacobian(q))

    def moved(self, q: Array, step: Array) -> Array:
        """The coordinates after a motion with the speeds ``step`` (n,) for unit time."""
        return np.asarray(self._move(q, step).full())[:, 0]

    def descended(self, q: Array) -> Array:
        """The coordinates at which the Levenberg-Marquardt method ends if it starts at ``q``."""
        return self._descend(q, list(range(self.robot.nv)))

    def assembled(self, guess: Array, locked: Sequence[str] = ()) -> Array:
        """Coordinates near ``guess`` that satisfy the constraints; the ``locked`` joints do not move.

        Levenberg-Marquardt method with the exact Jacobian. If it does not converge to a solution, it starts
        again near the guess. Raises AssemblyError with the constraint that has the largest gap, InputError
        for a quaternion of zeros, and UnknownNameError for an unknown joint.
        """
        free = self._free_speeds(locked)
        random = np.random.default_rng(0)
        guess = np.asarray(self._normalise(guess).full())[:, 0]
        if not np.isfinite(guess).all():
            raise InputError(
                "the start value of q has a quaternion of zeros",
                where=f"robot '{self.robot.name}'",
                allowed="quaternions w x y z with a direction",
                fix="begin with arm.neutral(), whose quaternions are 1 0 0 0",
            )
        best, smallest = guess, math.inf
        for attempt in range(RESTARTS + 1):
            start = guess
            if attempt:
                step = np.zeros(self.robot.nv)
                step[free] = random.normal(scale=0.1 * attempt, size=len(free)) * self._columns[free]
                start = self.moved(guess, step)
            q = self._descend(start, free)
            size = self.distance(q)
            if size < smallest:
                best, smallest = q, size
            if size <= RESIDUAL_TOLERANCE:
                return q
        raise self._assembly_error(best, locked)

    def assembled_anywhere(self) -> Array:
        """Coordinates that satisfy the constraints: near the neutral configuration, or else within the joint
        ranges.

        Joints without range rotate by at most pi or move by at most 1 m. Raises AssemblyError.
        """
        neutral = self.robot.neutral
        try:
            return self.assembled(neutral)
        except AssemblyError as error:
            random, free = np.random.default_rng(2), list(range(self.robot.nv))
            ranges: Array = np.array(
                [
                    limits.position
                    or ((-math.pi, math.pi) if entry.unit == "rad" else (-self._length, self._length))
                    for limits, entry in zip(self.robot.limits, self.robot.speeds)
                ]
            )
            for _ in range(WIDE_STARTS):
                step = random.uniform(ranges[:, 0], ranges[:, 1])
                q = self._descend(self.moved(neutral, step), free)
                if self.distance(q) <= RESIDUAL_TOLERANCE:
                    return q
            raise error

    def consistent_speeds(self, q: Array, qd: Array, locked: Sequence[str] = ()) -> Array:
        """The speeds nearest to ``qd`` (n,) that satisfy the constraints at ``q``.

        The ``locked`` joints keep their speeds. Raises RobotError if these contradict the constraints.
        """
        free = self._free_speeds(locked)
        J = self.jacobian(q)
        change = np.zeros(self.robot.nv)
        rates = J @ qd
        change[free] = -self._least_squares(J, rates, free)
        remaining = np.abs(J @ (qd + change)) / self._rows
        if len(remaining) and remaining.max() > 1e-9 * max(1.0, float(np.abs(rates / self._rows).max())):
            row = int(np.argmax(remaining))
            worst, violation = self.names[row], float(remaining[row] * self._rows[row])
            raise RobotError(
                f"the speeds of the locked joints violate constraint '{worst}' by {violation:.3g} per second",
                where=f"robot '{self.robot.name}'",
                allowed="speeds of locked joints that the constraints permit",
                fix="lock fewer joints, at most as many as the mechanism has degrees of freedom",
            )
        return qd + change

    def mobility(self, q: Array) -> Mobility:
        """The degrees of freedom at and near an assembled configuration ``q``."""
        jacobians = [self.balanced(q), *(self.balanced(other) for other in self._neighbours(q))]
        ranks = [_rank(J) for J in jacobians]
        rank = max(ranks)
        independent = _independent_rows([J for J, r in zip(jacobians, ranks) if r == rank], rank)
        others = [i for i in range(len(self.names)) if i not in independent]
        return Mobility(
            self.robot.nv - rank,
            self.robot.nv - ranks[0],
            tuple(independent),
            tuple(self.names[i] for i in others),
        )

    def free_joints(self, q: Array) -> tuple[str, ...]:
        """The joints that the first derivatives of the constraints permit to move at ``q``."""
        J = self.jacobian(q)
        motion = np.eye(self.robot.nv) - np.column_stack([self._least_squares(J, column) for column in J.T])
        owners = [link.name for link in self.robot.moving_links for _ in link.joint.speeds]
        return tuple(dict.fromkeys(name for name, row in zip(owners, motion) if np.abs(row).max() > 1e-6))

    def branches(self, q: Array) -> list[Array]:
        """The directions (n,), each of length 1, of the curves of assembled configurations through ``q``.

        For a mechanism with one degree of freedom. With several directions, ``q`` is a bifurcation, where
        branches of the motion cross. Without a direction, the mechanism cannot move.
        """
        random, J = np.random.default_rng(3), self.jacobian(q)
        found: list[Array] = []
        for _ in range(BRANCH_STARTS):
            step = random.normal(size=self.robot.nv)
            step = self._permitted(J, step)
            length = float(np.linalg.norm(step / self._columns))
            if length < 1e-9:
                return []
            other = self._descend(self.moved(q, BRANCH_STEP / length * step), [*range(self.robot.nv)])
            chord = np.asarray(self._difference(q, other).full())[:, 0] / self._columns
            size = float(np.linalg.norm(chord))
            is_assembled = self._largest_residual(other) <= RESIDUAL_TOLERANCE
            if is_assembled and size > 0.2 * BRANCH_STEP:
                direction = chord / size
                if all(abs(float(direction @ known)) < SAME_BRANCH for known in found):
                    found.append(direction)
        if self._length == 1.0:
            return found
        in_metres = [direction * self._columns for direction in found]
        return [direction / np.linalg.norm(direction) for direction in in_metres]

    def gaps(self, q: Array) -> dict[str, str]:
        """The violation of each closure at ``q`` as text, in mm and degrees."""
        texts: dict[str, str] = {}
        for closure in self._closures:
            position, angle = self._gap(closure, q)
            has_angle = any(isinstance(relation, Perpendicular) for relation in closure.relations)
            angle_text = f" and {math.degrees(angle):.4g} deg" if has_angle else ""
            texts[closure.name] = f"{1000.0 * position:.4g} mm{angle_text}"
        return texts

    def _gap(self, closure: Closure, q: Array) -> tuple[float, float]:
        """The violation of one closure: distance (m) and angle (rad)."""
        values = self.residuals(q)[[i for i, name in enumerate(self.names) if name == closure.name]]
        position: list[float] = [0.0]
        angle: list[float] = [0.0]
        for relation, value in zip(closure.relations, values.tolist()):
            match relation:
                case NoDisplacement():
                    position.append(value)
                case Perpendicular():
                    angle.append(math.asin(max(-1.0, min(1.0, value))))
                case Distance(length):
                    position.append(math.sqrt(max(0.0, length * (length + 2.0 * value))) - length)
        if self._reversed_axes(closure, q):
            angle.append(math.pi)
        return math.hypot(*position), max(map(abs, angle))

    def distance(self, q: Array) -> float:
        """The largest residual, in balanced units; infinite if a closure has a reversed axis."""
        if any(self._reversed_axes(closure, q) for closure in self._closures):
            return math.inf
        return self._largest_residual(q)

    def _largest_residual(self, q: Array) -> float:
        return float(np.abs(self.residuals(q) / self._rows).max(initial=0.0))

    def _reversed_axes(self, closure: Closure, q: Array) -> bool:
        """Whether an axis of the second frame is opposite to the same axis of the first frame."""
        index = self._closures.index(closure)
        poses = self._poses(q)
        a, b = (np.asarray(pose.full()) for pose in poses[2 * index : 2 * index + 2])
        return any(float(a[:3, axis] @ b[:3, axis]) < 0.0 for axis in closure.parallel_axes)

    def _free_speeds(self, locked: Sequence[str]) -> list[int]:
        """The indices in qd of the joints that are not locked."""
        names = self.robot.joint_names
        for name in locked:
            if name not in names:
                raise UnknownNameError("joint", name, names, where=f"robot '{self.robot.name}'")
        owners = [link.name for link in self.robot.moving_links for _ in link.joint.speeds]
        return [k for k, name in enumerate(owners) if name not in locked]

    def _descend(self, q: Array, free: list[int]) -> Array:
        """The coordinates at which the Levenberg-Marquardt method ends if it starts at ``q``."""
        residuals = self.residuals(q)
        size, damping = float(residuals @ residuals), 1e-3
        for _ in range(MAX_STEPS):
            largest_residual = np.abs(residuals / self._rows).max(initial=0.0)
            if largest_residual <= 0.01 * RESIDUAL_TOLERANCE or damping > 1e12:
                break
            U, s, Vt = np.linalg.svd(self.balanced(q)[:, free], full_matrices=False)
            largest = float(s.max(initial=0.0))
            if largest == 0.0:
                break
            # Directions whose singular values are rounding errors are excluded, because the last steps are
            # undamped.
            gains = np.where(
                s > 1e-11 * largest, s / (s * s + damping * largest * largest * min(1.0, size)), 0.0
            )
            step = np.zeros(self.robot.nv)
            step[free] = -Vt.T @ (gains * (U.T @ (residuals / self._rows)))
            step *= self._columns
            candidate = self.moved(q, step)
            new = self.residuals(candidate)
            new_size = float(new @ new)
            if new_size < size:
                q, residuals, size, damping = candidate, new, new_size, max(0.2 * damping, 1e-15)
            else:
                damping *= 8.0
        return q

    def _balanced(self, J: Array) -> Array:
        return J * self._columns / self._rows[:, None]

    def _least_squares(self, J: Array, b: Array, free: Sequence[int] | None = None) -> Array:
        """The shortest speeds of the ``free`` joints that minimise |J x - b|, in balanced units."""
        chosen = [*range(self.robot.nv)] if free is None else free
        return _least_squares(self._balanced(J)[:, chosen], b / self._rows) * self._columns[chosen]

    def _permitted(self, J: Array, step: Array) -> Array:
        """The part of a step, given in balanced units, that J permits."""
        step = step * self._columns
        return step - self._least_squares(J, J @ step)

    def _neighbours(self, q: Array) -> list[Array]:
        """Assembled configurations near ``q``, by random motions in the directions that J permits."""
        random = np.random.default_rng(1)
        found: list[Array] = []
        free = list(range(self.robot.nv))
        for k in range(MOTIONS):
            J = self.jacobian(q)
            step = random.normal(size=self.robot.nv)
            step = self._permitted(J, step)
            length = float(np.linalg.norm(step / self._columns))
            if length < 1e-9:
                break
            other = self._descend(self.moved(q, (0.03 + 0.04 * k) / length * step), free)
            if self._largest_residual(other) <= RESIDUAL_TOLERANCE:
                found.append(other)
        return found

    def _assembly_error(self, q: Array, locked: Sequence[str]) -> AssemblyError:
        gaps = self.gaps(q)

        worst = max(self._closures, key=lambda closure: max(self._gap(closure, q))).name
        keeping = f", with {', '.join(locked)} locked," if locked else ""
        return AssemblyError(
            f"no configuration near the guess{keeping} satisfies constraint '{worst}': "
            f"a gap of {gaps[worst]} remains",
            where=f"robot '{self.robot.name}'",
            allowed="links whose lengths permit all constraints together",
            fix="start from a nearer guess, lock fewer joints, or correct the frames of the constraint",
            q=q.tolist(),
            gaps=gaps,
        )


def characteristic_length(robot: Robot) -> float:
    """The unit of length, m, in which rows and columns of the Jacobian are compared: 1 m for most robots.

    Robots below 0.01 m or above 100 m have the sum of the distances of their frames. In metres, the
    singular values of their displacements would be negligible beside those of angles, or the reverse.
    """
    poses = [pose for link in robot.links for pose in (link.before, link.after)]
    poses += [end.pose for closure in robot.closures for end in (closure.first, closure.second)]
    size = sum(math.hypot(*pose.translation) for pose in poses)
    return 1.0 if size == 0.0 or SIZES[0] <= size <= SIZES[1] else size


@lru_cache(maxsize=32)
def mechanism(robot: Robot) -> Mechanism:
    """The numerical functions of a robot's constraints, cached for the last 32 robots."""
    return Mechanism(robot)


def _least_squares(A: Array, b: Array) -> Array:
    """The shortest x that minimises |A x - b|, without singular values below ``RANK_TOLERANCE``."""
    U, s, Vt = np.linalg.svd(A, full_matrices=False)
    kept = s > RANK_TOLERANCE * s.max(initial=0.0)
    return np.asarray(Vt[kept].T @ ((U[:, kept].T @ b) / s[kept]))


def _rank(J: Array) -> int:
    s = np.linalg.svd(J, compute_uv=False)
    return int(np.sum(s > RANK_TOLERANCE * s.max(initial=0.0)))


def _independent_rows(jacobians: Sequence[Array], rank: int) -> list[int]:
    """``rank`` rows that are independent in all Jacobians.

    Gram-Schmidt orthogonalisation with row exchange. Each row has a remainder in every Jacobian; the next row
    is the one whose smallest remainder is largest.
    """
    remainders = [J.copy() for J in jacobians]
    scale = [max(float(np.linalg.norm(row)) for row in J) if len(J) else 1.0 for J in jacobians]
    chosen: list[int] = []
    for _ in range(rank):
        lengths = np.min([np.linalg.norm(R, axis=1) / s for R, s in zip(remainders, scale)], axis=0)
        lengths[chosen] = -1.0
        # The first of several nearly equal rows is chosen, so that rounding errors do not change the choice.
        best = int(np.argmax(lengths > 0.9 * lengths.max()))
        chosen.append(best)
        for remainder in remainders:
            direction = remainder[best] / np.linalg.norm(remainder[best])
            remainder -= np.outer(remainder @ direction, direction)
    return sorted(chosen)
