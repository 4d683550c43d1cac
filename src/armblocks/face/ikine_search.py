"""The compiled inverse kinematics of a frame of an arm, with a table of starts for each choice of options."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armblocks.compiler import Kernel
from armblocks.face.ikine_coordinates import periodic_coordinates, random_coordinates
from armblocks.inverse_kinematics.solver import (
    Bounds,
    InverseKinematics,
    SearchSettings,
    Solutions,
    StartTable,
    settings_array,
)
from armblocks.robot import Robot
from armblocks.robot.joints.motions import AxisMotion

Array = NDArray[np.float64]

STARTS = 512
"""Number of starts in the table."""
LARGEST_STEP = 0.6
"""Largest change of an angle in one iteration, rad; of a translation relative to the size of the arm."""


class Options(NamedTuple):
    """The settings on which a search depends, besides targets and starts."""

    mask: tuple[float, ...]
    limits: bool
    tolerance: float
    restarts: int
    seed: int


@dataclass(frozen=True, kw_only=True)
class SearchArrays:
    """The arrays of a search for given options."""

    settings: Array
    bounds: Array
    table: StartTable
    weights: Array
    lowest: Array
    highest: Array


class ArmSearch:
    """Inverse kinematics of one frame of an arm, with the error in the axes of the world or of the target."""

    def __init__(
        self, robot: Robot, error: Kernel, fkine: Callable[[Array], Array], integrate: Kernel
    ) -> None:
        self.robot = robot
        self.search = InverseKinematics(error, integrate, robot.position_of_speed)
        self.where = f"ikine of robot '{robot.name}'"
        self.names = tuple(entry.name for entry in robot.positions)
        self._fkine = fkine
        self._prepared: dict[Options, SearchArrays] = {}
        self._tables: dict[tuple[bool, int], tuple[Array, Array, float]] = {}

    def run(
        self, targets: Array, starts: Array | None, prepared: SearchArrays, threads: int = 1
    ) -> Solutions:
        """Search for the targets (N, 16) from ``starts`` (N, nq), or from the table."""
        return self.search.solve(
            targets, starts, prepared.settings.copy(), prepared.bounds, prepared.table, threads
        )

    def prepared(self, options: Options) -> SearchArrays:
        """The arrays of a search with these options."""
        return self._prepared.get(options) or self._prepare(options)

    def _prepare(self, options: Options) -> SearchArrays:
        q, poses, size = self._table(options.limits, options.seed)
        lowest, highest = self._limits(options.limits)
        table = StartTable.of(q, poses)
        mask = np.array(options.mask)
        scales = np.array([1.0 / size] * 3 + [1.0] * 3)
        settings = SearchSettings(
            position_tolerance=options.tolerance,
            rotation_tolerance=options.tolerance,
            weights=mask * scales,
            pose_weights=_pose_weights(mask, size),
            attempts=min(options.restarts + 1, q.shape[0]),
        )
        bounds = Bounds(
            lowest=lowest,
            highest=highest,
            periodic=periodic_coordinates(self.robot),
            largest_step=self._largest_steps(size),
        )
        prepared = SearchArrays(
            settings=settings_array(settings, table),
            bounds=self.search.bounds_array(bounds),
            table=table,
            weights=settings.weights,
            lowest=lowest,
            highest=highest,
        )
        self._prepared[options] = prepared
        return prepared

    def _limits(self, limited: bool) -> tuple[Array, Array]:
        qlim = self.robot.qlim
        if not limited:
            return np.full(self.robot.nq, -np.inf), np.full(self.robot.nq, np.inf)
        return qlim[:, 0].copy(), qlim[:, 1].copy()

    def _table(self, limited: bool, seed: int) -> tuple[Array, Array, float]:
        """Random coordinates, their poses, and the size of the arm: the spread of these poses, m."""
        known = self._tables.get((limited, seed))
        if known is None:
            q = random_coordinates(self.robot, STARTS, np.random.default_rng(seed), limited=limited)
            poses = self._fkine(q)
            positions = poses[:, :3, 3]
            size = float(np.abs(positions - positions.mean(axis=0)).max(initial=0.0))
            known = self._tables[limited, seed] = q, poses, size if size > 1e-9 else 1.0
        return known

    def _largest_steps(self, size: float) -> Array:
        """Largest steps (n,) of one iteration; infinite for translations without limits."""
        limited = iter(self.robot.limits)
        steps: list[float] = []
        for joint in self.robot.joints:
            for motion in joint.motions:
                ranges = [next(limited).position for _ in motion.speeds]
                if not isinstance(motion, AxisMotion) or motion.angular:
                    steps += [LARGEST_STEP] * len(ranges)
                else:
                    steps += [LARGEST_STEP * size if entry else np.inf for entry in ranges]
        return np.array(steps)


def _pose_weights(mask: Array, size: float) -> Array:
    """Weights of the squared differences between the 12 entries of two poses.

    A column of the rotation matrix
    has a weight if the mask contains both rotations that change the column.
    """
    weights = np.zeros((3, 4))
    for column in range(3):
        others: Sequence[int] = [k for k in range(3) if k != column]
        weights[:, column] = 0.5 * all(mask[3 + k] for k in others)
    weights[:, 3] = mask[:3].mean() / size**2
    return weights.ravel()
