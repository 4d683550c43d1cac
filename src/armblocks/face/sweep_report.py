"""The report of a sweep: measures, pictures, worst cases, failed runs and the design on one page."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from armblocks import formats
from armblocks.argument_errors import ArgumentErrors
from armblocks.diagram import Diagram, with_parameters
from armblocks.errors import ArmblocksError, FormatError, InputError, UnknownNameError, counted
from armblocks.face.sweep_parameters import parameter_unit
from armblocks.face.sweep_pictures import SweepTable, sweep_picture
from armblocks.face.sweep_sensitivity import MorrisEffects, SobolIndices
from armblocks.face.sweep_source import SweepSource
from armblocks.files import write_atomically
from armblocks.pictures.numbers import axis_number, table_number
from armblocks.pictures.svg import escape, svg_inline
from armblocks.report.page_frame import PageSection, fact_list, framed_page, notice_list
from armblocks.report.page_tables import html_table
from armblocks.report.writing import make_folder
from armblocks.sweeps.batch import COMPLETED, FAILED, STATUSES, STOPPED
from armblocks.sweeps.designs import GRID, PAIRED
from armblocks.sweeps.sensitivity_designs import MORRIS, SALTELLI
from armblocks.sweeps.tables import MESSAGE, RUN, STATUS

Array = NDArray[np.float64]

MOST_MEASURES = 6
"""Maximum number of measures with pictures."""
MOST_PARAMETERS = 12
"""Maximum number of parameters in the table of the worst cases."""
MOST_MESSAGES = 12
"""Maximum number of messages of runs that did not complete."""
DIGITS = 6
_NUMBER = re.compile(r"[-+\u2212]?\b\d[\d.]*(?:e[-+\u2212]?\d+)?")
_RANDOM = "random"
"""The design of independent runs, for which a confidence interval is valid."""

_DESIGNS = {
    GRID: "all combinations of the values",
    PAIRED: "a row of values for each run",
    SALTELLI: "groups of runs for Sobol indices",
    MORRIS: "paths for the effects of Morris",
    "random": "independent random values",
    "sobol": "a Sobol sequence",
    "halton": "a Halton sequence",
    "latin": "a Latin hypercube",
}


class ReportedSweep(SweepTable, Protocol):
    """The part of a result of a sweep that its report needs; see :class:`SweepResult`."""

    @property
    def name(self) -> str: ...
    @property
    def source(self) -> SweepSource: ...
    @property
    def planned(self) -> int: ...
    @property
    def complete(self) -> bool: ...
    @property
    def remark(self) -> str: ...
    @property
    def path(self) -> Path | None: ...
    def __len__(self) -> int: ...
    def parameters(self, run: int) -> Mapping[str, Any]: ...
    def largest(self, name: str, count: int = 1) -> NDArray[np.int64]: ...
    def smallest(self, name: str, count: int = 1) -> NDArray[np.int64]: ...
    def probability(self, name: str, *, low: float, high: float) -> tuple[float, float, float]: ...
    def sobol(self, name: str) -> SobolIndices: ...
    def morris(self, name: str) -> MorrisEffects: ...
    def save(self, path: str | PathLike[str]) -> None: ...


@dataclass(frozen=True, kw_only=True)
class SweepReportFiles(metaclass=ArgumentErrors):
    """The paths of the files of a report of a sweep.

    ``table``: the table of all runs; the file of the sweep, if it has one. ``runs``: the diagrams of single
    runs by number, with the parameters and the settings of the run.
    """

    folder: Path
    page: Path
    table: Path
    runs: Mapping[int, Path]


@dataclass(frozen=True, kw_only=True)
class _Message:
    """The runs that did not complete for the same reason."""

    status: str
    text: str
    runs: NDArray[np.int64]


def write_sweep_report(
    result: ReportedSweep,
    folder: str | PathLike[str],
    worst: int,
    smallest: Sequence[str],
    limits: Mapping[str, tuple[float, float]],
) -> SweepReportFiles:
    """Write ``report.html``, ``table.csv`` and ``runs/*.json``; see :meth:`SweepResult.write_report`."""
    names = [smallest] if isinstance(smallest, str) else list(smallest)
    count = cast("object", worst)
    for name in (*names, *limits):
        if name not in result.measures:
            raise UnknownNameError("measure", name, result.measures, where="SweepResult.write_report")
    if not isinstance(count, int) or isinstance(count, bool) or count < 0:
        raise InputError(
            f"worst is {worst!r}",
            where="SweepResult.write_report",
            allowed="an integer number of runs, 0 or more",
            fix="omit worst",
        )
    if not len(result):
        raise InputError(
            "no run has been computed",
            where="SweepResult.write_report",
            allowed="a sweep with at least one run",
            fix="repeat the sweep",
        )
    target = Path(folder)
    make_folder(target / "runs")
    cases = {
        name: (result.smallest if name in names else result.largest)(name, worst).tolist()
        for name in result.measures
    }
    messages = _messages(result)
    wanted = {run for runs in cases.values() for run in runs}
    wanted |= {int(message.runs[0]) for message in messages[:MOST_MESSAGES]}
    files = _write_runs(result, sorted(wanted), target / "runs")
    table = result.path
    if table is None or not result.complete:
        table = target / "table.csv"
        result.save(table)
    page = target / "report.html"
    sections = [
        _measures(result, limits),
        *_pictures(result),
        _worst_cases(result, cases, names, files),
        _not_completed(messages, files),
        _design(result),
        _files(table, files),
    ]
    text = framed_page(
        escape(result.name),
        _lead(result),
        _facts(result),
        notice_list(_notices(result, messages)),
        [section for section in sections if section.body],
    )
    write_atomically(page, text.encode())
    return SweepReportFiles(folder=target, page=page, table=table, runs=files)


def _messages(result: ReportedSweep) -> list[_Message]:
    """The reasons why runs did not complete, the most frequent one of failed runs first.

    Messages that differ only in their numbers are the same reason; the text is that of the first run.
    """
    status, texts, numbers = result[STATUS], result[MESSAGE], result[RUN]
    found: dict[tuple[str, str], list[int]] = {}
    for place in np.flatnonzero(status != COMPLETED).tolist():
        reason = _NUMBER.sub("0", texts[place])
        found.setdefault((status[place], reason), []).append(place)
    order = (*STATUSES[2:], STOPPED)
    return [
        _Message(status=kind, text=texts[places[0]], runs=numbers[places])
        for (kind, _), places in sorted(found.items(), key=lambda e: (order.index(e[0][0]), -len(e[1])))
    ]


def _write_runs(result: ReportedSweep, runs: Sequence[int], folder: Path) -> dict[int, Path]:
    """The diagrams of single runs; without runs whose diagram no file can represent."""
    files: dict[int, Path] = {}
    for run in runs:
        try:
            diagram = run_diagram(result, run)
            files[run] = formats.write_diagram(folder / f"run-{run}.json", diagram)
        except FormatError as error:
            if isinstance(error.__cause__, OSError):
                raise  # the folder cannot be written
        except ArmblocksError:
            continue  # invalid values: the message of the run states the reason
    return files


def run_diagram(result: ReportedSweep, run: int) -> Diagram:
    """The diagram of one run, with its parameters and the settings of the sweep."""
    source = result.source
    changed = with_parameters(source.model.diagram, result.parameters(run))
    return dataclasses.replace(changed, name=f"{changed.name} run {run}", settings=source.options)


def _lead(result: ReportedSweep) -> str:
    about = result.source.model.diagram.description.strip()
    description = f"{escape(about[:1].upper() + about[1:]).removesuffix('.')}. " if about else ""
    return (
        f"{description}Sweep of {counted(result.planned, 'run')} of {axis_number(_stop(result))} s, "
        f"{counted(len(_parameters(result)), 'varied parameter')}."
    )


def _facts(result: ReportedSweep) -> str:
    status = result[STATUS]
    facts: list[tuple[str, str, str]] = []
    for label, kind in zip(("Completed", "Stopped by a block", "Failed", "Step limit"), STATUSES):
        count = int((status == kind).sum())
        if count or kind in (COMPLETED, FAILED):
            share = 100.0 * count / max(1, status.size)
            facts.append((label, axis_number(count), f"{table_number(share, 3)} %"))
    facts.append(("Design", escape(result.source.design.kind), ""))
    facts.append(("Measures", str(len(result.measures)), ""))
    return fact_list(facts)


def _notices(result: ReportedSweep, messages: Sequence[_Message]) -> list[tuple[str, str]]:
    notices: list[tuple[str, str]] = []
    if not result.complete:
        notices.append(
            ("error", f"Incomplete: {len(result)} of {counted(result.planned, 'run')} were computed.")
        )
    failed = sum(message.runs.size for message in messages if message.status != STOPPED)
    if failed:
        notices.append(
            ("warning", f"{counted(failed, 'run')} did not complete and have no measures; see below.")
        )
    return notices


def _measures(result: ReportedSweep, limits: Mapping[str, tuple[float, float]]) -> PageSection:
    """Percentiles of all measures, and the shares of the runs within the limits."""
    heads = [
        ("Measure", ""), ("Least", ""), ("5 %", ""), ("Median", ""), ("Mean", ""), ("95 %", ""),
        ("Largest", ""), ("Runs without value", ""),
    ]  # fmt: skip
    rows: list[str] = []
    for name in result.measures:
        values = result[name].astype(np.float64)
        finite = values[np.isfinite(values)]
        cells = [""] * 6
        if finite.size:
            low, median, high = np.percentile(finite, (5.0, 50.0, 95.0)).tolist()
            numbers = (finite.min(), low, median, finite.mean(), high, finite.max())
            cells = [table_number(float(number), DIGITS) for number in numbers]
        missing = values.size - finite.size
        text = result.source.measures.get(name, "")
        formula = f'<span class="unit"><code>{escape(text)}</code></span>' if text not in ("", name) else ""
        rows.append(_row(escape(name) + formula, [*cells, axis_number(missing) if missing else ""]))
    if not rows:
        return PageSection("measures", "Measures", "")
    body = html_table("Least, percentiles and largest values of all runs", heads, rows)
    if limits:
        body += "<h3>Limits</h3>" + _limits(result, limits)
    return PageSection("measures", "Measures", body)


def _limits(result: ReportedSweep, limits: Mapping[str, tuple[float, float]]) -> str:
    heads = [("Measure", ""), ("Allowed", ""), ("Runs within", "%"), ("Confidence interval", "%")]
    independent = result.source.design.kind == _RANDOM and result.complete
    rows: list[str] = []
    for name, (low, high) in limits.items():
        share, *interval = result.probability(name, low=low, high=high)
        ends = [
            f"{sign} {table_number(end, DIGITS)}"
            for sign, end in (("≥", low), ("≤", high))
            if np.isfinite(end)
        ]
        between = " … ".join(table_number(100.0 * end, 4) for end in interval) if independent else ""
        rows.append(_row(escape(name), [", ".join(ends), table_number(100.0 * share, 4), between]))
    note = "Runs without a value count as outside. "
    note += (
        "The confidence is 95 % (Wilson score interval)."
        if independent
        else "Confidence intervals need a complete sweep with the design 'random'."
    )
    return html_table(note, heads, rows)


def _pictures(result: ReportedSweep) -> list[PageSection]:
    """A section for each measure, and one for the kept signals."""
    sections: list[PageSection] = []
    for number, name in enumerate(result.measures[:MOST_MEASURES]):
        body = _sensitivities(result, name)
        if np.isfinite(result[name].astype(np.float64)).any() and _varying(result):
            kinds = {
                "response": "Each dot is a run; the median, and the percentiles 25 to 75 and 5 to 95.",
                "tornado": "Medians in the runs with the lowest and the highest tenth of each parameter.",
                "parallel": "Each line is a run.",
            }
            if len(_varying(result)) == 2:
                kinds["map"] = "Medians of the runs in each cell."
            body = "".join(
                _figure(result, kind, name, f"fig-{kind}-{number}", text) for kind, text in kinds.items()
            ) + _sensitivities(result, name)
        sections.append(PageSection(f"measure-{number + 1}", f"Measure {escape(name)}", body))
    more = result.measures[MOST_MEASURES:]
    if more:
        text = f"<p>Without pictures here: {escape(', '.join(more))}.</p>"
        sections.append(PageSection("further-measures", "Further measures", text))
    bands = "".join(
        _figure(result, "bands", name, f"fig-bands-{k}", "") for k, name in enumerate(result.kept)
    )
    return [*sections, PageSection("signals", "Signals", bands)]


def _figure(result: ReportedSweep, kind: str, name: str, identifier: str, caption: str) -> str:
    drawing = svg_inline(sweep_picture(result, kind, name), identifier)
    note = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    return f'<figure class="wide">{drawing}{note}</figure>'


def _sensitivities(result: ReportedSweep, name: str) -> str:
    """Sobol indices or effects of Morris, if the design permits them."""
    kind = result.source.design.kind
    if kind not in (SALTELLI, MORRIS) or len(result) != result.planned:
        return ""
    if kind == SALTELLI:
        shares = result.sobol(name)
        columns = {
            "First order": shares.first, "± of first order": shares.first_error,
            "Total": shares.total, "± of total": shares.total_error,
        }  # fmt: skip
        order, parameters = np.argsort(-shares.total, kind="stable"), shares.parameters
        caption = "Shares of the variance that come from each parameter, with confidence intervals of 95 %"
        title, groups, omitted = "Sobol indices", shares.groups, shares.omitted
    else:
        effects = result.morris(name)
        columns = {
            "Mean absolute": effects.mean_absolute, "Mean": effects.mean, "Deviation": effects.deviation,
        }  # fmt: skip
        order, parameters = np.argsort(-effects.mean_absolute, kind="stable"), effects.parameters
        caption = "Changes of the measure if a parameter passes its whole distribution"
        title, groups, omitted = "Effects of Morris", effects.groups, effects.omitted
    caption += f"; {counted(groups, 'group')}"
    caption += f", {omitted} omitted because of failed runs" if omitted else ""
    places: list[int] = order.tolist()
    rows = [
        _row(escape(parameters[k]), [table_number(float(column[k]), 3) for column in columns.values()])
        for k in places
    ]
    heads = [("Parameter", ""), *((head, "") for head in columns)]
    return f"<h3>{title}</h3>" + html_table(caption, heads, rows)


def _worst_cases(
    result: ReportedSweep,
    cases: Mapping[str, Sequence[int]],
    smallest: Sequence[str],
    files: Mapping[int, Path],
) -> PageSection:
    shown = _varying(result, numbers=False)[:MOST_PARAMETERS]
    place = {int(run): k for k, run in enumerate(result[RUN].tolist())}
    columns = {name: result[name] for name in (*shown, *cases)}
    tables: list[str] = []
    for name, runs in cases.items():
        if not runs:
            continue
        heads = [("Run", ""), (escape(name), "")]
        heads += [(escape(parameter), escape(_unit(result, parameter))) for parameter in shown]
        rows = [
            _row(
                _link(run, files),
                [_text(columns[column][place[run]]) for column in (name, *shown)],
            )
            for run in runs
        ]
        word = "smallest" if name in smallest else "largest"
        tables.append(html_table(f"The runs with the {word} {name}", heads, rows))
    if not tables:
        return PageSection("worst", "Worst cases", "")
    text = (
        "<p>Each link leads to the file of a diagram with the parameters and settings of one run. The "
        "studio, opened in the folder of this report, opens it with one click, and <code>armblocks studio "
        "FILE</code> opens it from a terminal. Its run is bit-identical to the run of the sweep.</p>"
    )
    return PageSection("worst", "Worst cases", text + "".join(tables))


def _not_completed(messages: Sequence[_Message], files: Mapping[int, Path]) -> PageSection:
    if not messages:
        return PageSection("not-completed", "Runs that did not complete", "")
    heads = [("Status", ""), ("Runs", ""), ("First run", ""), ("Message", "")]
    rows = [
        f'<tr><th scope="row">{escape(message.status)}</th><td class="text">{axis_number(message.runs.size)}'
        f'</td><td class="text">{_link(int(message.runs[0]), files)}</td>'
        f'<td class="text" style="white-space:normal;min-width:30ch">{escape(message.text)}</td></tr>'
        for message in messages[:MOST_MESSAGES]
    ]
    body = html_table("Reasons, with the number of runs and the first run", heads, rows, words=True)
    rest = messages[MOST_MESSAGES:]
    if rest:
        count = sum(message.runs.size for message in rest)
        body += f"<p>{counted(count, 'other run')} with other messages: see the table.</p>"
    return PageSection("not-completed", "Runs that did not complete", body)


def _design(result: ReportedSweep) -> PageSection:
    kind = result.source.design.kind
    text = f"<p>Design <code>{escape(kind)}</code>: {_DESIGNS.get(kind, 'given values')}.</p>"
    text += f"<p>{escape(result.remark[:1].upper() + result.remark[1:])}.</p>" if result.remark else ""
    heads = [("Parameter", ""), ("Unit", ""), ("Different values", ""), ("Least", ""), ("Largest", "")]
    rows: list[str] = []
    for name in _parameters(result):
        column = result[name]
        levels = dict.fromkeys(column.tolist())
        ends = ["", ""]
        if column.dtype != object and column.size:
            ends = [_text(column.min()), _text(column.max())]
        rows.append(_row(escape(name), [escape(_unit(result, name)), axis_number(len(levels)), *ends]))
    body = html_table("The varied parameters of all runs", heads, rows)
    options = dataclasses.asdict(result.source.options)
    settings = [
        f'<tr><th scope="row"><code>{name}</code></th><td class="text">{_text(value)}</td></tr>'
        for name, value in options.items()
        if value is not None
    ]
    heads = [("Setting", ""), ("Value", "")]
    body += "<h3>Settings of all runs</h3>" + html_table("In SI units", heads, settings, words=True)
    return PageSection("design", "Design", text + body)


def _files(table: Path, files: Mapping[int, Path]) -> PageSection:
    name = f"<code>{escape(table.name)}</code> has all runs"
    runs = f", <code>runs/</code> has {counted(len(files), 'diagram')} of single runs" if files else ""
    return PageSection("files", "Files", f'<p class="files">{name}{runs}.</p>')


def _parameters(result: ReportedSweep) -> list[str]:
    return list(result.names[1 : result.names.index(STATUS)])


def _varying(result: ReportedSweep, *, numbers: bool = True) -> list[str]:
    """The parameters with different values; ``numbers``: without texts."""
    found: list[str] = []
    for name in _parameters(result):
        column = result[name]
        if column.dtype == object:
            different = not numbers and len(set(column.tolist())) > 1
        else:
            different = bool(column.size and np.ptp(column) > 0.0)
        if different:
            found.append(name)
    return found


def _unit(result: ReportedSweep, name: str) -> str:
    return parameter_unit(result.source.model.diagram, name)


def _stop(result: ReportedSweep) -> float:
    return float(result.source.options.stop_time)


def _text(value: Any) -> str:
    """A value as HTML."""
    if isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool):
        return table_number(float(cast("float", value)), DIGITS)
    return escape(str(value))


def _link(run: int, files: Mapping[int, Path]) -> str:
    return f'<a href="runs/{files[run].name}">{run}</a>' if run in files else str(run)


def _row(head: str, cells: Sequence[str]) -> str:
    return f'<tr><th scope="row">{head}</th>{"".join(f"<td>{cell}</td>" for cell in cells)}</tr>'
