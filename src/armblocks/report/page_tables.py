"""The tables of the report's page: joints against their limits, loads, tool, values."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from armblocks.pictures.numbers import MINUS, axis_number, table_number
from armblocks.pictures.style import trace_tone
from armblocks.pictures.svg import escape
from armblocks.report.motion import Motion
from armblocks.report.motion_summary import LimitFinding, LimitKind, MotionSummary, shown_unit_of

MAX_NUMBERS = 64
"""Maximum number of elements of an array that is listed; of larger arrays only the range is given."""


def limits_table(summary: MotionSummary) -> str:
    """Each joint's range and speed over the run against its limits, in degrees or m."""
    exceeded = {(finding.joint, finding.kind): finding for finding in summary.findings}
    heads = [
        ("Joint", ""), ("Range used", ""), ("Range allowed", ""), ("Margin", ""), ("Peak speed", ""),
        ("at", "s"), ("Speed allowed", ""), ("Speed used", "%"), ("Peak acceleration", ""),
    ]  # fmt: skip
    same_unit = len({joint.unit for joint in summary.joints}) == 1
    if same_unit and summary.joints:
        unit = summary.joints[0].unit
        position, speed = shown_unit_of(LimitKind.POSITION, unit)[1], shown_unit_of(LimitKind.SPEED, unit)[1]
        units = ["", position, position, position, speed, "s", speed, "%", f"{speed}²"]
        heads = [(title, unit) for (title, _), unit in zip(heads, units)]
    rows: list[str] = []
    for index, joint in enumerate(summary.joints):
        factor, unit = shown_unit_of(LimitKind.POSITION, joint.unit)
        unit_html = "" if same_unit else f' <span class="unit">{unit}</span>'
        allowed = "not limited"
        if joint.position_limits is not None:
            allowed = _span(joint.position_limits[0] * factor, joint.position_limits[1] * factor)
        share = None if joint.speed_share is None else 100 * joint.speed_share
        cells = [
            _cell(_range(joint.position_min, joint.position_max, factor, unit_html)),
            _cell(allowed),
            _limit_cell(joint.position_margin, factor, exceeded.get((joint.name, LimitKind.POSITION))),
            _limit_cell(joint.speed_peak, factor, exceeded.get((joint.name, LimitKind.SPEED))),
            _cell(table_number(joint.speed_peak_time, 3)),
            _cell("not limited" if joint.speed_limit is None else table_number(joint.speed_limit * factor)),
            _cell("" if share is None else table_number(share, 3)),
            _cell(table_number(joint.acceleration_peak * factor)),
        ]
        rows.append(_row(joint.name, index, cells))
    return html_table("Positions and speeds of each joint over the run", heads, rows)


def loads_table(motion: Motion, summary: MotionSummary) -> str:
    """Each joint's torque (N m, or force in N), also at its motor, power (W) and work (J)."""
    exceeded = {(finding.joint, finding.kind): finding for finding in summary.findings}
    torque = "N m" if {entry.unit for entry in motion.robot.speeds} == {"rad"} else "N m or N"
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
                _limit_cell(joint.torque_peak, 1.0, exceeded.get((joint.name, LimitKind.TORQUE))),
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
    work_done = sum(joint.work_done or 0.0 for joint in summary.joints)
    work_taken = sum(joint.work_taken or 0.0 for joint in summary.joints)
    total = [
        "",
        "",
        "",
        "",
        "",
        _optional(summary.power_peak),
        table_number(work_done),
        table_number(work_taken),
    ]
    rows.append(f'<tr><th scope="row">All</th>{"".join(_cell(text) for text in total)}</tr>')
    note = (
        "Torques at the joint. Motor torques are divided by the gear ratio, motor speeds multiplied by it. "
        "Work done: positive work of the drives; taken: negative work, in braking."
    )
    return html_table(note, heads, rows)


def tool_table(summary: MotionSummary) -> str:
    """Start and end position of the tool (m, world frame), its path length and maximum speed."""
    heads = [("", ""), ("x", "m"), ("y", "m"), ("z", "m")]
    rows = [
        f'<tr><th scope="row">{word}</th>{"".join(_cell(_fixed(v)) for v in position)}</tr>'
        for word, position in (("Start", summary.tool_start), ("End", summary.tool_end))
    ]
    return (
        html_table("Position of the tool in the world", heads, rows)
        + f"<p>Path length {table_number(summary.tool_path_length, 5)} m, "
        f"maximum speed {table_number(summary.tool_speed_peak)} m/s.</p>"
    )


def _fixed(value: float) -> str:
    return f"{round(value, 6) + 0.0:.6f}".replace("-", MINUS)


def html_table(
    caption: str, heads: Sequence[tuple[str, str]], rows: Sequence[str], *, words: bool = False
) -> str:
    """A table with a caption and headed columns (title, unit); ``words``: columns of text, not of numbers."""
    kind = ' class="words"' if words else ""
    head = "".join(
        f'<th scope="col">{title}' + (f'<span class="unit">{unit}</span>' if unit else "") + "</th>"
        for title, unit in heads
    )
    return (
        f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(caption)}">'
        f"<table{kind}><caption>{escape(caption)}</caption><thead><tr>{head}</tr></thead>"
        f"<tbody>{''.join(rows)}</tbody></table></div>"
    )


def _row(name: str, index: int, cells: Sequence[str]) -> str:
    key = f'<span class="key" style="background:var(--{trace_tone(index).value})"></span>'
    return f'<tr><th scope="row">{key}{escape(name)}</th>{"".join(cells)}</tr>'


def _cell(text: str) -> str:
    return f"<td>{text}</td>"


def _limit_cell(value: float | None, factor: float, finding: LimitFinding | None) -> str:
    text = _optional(value, factor)
    if finding is None:
        return _cell(text)
    since = table_number(finding.first_time, 3)
    return f'<td class="bad">{text}<small>over limit from {since} s</small></td>'


def _optional(value: float | None, factor: float = 1.0) -> str:
    return "" if value is None else table_number(value * factor)


def _range(low: float | None, high: float | None, factor: float, unit_html: str) -> str:
    """The range of a coordinate and its unit; empty for ball joints, which have no range."""
    return "" if low is None or high is None else _span(low * factor, high * factor) + unit_html


def _span(low: float, high: float) -> str:
    return f"{table_number(low)} … {table_number(high)}"


def value_cell(value: NDArray[np.float64]) -> str:
    """A scalar with nine digits, a vector as a row, a matrix as rows; for many numbers their range."""
    if value.ndim == 0:
        return table_number(float(value), 9)
    if value.size > MAX_NUMBERS:
        low, high = (table_number(float(end), 7) for end in (value.min(), value.max()))
        return f"{axis_number(value.size)} numbers, {low} … {high}"
    lines = value.reshape(-1, value.shape[-1]) if value.ndim > 1 else value[None]
    body = "".join(
        "<tr>" + "".join(_cell(table_number(float(v), 7)) for v in line) + "</tr>" for line in lines
    )
    return f'<table class="matrix" role="presentation">{body}</table>'
