"""The summary of a run: statistics, displayed values, joints and their limits, files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from rich.text import Text

from armblocks.cli.progress import factor_text
from armblocks.cli.terminal import ERROR, STRONG, WARNING, table
from armblocks.diagram import ViewKind, diagram_views
from armblocks.errors import counted
from armblocks.extras import installed
from armblocks.pictures.numbers import wall_time
from armblocks.report.motion import motions
from armblocks.report.motion_summary import JointSummary, LimitKind, shown_summary, shown_unit_of, summarise

if TYPE_CHECKING:
    from armblocks import Diagram, SimulationResult
    from armblocks.report.writing import ReportFiles

LIMIT_MARK = "!"
"""Marks values beyond a limit, for output without colours."""


def print_run(result: SimulationResult, console: Console) -> None:
    """Print one line with model, solver and speed."""
    run = result.run
    end = f"{result.time[-1]:,.10g} s" if result.time.size else "nothing"
    method = "evaluated at" if run.solver == "none" else f"{run.solver}, {run.steps:,} steps, recorded at"
    text = Text.assemble(
        (f"{result.name}: ", STRONG),
        f"{end} in {' '.join(wall_time(run.wall_time))}, {factor_text(run.real_time_factor)} x real time; ",
        f"{method} {result.time.size:,} samples",
    )
    console.print(text)
    if not run.complete:
        console.print(Text.assemble(("incomplete: ", WARNING), run.message))
    elif run.message:
        console.print(Text.assemble(("note: ", WARNING), run.message))


def print_displays(diagram: Diagram, result: SimulationResult, console: Console) -> None:
    """Print the last values of all Display blocks."""
    displays = table(("display", "left"), ("signal", "left"), ("at the end", "left"), ("", "left"))
    for block, view in diagram_views(diagram):
        if view.kind is not ViewKind.VALUE or not result.time.size:
            continue
        labels = view.labels or ("",) * len(view.signals)
        for signal, label in zip(view.signals, labels):
            path = result.resolve(f"{block}/{signal}")
            displays.add_row(
                block, label or path, _value_text(np.asarray(result[path][-1])), result.units[path]
            )
    if displays.row_count:
        console.print()
        console.print(displays)


def _value_text(value: NDArray[np.float64]) -> str:
    """A value with nine digits: more than a Display block shows, enough to compare two runs."""
    rows = [[f"{number + 0.0:.9g}" for number in row] for row in np.atleast_2d(value)]
    widths = [max(len(cell) for cell in column) for column in zip(*rows)]
    return "\n".join("  ".join(cell.rjust(width) for cell, width in zip(row, widths)) for row in rows)


def print_motions(diagram: Diagram, result: SimulationResult, console: Console) -> None:
    """Print the joints of each robot and their limits; values beyond a limit are marked and listed."""
    if not result.time.size:
        return
    for motion in motions(diagram, result):
        summary = shown_summary(
            summarise(motion.robot, motion.time, motion.q, motion.qd, motion.qdd, motion.tau, motion.tool)
        )
        exceeded = {(finding.joint, finding.kind) for finding in summary.findings}
        console.print()
        console.print(Text(motion.robot.name, STRONG))
        console.print(_joint_table(summary.joints, exceeded))
        for finding in summary.findings:
            console.print(Text.assemble((f"{LIMIT_MARK} ", ERROR), finding.text))


def _joint_table(joints: Sequence[JointSummary], exceeded: set[tuple[str, LimitKind]]) -> Table:
    units = {joint.unit for joint in joints}
    mixed = len(units) != 1
    limited = any(joint.torque_limit is not None for joint in joints)
    headings = {kind: "" if mixed else f"\n{shown_unit_of(kind, joints[0].unit)[1]}" for kind in LimitKind}
    rows = table(
        ("joint", "left"),
        *((("unit", "left"),) if mixed else ()),
        (f"from … to{headings[LimitKind.POSITION]}", "right"),
        ("allowed", "right"),
        (f"peak speed{headings[LimitKind.SPEED]}", "right"),
        ("allowed", "right"),
        (f"peak torque{headings[LimitKind.TORQUE]}", "right"),
        ("RMS", "right"),
        *((("allowed", "right"),) if limited else ()),
    )
    for joint in joints:
        position, angle = shown_unit_of(LimitKind.POSITION, joint.unit)
        speed, _ = shown_unit_of(LimitKind.SPEED, joint.unit)
        ends = joint.position_limits
        rows.add_row(
            joint.name,
            *((angle,) if mixed else ()),
            _limit_cell(
                _range(joint.position_min, joint.position_max, position),
                (joint.name, LimitKind.POSITION) in exceeded,
            ),
            "" if ends is None else _span(ends[0] * position, ends[1] * position),
            _limit_cell(_short(joint.speed_peak * speed), (joint.name, LimitKind.SPEED) in exceeded),
            _short(None if joint.speed_limit is None else joint.speed_limit * speed),
            _limit_cell(_short(joint.torque_peak), (joint.name, LimitKind.TORQUE) in exceeded),
            _short(joint.torque_rms),
            *((_short(joint.torque_limit),) if limited else ()),
        )
    return rows


def _limit_cell(text: str, is_exceeded: bool) -> Text:
    """A cell; a value beyond a limit has a mark and a colour."""
    return Text(f"{LIMIT_MARK} {text}", ERROR) if is_exceeded else Text(text)


def _range(low: float | None, high: float | None, factor: float) -> str:
    """The range of a coordinate; empty for the speeds of ball joints, which have none."""
    return "" if low is None or high is None else _span(low * factor, high * factor)


def _span(low: float, high: float) -> str:
    return f"{_short(low)} … {_short(high)}"


def _short(value: float | None) -> str:
    return "" if value is None else f"{value + 0.0:.4g}"


def print_files(files: ReportFiles, console: Console) -> None:
    """Print the paths of the report and its files."""
    names = [path.name for path in (*files.data, files.diagram)]
    if files.figures:
        names.append(f"{counted(len(files.figures), 'figure')} in {files.figures[0].parent.name}")
    console.print()
    console.print(Text.assemble(("report: ", STRONG), str(files.page)), soft_wrap=True)
    console.print(f"in the same folder: {', '.join(names)}", soft_wrap=True)
    absent = [
        (kind, extra)
        for kind, library, extra in (("PNG figures", "matplotlib", "figures"), ("Parquet", "pyarrow", "data"))
        if not installed(library)
    ]
    if absent:
        kinds, extras = " and ".join(kind for kind, _ in absent), ",".join(extra for _, extra in absent)
        console.print(f'To write {kinds} as well: pip install "armblocks[{extras}]"', soft_wrap=True)
