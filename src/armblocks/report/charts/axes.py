"""A framed field with a grid, numbers and names of axes, for the charts of linear systems."""

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
"""Margins around the field, px."""


@dataclass(frozen=True, kw_only=True)
class Field:
    """The inside of a chart: two scales, and the positions of their grid lines and numbers."""

    across: Scale | LogScale
    up: Scale
    x_ticks: tuple[float, ...]
    y_ticks: tuple[float, ...]
    x_finer: tuple[float, ...] = ()
    x_number: Callable[[float], str] = axis_number

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Left, top, right and bottom, px."""
        return self.across.start, self.up.end, self.across.end, self.up.start

    def points(self, x: _Array, y: _Array) -> _Array:
        """Positions (N, 2) in px. Distant points are moved closer, because renderers fail at huge numbers."""
        left, top, right, bottom = self.box
        width, height = right - left, bottom - top
        px = np.clip(self.across.array(x), left - 20 * width, right + 20 * width)
        py = np.clip(self.up.array(y), top - 20 * height, bottom + 20 * height)
        return np.column_stack([px, py])

    def frame(self, *, x_label: str, y_label: str, numbers: bool = True) -> list[Mark]:
        """Draw grid, frame, numbers and names; with ``numbers`` false those of the x axis are omitted."""
        left, top, right, bottom = self.box
        marks: list[Mark] = []
        for value in (*self.x_finer, *self.x_ticks):
            x = self.across(value)
            fine = value in self.x_finer
            marks.append(Polyline([(x, top), (x, bottom)], Tone.GRID, 0.6 if fine else 1.0, sharp=True))
        for value in self.y_ticks:
            y = self.up(value)
            tone = Tone.HAIRLINE if value == 0 else Tone.GRID
            marks.append(Polyline([(left, y), (right, y)], tone, sharp=True))
            marks.append(Text(left - 7, y + 3.5, axis_number(value), SMALL_SIZE, Tone.MUTED, "end"))
        marks.append(Rectangle(left, top, right - left, bottom - top, stroke=Tone.HAIRLINE))
        marks.append(Text(left, top - 10, y_label, TEXT_SIZE, bold=True))
        if numbers:
            marks += [
                Text(self.across(value), bottom + 16, self.x_number(value), SMALL_SIZE, Tone.MUTED, "middle")
                for value in self.x_ticks
            ]
            marks.append(Text((left + right) / 2, bottom + 36, x_label, TEXT_SIZE, anchor="middle"))
        return marks


def straight_field(
    x: tuple[float, float], y: tuple[float, float], box: tuple[float, float, float, float], *, count: int = 6
) -> Field:
    """A field with linear axes for two ranges; ``box``: left, top, right, bottom in px."""
    left, top, right, bottom = box
    return Field(
        across=Scale(*x, left, right),
        up=Scale(*y, bottom, top),
        x_ticks=tuple(nice_ticks(*x, max(3, round((right - left) / 95)))),
        y_ticks=tuple(nice_ticks(*y, count)),
    )


def log_field(
    x: tuple[float, float], y: tuple[float, float], box: tuple[float, float, float, float], *, degrees: bool
) -> Field:
    """A field whose x axis is logarithmic."""
    left, top, right, bottom = box
    named, finer = log_ticks(*x)
    return Field(
        across=LogScale(*x, left, right),
        up=Scale(*y, bottom, top),
        x_ticks=tuple(named),
        y_ticks=tuple(nice_ticks(*y, 5, degrees=degrees)),
        x_finer=tuple(finer),
        x_number=power_of_ten,
    )


def equal_box(
    x: tuple[float, float], y: tuple[float, float], box: tuple[float, float, float, float]
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Ranges widened about their middles so that a unit has the same length on both axes."""
    left, top, right, bottom = box
    per_px = max((x[1] - x[0]) / (right - left), (y[1] - y[0]) / (bottom - top))

    def about(interval: tuple[float, float], length: float) -> tuple[float, float]:
        middle = (interval[0] + interval[1]) / 2
        return middle - length / 2, middle + length / 2

    return about(x, per_px * (right - left)), about(y, per_px * (bottom - top))


def clipped_to(points: _Array, box: tuple[float, float, float, float]) -> _Array:
    """A line clipped exactly at the edges of a box (Liang-Barsky); pieces outside become gaps."""
    left, top, right, bottom = box
    clipped: list[tuple[float, float]] = []
    gap = (np.nan, np.nan)
    for (x0, y0), (x1, y1) in zip(points[:-1].tolist(), points[1:].tolist()):
        dx, dy = x1 - x0, y1 - y0
        begin, end = 0.0, 1.0
        for step, room in ((-dx, x0 - left), (dx, right - x0), (-dy, y0 - top), (dy, bottom - y0)):
            if step == 0.0:
                if room < 0.0:
                    begin, end = 1.0, 0.0
            elif step < 0.0:
                begin = max(begin, room / step)
            else:
                end = min(end, room / step)
        if not begin <= end:
            continue
        first, last = (x0 + begin * dx, y0 + begin * dy), (x0 + end * dx, y0 + end * dy)
        if not clipped or clipped[-1] != first:
            clipped += [gap, first] if clipped else [first]
        clipped.append(last)
    return np.array(clipped, dtype=np.float64).reshape(-1, 2)


def legend(names: Sequence[str], x: float, y: float, room: float) -> tuple[list[Mark], float]:
    """A legend row from (x, y), wrapped to the width ``room``; returns its height (px)."""
    marks: list[Mark] = []
    at, line = x, y
    for index, name in enumerate(names):
        text = shorten(name, SMALL_SIZE, room - 30)
        width = 30 + text_width(text, SMALL_SIZE) + 16
        if at > x and at + width > x + room:
            at, line = x, line + 17
        stroke = Polyline([(at, line - 4), (at + 22, line - 4)], trace_tone(index), 1.8, trace_dash(index))
        marks += [stroke, Text(at + 28, line, text, SMALL_SIZE)]
        at += width
    return marks, line - y + 17 if names else 0.0


def headed(picture: Picture, names: Sequence[str]) -> Picture:
    """The picture, with a legend above it if there is more than one line."""
    if len(names) < 2:
        return picture
    marks, height = legend(names, LEFT, 14.0, picture.width - LEFT - RIGHT)
    whole = replace(picture, height=picture.height + height + 6, marks=[])
    whole.extend(marks)
    whole.place(picture, 0.0, height + 6)
    return whole
