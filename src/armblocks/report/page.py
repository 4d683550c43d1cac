"""``report.html``: one self-contained page. No network, no script; every name from a user is escaped."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from armblocks.diagram import Diagram, ViewKind
from armblocks.report.analysis import LimitFinding, LimitKind, MotionSummary, people_unit
from armblocks.report.figures import Figure
from armblocks.report.motion import Motion
from armblocks.report.numbers import MINUS, axis_number, si_prefix, table_number
from armblocks.report.page_style import page_css
from armblocks.report.picture import Picture
from armblocks.report.style import trace_tone
from armblocks.report.svg import escape, svg_inline
from armblocks.robot import inertia_findings
from armblocks.simulation.result import SimulationResult

# Nothing may be loaded or run; styles stand in the page, pictures in data: addresses.
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"

_ICONS = {
    "error": '<path d="M7.9 2.5h4.2L17.5 7.9v4.2L12.1 17.5H7.9L2.5 12.1V7.9z" fill="none" '
    'stroke="currentColor" stroke-width="1.6" stroke-linejoin="round"/>',
    "warning": '<path d="M10 2.8 18 16.8H2z" fill="none" stroke="currentColor" stroke-width="1.6" '
    'stroke-linejoin="round"/>',
}


@dataclass(frozen=True, eq=False, kw_only=True)
class ReportContents:
    """Everything that the page shows; ``summaries`` go with ``motions``, ``files`` are relative paths."""

    diagram: Diagram
    result: SimulationResult
    motions: Sequence[Motion]
    summaries: Sequence[MotionSummary]
    figures: Sequence[Figure]
    drawing: Picture
    files: Sequence[str]


def report_page(contents: ReportContents) -> str:
    """The whole page as HTML text."""
    name = escape(contents.diagram.name)
    sections: list[tuple[str, str, str]] = []
    motion_figures = [figure for figure in contents.figures if figure.section == "motion"]
    share = len(motion_figures) // max(len(contents.motions), 1)
    for number, (motion, summary) in enumerate(zip(contents.motions, contents.summaries)):
        own = motion_figures[number * share : (number + 1) * share]
        body = _motion(motion, summary, own)
        sections.append((f"motion-{number + 1}", f"Motion of {escape(motion.robot.name)}", body))
    displays = _displays(contents)
    if displays:
        sections.append(("displays", "Displays", displays))
    for key, heading in (("graphs", "XY graphs"), ("scopes", "Scopes")):
        chosen = [figure for figure in contents.figures if figure.section == key]
        if chosen:
            sections.append((key, heading, _figure_list(chosen)))
    sections.append(("diagram", "Diagram", _diagram(contents)))
    sections.append(("run", "Run", _run(contents)))
    links = "".join(f'<li><a href="#{key}">{heading}</a></li>' for key, heading, _ in sections)
    body = "".join(
        f'<section aria-labelledby="{key}"><h2 id="{key}">{heading}</h2>{text}</section>'
        for key, heading, text in sections
    )
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        f"<title>{name}: report</title><style>{page_css()}</style></head><body>"
        f'<header class="top"><h1>{name}</h1><p class="lead">{_lead(contents)}</p>'
        f"{_facts(contents)}{_notices(contents)}"
        f'<nav aria-label="Sections"><ul>{links}</ul></nav></header>'
        f"<main>{body}<footer>Written by armblocks. All quantities in SI units unless a unit is given; "
        "angles in degrees.</footer></main></body></html>\n"
    )


def _lead(contents: ReportContents) -> str:
    result, count = contents.result, len(contents.diagram.blocks)
    end = axis_number(float(result.time[-1])) if result.time.size else "0"
    robots = sorted({motion.robot.name for motion in contents.motions})
    arm = f", robot {escape(', '.join(robots))}" if robots else ""
    return f"Simulation of {end} s, {count} blocks{arm}."


def _facts(contents: ReportContents) -> str:
    run = contents.result.run
    solver = "none needed" if run.solver == "none" else run.solver
    facts: list[tuple[str, str, str]] = [
        ("Solver", escape(solver), ""),
        ("Steps", axis_number(run.steps), f"{axis_number(run.rejected)} rejected" if run.rejected else ""),
        ("Instants recorded", axis_number(contents.result.time.size), ""),
        ("Wall time", *_seconds(run.wall_time)),
        ("Speed", axis_number(float(f"{run.real_time_factor:.3g}")), "× real time"),
    ]
    if run.solver == "none":
        del facts[1]
    items = "".join(
        f"<div><dt>{label}</dt><dd>{value} <small>{unit}</small></dd></div>" for label, value, unit in facts
    )
    return f'<dl class="facts">{items}</dl>'


def _seconds(value: float) -> tuple[str, str]:
    factor, prefix = si_prefix(value) if value < 1 else (1.0, "")
    return axis_number(float(f"{value * factor:.3g}")), f"{prefix}s"


def _notices(contents: ReportContents) -> str:
    """What deserves a look, the worst first: a run that stopped early, limits, inertias, differences."""
    notices: list[tuple[str, str]] = []
    run = contents.result.run
    if not run.complete:
        reason = f" {run.message}" if run.message else ""
        end = axis_number(float(contents.result.time[-1])) if contents.result.time.size else "0"
        notices.append(
            ("error", f"Incomplete: the run stopped at t = {end} s; what follows ends there.{reason}")
        )
    elif run.message:
        notices.append(("warning", run.message))
    for summary in contents.summaries:
        notices += [("error", f"Limit broken: {finding.text}.") for finding in summary.findings]
    seen: set[str] = set()
    for motion in contents.motions:
        for finding in inertia_findings(motion.robot):
            if str(finding) not in seen:
                seen.add(str(finding))
                notices.append(("warning", str(finding)[:1].upper() + str(finding)[1:]))
        notices += [("warning", f"{motion.robot.name}: {note}.") for note in motion.notes]
    if not notices:
        return ""
    items = "".join(
        f'<li class="{kind}"><svg viewBox="0 0 20 20" role="img" aria-label="{kind}">{_ICONS[kind]}'
        '<path d="M10 7.2v4.2M10 13.6v.4" stroke="currentColor" stroke-width="1.8" stroke-linecap="round"/>'
        f"</svg><span>{escape(text)}</span></li>"
        for kind, text in notices
    )
    return f'<ul class="notes">{items}</ul>'


def _figure(figure: Figure) -> str:
    kind = "narrow" if figure.narrow else "wide"
    return (
        f'<figure class="{kind}">{svg_inline(figure.picture, "fig-" + figure.name)}'
        f"<figcaption>{escape(figure.caption)}</figcaption></figure>"
    )


def _figure_list(figures: Iterable[Figure]) -> str:
    listed = list(figures)
    drawn = "".join(_figure(figure) for figure in listed)
    return f'<div class="pair">{drawn}</div>' if all(figure.narrow for figure in listed) else drawn


def _motion(motion: Motion, summary: MotionSummary, figures: Sequence[Figure]) -> str:
    return (
        "".join(_figure(figure) for figure in figures)
        + "<h3>Joints against their limits</h3>"
        + _limits_table(summary)
        + (("<h3>Loads</h3>" + _loads_table(motion, summary)) if motion.tau is not None else "")
        + "<h3>Tool</h3>"
        + _tool_table(summary)
    )


def _limits_table(summary: MotionSummary) -> str:
    broken = {(finding.joint, finding.kind): finding for finding in summary.findings}
    heads = [
        ("Joint", ""), ("Range used", ""), ("Range allowed", ""), ("Margin", ""), ("Peak speed", ""),
        ("at", "s"), ("Speed allowed", ""), ("Speed used", "%"), ("Peak acceleration", ""),
    ]  # fmt: skip
    same_unit = len({joint.unit for joint in summary.joints}) == 1
    if same_unit and summary.joints:
        unit = summary.joints[0].unit
        position, speed = people_unit(LimitKind.POSITION, unit)[1], people_unit(LimitKind.SPEED, unit)[1]
        units = ["", position, position, position, speed, "s", speed, "%", f"{speed}²"]
        heads = [(title, unit) for (title, _), unit in zip(heads, units)]
    rows: list[str] = []
    for index, joint in enumerate(summary.joints):
        factor, unit = people_unit(LimitKind.POSITION, joint.unit)
        tail = "" if same_unit else f' <span class="unit">{unit}</span>'
        allowed = "not limited"
        if joint.position_limits is not None:
            allowed = _span(joint.position_limits[0] * factor, joint.position_limits[1] * factor)
        share = None if joint.speed_share is None else 100 * joint.speed_share
        cells = [
            _cell(_span(joint.position_min * factor, joint.position_max * factor) + tail),
            _cell(allowed),
            _judged(joint.position_margin, factor, broken.get((joint.name, LimitKind.POSITION))),
            _judged(joint.speed_peak, factor, broken.get((joint.name, LimitKind.SPEED))),
            _cell(table_number(joint.speed_peak_time, 3)),
            _cell("not limited" if joint.speed_limit is None else table_number(joint.speed_limit * factor)),
            _cell("" if share is None else table_number(share, 3)),
            _cell(table_number(joint.acceleration_peak * factor)),
        ]
        rows.append(_row(joint.name, index, cells))
    return _table("Positions and speeds of each joint over the run", heads, rows)


def _loads_table(motion: Motion, summary: MotionSummary) -> str:
    broken = {(finding.joint, finding.kind): finding for finding in summary.findings}
    torque = "N m" if set(motion.robot.joint_units) == {"rad"} else "N m or N"
    heads = [
        ("Joint", ""), ("Peak torque", torque), ("RMS torque", torque), ("Motor peak", "N m"),
        ("Motor RMS", "N m"), ("Motor speed", "rev/min"), ("Peak power", "W"), ("Work done", "J"),
        ("Work taken", "J"),
    ]  # fmt: skip
    rows = [
        _row(
            joint.name,
            index,
            [
                _judged(joint.torque_peak, 1.0, broken.get((joint.name, LimitKind.TORQUE))),
                _cell(_optional(joint.torque_rms)),
                _cell(_optional(joint.motor_torque_peak)),
                _cell(_optional(joint.motor_torque_rms)),
                _cell(_optional(joint.motor_speed_peak, 30 / np.pi)),
                _cell(_optional(joint.power_peak)),
                _cell(_optional(joint.work_done)),
                _cell(_optional(joint.work_taken)),
            ],
        )
        for index, joint in enumerate(summary.joints)
    ]
    done = sum(joint.work_done or 0.0 for joint in summary.joints)
    taken = sum(joint.work_taken or 0.0 for joint in summary.joints)
    total = ["", "", "", "", "", _optional(summary.power_peak), table_number(done), table_number(taken)]
    rows.append(f'<tr><th scope="row">All</th>{"".join(_cell(text) for text in total)}</tr>')
    note = (
        "Torques at the joint; the motor's are divided by the gear ratio, its speed multiplied by it. "
        "Work done: what the drives put in; taken: what they brake."
    )
    return _table(note, heads, rows)


def _tool_table(summary: MotionSummary) -> str:
    heads = [("", ""), ("x", "m"), ("y", "m"), ("z", "m")]
    rows = [
        f'<tr><th scope="row">{word}</th>{"".join(_cell(_fixed(v)) for v in place)}</tr>'
        for word, place in (("Start", summary.tool_start), ("End", summary.tool_end))
    ]
    return (
        _table("Position of the tool in the world", heads, rows)
        + f"<p>Path length {table_number(summary.tool_path_length, 5)} m, "
        f"greatest speed {table_number(summary.tool_speed_peak)} m/s.</p>"
    )


def _fixed(value: float) -> str:
    return f"{value:.6f}".replace("-", MINUS)


def _table(caption: str, heads: Sequence[tuple[str, str]], rows: Sequence[str]) -> str:
    head = "".join(
        f'<th scope="col">{title}' + (f'<span class="unit">{unit}</span>' if unit else "") + "</th>"
        for title, unit in heads
    )
    return (
        f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(caption)}">'
        f"<table><caption>{escape(caption)}</caption><thead><tr>{head}</tr></thead>"
        f"<tbody>{''.join(rows)}</tbody></table></div>"
    )


def _row(name: str, index: int, cells: Sequence[str]) -> str:
    key = f'<span class="key" style="background:var(--{trace_tone(index).value})"></span>'
    return f'<tr><th scope="row">{key}{escape(name)}</th>{"".join(cells)}</tr>'


def _cell(text: str) -> str:
    return f"<td>{text}</td>"


def _judged(value: float | None, factor: float, finding: LimitFinding | None) -> str:
    text = _optional(value, factor)
    if finding is None:
        return _cell(text)
    since = table_number(finding.first_time, 3)
    return f'<td class="bad">{text}<small>over limit from {since} s</small></td>'


def _optional(value: float | None, factor: float = 1.0) -> str:
    return "" if value is None else table_number(value * factor)


def _span(low: float, high: float) -> str:
    return f"{table_number(low)} … {table_number(high)}"


def _displays(contents: ReportContents) -> str:
    """The last value of every signal that a Display shows."""
    result = contents.result
    rows: list[str] = []
    for block, view in contents.diagram.views():
        if view.kind is not ViewKind.VALUE or result.time.size == 0:
            continue
        for number, signal in enumerate(view.signals):
            path = result.resolve(f"{block}/{signal}")
            label = view.labels[number] if number < len(view.labels) else ""
            value = _value(np.asarray(result[path][-1]))
            unit = f' <span class="unit">{escape(result.units[path])}</span>' if result.units[path] else ""
            rows.append(
                f'<tr><th scope="row">{escape(block)}</th><td class="text">{escape(label or path)}</td>'
                f'<td class="text">{value}{unit}</td></tr>'
            )
    if not rows:
        return ""
    end = axis_number(float(result.time[-1]))
    return (
        _table(f"Values at t = {end} s", [("Display", ""), ("Signal", ""), ("Value", "")], rows)
        .replace('<th scope="col">Signal', '<th scope="col" style="text-align:left">Signal')
        .replace('<th scope="col">Value', '<th scope="col" style="text-align:left">Value')
    )


def _value(value: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    if value.ndim == 0:
        return table_number(float(value), 9)
    lines = value.reshape(-1, value.shape[-1]) if value.ndim > 1 else value[None]
    body = "".join(
        "<tr>" + "".join(_cell(table_number(float(v), 7)) for v in line) + "</tr>" for line in lines
    )
    return f'<table class="matrix" role="presentation">{body}</table>'


def _diagram(contents: ReportContents) -> str:
    picture = contents.drawing
    wide = f' style="max-width:{max(round(picture.width * 1.25), 320)}px;margin-inline:auto"'
    return (
        f'<figure class="wide"{wide}>{svg_inline(picture, "fig-diagram")}'
        "<figcaption>The model. Thin wires carry scalars, heavy ones vectors, double ones matrices."
        "</figcaption></figure>"
    )


def _run(contents: ReportContents) -> str:
    result, run = contents.result, contents.result.run
    settings = contents.diagram.settings
    facts = [
        ("Solver", f"{run.solver} ({run.reason})" if run.reason else run.solver),
        ("Stop time asked for", f"{axis_number(settings.stop_time)} s by the diagram"),
        ("Steps accepted, rejected", f"{axis_number(run.steps)}, {axis_number(run.rejected)}"),
        ("Evaluations of the equations", axis_number(run.evaluations)),
        ("Continuous states", axis_number(result.states.shape[1])),
        ("Signals recorded", axis_number(len(result.names))),
        ("Complete", "yes" if run.complete else "no"),
    ]
    rows = [
        f'<tr><th scope="row">{label}</th><td class="text">{escape(text)}</td></tr>' for label, text in facts
    ]
    text = f"<table><tbody>{''.join(rows)}</tbody></table>"
    if result.parameters:
        values = [
            f'<tr><th scope="row"><code>{escape(name)}</code></th>'
            f'<td class="text">{_value(np.asarray(value))}</td></tr>'
            for name, value in sorted(result.parameters.items())
        ]
        text += "<h3>Parameters of the run</h3>" + _table(
            "As the run used them, SI units", [("Parameter", ""), ("Value", "")], values
        )
    listed = ", ".join(f"<code>{escape(name)}</code>" for name in contents.files)
    return text + f'<h3>Files beside this page</h3><p class="files">{listed}</p>'
