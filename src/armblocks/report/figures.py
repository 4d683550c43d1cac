"""The figures of a run: the figures of its arms, and one figure for each sink of the diagram."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.spectrum import SignalSpectrum, signal_spectrum
from armblocks.blocks import Mux
from armblocks.diagram import Diagram, SpectrumSettings, View, ViewKind, diagram_views, flat_diagram
from armblocks.errors import InputError
from armblocks.pictures.numbers import axis_number, si_prefix
from armblocks.pictures.picture import Picture, Text
from armblocks.pictures.style import FIGURE_WIDTH, SMALL_SIZE, Tone
from armblocks.pictures.svg import svg_marks
from armblocks.rendering.arm_drawing import pose_sequence_picture
from armblocks.report.charts.path_chart import path_chart, side_by_side
from armblocks.report.charts.spectrum_chart import spectrum_chart
from armblocks.report.charts.time_chart import Panel, Trace, fitted_label, label_fits, time_chart
from armblocks.report.motion import Motion
from armblocks.simulation.result import SimulationResult

_Array = NDArray[np.float64]

_DEGREES = 180 / math.pi
_UNIT_SPELLING = {"m/s2": "m/s²", "rad/s2": "rad/s²", "deg/s2": "deg/s²", "kg m2": "kg m²"}
_MAX_ENTRIES = 12
"""Maximum number of matrix entries that one chart shows; more lines cannot be distinguished."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Figure:
    """One picture of the report: ``name`` of its files, ``section`` of the report, and caption."""

    name: str
    section: str
    caption: str
    picture: Picture
    narrow: bool = False
    """Whether these pictures are placed side by side instead of one below the other."""

    @cached_property
    def svg_marks(self) -> str:
        """The marks as SVG, for the file and for the page."""
        return svg_marks(self.picture)


def motion_figures(motion: Motion, prefix: str) -> Iterator[Figure]:
    """The arm at six times, three projections of the tool's path, and the joints over time."""
    robot = motion.robot
    yield Figure(
        name=f"{prefix}moments",
        section="motion",
        caption=f"{robot.name} at six times of the run, with the path of its tool.",
        picture=pose_sequence_picture(robot, motion.time, motion.poses),
    )
    yield Figure(
        name=f"{prefix}tool-path",
        section="motion",
        caption="Path of the tool in the planes XY, XZ and YZ, all at one scale.",
        picture=_projections(motion),
    )
    yield Figure(
        name=f"{prefix}joints",
        section="motion",
        caption="Joints over time. Dashed lines: limits that a joint approaches or exceeds.",
        picture=_joints(motion),
    )


def view_figures(diagram: Diagram, result: SimulationResult, width: float = FIGURE_WIDTH) -> Iterator[Figure]:
    """A figure for every Scope, XY Graph and Spectrum of the diagram, in the order of their names."""
    rows = result.with_jumps()
    for block, view in diagram_views(diagram):
        if view.kind is ViewKind.TRACES:
            yield Figure(
                name=f"scope-{file_name(view.title or block)}",
                section="scopes",
                caption=view.title or block,
                picture=_scope(diagram, block, view, rows, width),
            )
        elif view.kind is ViewKind.PATH:
            yield Figure(
                name=f"xy-{file_name(block)}",
                section="graphs",
                caption=view.title or block,
                picture=_xy_graph(block, view, rows),
                narrow=True,
            )
        elif view.kind is ViewKind.SPECTRUM:
            yield Figure(
                name=f"spectrum-{file_name(block)}",
                section="spectra",
                caption=view.title or block,
                picture=_spectrum(block, view, result, width),
            )


def file_name(name: str) -> str:
    """A file name, made from a block's name, that is valid on every file system."""
    name = "".join(c if c.isascii() and c.isalnum() else "-" for c in name.lower()).strip("-")
    return name[:48] or "unnamed"


def in_display_unit(values: _Array, unit: str) -> tuple[_Array, str]:
    """Values and unit for display: degrees for radians, SI prefixes for very large or small values."""
    if unit.startswith("rad"):
        unit = "deg" + unit.removeprefix("rad")
        return values * _DEGREES, _UNIT_SPELLING.get(unit, unit)
    finite = np.abs(values[np.isfinite(values)])
    factor, prefix = si_prefix(float(finite.max(initial=0.0)))
    # No prefix for numbers without unit and units with powers, where it is ambiguous, and for usual numbers.
    if not unit or unit.startswith("kg") or unit == "s" or 1e-3 < factor < 1e3:
        return values, _UNIT_SPELLING.get(unit, unit)
    return values * factor, prefix + _UNIT_SPELLING.get(unit, unit)


