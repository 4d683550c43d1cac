"""The plot area of charts of linear systems: frame, grid, tick numbers and axis labels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from armblocks.pictures.numbers import axis_number, log_ticks, nice_ticks, power_of_ten
from armblocks.pictures.picture import Mark, Picture, Polyline, Rectangle, Text
from armblocks.pictures.style import SMALL_SIZE, TEXT_SIZE, Tone, trace_dash, trace_tone
from armblocks.pictures.text_width import shorten, text_width
from armblocks.report.charts.scale import LogScale, Scale

_Array = NDArray[np.float64]

LEFT, RIGHT, TOP, BOTTOM = 64.0, 20.0, 28.0, 46.0
"""Margins around the area, px."""


@dataclass(frozen=True, kw_only=True)
class PlotArea:
    """The area of a chart inside the axes: two scales, and the values of grid lines and tick numbers."""

    x_scale: Scale | LogScale
    y_scale: Scale
    x_ticks: tuple[float, ...]
    y_ticks: tuple[float, ...]
    x_minor_ticks: tuple[float, ...] = ()
    x_tick_text: Callable[[float], str] = axis_number

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Left, top, right and bottom, px."""
        return self.x_scale.start, self.y_scale.end, self.x_scale.end, self.y_scale.start

    def points(self, x: _Array, y: _Array) -> _Array:
        """Positions (N, 2) in px. Distant points are clipped, because renderers fail at huge coordinates."""
        left, top, right, bottom = self.box
        width, height = right - left, bottom - top
        px = np.clip(self.x_scale.array(x), left - 20 * width, right + 20 * width)
        py = np.clip(self.y_scale.array(y), top - 20 * height, bottom + 20 * height)
        return np.column_stack([px, py])

    def frame(self, *, x_label: str, y_label: str, numbers: bool = True) -> list[Mark]:
        """Draw grid, frame, numbers and names; ``numbers`` false omits numbers and name of the x axis."""
        left, top, right, bottom = self.box
        marks: list[Mark] = []
        for value in (*self.x_minor_ticks, *self.x_ticks):
            x = self.x_scale(value)
            fine = value in self.x_minor_ticks
            marks.append(Polyline([(x, top), (x, bottom)], Tone.GRID, 0.6 if fine else 1.0, sharp=True))
        for value in self.y_ticks:
            y = self.y_scale(value)
            tone = Tone.HAIRLINE if value == 0 else Tone.GRID
            marks.append(Polyline([(left, y), (right, y)], tone, sharp=True))
            marks.append(Text(left - 7, y + 3.5, axis_number(value), SMALL_SIZE, Tone.MUTED, "end"))
        marks.append(Rectangle(left, top, right - left, bottom - top, stroke=Tone.HAIRLINE))
        marks.append(Text(left, top - 10, y_label, TEXT_SIZE, bold=True))
        if numbers:
            marks += [
                Text(
                    self.x_scale(value),
                    bottom + 16,
                    self.x_tick_text(value),
                    SMALL_SIZE,
                    Tone.MUTED,
                    "middle",
                )
                for value in self.x_ticks
            ]
            marks.append(Text((left + right) / 2, bottom + 36, x_label, TEXT_SIZE, anchor="middle"))
        return marks


def linear_area(
    x: tuple[float, float], y: tuple[float, float], box: tuple[float, float, float, float], *, count: int = 6
) -> PlotArea:
    """A plot area with linear axes for two ranges; ``box``: left, top, right, bottom in px."""
    left, top, right, bottom = box
    return PlotArea(
        x_scale=Scale(*x, left, right),
        y_scale=Scale(*y, bottom, top),
        x_ticks=tuple(nice_ticks(*x, max(3, round((right - left) / 95)))),
        y_ticks=tuple(nice_ticks(*y, count)),
    )


def log_area(
    x: tuple[float, float], y: tuple[float, float], box: tuple[float, float, float, float], *, degrees: bool
) -> PlotArea:
    """A plot area whose x axis is logarithmic."""
    left, top, right, bottom = box
    major, minor = log_ticks(*x)
    return PlotArea(
        x_scale=LogScale(*x, left, right),
        y_scale=Scale(*y, bottom, top),
        x_ticks=tuple(major),
        y_ticks=tuple(nice_ticks(*y, 5, degrees=degrees)),
        x_minor_ticks=tuple(minor),
        x_tick_text=power_of_ten,
    )


def equal_scale_ranges(
    x: tuple[float, float], y: tuple[float, float], box: tuple[float, float, float, float]
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Ranges widened about their middles so that a unit has the same length on both axes."""
    left, top, right, bottom = box
    per_px = max((x[1] - x[0]) / (right - left), (y[1] - y[0]) / (bottom - top))

    def about(interval: tuple[float, float], length: float) -> tuple[float, float]:
        middle = (interval[0] + interval[1]) / 2
        return middle - length / 2, middle + length / 2

    return about(x, per_px * (right - left)), about(y, per_px * (bottom - top))


def clip_line(points: _Array, box: tuple[float, float, float, float]) -> _Array:
    """A line clipped exactly at the edges of a box (Liang-Barsky); parts outside become gaps."""
    left, top, right, bottom = box
    clipped: list[tuple[float, float]] = []
    gap = (np.nan, np.nan)
    for (x0, y0), (x1, y1) in zip(points[:-1].tolist(), points[1:].tolist()):
        dx, dy = x1 - x0, y1 - y0
        begin, end = 0.0, 1.0
        for step, distance in ((-dx, x0 - left), (dx, right - x0), (-dy, y0 - top), (dy, bottom - y0)):
            if step == 0.0:
                if distance < 0.0:
                    begin, end = 1.0, 0.0
            elif step < 0.0:
                begin = max(begin, distance / step)
            else:
                end = min(end, distance / step)
        if not begin <= end:
            continue
        first, last = (x0 + begin * dx, y0 + begin * dy), (x0 + end * dx, y0 + end * dy)
        if not clipped or clipped[-1] != first:
            clipped += [gap, first] if clipped else [first]
        clipped.append(last)
    return np.array(clipped, dtype=np.float64).reshape(-1, 2)


def legend(names: Sequence[str], x: float, y: float, max_width: float) -> tuple[list[Mark], float]:
    """A legend row from (x, y), wrapped to ``max_width``; returns its height (px)."""
    marks: list[Mark] = []
    left, baseline = x, y
    for index, name in enumerate(names):
        text = shorten(name, SMALL_SIZE, max_width - 30)
        width = 30 + text_width(text, SMALL_SIZE) + 16
        if left > x and left + width > x + max_width:
            left, baseline = x, baseline + 17
        stroke = Polyline(
            [(left, baseline - 4), (left + 22, baseline - 4)], trace_tone(index), 1.8, trace_dash(index)
        )
        marks += [stroke, Text(left + 28, baseline, text, SMALL_SIZE)]
        left += width
    return marks, baseline - y + 17 if names else 0.0


def with_legend(picture: Picture, names: Sequence[str]) -> Picture:
    """The picture, with a legend above it if there is more than one line."""
    if len(names) < 2:
        return picture
    marks, height = legend(names, LEFT, 14.0, picture.width - LEFT - RIGHT)
    combined = replace(picture, height=picture.height + height + 6, marks=[])
    combined.extend(marks)
    combined.place(picture, 0.0, height + 6)
    return combined
