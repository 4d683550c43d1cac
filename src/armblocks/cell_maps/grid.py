"""A grid of cubic cells that grows with its samples; counting is native code.

The grid keeps for each cell the number of its samples, and for each value the sum, the largest and the
smallest value. It needs memory for the box of the visited cells; the samples themselves are not kept.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armblocks.compiler.native import NativeCode, load_code
from armblocks.errors import InputError
from armblocks.routines.arithmetic import select
from armblocks.routines.llvm import definitions
from armblocks.routines.memory import Integers, Reals
from armblocks.routines.routine import Program, Routine
from armblocks.routines.values import Integer

Array = NDArray[np.float64]
Counts = NDArray[np.int64]

MAX_CELLS = 8_000_000
"""Maximum number of cells of the box; with one value they need 256 MB."""
MARGIN = 2
"""Cells added on each side where the box grows, so that it grows rarely."""


class CellGrid:
    """Cubic cells of the side ``cell`` (m); the centre of the cell (0, 0, 0) is at ``anchor`` (3,).

    ``first`` (3,): the indices of the first cell of the box. ``counts`` (nx, ny, nz); ``sums``, ``most`` and
    ``least`` (m, nx, ny, nz) of the m values.
    """

    def __init__(self, cell: float, anchor: Array, values: int, where: str) -> None:
        self.cell, self.anchor, self.values, self._where = cell, anchor, values, where
        self.first = np.zeros(3, dtype=np.int64)
        self._allocate(np.zeros(3, dtype=np.int64))

    def _allocate(self, shape: Counts) -> None:
        size = tuple(int(side) for side in shape)
        self.counts = np.zeros(size, dtype=np.int64)
        self.sums = np.zeros((self.values, *size))
        self.most = np.full((self.values, *size), -np.inf)
        self.least = np.full((self.values, *size), np.inf)

    def add(self, points: Array, values: Array) -> None:
        """Count samples: ``points`` (3, N) m and their ``values`` (m, N), both C-contiguous.

        Raises InputError if the box would have too many cells.
        """
        if not points.shape[1]:
            return
        ends = np.stack([points.min(axis=1), points.max(axis=1)])
        low, high = np.floor((ends - self.anchor) / self.cell + 0.5)
        self._check_size(low, high)
        self._include(low.astype(np.int64), high.astype(np.int64))
        corner = self.anchor + (self.first - 0.5) * self.cell
        shape = np.array(self.counts.shape, dtype=np.int64)
        numbers = np.array([*corner, 1.0 / self.cell])
        arrays = (points, values, numbers, shape, self.counts, self.sums, self.most, self.least)
        _accumulate()(*(part.ctypes.data for part in arrays), points.shape[1], self.values)

    def _include(self, low: Counts, high: Counts) -> None:
        """Enlarge the box to the cells from ``low`` to ``high``."""
        shape = np.array(self.counts.shape)
        first, end = self.first, self.first + shape
        if shape.all() and (low >= first).all() and (high < end).all():
            return
        if shape.all():
            low = np.where(low < first, low - MARGIN, first)
            high = np.where(high >= end, high + MARGIN, end - 1)
        size = high - low + 1
        self._check_size(low, high)
        old = self.counts, self.sums, self.most, self.least
        self._allocate(size)
        if shape.all():
            inside = tuple(slice(a, a + n) for a, n in zip((first - low).tolist(), shape.tolist()))
            new = self.counts, self.sums, self.most, self.least
            for before, after in zip(old, new):
                after[(..., *inside)] = before
        self.first = low

    def _check_size(self, low: Array | Counts, high: Array | Counts) -> None:
        """Raise InputError for a box with too many cells; indices beyond integers are real numbers."""
        size = (high - low + 1).astype(np.float64)
        if not float(np.prod(size)) <= MAX_CELLS:
            raise InputError(
                f"cells of {self.cell:g} m give a box of {' x '.join(f'{side:.10g}' for side in size)} cells",
                where=self._where,
                allowed=f"at most {MAX_CELLS} cells",
                fix="give a larger cell, in m",
            )

    def trim(self) -> None:
        """Reduce the box to the cells with samples."""
        kept: list[slice] = []
        for axis in range(3):
            others = tuple(k for k in range(3) if k != axis)
            used = np.flatnonzero(self.counts.any(axis=others))
            kept.append(slice(int(used[0]), int(used[-1]) + 1) if used.size else slice(0, 0))
        self.first = self.first + np.array([part.start for part in kept])
        self.counts = np.ascontiguousarray(self.counts[tuple(kept)])
        self.sums, self.most, self.least = (
            np.ascontiguousarray(part[(..., *kept)]) for part in (self.sums, self.most, self.least)
        )


def accumulate(
    r: Routine,
    points: Reals,
    values: Reals,
    numbers: Reals,
    shape: Integers,
    counts: Integers,
    sums: Reals,
    most: Reals,
    least: Reals,
    N: Integer,
    m: Integer,
) -> None:
    """Add N samples to the cells; all points are inside the box.

    ``points`` (3, N), ``values`` (m, N); ``numbers``: the lowest corner of the box (3,), then the number of
    cells in a metre. A point whose index is rounded beyond the last cell counts in this cell.
    """
    nx, ny, nz = shape[0], shape[1], shape[2]
    cells = nx * ny * nz
    corner, per_metre = (numbers[0], numbers[1], numbers[2]), numbers[3]
    for k in r.range(0, N):
        indices: list[Integer] = []
        for axis, (start, sides) in enumerate(zip(corner, (nx, ny, nz))):
            index = ((points[k + N * axis] - start) * per_metre).to_integer()
            index = select(index < 0, 0, index)
            indices.append(select(index < sides, index, sides - 1))
        cell = (indices[0] * ny + indices[1]) * nz + indices[2]
        counts[cell] = counts[cell] + 1
        for j in r.range(0, m):
            value, at = values[j * N + k], j * cells + cell
            sums[at] = sums[at] + value
            most[at] = select(value > most[at], value, most[at])
            least[at] = select(value < least[at], value, least[at])


@cache
def _code() -> NativeCode:
    program = Program()
    program.define(accumulate, public=True, distinct=True)
    parts = definitions(program)
    return load_code(("cell map", *parts.values()), lambda: "\n\n".join(parts.values()))


@cache
def _accumulate() -> Callable[..., None]:
    array, size = ctypes.c_void_p, ctypes.c_int64
    prototype: Any = ctypes.CFUNCTYPE(None, *[array] * 8, *[size] * 2)
    return prototype(_code().address("accumulate"))