def _projections(motion: Motion) -> Picture:
    tool = motion.tool
    span = float(np.ptp(tool, axis=0).max())
    width = (FIGURE_WIDTH - 24) / 3
    pictures = [
        path_chart(
            tool[:, a],
            tool[:, b],
            x_label=f"{'xyz'[a]}, m",
            y_label=f"{'xyz'[b]}, m",
            width=width,
            height=width + 6,
            equal=True,
            span=span,
        )
        for a, b in ((0, 1), (0, 2), (1, 2))
    ]
    start, end = (", ".join(axis_number(round(float(v), 3)) for v in p) for p in (tool[0], tool[-1]))
    return side_by_side(
        pictures,
        title=f"Tool path of {motion.robot.name} in three projections",
        description=f"From ({start}) m to ({end}) m.",
    )


def _joints(motion: Motion) -> Picture:
    robot = motion.robot
    panels: list[Panel] = []
    quantities: list[tuple[str, str, _Array, str]] = [
        ("position", "", motion.q, "position"),
        ("speed", "/s", motion.qd, "speed"),
        ("acceleration", "/s2", motion.qdd, ""),
    ]
    units = sorted({entry.unit for entry in robot.speeds}, reverse=True)  # rad before m
    for quantity, suffix, values, limit in quantities:
        for unit in units:
            name = {"rad": "angle", "m": "position"}[unit] if quantity == "position" else quantity
            panel = _joint_panel(motion, f"Joint {name}", unit, unit + suffix, values, limit)
            if panel.traces:
                panels.append(panel)
    if motion.tau is not None:
        for unit in units:
            torque, shown = ("Joint torque", "N m") if unit == "rad" else ("Joint force", "N")
            panels.append(_joint_panel(motion, torque, unit, shown, motion.tau, "torque"))
    quantity_names = ", ".join(panel.quantity.lower() for panel in panels)
    return time_chart(
        motion.time,
        panels,
        title=f"Joints of {robot.name} over time",
        description=f"Line charts of {quantity_names} over {axis_number(float(motion.time[-1]))} s.",
    )


def _joint_panel(
    motion: Motion, quantity: str, joint_unit: str, unit: str, values: _Array, limit: str
) -> Panel:
    robot = motion.robot
    joints = [j for j, entry in enumerate(robot.speeds) if entry.unit == joint_unit]
    columns = joints
    if limit == "position":
        indices = [(j, robot.position_of_speed[j]) for j in joints]
        joints = [j for j, index in indices if index is not None]
        columns = [index for _, index in indices if index is not None]
    values = values[:, columns]
    shown, shown_unit = in_display_unit(values, unit)
    factor = _factor(unit, shown_unit, values)
    traces: list[Trace] = []
    for column, j in enumerate(joints):
        limits = robot.limits[j]
        bounds: tuple[float, float] | None = None
        if limit == "position":
            bounds = limits.position
        elif limit == "speed" and limits.speed is not None:
            bounds = (-limits.speed, limits.speed)
        elif limit == "torque" and limits.torque is not None:
            bounds = (-limits.torque, limits.torque)
        scaled = None if bounds is None else (bounds[0] * factor, bounds[1] * factor)
        traces.append(Trace(label=robot.speeds[j].name, values=shown[:, column], index=j, limits=scaled))
    return Panel(quantity=quantity, unit=shown_unit, traces=tuple(traces))


def _factor(unit: str, shown_unit: str, values: _Array) -> float:
    """The factor that :func:`in_display_unit` applied."""
    if unit.startswith("rad"):
        return _DEGREES
    if shown_unit == _UNIT_SPELLING.get(unit, unit):
        return 1.0
    return si_prefix(float(np.abs(values[np.isfinite(values)]).max(initial=0.0)))[0]


def _scope(diagram: Diagram, block: str, view: View, result: SimulationResult, width: float) -> Picture:
    panels: list[Panel] = []
    for numbers in _panel_groups(block, view, result):
        names: list[str] = []
        columns: list[_Array] = []
        labels: list[str] = []
        unit = ""
        for number in numbers:
            label = view.labels[number] if number < len(view.labels) else ""
            path = result.resolve(f"{block}/{view.signals[number]}")
            slot = result.signals_layout[path]
            unit = slot.unit
            entries = list(np.ndindex(*slot.shape))[:_MAX_ENTRIES]
            columns.append(result[path].reshape(len(result.time), -1)[:, : len(entries)])
            mux_labels = () if label else _mux_labels(diagram, path, result)[: len(entries)]
            label = label or slot.title
            mux_labels = () if label else mux_labels
            name = label or (", ".join(mux_labels) if 0 < len(mux_labels) <= 3 else path)
            names.append(name)
            if mux_labels:
                labels += mux_labels
                continue
            short = name if len(numbers) > 1 and label_fits(name) else name.rpartition("/")[2]
            if slot.entries:
                labels += slot.entries[: len(entries)]
                continue
            labels += [f"{short}[{','.join(map(str, index))}]" if index else short for index in entries]
        if len(set(labels)) < len(labels) == len(names):
            # The last parts of long names are equal.
            labels = [fitted_label(name) for name in names]
        # One prefix for all signals of a panel, so that they can be compared.
        values, unit = in_display_unit(np.hstack(columns), unit)
        first = numbers[0] if len(labels) == 1 else 0
        traces = tuple(
            Trace(label=label, values=values[:, k], index=first + k) for k, label in enumerate(labels)
        )
        panels.append(Panel(quantity=", ".join(names), unit=unit, traces=traces))
    return time_chart(
        result.time,
        panels,
        title=f"Scope {block}",
        description=f"Traces over time of {', '.join(panel.quantity for panel in panels)}.",
        height=128.0,
        width=width,
    )


