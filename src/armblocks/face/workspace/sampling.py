"""``workspace``: the reachable region of an arm by sampling, in bounded memory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.cell_maps.grid import CellGrid
from armblocks.compiler import Kernel, cached_kernel
from armblocks.errors import InputError
from armblocks.face.arm import Arm
from armblocks.face.arm_kernels import ArmKernels
from armblocks.face.robots import given_arm
from armblocks.face.trajectory_arguments import positive
from armblocks.face.workspace.arguments import (
    MAX_SAMPLES,
    SampledRanges,
    check_robot,
    checked_axes,
    checked_measures,
    load_arguments,
    whole,
)
from armblocks.face.workspace.cells import UNITS, MeasureMap
from armblocks.face.workspace.result import Workspace
from armblocks.pictures.numbers import nice_step
from armblocks.robot import Robot

if TYPE_CHECKING:
    from armblocks.equations import TracedFunction

Array = NDArray[np.float64]

CHUNK = 65_536
"""Samples that are evaluated at once."""
SAMPLES_PER_CELL = 8
"""Minimum number of samples for each cell of the box, by default; few samples leave gaps in the region."""
CELLS_ACROSS = 60
"""Cells along the longest side of the region, by default at least half of this number."""
MAX_POINTS = 1_000_000
ROUNDING = 1e-12
"""Measures of the Jacobian below this fraction of the reach are rounding errors of 0."""


def workspace(
    arm: Arm | Robot | str | PathLike[str],
    samples: int = 1_000_000,
    *,
    measures: str | Sequence[str] = "manipulability",
    axes: str | None = None,
    frame: str | None = None,
    cell: float | None = None,
    ranges: Mapping[str, ArrayLike] | None = None,
    torque: ArrayLike | None = None,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    qd: ArrayLike | None = None,
    qdd: ArrayLike | None = None,
    points: int = 5000,
    seed: int = 0,
    threads: int = 1,
) -> Workspace:
    """The region that the tool reaches, with maps of ``measures``, from ``samples`` configurations.

    - ``samples``, ``seed``: the number of configurations, which are uniform in the joint limits
      (quasi-random); ``seed`` selects their sequence. A rotation without limits is sampled over one turn, and
      a rotation of a ball joint is uniform. Samples beyond the limits of joints that couplings determine do
      not count.
    - ``measures``: names of the list below. Each cell has their largest, smallest and mean values.
    - ``axes``: rows of the Jacobian, ``"all"``, ``"trans"`` or ``"rot"``; by default ``"all"`` for six
      degrees of freedom or more, else ``"trans"``.
    - ``frame``: the frame whose positions are counted, by default the tool.
    - ``cell`` (m): the side of the cubic cells in which the positions are counted.
    - ``ranges``: pairs (lowest, highest) by the name of the coordinate, rad or m, within the joint limits.
      The configurations are then in these ranges.
    - ``torque`` (n,), ``centre`` (3,) m, ``qd``, ``qdd`` (n,): for the measure ``"payload"``.
    - ``points``: the number of samples, from the first, that are stored for point clouds.

    Measures:

    - ``"manipulability"``: Yoshikawa's product of the singular values of the Jacobian;
    - ``"singularity"``: the smallest singular value, which is the distance to the nearest singular Jacobian;
    - ``"condition"``: the smallest divided by the largest singular value;
    - ``"limits"``: the minimum distance to a joint limit over half the range, 1 in the middle, 0 at a limit;
    - ``"payload"``: the largest mass (kg) at the frame that the ``torque`` limits hold, by default those of
      the robot. ``centre``: its position in the axes of the frame. At rest, or with the speeds ``qd`` and
      accelerations ``qdd``.

    Raises RobotError for closed loops and for translations without limits, InputError for too many cells.
    """
    arm = given_arm(arm, "workspace")
    where = f"workspace of robot '{arm.name}'"
    check_robot(arm, where)
    names = checked_measures(measures, where)
    chosen = checked_axes(axes, arm.n, where)
    count = whole("samples", samples, 1, MAX_SAMPLES, where)
    kept = whole("points", points, 0, MAX_POINTS, where)
    whole("seed", seed, 0, 2**63 - 1, where)
    limits = SampledRanges.of(arm.robot, ranges, where)
    side = None if cell is None else positive("cell", cell, "m", where)
    loads, notes = ([], ()) if "payload" not in names else load_arguments(arm, torque, centre, qd, qdd, where)
    if frame is not None:
        arm.robot.frame(frame)
    sampler = _Sampler.of(arm, names, chosen, frame, limits, loads, seed)
    grid = _Collector(names, side, arm.robot.base.translation, kept, count, where)
    for first in range(0, count, CHUNK):
        grid.add(*sampler(np.arange(first, min(first + CHUNK, count), dtype=np.float64), threads))
    notes = (*limits.notes, *notes)
    return _result(arm, names, chosen, frame, count, sampler, grid, notes)


@dataclass(frozen=True, eq=False)
class _Sampler:
    """Positions and measures of the samples with given numbers."""

    measures: Kernel
    q: Kernel
    sequence: tuple[Array, ...]
    loads: tuple[Array, ...]

    @classmethod
    def of(
        cls,
        arm: Arm,
        names: Sequence[str],
        axes: str,
        frame: str | None,
        ranges: SampledRanges,
        loads: Sequence[Array],
        seed: int,
    ) -> _Sampler:
        robot = arm.robot
        key = f"robot/workspace/{ArmKernels(robot, None, arm.__reduce__()).description_key}"

        def trace_measures() -> TracedFunction:
            from armblocks.dynamics.workspace_measures import trace_workspace

            return trace_workspace(robot, names, axes, frame)

        def trace_coordinates() -> TracedFunction:
            from armblocks.dynamics.workspace_measures import trace_workspace_coordinates

            return trace_workspace_coordinates(robot)

        d = len(ranges.low)
        start = np.random.default_rng(seed).random(d)
        return cls(
            cached_kernel(f"{key}/{names}/{axes}/{frame!r}", trace_measures),
            cached_kernel(f"{key}/coordinates", trace_coordinates),
            (start, irrational_steps(d), ranges.low, ranges.width),
            tuple(loads),
        )

    def __call__(self, numbers: Array, threads: int) -> tuple[Array, Array, list[Array], Array]:
        """Points (3, N), whether each is within all limits, the measures (N,), and the numbers."""
        point, inside, *values = self.measures.columns(numbers, *self.sequence, *self.loads, threads=threads)
        return point, inside, values, numbers

    def coordinates(self, numbers: Array) -> Array:
        """The coordinates (N, nq) of samples."""
        return self.q(numbers, *self.sequence)


def irrational_steps(count: int) -> Array:
    """The fractional parts of the square roots of the first primes (Richtmyer's sequence)."""
    primes: list[int] = []
    candidate = 2
    while len(primes) < count:
        if all(candidate % prime for prime in primes):
            primes.append(candidate)
        candidate += 1
    return np.sqrt(np.array(primes, dtype=np.float64)) % 1.0


class _Collector:
    """The cells, bounds and kept points of the samples so far."""

    def __init__(
        self,
        names: Sequence[str],
        cell: float | None,
        base: Sequence[float],
        kept: int,
        samples: int,
        where: str,
    ) -> None:
        self._names, self._cell, self._kept, self._where = names, cell, kept, where
        self._samples = samples
        self._base = np.array(base)[:, None]
        self._grid: CellGrid | None = None
        self._low, self._high = np.full(3, np.inf), np.full(3, -np.inf)
        self._cloud: list[tuple[Array, Array, Array]] = []
        self.accepted = 0
        self.reach = 0.0

    def add(self, points: Array, inside: Array, values: Sequence[Array], numbers: Array) -> None:
        """Count a chunk of samples."""
        table = np.ascontiguousarray(values).reshape(len(self._names), -1)
        if not inside.all():
            chosen = inside != 0.0
            points, table, numbers = np.compress(chosen, points, 1), table[:, chosen], numbers[chosen]
            points, table = np.ascontiguousarray(points), np.ascontiguousarray(table)
        if not len(numbers):
            return
        self._low = np.minimum(self._low, points.min(axis=1))
        self._high = np.maximum(self._high, points.max(axis=1))
        self.reach = max(self.reach, float(np.sqrt(((points - self._base) ** 2).sum(axis=0).max())))
        if self._grid is None:
            extent = self._high - self._low
            cell = self._cell or self._default_cell(extent)
            # Centres are at multiples of the side. Where the region is a plane, they are in this plane.
            anchor = np.where(extent > cell, 0.0, points[:, 0])
            self._grid = CellGrid(cell, anchor, len(self._names), self._where)
        self._grid.add(points, table)
        wanted = self._kept - sum(len(part[0]) for part in self._cloud)
        if wanted > 0:
            self._cloud.append((numbers[:wanted].copy(), points[:, :wanted].copy(), table[:, :wanted].copy()))
        self.accepted += len(numbers)

    def _default_cell(self, extent: Array) -> float:
        """A round side (m) of the cells of a region with these extents (3,)."""
        longest = float(extent.max())
        spacious = float(extent.prod() * SAMPLES_PER_CELL / self._samples) ** (1.0 / 3.0)
        return nice_step(max(longest / CELLS_ACROSS, spacious)) if longest > 0.0 else 0.01

    def finished(self) -> tuple[CellGrid, Array]:
        """The cells with samples, and the lowest and highest coordinates (2, 3) of the points."""
        if self._grid is None:
            raise InputError(
                "no sample is within the limits of the joints that couplings determine",
                where=self._where,
                allowed="ranges in which some configurations are valid",
                fix="use more samples, or give ranges",
            )
        self._grid.trim()
        return self._grid, np.stack([self._low, self._high])

    def cloud(self) -> tuple[Array, Array, list[Array]]:
        """Numbers (P,), points (P, 3) and values (P,) of the kept samples."""
        if not self._cloud:
            return np.zeros(0), np.zeros((0, 3)), [np.zeros(0) for _ in self._names]
        numbers, points, table = (np.concatenate(part, axis=-1) for part in zip(*self._cloud))
        return numbers, np.ascontiguousarray(points.T), list(table)


def _result(
    arm: Arm,
    names: Sequence[str],
    axes: str,
    frame: str | None,
    samples: int,
    sampler: _Sampler,
    grid: _Collector,
    notes: tuple[str, ...],
) -> Workspace:
    cells, bounds = grid.finished()
    divisor: Array = np.maximum(cells.counts, 1).astype(np.float64)
    empty = cells.counts == 0
    maps = {
        name: MeasureMap(
            name=name,
            unit=UNITS[name],
            most=np.where(empty, np.nan, cells.most[k]),
            least=np.where(empty, np.nan, cells.least[k]),
            mean=np.where(empty, np.nan, cells.sums[k] / divisor),
        )
        for k, name in enumerate(names)
    }
    numbers, places, values = grid.cloud()
    flat = [
        f"{name} is 0 everywhere up to rounding: the Jacobian has dependent rows"
        for name in ("manipulability", "singularity")
        if name in maps and np.nanmax(maps[name].most) < ROUNDING * max(1.0, grid.reach)
    ]
    return Workspace(
        name=arm.name,
        frame=frame or "tool",
        axes=axes,
        coordinates=tuple(entry.name for entry in arm.robot.positions),
        samples=samples,
        accepted=grid.accepted,
        cell=cells.cell,
        corner=cells.anchor + cells.first * cells.cell,
        counts=cells.counts,
        maps=maps,
        low=bounds[0],
        high=bounds[1],
        base=np.array(arm.robot.base.translation),
        reach=grid.reach,
        points=places,
        q=sampler.coordinates(numbers),
        values=dict(zip(names, values)),
        notes=(*notes, *flat),
    )
