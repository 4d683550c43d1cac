"""Quantities over time, in panels one below the other with a common time axis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.pictures.numbers import axis_number, axis_numbers, nice_ticks
from armblocks.pictures.picture import Mark, Picture, Polyline, Text
from armblocks.pictures.style import FIGURE_WIDTH, SMALL_SIZE, TEXT_SIZE, Tone, trace_dash, trace_tone
from armblocks.pictures.text_width import shorten, text_width
from armblocks.pictures.thinning import thin_out
from armblocks.report.charts.scale import Scale, padded_range

_Array = NDArray[np.float64]

PANEL_HEIGHT = 148.0
_LABEL_WIDTH = 132.0
_LABEL_STEP = SMALL_SIZE + 4.0
_LABEL_OVERHANG = 3.0
"""Distance of the first and the last label beyond the ends of the vertical axis, px."""
_HEADING_HEIGHT = 26.0
_GAP = 18.0
_SHOWN_LIMIT_FRACTION = 0.6
"""A limit is drawn if the signal exceeds this fraction of it."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Trace:
    """One line: ``values`` (N,) in the panel's unit, ``index`` of its colour, ``limits`` of the quantity."""

    label: str
    values: _Array
    index: int
    limits: tuple[float, float] | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class Panel:
    """Lines of one quantity and unit."""

    quantity: str
    unit: str
    traces: tuple[Trace, ...]

    @property
    def heading(self) -> str:
        """The heading of the panel: ``Joint angle, deg``."""
        return f"{self.quantity}, {self.unit}" if self.unit else self.quantity


def time_chart(
    time: _Array,
    panels: Sequence[Panel],
    *,
    title: str,
    description: str,
    height: float = PANEL_HEIGHT,
    width: float = FIGURE_WIDTH,
) -> Picture:
    """Panels one below the other with a common time axis (s); each line is named at its right end.

    ``height`` is the minimum height of a panel. Panels with many lines are higher, so that their names do not
    overlap.
    """
    spans = [_value_range(panel) for panel in panels]
    ticks = [
        nice_ticks(low, high, 4, degrees=panel.unit == "deg") for panel, (low, high) in zip(panels, spans)
    ]
    texts = [axis_numbers(values) for values in ticks]
    left = 14 + max(text_width(text, SMALL_SIZE) for panel_texts in texts for text in panel_texts)
    left = max(left, 48.0)
    right = width - _LABEL_WIDTH
    heights = [max(height, _labels_height(len(panel.traces))) for panel in panels]
    bottom = len(panels) * (_HEADING_HEIGHT + _GAP) - _GAP + sum(heights)
    picture = Picture(width=width, height=bottom + 44, title=title, description=description)
    x_scale = Scale(float(time[0]), _end_time(time), left, right)
    time_ticks = nice_ticks(x_scale.low, x_scale.high, 10 if width >= FIGURE_WIDTH else 6)
    top = _HEADING_HEIGHT
    for number, (panel, span, panel_height) in enumerate(zip(panels, spans, heights)):
        y_scale = Scale(*span, top + panel_height, top)
        heading = shorten(panel.heading, TEXT_SIZE, width - left, bold=True)
        picture.add(Text(left, top - 10, heading, size=TEXT_SIZE, bold=True))
        named = list(zip(ticks[number], texts[number]))
        picture.extend(_grid(x_scale, y_scale, time_ticks, named, last=number == len(panels) - 1))
        picture.extend(_traces(time, panel, x_scale, y_scale))
        picture.extend(_end_labels(panel, y_scale, right))
        top += panel_height + _GAP + _HEADING_HEIGHT
    picture.add(Text((left + right) / 2, bottom + 36, "Time, s", size=TEXT_SIZE, anchor="middle"))
    return picture


def label_fits(label: str) -> bool:
    """Whether there is space for the label at the right end of a line."""
    return text_width(label, SMALL_SIZE) <= _LABEL_WIDTH - 31


def fitted_label(label: str) -> str:
    """The label, cut in the middle if there is no space for it at the right end of a line."""
    fitted, kept = label, len(label)
    while not label_fits(fitted) and kept > 2:
        kept -= 1
        fitted = f"{label[: kept // 2]}…{label[len(label) - (kept - kept // 2) :]}"
    return fitted


def _labels_height(count: int) -> float:
    """The height of a panel beside which ``count`` labels do not overlap, px."""
    return (count - 1) * _LABEL_STEP - 2 * _LABEL_OVERHANG


def _end_time(time: _Array) -> float:
    return float(time[-1]) if time[-1] > time[0] else float(time[0]) + 1.0


def _value_range(panel: Panel) -> tuple[float, float]:
    values = np.concatenate([trace.values for trace in panel.traces]) if panel.traces else np.zeros(1)
    limits = [bound for trace in panel.traces for bound in _drawn_limits(trace)]
    return padded_range(np.concatenate([values, np.array(limits)]), 0.08)


def _drawn_limits(trace: Trace) -> list[float]:
    """The limits that the trace approaches or exceeds."""
    if trace.limits is None:
        return []
    finite = trace.values[np.isfinite(trace.values)]
    if len(finite) == 0:
        return []
    low, high = trace.limits
    shown_limits: list[float] = []
    if math.isfinite(high) and finite.max() >= _SHOWN_LIMIT_FRACTION * high > 0:
        shown_limits.append(high)
    if math.isfinite(low) and finite.min() <= _SHOWN_LIMIT_FRACTION * low < 0:
        shown_limits.append(low)
    return shown_limits


