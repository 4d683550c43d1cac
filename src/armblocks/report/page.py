"""``report.html``: one self-contained page. No network, no script; every name from a user is escaped."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from armblocks.diagram import Diagram, ViewKind, diagram_views
from armblocks.errors import counted
from armblocks.pictures.numbers import axis_number, wall_time
from armblocks.pictures.picture import Picture
from armblocks.pictures.svg import escape, svg_inline
from armblocks.report.figures import Figure
from armblocks.report.motion import Motion
from armblocks.report.motion_summary import MotionSummary
from armblocks.report.page_frame import PageSection, fact_list, framed_page, notice_list
from armblocks.report.page_tables import html_table, limits_table, loads_table, tool_table, value_cell
from armblocks.robot import inertia_findings
from armblocks.simulation.result import SimulationResult

_MAX_OPEN_SHEETS = 6
"""Maximum number of subsystems whose drawings are open at first; with more, all are closed."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Sheet:
    """The drawing of a subsystem, and the paths of all subsystems with the same content."""

    path: str
    same: tuple[str, ...]
    picture: Picture


@dataclass(frozen=True, eq=False, kw_only=True)
class ReportContents:
    """The contents of the page; ``summaries`` belong to ``motions``, ``files`` are relative paths."""

    diagram: Diagram
    result: SimulationResult
    motions: Sequence[Motion]
    summaries: Sequence[MotionSummary]
    figures: Sequence[Figure]
    drawing: Picture
    sheets: Sequence[Sheet] = ()
    files: Sequence[str]


def report_page(contents: ReportContents) -> str:
    """The whole page as HTML text."""
    name = escape(contents.diagram.name)
    sections: list[PageSection] = []
    motion_figures = [figure for figure in contents.figures if figure.section == "motion"]
    count = len(motion_figures) // max(len(contents.motions), 1)
    for number, (motion, summary) in enumerate(zip(contents.motions, contents.summaries)):
        arm_figures = motion_figures[number * count : (number + 1) * count]
        body = _motion(motion, summary, arm_figures)
        sections.append(PageSection(f"motion-{number + 1}", f"Motion of {escape(motion.robot.name)}", body))
    displays = _displays(contents)
    if displays:
        sections.append(PageSection("displays", "Displays", displays))
    for key, heading in (("graphs", "XY graphs"), ("scopes", "Scopes"), ("spectra", "Spectra")):
        section_figures = [figure for figure in contents.figures if figure.section == key]
        if section_figures:
            sections.append(PageSection(key, heading, _figure_list(section_figures)))
    sections.append(PageSection("diagram", "Diagram", _diagram(contents)))
    sections.append(PageSection("run", "Run", _run(contents)))
    return framed_page(name, _lead(contents), _facts(contents), _notices(contents), sections)


def _lead(contents: ReportContents) -> str:
    result, count = contents.result, len(contents.diagram.blocks)
    end = axis_number(float(result.time[-1])) if result.time.size else "0"
    robots = sorted({motion.robot.name for motion in contents.motions})
    arm = f", robot {escape(', '.join(robots))}" if robots else ""
    about = contents.diagram.description.strip()
    description = f"{escape(about[:1].upper() + about[1:]).removesuffix('.')}. " if about else ""
    return f"{description}Simulation of {end} s, {counted(count, 'block')}{arm}."


def _facts(contents: ReportContents) -> str:
    run = contents.result.run
    solver = "none needed" if run.solver == "none" else run.solver
    facts: list[tuple[str, str, str]] = [
        ("Solver", escape(solver), ""),
        ("Steps", axis_number(run.steps), f"{axis_number(run.rejected)} rejected" if run.rejected else ""),
        ("Samples recorded", axis_number(contents.result.time.size), ""),
        ("Run in", *wall_time(run.wall_time)),
        ("Speed", axis_number(float(f"{run.real_time_factor:.3g}")), "× real time"),
    ]
    if run.solver == "none":
        del facts[1]
    return fact_list(facts)


def _notices(contents: ReportContents) -> str:
    """The notes of the report, most severe first: a run that ended early, limits, inertias, differences."""
    notices: list[tuple[str, str]] = []
    run = contents.result.run
    if not run.complete:
        reason = f" {run.message}" if run.message else ""
        end = axis_number(float(contents.result.time[-1])) if contents.result.time.size else "0"
        notices.append(
            ("error", f"Incomplete: the run stopped at t = {end} s; all results end there.{reason}")
        )
    elif run.message:
        notices.append(("warning", run.message))
    for summary in contents.summaries:
        notices += [("error", f"Limit exceeded: {finding.text}.") for finding in summary.findings]
    log = contents.result.log
    if log is not None and log.rows > contents.result.time.size:
        notices.append(
            (
                "warning",
                f"This report shows {axis_number(contents.result.time.size)} of "
                f"{axis_number(log.rows)} samples, with all extremes of the logged signals. Averages over "
                "time, work, path lengths and spectra are computed from them and less accurate than from "
                f"all samples, which are in {log.path.name}.",
            )
        )
    inertia_texts: set[str] = set()
    for motion in contents.motions:
        for finding in inertia_findings(motion.robot):
            if str(finding) not in inertia_texts:
                inertia_texts.add(str(finding))
                notices.append(("warning", str(finding)[:1].upper() + str(finding)[1:]))
        notices += [("warning", f"{motion.robot.name}: {note}.") for note in motion.notes]
    return notice_list(notices)


