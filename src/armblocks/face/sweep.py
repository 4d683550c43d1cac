"""``sweep``: many runs of a diagram with different parameters, as one table."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from time import perf_counter
from typing import Any, Unpack, cast

import numpy as np

from armblocks import interrupts
from armblocks.diagram import Diagram, content_key, with_parameters
from armblocks.diagram.function_content import UnknownContentError, function_parts
from armblocks.equations import SimulationOptions
from armblocks.errors import InputError, counted
from armblocks.face.model import CompiledDiagram, compile_diagram
from armblocks.face.settings import RunSettings, check_settings, takes_settings, with_settings
from armblocks.face.sweep_parameters import RunParameters
from armblocks.face.sweep_programs import ProgramRecipe, Programs
from armblocks.face.sweep_result import SweepResult
from armblocks.face.sweep_source import SweepSource
from armblocks.simulation import SimulationResult
from armblocks.sweeps.batch import RunRows
from armblocks.sweeps.cluster import ClusterScheduler, connected
from armblocks.sweeps.designs import make_design
from armblocks.sweeps.files import SweepFile
from armblocks.sweeps.measures import Measure
from armblocks.sweeps.scheduling import Scheduler, default_threads
from armblocks.sweeps.tables import Layout, concatenated

SweepProgress = Callable[[int, int, float, float], None]
"""A function of the number of computed runs, the number of all runs, runs/s, and the remaining time in s."""

PART_SECONDS, PART_RUNS = 5.0, 100_000
"""A part of the results is written after this time (s) or this number of runs."""
PROGRESS_SECONDS = 0.1
LANE_RUNS = 500
"""Number of runs of a model from which on they are computed in lanes by default. The compilation of the code
takes some tenths of a second, once."""
VERSION = "1"
"""Version of the computation; files of another version are not continued."""


@takes_settings
@interrupts.kept()
def sweep(
    diagram: Diagram | CompiledDiagram | str | PathLike[str],
    vary: object,
    *,
    measures: Mapping[str, Measure | str | Callable[[SimulationResult], float]] | None = None,
    keep: Sequence[str] = (),
    runs: int | None = None,
    design: str | None = None,
    seed: int = 0,
    parameters: Mapping[str, object] | None = None,
    max_steps: int | None = None,
    threads: int | None = None,
    lanes: bool | None = None,
    scheduler: object = None,
    out: str | PathLike[str] | None = None,
    progress: SweepProgress | None = None,
    **settings: Unpack[RunSettings],
) -> SweepResult:
    """Run a diagram with many combinations of parameters, and return a table with a row for each run.

    - ``vary``: ``{"block.parameter": values}``. Values are a list, an array, or a distribution:
      :func:`uniform`, :func:`loguniform`, :func:`normal`, :func:`seeds`. Lists form a grid of all
      combinations. In a table or a list of mappings, each row is a run. Entries of arrays are
      ``block.parameter[k]``. Parameters that are constants of the equations, such as robots and sample times,
      are compiled for each combination.
    - ``measures``: a mapping of names to measures. A measure is a :class:`Measure`, a string such as
      ``"overshoot(motor/speed, final=1)"``, or a Python function of the result that returns a number.
    - ``keep``: signals whose samples are kept in memory or in the file.
    - ``runs``: the number of runs if there are distributions, a multiple of the size of the grid.
    - ``design``: ``random``, ``sobol``, ``halton`` or ``latin`` for distributions. With ``paired``, each row
      of the lists is a run. ``seed`` determines the points of the design.
    - ``parameters``: parameter values for all runs. ``settings``: as for :func:`simulate`.
    - ``max_steps``: the maximum number of steps of a run. ``threads``: by default the number of cores.
    - ``lanes``: whether each thread computes several runs at a time in the lanes of vector registers, by
      default for 500 runs or more. ``remark`` states the reason if this is not possible.
    - ``scheduler``: the address of a Dask scheduler, or a client of ``dask.distributed``, whose workers
      compute the runs.
    - ``out``: a ``.parquet`` or ``.csv`` file, which is written during the sweep, so that the memory does not
      grow with the number of runs. Another call with the same arguments continues an interrupted sweep.
    - ``progress(done, runs, rate, remaining)`` is called about ten times a second. After Ctrl-C the function
      returns the completed runs.

    Each run is bit-identical to :func:`simulate`, for any number of threads. A failed run is a row with its
    message. Raises ``UnknownNameError``, ``DiagramError`` and ``InputError`` for invalid arguments, also if
    ``out`` contains the results of another sweep.
    """
    check_settings(settings, sweep)
    model = compile_diagram(diagram)
    if parameters:
        model = CompiledDiagram(with_parameters(model.diagram, parameters))
    _check_numbers(max_steps, threads)
    options = with_settings(model.diagram.settings, settings)
    functions, named = _split(measures or {})
    all_parameters = RunParameters(model, make_design(vary, runs, design, seed))
    kept = (keep,) if isinstance(keep, str) else tuple(keep)
    wide = _wants_lanes(all_parameters) if lanes is None else lanes
    measured = tuple(named.values()), tuple(functions.values())
    programs = Programs(ProgramRecipe(options, *measured, kept, max_steps, wide))
    layout, time = programs.layout(all_parameters, (*named, *functions), text_file=_is_csv(out))
    file = None
    if out is not None:
        content = all_parameters.digest
        identity = _identity(model.diagram, options, content, named, functions, layout.kept, max_steps)
        file = SweepFile(Path(out), identity, layout.texts)
    collected = _Collected(layout, file, progress)
    complete = _compute(collected, programs, all_parameters, scheduler, 1 if functions else threads)
    return SweepResult(
        name=model.diagram.name,
        names=layout.names,
        measures=layout.measures,
        kept=layout.kept,
        time=time,
        planned=layout.design.count,
        complete=complete,
        remark=_remark(programs, all_parameters, collected.general, functions),
        # A sweep that is interrupted before its first part has no file to read.
        columns={} if file is not None and file.started else concatenated(collected.parts, layout),
        file=file,
        source=SweepSource(model, options, layout.design, _texts(named, functions)),
    )


def _texts(named: Mapping[str, object], functions: Mapping[str, object]) -> dict[str, str]:
    """The texts of measures, or the names of their Python functions."""
    calls = {name: str(getattr(call, "__name__", "function")) for name, call in functions.items()}
    return {name: str(measure) for name, measure in named.items()} | calls


def _wants_lanes(parameters: RunParameters) -> bool:
    """Whether the models of a sweep have enough runs for lanes."""
    models = len({id(variant.model) for variant in parameters.variants})
    return parameters.design.count >= LANE_RUNS * models


def _compute(
    collected: _Collected,
    programs: Programs,
    parameters: RunParameters,
    scheduler: object,
    threads: int | None,
) -> bool:
    """Compute all runs, in threads or on a cluster; returns whether all are done."""
    groups = programs.groups_of(parameters)
    if any(variant.model.compiled.called for variant in parameters.variants):
        threads = 1  # called Python functions
    if scheduler is None:
        return collected.collect(Scheduler(groups, threads or default_threads()))
    with connected(scheduler) as client:
        return collected.collect(ClusterScheduler(groups, client, programs.maker))


class _Collected:
    """Collects the rows of a sweep in memory, or writes them to its files."""

    def __init__(self, layout: Layout, file: SweepFile | None, progress: SweepProgress | None) -> None:
        self._layout = layout
        self._file = file
        self._progress = progress
        self._count = layout.design.count
        self._done = self._before = 0
        self._started = self._reported = perf_counter()
        self._pending: list[dict[str, Any]] = []
        self._pending_runs, self._written = 0, perf_counter()
        self.parts: list[dict[str, Any]] = []
        self.general = 0

    def collect(self, scheduler: Scheduler) -> bool:
        """Compute all missing runs; returns whether all runs are done. Ctrl-C ends the computation early."""
        file = self._file
        if file is not None and file.complete:
            return True
        if file is None:
            ranges: Iterator[tuple[int, int]] = iter([(0, self._count)])
        else:
            missing = list(file.missing(self._count))
            self._done = self._before = self._count - sum(end - begin for begin, end in missing)
            ranges = iter(missing)
        try:
            expected = -1
            for begin, rows in scheduler.rows(ranges):
                if begin != expected:
                    self._write()
                self._add(begin, rows)
                expected = begin + rows.status.size
        except KeyboardInterrupt:
            interrupts.answered()
            self._write()
            return False
        self._write()
        if file is not None:
            file.finish()
        self._report()
        return True

    def _add(self, begin: int, rows: RunRows) -> None:
        columns = self._layout.columns(begin, rows)
        self.general += rows.general
        count = rows.status.size
        self._done += count
        now = perf_counter()
        if self._file is None:
            self.parts.append(columns)
        else:
            self._pending.append(columns)
            self._pending_runs += count
            if self._pending_runs >= PART_RUNS or now - self._written >= PART_SECONDS:
                self._write()
        if now - self._reported >= PROGRESS_SECONDS and self._done < self._count:
            self._report()

    def _write(self) -> None:
        """Write the pending rows as one part."""
        if self._file is not None and self._pending:
            columns = concatenated(self._pending, self._layout)
            self._file.append(int(columns["run"][0]), columns)
        self._pending, self._pending_runs, self._written = [], 0, perf_counter()

    def _report(self) -> None:
        self._reported = perf_counter()
        if self._progress is None:
            return
        rate = (self._done - self._before) / max(1e-9, self._reported - self._started)
        remaining = (self._count - self._done) / rate if rate > 0.0 else 0.0
        self._progress(self._done, self._count, rate, remaining)


def _is_csv(out: str | PathLike[str] | None) -> bool:
    return out is not None and Path(out).suffix.lower() == ".csv"


def _split(
    measures: Mapping[str, Measure | str | Callable[[SimulationResult], float]],
) -> tuple[dict[str, Callable[[SimulationResult], float]], dict[str, Measure]]:
    """The measures that are Python functions, and the other measures."""
    functions: dict[str, Callable[[SimulationResult], float]] = {}
    named: dict[str, Measure] = {}
    for name, measure in measures.items():
        if isinstance(measure, str):
            named[name] = Measure.parse(measure)
        elif isinstance(measure, Measure):
            named[name] = measure
        elif callable(measure):
            functions[name] = measure
        else:
            raise InputError(
                f"the measure '{name}' is a {type(cast('object', measure)).__name__}",
                allowed="a Measure, its text, or a function of the result",
                where="sweep",
                fix="write for example measures={'peak': 'peak(plant/y)'}",
            )
    return functions, named


def _check_numbers(max_steps: int | None, threads: int | None) -> None:
    for name, number in (("max_steps", max_steps), ("threads", threads)):
        whole = isinstance(number, int | np.integer) and not isinstance(number, bool)
        if number is not None and (not whole or number < 1):
            raise InputError(
                f"{name} is {number!r}, not an integer above 0",
                allowed="1, 2, 3 …",
                where="sweep",
                fix=f"omit {name}",
            )


def _identity(
    diagram: Diagram,
    options: SimulationOptions,
    design: str,
    named: Mapping[str, Measure],
    functions: Mapping[str, Callable[[SimulationResult], float]],
    kept: Sequence[str],
    max_steps: int | None,
) -> dict[str, str]:
    """Digests of everything that the table depends on."""
    key = content_key(diagram)
    if key is None or not design:
        raise InputError(
            "the model has Python code of unknown content, such as an imported module",
            allowed="models whose content has a digest",
            where=diagram.name,
            fix="omit out=, and save the result",
        )
    try:
        code = {name: _digest(function_parts(function)) for name, function in functions.items()}
    except UnknownContentError as error:
        raise InputError(
            f"a measure uses Python code of unknown content ({error})",
            allowed="functions of their arguments, NumPy and constants",
            where="sweep",
            fix="omit out=, and save the result",
        ) from None
    return {
        "model": key,
        "settings": _digest([dataclasses.asdict(options), max_steps]),
        "design": design,
        "measures": _digest([(name, str(measure)) for name, measure in named.items()], code, kept),
        "version": VERSION,
    }


def _digest(*values: object) -> str:
    return hashlib.sha256(repr(values).encode()).hexdigest()


def _remark(
    programs: Programs,
    parameters: RunParameters,
    general: int,
    functions: Mapping[str, object],
) -> str:
    """The number of runs that the native loop did not compute, and the reason."""
    parts: list[str] = []
    reason = f"the measure '{next(iter(functions))}' is a Python function" if functions else ""
    reason = reason or programs.general_reason
    if reason:
        parts.append(f"all runs one after the other, because {reason}")
    elif programs.against_lanes:
        parts.append(f"one run at a time in each thread, because {programs.against_lanes}")
    if general and not reason:
        parts.append(f"{general} runs one after the other, because they failed, were stiff or too long")
    if parameters.recompiled:
        models = counted(parameters.recompiled, "model")
        parts.append(f"{models} compiled, because constants of the equations vary")
    return "; ".join(parts)
