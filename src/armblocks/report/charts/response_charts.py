"""Step and impulse responses of linear systems, with their characteristics."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.linear_system import LinearSystem
from armblocks.analysis.time_response import StepMeasures, TimeResponse, shown_measures
from armblocks.pictures.numbers import table_number
from armblocks.pictures.picture import Disc, Mark, Picture, Polyline, Rectangle, Text
from armblocks.pictures.style import FIGURE_WIDTH, SMALL_SIZE, Tone, trace_dash, trace_tone
from armblocks.pictures.text_width import text_width
from armblocks.report.charts.axes import (
    BOTTOM,
    LEFT,
    RIGHT,
    TOP,
    PlotArea,
    clip_line,
    linear_area,
    with_legend,
)
from armblocks.report.charts.frequency_charts import channels
from armblocks.report.charts.scale import padded_range

_Array = NDArray[np.float64]

_HEIGHT = 300.0


def step_picture(
    system: LinearSystem, stop_time: float | None = None, *, width: float = FIGURE_WIDTH
) -> Picture:
    """Outputs after unit steps of the inputs; a single response has its characteristics marked."""
    response = system.step_response(stop_time)
    picture, area = _response_picture(response, "Step response", width)
    if system.is_siso:
        measures = shown_measures(response)
        picture.description += f" {measures_text(measures)}"
        picture.extend(_measure_marks(measures, area))
    return with_legend(picture, _names(system))


def impulse_picture(
    system: LinearSystem, stop_time: float | None = None, *, width: float = FIGURE_WIDTH
) -> Picture:
    """Outputs after unit impulses of the inputs."""
    picture, _ = _response_picture(system.impulse_response(stop_time), "Impulse response", width)
    return with_legend(picture, _names(system))


def measures_text(measures: StepMeasures) -> str:
    """Rise time, settling time, overshoot and final value, as far as defined, as one line of text."""
    parts = [
        f"{word} {table_number(value, 3)}{unit}"
        for word, value, unit in (
            ("rise time", measures.rise_time, " s"),
            ("settling time", measures.settling_time, " s"),
            ("overshoot", measures.overshoot, " %"),
            ("final value", measures.final, ""),
        )
        if math.isfinite(value)
    ]
    return (", ".join(parts) + ".").capitalize() if parts else "The response does not settle."


def _names(system: LinearSystem) -> list[str]:
    return [name for _, _, name in channels(system)]


def _response_picture(
    response: TimeResponse[LinearSystem], what: str, width: float
) -> tuple[Picture, PlotArea]:
    system = response.system
    shown = channels(system)
    values = np.concatenate([response.values[:, row, column] for row, column, _ in shown])
    low, high = padded_range(np.concatenate([values, [0.0]]), 0.08)
    box = (LEFT, TOP, width - RIGHT, TOP + _HEIGHT)
    time = response.time
    area = linear_area((float(time[0]), float(time[-1])), (low, high), box)
    units = {system.output_units[row] for row, _, _ in shown}
    unit = units.pop() if len(units) == 1 else ""
    head = system.outputs[0] if len(system.outputs) == 1 else "Outputs"
    picture = Picture(
        width=width,
        height=TOP + _HEIGHT + BOTTOM,
        title=f"{what} of {system.name or 'a linear system'}",
        description=f"{what} of {', '.join(name for _, _, name in shown)}.",
    )
    picture.extend(area.frame(x_label="Time, s", y_label=f"{head}, {unit}" if unit else head))
    for index, (row, column, _) in enumerate(shown):
        x, y = time, response.values[:, row, column]
        if system.is_discrete:
            # Zero-order hold: the value is constant until the next sample.
            x, y = np.repeat(x, 2)[1:], np.repeat(y, 2)[:-1]
        points = clip_line(area.points(x, y), box)
        picture.add(Polyline(points, trace_tone(index), 1.8, trace_dash(index)))
    return picture, area


def _measure_marks(measures: StepMeasures, area: PlotArea) -> list[Mark]:
    if not math.isfinite(measures.final) or measures.final == 0.0:
        return []
    left, top, right, bottom = area.box
    low, high = (area.y_scale(measures.final * fraction) for fraction in (0.98, 1.02))
    upper = max(min(low, high), top)
    level = area.y_scale(measures.final)
    marks: list[Mark] = [
        Rectangle(
            left, upper, right - left, min(max(low, high), bottom) - upper, fill=Tone.HAIRLINE, opacity=0.35
        ),
        Polyline([(left, level), (right, level)], Tone.ACCENT, 1.0, (5.0, 4.0)),
    ]
    labels: list[tuple[float, str]] = []
    if math.isfinite(measures.settling_time) and measures.settling_time > 0.0:
        labels.append((measures.settling_time, f"settled {table_number(measures.settling_time, 3)} s"))
    if math.isfinite(measures.rise_time) and measures.rise_time > 0.0:
        word = f"rise time {table_number(measures.rise_time, 3)} s"
        marks.append(Text(right - 8, bottom - 12, word, SMALL_SIZE, Tone.ACCENT, "end", bold=True))
    for time, word in labels:
        x = area.x_scale(time)
        if x > right:
            continue
        marks.append(Polyline([(x, level), (x, bottom)], Tone.ACCENT, 1.4, (2.0, 3.0)))
        fits = x + 10 + text_width(word, SMALL_SIZE, bold=True) < right
        side = "start" if fits else "end"
        marks.append(
            Text(x + (7 if fits else -7), bottom - 28, word, SMALL_SIZE, Tone.ACCENT, side, bold=True)
        )
    if measures.overshoot > 0.5:
        x, y = area.x_scale(measures.peak_time), area.y_scale(measures.peak)
        word = f"overshoot {table_number(measures.overshoot, 3)} %"
        fits = x + 10 + text_width(word, SMALL_SIZE, bold=True) < right
        marks.append(Disc(x, y, 3.6, fill=Tone.ACCENT))
        marks.append(
            Text(
                x + (9 if fits else -9),
                y + 3.5,
                word,
                SMALL_SIZE,
                Tone.ACCENT,
                "start" if fits else "end",
                bold=True,
            )
        )
    return marks