def _figure(figure: Figure) -> str:
    kind = "narrow" if figure.narrow else "wide"
    return (
        f'<figure class="{kind}">{svg_inline(figure.picture, "fig-" + figure.name, marks=figure.svg_marks)}'
        f"<figcaption>{escape(figure.caption)}</figcaption></figure>"
    )


def _figure_list(figures: Iterable[Figure]) -> str:
    figure_list = list(figures)
    figures_html = "".join(_figure(figure) for figure in figure_list)
    return (
        f'<div class="pair">{figures_html}</div>'
        if all(figure.narrow for figure in figure_list)
        else figures_html
    )


def _motion(motion: Motion, summary: MotionSummary, figures: Sequence[Figure]) -> str:
    return (
        "".join(_figure(figure) for figure in figures)
        + "<h3>Joints against their limits</h3>"
        + limits_table(summary)
        + (("<h3>Loads</h3>" + loads_table(motion, summary)) if motion.tau is not None else "")
        + "<h3>Tool</h3>"
        + tool_table(summary)
    )


def _displays(contents: ReportContents) -> str:
    """The last value of every signal that a Display shows."""
    result = contents.result
    rows: list[str] = []
    for block, view in diagram_views(contents.diagram):
        if view.kind is not ViewKind.VALUE or result.time.size == 0:
            continue
        for number, signal in enumerate(view.signals):
            path = result.resolve(f"{block}/{signal}")
            label = view.labels[number] if number < len(view.labels) else ""
            value = value_cell(np.asarray(result[path][-1]))
            unit = f' <span class="unit">{escape(result.units[path])}</span>' if result.units[path] else ""
            rows.append(
                f'<tr><th scope="row">{escape(block)}</th><td class="text">{escape(label or path)}</td>'
                f'<td class="text">{value}{unit}</td></tr>'
            )
    if not rows:
        return ""
    end = axis_number(float(result.time[-1]))
    heads = [("Display", ""), ("Signal", ""), ("Value", "")]
    return html_table(f"Values at t = {end} s", heads, rows, words=True)


def _diagram(contents: ReportContents) -> str:
    """The drawing of the top level, then each subsystem in a collapsible part; open if there are few."""
    state = " open" if len(contents.sheets) <= _MAX_OPEN_SHEETS else ""
    inner = "".join(
        f'<details class="sheet"{state}><summary>{escape(sheet.path)}</summary>'
        + _drawing(sheet.picture, f"fig-sheet-{number}", _same_content_note(sheet))
        + "</details>"
        for number, sheet in enumerate(contents.sheets, start=1)
    )
    heading = "<h3>Inside the subsystems</h3>" if inner else ""
    kinds = (
        "The model. Thin wires carry scalars, heavy wires vectors, double wires matrices, triple wires buses."
    )
    return _drawing(contents.drawing, "fig-diagram", kinds) + heading + inner


def _drawing(picture: Picture, identifier: str, caption: str) -> str:
    wide = f' style="max-width:{max(round(picture.width * 1.25), 320)}px;margin-inline:auto"'
    caption_html = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    return f'<figure class="wide"{wide}>{svg_inline(picture, identifier)}{caption_html}</figure>'


def _same_content_note(sheet: Sheet) -> str:
    return f"The following subsystems have the same content: {', '.join(sheet.same)}." if sheet.same else ""


def _run(contents: ReportContents) -> str:
    result, run = contents.result, contents.result.run
    settings = contents.diagram.settings
    facts = [
        ("Solver", run.reason if run.solver == "none" else f"{run.solver} ({run.reason})"),
        ("Stop time of the diagram", f"{axis_number(settings.stop_time)} s"),
        ("Steps accepted, rejected", f"{axis_number(run.steps)}, {axis_number(run.rejected)}"),
        ("Evaluations of the equations", axis_number(run.evaluations)),
        ("Continuous states", axis_number(result.states.shape[1])),
        ("Native code ready in", " ".join(wall_time(run.preparation_time))),
        ("Signals recorded", axis_number(len(result.names))),
        ("Complete", "yes" if run.complete else "no"),
    ]
    rows = [
        f'<tr><th scope="row">{label}</th><td class="text">{escape(text)}</td></tr>' for label, text in facts
    ]
    text = f"<table class='run'><tbody>{''.join(rows)}</tbody></table>"
    if result.parameters:
        values = [
            f'<tr><th scope="row"><code>{escape(name)}</code></th>'
            f'<td class="text">{value_cell(np.asarray(value))}</td></tr>'
            for name, value in sorted(result.parameters.items())
        ]
        text += "<h3>Parameters of the run</h3>" + html_table(
            "Values used in the run, in SI units", [("Parameter", ""), ("Value", "")], values, words=True
        )
    figures = [name for name in contents.files if name.startswith("figures/")]
    names = [name for name in contents.files if name not in figures]
    name_list = ", ".join(f"<code>{escape(name)}</code>" for name in names)
    if figures:
        name_list += f", and {counted(len(figures), 'figure')} in <code>figures/</code>"
    return text + f'<h3>Files in the same folder</h3><p class="files">{name_list}</p>'
