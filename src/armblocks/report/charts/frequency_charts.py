"""Bode and Nyquist diagrams of linear systems."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.frequency import (
    as_continuous,
    evaluate,
    frequency_grid,
    frequency_range,
    frequency_response,
    gain_and_phase,
)
from armblocks.analysis.linear_system import LinearSystem
from armblocks.analysis.margins import Margins, shown_margins
from armblocks.pictures.numbers import MINUS, table_number
from armblocks.pictures.picture import Disc, Mark, Picture, Polyline, Text
from armblocks.pictures.style import FIGURE_WIDTH, SMALL_SIZE, Tone, trace_dash, trace_tone
from armblocks.pictures.text_width import text_width
from armblocks.report.charts.axes import (
    BOTTOM,
    LEFT,
    RIGHT,
    TOP,
    PlotArea,
    clip_line,
    equal_scale_ranges,
    linear_area,
    log_area,
    with_legend,
)
from armblocks.report.charts.scale import padded_range

_Array = NDArray[np.float64]
_Complex = NDArray[np.complex128]

_PANEL_HEIGHT = 210.0
_MAX_CHANNELS = 8
_MIN_RELATIVE_GAIN = 1e-12
"""Lower limit of displayed gains relative to the largest, because a gain of 0 has no value in decibels."""


def channels(system: LinearSystem) -> list[tuple[int, int, str]]:
    """Row, column and name of the displayed channels: the first pairs of output and input."""
    several_in, several_out = len(system.inputs) > 1, len(system.outputs) > 1
    pairs: list[tuple[int, int, str]] = []
    for row, output in enumerate(system.outputs):
        for column, entry in enumerate(system.inputs):
            name = f"{output} from {entry}" if several_in or not several_out else output
            pairs.append((row, column, name))
    return pairs[:_MAX_CHANNELS]


def bode_picture(
    system: LinearSystem, *, margins: bool = False, hertz: bool = False, width: float = FIGURE_WIDTH
) -> Picture:
    """Gain in dB and phase in degrees over frequency; ``margins``: with the margins of the loop ``1 + L``.

    The phase is continuous. For a sampled system the curves end at the Nyquist frequency, which is marked.
    """
    low, high = frequency_range(system)
    loop_margins = shown_margins(system) if margins else None
    if loop_margins is not None:
        marked = [
            w for w in (loop_margins.gain_frequency, loop_margins.phase_frequency) if 0.0 < w < math.inf
        ]
        low = min([low, *(w / 3.0 for w in marked)])
        high = max([high, *(w * 3.0 for w in marked)])
    high = min(high, math.pi / system.dt) if system.is_discrete else high
    grid = frequency_grid(system, low, high, 700)
    magnitude, phase = gain_and_phase(system, grid)
    shown = channels(system)
    largest = float(magnitude[np.isfinite(magnitude)].max(initial=1e-300))
    decibels = 20.0 * np.log10(np.clip(magnitude, _MIN_RELATIVE_GAIN * largest, 1e300))
    unit = 2.0 * math.pi if hertz else 1.0
    x = (low / unit, high / unit)
    names = [name for _, _, name in shown]
    picture = Picture(
        width=width,
        height=2 * (TOP + _PANEL_HEIGHT) + BOTTOM,
        title=f"Bode diagram of {system.name or 'a linear system'}",
        description=f"Gain and phase of {', '.join(names)}."
        + (f" {margins_text(loop_margins)}" if loop_margins is not None else ""),
    )
    right = width - RIGHT
    upper_box = (LEFT, TOP, right, TOP + _PANEL_HEIGHT)
    lower_box = (LEFT, 2 * TOP + _PANEL_HEIGHT, right, 2 * (TOP + _PANEL_HEIGHT))
    gain_area = log_area(x, _decibel_range(decibels, shown), upper_box, degrees=False)
    phase_area = log_area(x, _phase_range(phase, shown), lower_box, degrees=True)
    label = f"Frequency, {'Hz' if hertz else 'rad/s'}"
    picture.extend(gain_area.frame(x_label="", y_label="Gain, dB", numbers=False))
    picture.extend(phase_area.frame(x_label=label, y_label="Phase, deg"))
    for index, (row, column, _) in enumerate(shown):
        for area, values in ((gain_area, decibels), (phase_area, phase)):
            points = clip_line(area.points(grid / unit, values[:, row, column]), area.box)
            picture.add(Polyline(points, trace_tone(index), 1.8, trace_dash(index)))
    if loop_margins is not None:
        picture.extend(_margin_marks(loop_margins, gain_area, phase_area, unit, grid, phase[:, 0, 0]))
    return with_legend(picture, names)


def margins_text(loop_margins: Margins) -> str:
    """Both margins as one line of text."""
    parts: list[str] = []
    if math.isfinite(loop_margins.gain):
        parts.append(f"Gain margin {table_number(loop_margins.gain_decibels, 3)} dB")
    if math.isfinite(loop_margins.phase):
        parts.append(f"phase margin {table_number(loop_margins.phase, 3)} deg")
    loop = "closed loop stable" if loop_margins.stable else "closed loop unstable"
    return (", ".join([*parts, loop]) + ".").capitalize() if not parts else ", ".join([*parts, loop]) + "."


def _decibel_range(decibels: _Array, shown: list[tuple[int, int, str]]) -> tuple[float, float]:
    values = np.concatenate([decibels[:, row, column] for row, column, _ in shown])
    low, high = padded_range(values, 0.06)
    if high - low < 12.0:
        middle = (low + high) / 2.0
        low, high = middle - 6.0, middle + 6.0
    return max(low, high - 220.0), high


def _phase_range(phase: _Array, shown: list[tuple[int, int, str]]) -> tuple[float, float]:
    values = np.concatenate([phase[:, row, column] for row, column, _ in shown])
    finite = values[np.isfinite(values)]
    low = 45.0 * math.floor((float(finite.min(initial=0.0)) - 4.0) / 45.0)
    high = 45.0 * math.ceil((float(finite.max(initial=-1e9)) + 4.0) / 45.0)
    return (low, high) if high - low >= 90.0 else (low - 45.0, low + 45.0)


def _margin_marks(
    loop_margins: Margins, gain_area: PlotArea, phase_area: PlotArea, unit: float, grid: _Array, phase: _Array
) -> list[Mark]:
    """Draw the margins: lines from the curves to 0 dB and to the nearest odd multiple of 180 degrees."""
    marks: list[Mark] = []
    left, _, right, _ = gain_area.box
    if 0.0 < loop_margins.gain_frequency < math.inf:
        x = gain_area.x_scale(loop_margins.gain_frequency / unit)
        ends = (gain_area.y_scale(0.0), gain_area.y_scale(-loop_margins.gain_decibels))
        label_text = f"gain margin {table_number(loop_margins.gain_decibels, 3)} dB"
        marks += _margin_stroke(x, ends, gain_area.y_scale(0.0) - 7, label_text, (left, right))
    if math.isfinite(loop_margins.phase):
        x = phase_area.x_scale(loop_margins.phase_frequency / unit)
        value = float(np.interp(loop_margins.phase_frequency, grid, phase))
        ends = (phase_area.y_scale(value - loop_margins.phase), phase_area.y_scale(value))
        label_text = f"phase margin {table_number(loop_margins.phase, 3)} deg"
        level = phase_area.y_scale(value - loop_margins.phase)
        # The curve falls, so the area below it on the left is free.
        baseline = level + (15 if loop_margins.phase > 0.0 else -7)
        marks += _margin_stroke(x, ends, baseline, label_text, (left, right), to_the_left=True)
        marks.append(Polyline([(left, level), (right, level)], Tone.ACCENT, 1.0, (5.0, 4.0)))
    marks.append(
        Polyline(
            [(left, gain_area.y_scale(0.0)), (right, gain_area.y_scale(0.0))], Tone.ACCENT, 1.0, (5.0, 4.0)
        )
    )
    box = (*gain_area.box[:2], *phase_area.box[2:])
    return [mark for mark in marks if _inside(mark, box)]


def _inside(mark: Mark, box: tuple[float, float, float, float]) -> bool:
    if not isinstance(mark, Polyline):
        return True
    points = np.asarray(mark.points)
    return bool((points[:, 1] >= box[1] - 1).all() and (points[:, 1] <= box[3] + 1).all())


def _margin_stroke(
    x: float,
    ends: tuple[float, float],
    baseline: float,
    label_text: str,
    span: tuple[float, float],
    *,
    to_the_left: bool = False,
) -> list[Mark]:
    width = text_width(label_text, SMALL_SIZE, bold=True)
    fits = x + 10 + width < span[1] and not (to_the_left and x - 10 - width > span[0])
    return [
        Polyline([(x, ends[0]), (x, ends[1])], Tone.ACCENT, 2.2),
        Disc(x, ends[1], 3.4, fill=Tone.ACCENT),
        Text(
            x + 9 if fits else x - 9,
            baseline,
            label_text,
            SMALL_SIZE,
            Tone.ACCENT,
            "start" if fits else "end",
            bold=True,
        ),
    ]


def nyquist_picture(system: LinearSystem, *, width: float = 620.0) -> Picture:
    """The response in the complex plane, for positive frequencies and mirrored (dashed), with -1 marked.

    The Nyquist contour passes poles on the stability boundary on their right, along small half circles. The
    corresponding large half circles of the response are clipped.
    """
    height = width * 0.86
    box = (LEFT, TOP, width - RIGHT, height - BOTTOM)
    lines: list[tuple[str, _Complex]] = [
        (name, _nyquist_line(system, row, column)) for row, column, name in channels(system)
    ]
    all_values = np.concatenate([values for _, values in lines])
    x, y = _plane_range(all_values)
    x, y = equal_scale_ranges(x, y, box)
    area = linear_area(x, y, box)
    loop_margins = shown_margins(system) if system.is_siso else None
    names = [name for name, _ in lines]
    picture = Picture(
        width=width,
        height=height,
        title=f"Nyquist diagram of {system.name or 'a linear system'}",
        description=f"Response of {', '.join(names)} in the complex plane."
        + (f" {margins_text(loop_margins)}" if loop_margins is not None else ""),
    )
    picture.extend(area.frame(x_label="Real part", y_label="Imaginary part"))
    angle = np.linspace(0.0, 2.0 * math.pi, 181, dtype=np.float64)
    picture.add(
        Polyline(clip_line(area.points(np.cos(angle), np.sin(angle)), box), Tone.HAIRLINE, 1.0, (3.0, 3.0))
    )
    for index, (_, values) in enumerate(lines):
        tone = trace_tone(index)
        for sign, dash in ((1.0, trace_dash(index)), (-1.0, (5.0, 4.0))):
            points = clip_line(area.points(values.real, sign * values.imag), box)
            picture.add(Polyline(points, tone, 1.8 if sign > 0.0 else 1.2, dash))
        picture.extend(_arrow_heads(area.points(values.real, values.imag), box, tone))
    cross = (area.x_scale(-1.0), area.y_scale(0.0))
    picture.extend(_cross(*cross, Tone.ERROR))
    picture.add(Text(cross[0] - 8, cross[1] + 16, f"{MINUS}1", SMALL_SIZE, Tone.ERROR, "end", bold=True))
    return with_legend(picture, names)


def _nyquist_line(system: LinearSystem, row: int, column: int) -> _Complex:
    """The response along the stability boundary, with detours to the right of the poles on it."""
    part = system.select([system.outputs[row]], [system.inputs[column]]).minimal()
    low, high = frequency_range(part)
    high = high if part.is_discrete else 100.0 * high
    grid = frequency_grid(part, low / 30.0, high, 3000)
    poles = part.poles()
    continuous_poles = as_continuous(part, poles)
    size = max(float(np.abs(continuous_poles).max(initial=0.0)), 1e-300)
    boundary_poles = continuous_poles[
        (np.abs(continuous_poles.real) <= 1e-9 * size) & (continuous_poles.imag >= -1e-9 * size)
    ]
    if not boundary_poles.size:
        return frequency_response(part, grid)[:, 0, 0]
    path_points = 1j * np.concatenate([[0.0], grid])
    radius = low / 30.0
    for pole in boundary_poles.imag.tolist():
        r = radius if abs(pole) <= 1e-7 * size else 1e-4 * abs(pole)
        arc = 1j * pole + r * np.exp(1j * np.linspace(-math.pi / 2, math.pi / 2, 121))
        path_points = np.concatenate(
            [path_points[path_points.imag < pole - r], arc, path_points[path_points.imag > pole + r]]
        )
    path_points = path_points[path_points.imag >= 0.0]
    values = np.exp(path_points * part.dt) if part.is_discrete else path_points
    return evaluate(part, values)[:, 0, 0]


def _plane_range(values: _Complex) -> tuple[tuple[float, float], tuple[float, float]]:
    """The displayed part of the plane: the bounded part of the curve, and the area around -1."""
    size = np.abs(values)
    typical = float(np.quantile(size[np.isfinite(size)], 0.5))
    limit = max(8.0, 3.0 * typical) if float(size.max()) > max(20.0, 12.0 * typical) else math.inf
    bounded = values[size <= limit]
    x = padded_range(np.concatenate([bounded.real, [-1.3, 0.2]]), 0.08)
    reach = max(float(np.abs(bounded.imag).max(initial=0.0)), 0.6)
    return x, (-1.08 * reach, 1.08 * reach)


def _cross(x: float, y: float, tone: Tone, size: float = 4.5) -> list[Mark]:
    return [
        Polyline([(x - size, y - size), (x + size, y + size)], tone, 2.0),
        Polyline([(x - size, y + size), (x + size, y - size)], tone, 2.0),
    ]


def _arrow_heads(points: _Array, box: tuple[float, float, float, float], tone: Tone) -> list[Mark]:
    """Draw arrow heads in the direction of increasing frequency, on the part of the curve inside the box."""
    left, top, right, bottom = box
    x, y = points[:, 0], points[:, 1]
    inside = (x > left) & (x < right) & (y > top) & (y < bottom)
    steps = np.where(inside[1:] & inside[:-1], np.hypot(np.diff(x), np.diff(y)), 0.0)
    length_so_far: _Array = np.concatenate([[0.0], np.cumsum(steps)])
    marks: list[Mark] = []
    for fraction in (0.3, 0.7) if length_so_far[-1] > 90 else (0.5,) if length_so_far[-1] > 30 else ():
        k = min(
            max(int(np.searchsorted(length_so_far, fraction * float(length_so_far[-1]))), 1), len(points) - 1
        )
        back = int(np.searchsorted(length_so_far, float(length_so_far[k]) - 6.0))
        heading = points[k] - points[min(back, k - 1)]
        length = float(np.hypot(*heading))
        if length == 0.0:
            continue
        direction = heading / length
        side = np.array([-direction[1], direction[0]])
        tip = points[k] + 5 * direction
        wings = np.stack([tip, tip - 10 * direction + 4.4 * side, tip - 10 * direction - 4.4 * side])
        marks.append(Polyline(wings, stroke=None, fill=tone, closed=True))
    return marks