def _grid(
    x_scale: Scale, y_scale: Scale, times: Sequence[float], values: Sequence[tuple[float, str]], *, last: bool
) -> list[Mark]:
    marks: list[Mark] = []
    for value in times:
        x = x_scale(value)
        marks.append(Polyline([(x, y_scale.end), (x, y_scale.start)], stroke=Tone.GRID, sharp=True))
        if last:
            marks.append(Text(x, y_scale.start + 17, axis_number(value), SMALL_SIZE, Tone.MUTED, "middle"))
    for value, text in values:
        y = y_scale(value)
        tone = Tone.HAIRLINE if value == 0 else Tone.GRID
        marks.append(Polyline([(x_scale.start, y), (x_scale.end, y)], stroke=tone, sharp=True))
        marks.append(Text(x_scale.start - 7, y + 3.5, text, SMALL_SIZE, Tone.MUTED, "end"))
    frame = [(x_scale.start, y_scale.end), (x_scale.start, y_scale.start), (x_scale.end, y_scale.start)]
    marks.append(Polyline(frame, stroke=Tone.HAIRLINE, sharp=True))
    return marks


def _traces(time: _Array, panel: Panel, x_scale: Scale, y_scale: Scale) -> list[Mark]:
    columns = round(x_scale.end - x_scale.start)
    marks: list[Mark] = []
    exceeding: list[Mark] = []
    for trace in panel.traces:
        for bound in _drawn_limits(trace):
            y = y_scale(bound)
            marks.append(
                Polyline(
                    [(x_scale.start, y), (x_scale.end, y)],
                    stroke=trace_tone(trace.index),
                    dash=(7.0, 4.0),
                    opacity=0.9,
                )
            )
    for trace in panel.traces:
        t, v = thin_out(time, trace.values, columns)
        points = np.column_stack([x_scale.array(t), y_scale.array(v)])
        marks.append(
            Polyline(points, stroke=trace_tone(trace.index), width=1.8, dash=trace_dash(trace.index))
        )
        exceeds_limit = _exceeds_limit(trace, v)
        if exceeds_limit.any():
            # Neighbouring samples are included, so that a single sample beyond the limit is a visible line.
            widened = exceeds_limit | np.roll(exceeds_limit, 1) | np.roll(exceeds_limit, -1)
            widened[0], widened[-1] = exceeds_limit[:2].any(), exceeds_limit[-2:].any()
            exceeding.append(
                Polyline(np.where(widened[:, None], points, np.nan), stroke=Tone.ERROR, width=4.2)
            )
    return [*marks, *exceeding]


def _exceeds_limit(trace: Trace, values: _Array) -> NDArray[np.bool_]:
    if trace.limits is None:
        return np.zeros(len(values), dtype=np.bool_)
    low, high = trace.limits
    slack = 1e-9 * max(abs(low), abs(high))
    return (values > high + slack) | (values < low - slack)


def _end_labels(panel: Panel, y_scale: Scale, right: float) -> list[Mark]:
    """Draw names with keys at the right ends of the lines, moved apart if they would overlap."""
    preferred: list[float] = []
    for trace in panel.traces:
        finite = trace.values[np.isfinite(trace.values)]
        preferred.append(y_scale(float(finite[-1])) if len(finite) else y_scale.start)
    # Positions are compared in whole px: labels of lines that end at one point have the order of the lines,
    # in spite of rounding errors.
    order = sorted(range(len(preferred)), key=lambda k: (round(preferred[k]), k))
    low, high = y_scale.end - _LABEL_OVERHANG, y_scale.start + _LABEL_OVERHANG
    positions = separated_positions([preferred[k] for k in order], _LABEL_STEP, low, high)
    marks: list[Mark] = []
    for k, y in zip(order, positions):
        trace = panel.traces[k]
        tone, dash = trace_tone(trace.index), trace_dash(trace.index)
        exceeds = bool(_exceeds_limit(trace, trace.values).any())
        label = trace.label + (" over limit" if exceeds else "")
        marks.append(
            Polyline(
                [(right + 3, preferred[k]), (right + 10, y), (right + 24, y)],
                stroke=tone,
                width=1.8,
                dash=dash,
            )
        )
        marks.append(
            Text(
                right + 29,
                y + 3.8,
                shorten(label, SMALL_SIZE, _LABEL_WIDTH - 31, bold=exceeds),
                SMALL_SIZE,
                Tone.ERROR if exceeds else Tone.INK,
                bold=exceeds,
            )
        )
    return marks


def separated_positions(preferred: Sequence[float], step: float, low: float, high: float) -> list[float]:
    """Ascending positions close to ``preferred``, in its order, at least ``step`` apart, within ``low`` ..
    ``high`` if they fit.

    Groups that would overlap are centred on the mean of their preferred positions (pool adjacent violators,
    Ayer et al. 1955).
    """
    groups: list[tuple[float, int]] = []  # mean of (preferred position - offset in the group), count
    for k, position in enumerate(preferred):
        mean, count = position - k * step, 1
        while groups and groups[-1][0] > mean:
            other, size = groups.pop()
            mean = (mean * count + other * size) / (count + size)
            count += size
        groups.append((mean, count))
    flat = [mean for mean, count in groups for _ in range(count)]
    top = max(low, high - step * (len(preferred) - 1))
    return [min(max(mean, low), top) + k * step for k, mean in enumerate(flat)]