def _mux_labels(diagram: Diagram, path: str, result: SimulationResult) -> tuple[str, ...]:
    """The names of the source blocks of the entries of a Mux's output; empty for other blocks."""
    flat = flat_diagram(diagram)
    name = path.rpartition("/")[0]
    block = flat.blocks.get(name)
    if not isinstance(block, Mux):
        return ()
    names: list[str] = []
    for port in block.input_ports():
        source = flat.source(name, port.name)
        several = len(flat.blocks[source.block].output_ports()) > 1
        text = source.block.rpartition("/")[2] + (f" {source.port}" if several else "")
        shape = result.signals_layout[result.resolve(str(source))].shape
        names += [f"{text}[{','.join(map(str, index))}]" if index else text for index in np.ndindex(*shape)]
    return tuple(names)


def _panel_groups(block: str, view: View, result: SimulationResult) -> list[list[int]]:
    """Group the signals into panels: scalars of one unit share a panel, other signals have one each."""
    panels: list[list[int]] = []
    by_unit: dict[str, list[int]] = {}
    for number, signal in enumerate(view.signals):
        slot = result.signals_layout[result.resolve(f"{block}/{signal}")]
        if slot.size > 1:
            panels.append([number])
        elif slot.unit in by_unit:
            by_unit[slot.unit].append(number)
        else:
            by_unit[slot.unit] = [number]
            panels.append(by_unit[slot.unit])
    return panels


def _spectrum(block: str, view: View, result: SimulationResult, width: float) -> Picture:
    try:
        lines, settings = _spectra(block, view, result)
    except InputError as error:  # the run may have ended early; the rest of the report is still written
        picture = Picture(width=width, height=48.0, title=f"Spectrum {block}", description=str(error))
        picture.add(Text(14.0, 28.0, f"No spectrum: {error}", SMALL_SIZE, Tone.MUTED))
        return picture
    return spectrum_chart(
        lines,
        title=f"Spectrum {block}",
        decibels=settings.decibels,
        logarithmic=settings.logarithmic,
        width=width,
    )


def _spectra(
    block: str, view: View, result: SimulationResult
) -> tuple[list[tuple[str, str, SignalSpectrum]], SpectrumSettings]:
    """Label, unit and spectrum of every scalar, and the settings. Raises ``InputError``."""
    settings = view.subject
    assert isinstance(settings, SpectrumSettings)
    lines: list[tuple[str, str, SignalSpectrum]] = []
    for signal in view.signals:
        path = result.resolve(f"{block}/{signal}")
        slot = result.signals_layout[path]
        columns = result[path].reshape(len(result.time), -1)
        for element, column in list(zip(slot.elements, columns.T))[:_MAX_ENTRIES]:
            spectrum = signal_spectrum(
                result.time,
                column,
                quantity=settings.quantity,
                window=settings.window,
                averages=settings.averages,
                sample_rate=settings.sample_rate,
                begin=settings.begin,
                remove_mean=settings.remove_mean,
            )
            lines.append((element, _UNIT_SPELLING.get(slot.unit, slot.unit), spectrum))
    return lines, settings


def _xy_graph(block: str, view: View, result: SimulationResult) -> Picture:
    paths = [result.resolve(f"{block}/{signal}") for signal in view.signals[:2]]
    flats = [result[path].reshape(len(result.time), -1)[:, 0] for path in paths]
    units = [result.units[path] for path in paths]
    if units[0] == units[1]:  # one prefix for both axes, so that a unit has the same length on both axes
        axis_values, x_unit = in_display_unit(np.stack(flats), units[0])
        (x, y), y_unit = axis_values, x_unit
    else:
        (x, x_unit), (y, y_unit) = (in_display_unit(flat, unit) for flat, unit in zip(flats, units))
    labels = [
        ((view.labels[k] if k < len(view.labels) else "") or result.signals_layout[path].title or path)
        + (f", {unit}" if unit else "")
        for k, (path, unit) in enumerate(zip(paths, (x_unit, y_unit)))
    ]
    picture = path_chart(
        x,
        y,
        x_label=labels[0],
        y_label=labels[1],
        width=(FIGURE_WIDTH - 24) / 3,
        height=330.0,
        equal=bool(x_unit) and x_unit == y_unit,
    )
    picture.title = f"XY graph {block}"
    picture.description = f"{labels[1]} over {labels[0]}."
    return picture
