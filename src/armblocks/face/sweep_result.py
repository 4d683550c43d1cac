"""The result of a sweep: a table with a row for each run."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import InputError, UnknownNameError, counted
from armblocks.face.sweep_parameters import values_of_run
from armblocks.face.sweep_pictures import sweep_picture
from armblocks.face.sweep_report import SweepReportFiles, write_sweep_report
from armblocks.face.sweep_sensitivity import MorrisEffects, SobolIndices, morris_effects, sobol_indices
from armblocks.face.sweep_source import SweepSource
from armblocks.face.trajectory_report import save_picture
from armblocks.pictures.picture import Picture
from armblocks.simulation import SimulationResult
from armblocks.sweeps.batch import COMPLETED, STATUSES
from armblocks.sweeps.files import SweepFile, to_dataframe, write_table
from armblocks.sweeps.sensitivity_designs import MORRIS, SALTELLI
from armblocks.sweeps.statistics import rank_correlation, wilson_interval
from armblocks.sweeps.tables import STATUS, STEPS

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[Any]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SweepResult(metaclass=ArgumentErrors):
    """The table of a sweep, from :func:`armblocks.sweep`. ``result["name"]`` is a column, ``(runs,)``.

    Columns:

    - ``run``: the number from 0; then the varied parameters.
    - ``status``: ``completed``, ``stopped`` by a block, ``failed`` or ``step limit``.
    - ``message``: the reason why a run was not completed.
    - The measures; NaN for runs that failed or reached the step limit.
    - ``steps``, ``events`` and ``end_time`` (s).

    Attributes:

    - ``kept``: the signals whose samples are kept. ``result[name]`` is ``(runs, N)`` at ``time (N,)`` s, NaN
      after the end of a run.
    - ``complete``: whether all runs were computed; Ctrl-C ends a sweep early.
    - ``planned``: the number of runs of the design.
    - ``remark``: the number of runs that the native loop did not compute, the reason for this, and the reason
      why lanes are not used.
    """

    name: str
    names: tuple[str, ...]
    measures: tuple[str, ...]
    kept: tuple[str, ...]
    time: NDArray[np.float64]
    planned: int
    complete: bool
    remark: str = ""
    columns: Mapping[str, Array] = field(default_factory=dict[str, Array])
    file: SweepFile | None = None
    source: SweepSource

    def __getitem__(self, name: str) -> Array:
        if name not in self.names and name not in self.kept:
            raise UnknownNameError("column", name, (*self.names, *self.kept), where=self.name)
        if name not in self.columns and self.file is not None:
            return self.file.read((name,))[name]
        return self.columns[name]

    def __len__(self) -> int:
        """The number of computed runs."""
        return len(self["run"])

    @property
    def path(self) -> Path | None:
        """The path of the table's file, if any."""
        return None if self.file is None else self.file.path

    @property
    def failed(self) -> NDArray[np.int64]:
        """The numbers of the runs that failed or reached the limit of steps."""
        status = self[STATUS]
        return self["run"][(status == STATUSES[2]) | (status == STATUSES[3])]

    def parameters(self, run: int) -> Mapping[str, Any]:
        """The parameters of one run, ``{"block.parameter": value}``, for :func:`armblocks.simulate`."""
        self._check_run(run)
        return values_of_run(self.source.model.diagram, self.source.design, run)

    def run(self, run: int) -> SimulationResult:
        """Compute one run again with all signals; the results are bit-identical.

        Raises ``InputError`` for a number that does not exist, ``SimulationError`` for a run that fails.
        """
        self._check_run(run)
        return self.source.model.simulate(self.source.options, parameters=self.parameters(run))

    def _check_run(self, run: int) -> None:
        if not _is_integer(run) or not 0 <= run < self.planned:
            raise InputError(
                f"run {run!r} does not exist",
                where=self.name,
                allowed=f"0 to {self.planned - 1}",
                fix="choose a number of the column 'run'",
            )

    def largest(self, name: str, count: int = 1) -> NDArray[np.int64]:
        """The numbers of the runs with the largest values of a column, the largest first; without NaN."""
        return self._extreme(name, count, -1.0)

    def smallest(self, name: str, count: int = 1) -> NDArray[np.int64]:
        """The numbers of the runs with the smallest values of a column, the smallest first; without NaN."""
        return self._extreme(name, count, 1.0)

    def _extreme(self, name: str, count: int, sign: float) -> NDArray[np.int64]:
        if not _is_integer(count) or count < 0:
            raise InputError(
                f"count = {count!r}",
                where=self.name,
                allowed="an integer number of runs, 0 or more",
                fix="give the number of runs that the result lists",
            )
        values = self._numbers(name)
        order = np.argsort(sign * values, kind="stable")
        order = order[~np.isnan(values[order])]
        return self["run"][order[:count]]

    def probability(
        self, name: str, *, low: float = -np.inf, high: float = np.inf, confidence: float = 0.95
    ) -> tuple[float, float, float]:
        """The share of the runs whose column is from ``low`` to ``high``, and the limits of its confidence
        interval (Wilson score interval).

        Runs without a value, such as failed ones, count as outside. The interval is valid for independent
        runs: a random design. Raises ``InputError``.
        """
        values = self._numbers(name)
        if not (0.0 < confidence < 1.0 and low <= high):
            raise InputError(
                f"the limits are {low:g} and {high:g}, the confidence is {confidence:g}",
                where=self.name,
                allowed="a lower and an upper limit, and a confidence between 0 and 1",
                fix="write for example probability('peak', high=1.2, confidence=0.99)",
            )
        inside = int(((values >= low) & (values <= high)).sum())
        return (inside / values.size, *wilson_interval(inside, values.size, confidence))

    def correlations(self, name: str) -> Mapping[str, float]:
        """Spearman's rank correlation of a column with each varied parameter, the strongest first.

        1: the column increases with the parameter in all runs, -1: it decreases. Runs without a value are
        omitted; parameters without numbers, too. Raises ``InputError``.
        """
        values = self._numbers(name)
        valid = ~np.isnan(values)
        columns = {column: self[column] for column in self.names[1 : self.names.index(STATUS)]}
        known = {
            column: rank_correlation(entries[valid], values[valid])
            for column, entries in columns.items()
            if entries.dtype != object
        }
        return dict(sorted(known.items(), key=lambda item: -abs(np.nan_to_num(item[1]))))

    def sobol(self, name: str) -> SobolIndices:
        """Sobol indices of a column: the shares of its variance that come from each parameter.

        For a sweep with ``design="saltelli"`` and ``runs`` a multiple of d + 2 for d parameters. Groups with
        a failed run are omitted. Raises ``InputError`` for other designs and incomplete sweeps.
        """
        values = self._of_design(name, SALTELLI)
        return sobol_indices(name, tuple(self.source.design.columns), values)

    def morris(self, name: str) -> MorrisEffects:
        """Elementary effects of Morris on a column, which show the parameters that have an effect.

        For a sweep with ``design="morris"`` and ``runs`` a multiple of d + 1 for d parameters. Paths with a
        failed run are omitted. Raises ``InputError`` for other designs and incomplete sweeps.
        """
        values, design = self._of_design(name, MORRIS), self.source.design
        assert design.points is not None
        return morris_effects(name, tuple(design.columns), values, design.points)

    def _of_design(self, name: str, kind: str) -> NDArray[np.float64]:
        """A column of a complete sweep with this design, in the order of the runs."""
        values, given = self._numbers(name), self.source.design.kind
        if given != kind or len(values) != self.planned:
            found = f"the design is '{given}'" if given != kind else f"{len(values)} of {self.planned} runs"
            raise InputError(
                f"{found}, and these indices need all runs of the design '{kind}'",
                where=self.name,
                allowed=f"a complete sweep with design='{kind}'",
                fix=f"call ab.sweep(…, design='{kind}', runs=…)",
            )
        return values

    def plot(
        self,
        kind: str = "response",
        name: str | None = None,
        *,
        parameters: Sequence[str] | None = None,
        limit: float | None = None,
        save: str | PathLike[str] | None = None,
    ) -> Picture:
        """A picture of the table. ``name``: a column, by default the first measure.

        ``kind``:

        - ``response``: the column over each parameter, with the median and the bands of the percentiles 25
          to 75 and 5 to 95.
        - ``tornado``: medians in the runs with the lowest and the highest tenth of each parameter.
        - ``scatter``: a matrix of the parameters and the column.
        - ``parallel``: parallel coordinates; the tenth of the runs with the highest values is in colour.
        - ``map``: the column over two parameters, in colours; ``limit`` draws a line around the cells above
          it.
        - ``bands``: the same percentiles of a kept signal over time; ``name`` is by default the first kept
          signal.

        ``parameters``: by default those with the strongest rank correlation. ``save``: the ``.svg`` or
        ``.png`` file to write. Raises ``UnknownNameError`` and ``InputError``.
        """
        picture = sweep_picture(self, kind, name, parameters, limit)
        if save is not None:
            save_picture(picture, save, "SweepResult.plot")
        return picture

    def write_report(
        self,
        folder: str | PathLike[str],
        *,
        worst: int = 3,
        smallest: Sequence[str] = (),
        limits: Mapping[str, tuple[float, float]] | None = None,
    ) -> SweepReportFiles:
        """Write a report of the sweep into a folder, created if absent, and return the paths.

        ``report.html`` shows the measures with their percentiles, the pictures of :meth:`plot` for the first
        six measures, sensitivity indices if the design permits them, the worst cases, the messages of runs
        that did not complete, and the design. ``table.csv`` has all runs, unless the sweep has a file.
        ``runs/run-17.json`` is the diagram with the parameters and settings of run 17, for each worst case
        and for the first run with each message. The studio opens and repeats these runs bit for bit.

        - ``worst``: the number of worst cases of each measure.
        - ``smallest``: the measures whose smallest values are the worst, such as margins.
        - ``limits``: ``{"peak": (-np.inf, 12.0)}`` adds the share of the runs from the lower to the upper
          limit, with its confidence interval for random designs.

        Raises ``UnknownNameError``, ``InputError``, and ``FormatError`` if the folder cannot be written.
        """
        return write_sweep_report(self, folder, worst, smallest, limits or {})

    def with_columns(self, columns: Mapping[str, ArrayLike]) -> SweepResult:
        """The table with further measures, such as functions of its columns: ``{"ratio": values}`` with a
        number for each run, ``(runs,)``.

        Raises ``InputError`` for other numbers of values and for names that exist.
        """
        added: dict[str, Array] = {}
        for name, values in columns.items():
            array = np.asarray(values, dtype=np.float64)
            if name in self.names or name in self.kept or not name:
                raise InputError(
                    f"the column '{name}' exists",
                    where="SweepResult.with_columns",
                    allowed=f"other names than {', '.join((*self.names, *self.kept))}",
                    fix="give the column another name",
                )
            if array.shape != (len(self),):
                raise InputError(
                    f"the column '{name}' has the shape {array.shape}",
                    where="SweepResult.with_columns",
                    allowed=f"a number for each run, ({len(self)},)",
                    fix="compute the column from columns of this table",
                )
            added[name] = array
        place = self.names.index(STEPS)
        return dataclasses.replace(
            self,
            names=(*self.names[:place], *added, *self.names[place:]),
            measures=(*self.measures, *added),
            columns={**self.columns, **added},
        )

    def _numbers(self, name: str) -> NDArray[np.float64]:
        values = self[name]
        if values.dtype == object or values.ndim != 1 or not values.size:
            raise InputError(
                f"the column '{name}' has no numbers",
                where=self.name,
                allowed=", ".join(self.measures) or "the parameters",
                fix="choose a measure",
            )
        return values.astype(np.float64)

    def to_dataframe(self) -> pd.DataFrame:
        """The table as a pandas data frame with the index ``run``; without kept samples."""
        return to_dataframe(self._all())

    def save(self, path: str | PathLike[str]) -> None:
        """Write the table to a ``.parquet`` or ``.csv`` file, atomically; without kept samples.

        Raises ``UnknownNameError`` for an unsupported suffix, ``FormatError``.
        """
        write_table(Path(path), self._all())

    def _all(self) -> Mapping[str, Array]:
        if self.file is None or self.columns.keys() >= set(self.names):
            return {name: self[name] for name in self.names}
        stored = self.file.read([name for name in self.names if name not in self.columns])
        return {name: self.columns[name] if name in self.columns else stored[name] for name in self.names}

    def __repr__(self) -> str:
        status = self[STATUS]
        counts = {name: int((status == name).sum()) for name in STATUSES}
        parts = [f"{count} {name}" for name, count in counts.items() if count and name != COMPLETED]
        head = f"{self.name}: {counted(len(status), 'run')}"
        if not self.complete:
            head += f" of {self.planned}, INCOMPLETE"
        lines = [f"<SweepResult {', '.join([head, *parts])}>"]
        lines += [f"  {self.remark}"] if self.remark else []
        width = max((len(name) for name in self.measures), default=0)
        for name in self.measures:
            values = self[name]
            finite = values[np.isfinite(values)]
            text = "no finite values"
            if finite.size:
                text = f"{finite.min():.6g} to {finite.max():.6g}, median {np.median(finite):.6g}"
            lines.append(f"  {name:<{width}}  {text}")
        return "\n".join(lines)


def _is_integer(value: object) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool)
