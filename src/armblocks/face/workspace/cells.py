"""The data of a workspace: cells with counts and maps, slices, a point cloud, tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import InputError, UnknownNameError, counted
from armblocks.face.text_table import text_table
from armblocks.face.trajectory_arguments import as_array
from armblocks.pictures.numbers import table_number

Array = NDArray[np.float64]
Counts = NDArray[np.int64]
Statistic = Literal["most", "least", "mean"]

UNITS = {"manipulability": "", "singularity": "", "condition": "", "limits": "", "payload": "kg"}
"""The measures and their units; empty: dimensionless, or dependent on the types of the joints."""
STATISTICS = ("most", "least", "mean")
AXES = ("x", "y", "z")


@dataclass(frozen=True, eq=False, kw_only=True)
class MeasureMap(metaclass=ArgumentErrors):
    """A measure in each cell: the largest (``most``), ``least`` and ``mean`` value of its samples.

    Arrays (nx, ny, nz), NaN in cells without samples.
    """

    name: str
    unit: str
    most: Array
    least: Array
    mean: Array

    def statistic(self, name: str) -> Array:
        """The array of a statistic. Raises UnknownNameError."""
        if name not in STATISTICS:
            raise UnknownNameError("statistic", name, STATISTICS, where=f"map of {self.name}")
        return {"most": self.most, "least": self.least, "mean": self.mean}[name]


@dataclass(frozen=True, eq=False, kw_only=True)
class WorkspaceSlice(metaclass=ArgumentErrors):
    """One layer of cells normal to a world axis.

    - ``normal``: the axis.
    - ``at``: the coordinate (m) of the centres of the layer.
    - ``axes``: the names of the two other axes.
    - ``first`` (na,), ``second`` (nb,) m: the centres of the cells along these axes.
    - ``counts`` (na, nb): numbers of samples in the cells.
    - ``maps``: for each measure, its values in the cells (na, nb).
    """

    normal: str
    at: float
    axes: tuple[str, str]
    first: Array
    second: Array
    counts: Counts
    maps: Mapping[str, MeasureMap]


@dataclass(frozen=True, eq=False, kw_only=True)
class WorkspaceCells(metaclass=ArgumentErrors):
    """The data and functions of :class:`armblocks.Workspace` without its pictures and files."""

    name: str
    frame: str
    axes: str
    coordinates: tuple[str, ...]
    samples: int
    accepted: int
    cell: float
    corner: Array
    counts: Counts
    maps: Mapping[str, MeasureMap]
    low: Array
    high: Array
    base: Array
    reach: float
    points: Array
    q: Array
    values: Mapping[str, Array]
    notes: tuple[str, ...]

    @property
    def occupied(self) -> int:
        """Number of cells with samples."""
        return int(np.count_nonzero(self.counts))

    @property
    def volume(self) -> float:
        """Volume of the cells with samples, m³; cells at the boundary count as a whole."""
        return self.occupied * self.cell**3

    def centres(self) -> Array:
        """The centres (M, 3) of the M cells with samples, m, in the world."""
        return self.corner + self.cell * np.argwhere(self.counts > 0)

    def reached(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether the cells of ``points`` (3,) or (N, 3), m in the world, contain samples."""
        index, inside = self._cells(points)
        return np.asarray(inside & (self.counts[tuple(index)] > 0))

    def value(self, points: ArrayLike, measure: str, statistic: Statistic = "most") -> Array:
        """A measure in the cells of ``points`` (3,) or (N, 3), m in the world; NaN without samples."""
        index, inside = self._cells(points)
        values = self._map(measure).statistic(statistic)[tuple(index)]
        return np.asarray(np.where(inside, values, np.nan))

    def _cells(self, points: ArrayLike) -> tuple[Counts, NDArray[np.bool_]]:
        """The indices (3, …) of cells, limited to the box, and whether the points are in the box."""
        places = as_array(points)
        if places.ndim not in (1, 2) or places.shape[-1] != 3:
            raise InputError(
                f"points has the shape {places.shape}",
                where=f"workspace of {self.name}",
                allowed="(3,) or (N, 3), m in the world",
                fix="give x, y, z of each point",
            )
        exact: Array = np.floor((places - self.corner) / self.cell + 0.5)
        inside: NDArray[np.bool_] = np.asarray(((exact >= 0) & (exact < self.counts.shape)).all(axis=-1))
        index = np.where(inside[..., None], exact, 0.0).astype(np.int64)
        return np.moveaxis(index, -1, 0), inside

    def _map(self, measure: str) -> MeasureMap:
        if measure not in self.maps:
            raise UnknownNameError("measure", measure, list(self.maps), where=f"workspace of {self.name}")
        return self.maps[measure]

    def slice(self, normal: str = "y", at: float | None = None) -> WorkspaceSlice:
        """The layer of cells normal to the axis ``"x"``, ``"y"`` or ``"z"`` that contains the coordinate.

        ``at`` (m): the coordinate; by default that of the layer with the most reached cells.

        Raises InputError outside of the region, UnknownNameError for another axis.
        """
        where = f"slice of the workspace of {self.name}"
        if normal not in AXES:
            raise UnknownNameError("axis", str(normal), AXES, where=where)
        k = AXES.index(normal)
        a, b = (axis for axis in range(3) if axis != k)
        layers = self.counts.shape[k]
        if at is None:
            index = int(np.count_nonzero(self.counts, axis=(a, b)).argmax())
        else:
            place = float(as_array(at)) if as_array(at).ndim == 0 else np.nan
            exact = np.floor((place - self.corner[k]) / self.cell + 0.5)
            if not 0 <= exact < layers:
                low = float(self.corner[k]) - 0.5 * self.cell
                raise InputError(
                    f"at = {at!r} is outside of the reached cells",
                    where=where,
                    allowed=f"{low:g} to {low + layers * self.cell:g} m",
                    fix=f"give a coordinate along {normal} in this range",
                )
            index = int(exact)

        maps = {
            name: MeasureMap(
                name=name,
                unit=entry.unit,
                **{each: np.take(entry.statistic(each), index, axis=k) for each in STATISTICS},
            )
            for name, entry in self.maps.items()
        }
        lines: list[Array] = [
            self.corner[axis] + self.cell * np.arange(self.counts.shape[axis]) for axis in (a, b)
        ]
        return WorkspaceSlice(
            normal=normal,
            at=float(self.corner[k] + self.cell * index),
            axes=(AXES[a], AXES[b]),
            first=lines[0],
            second=lines[1],
            counts=np.take(self.counts, index, axis=k),
            maps=maps,
        )

    def table(self) -> dict[str, Array]:
        """The reached cells as columns (M,): ``x``, ``y``, ``z`` m, ``count``, statistics of the measures."""
        used = self.counts > 0
        columns = dict(zip(AXES, self.centres().T)) | {"count": self.counts[used].astype(np.float64)}
        for name, entry in self.maps.items():
            for each in STATISTICS:
                columns[f"{name} {each}"] = entry.statistic(each)[used]
        return columns

    def point_table(self) -> dict[str, Array]:
        """The stored samples as columns (P,): ``x``, ``y``, ``z`` m, the coordinates, and the measures."""
        return (
            dict(zip(AXES, self.points.T))
            | {f"q {name}": column for name, column in zip(self.coordinates, self.q.T)}
            | dict(self.values)
        )

    def facts(self) -> list[tuple[str, str]]:
        """Title and text of each line of the summary."""
        spans = ", ".join(
            f"{axis} {table_number(low)} to {table_number(high)} m"
            for axis, low, high in zip(AXES, self.low.tolist(), self.high.tolist())
        )
        lines = [
            ("frame", self.frame),
            ("samples", f"{self.samples}" if self.accepted == self.samples else self._accepted_text),
            ("reach from the base", f"{table_number(self.reach)} m"),
            ("bounds", spans),
            ("cells", f"{self.occupied} of {table_number(self.cell)} m"),
            ("volume of these cells", f"{table_number(self.volume)} m³"),
            ("rows of the Jacobian", {"all": "all", "trans": "translation", "rot": "rotation"}[self.axes]),
        ]
        return lines + [("note", note) for note in self.notes]

    @property
    def _accepted_text(self) -> str:
        return f"{self.samples}, {self.accepted} within the limits of coupled joints"

    def measure_rows(self) -> list[list[str]]:
        """Name, unit, least value, median of the cells' largest values, and largest value of each measure."""
        rows: list[list[str]] = []
        for name, entry in self.maps.items():
            best = entry.most[self.counts > 0]
            numbers = (float(np.nanmin(entry.least)), float(np.median(best)), float(best.max()))
            rows.append([name, entry.unit, *(table_number(value) for value in numbers)])
        return rows

    def __str__(self) -> str:
        lines = [f"workspace of {self.name}"]
        lines += [f"{title}: {text}" for title, text in self.facts()]
        heads = ["measure", "unit", "least", "median of cell maxima", "most"]
        return "\n".join([*lines, *(text_table(heads, self.measure_rows()) if self.maps else ())])

    def __repr__(self) -> str:
        return f"<Workspace of {self.name}: {counted(self.occupied, 'cell')} of {self.cell:g} m>"
