"""Faces of sinks: small screens with the data of a run, or sample data without a run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.drawing.face_marks import FaceArea
from armblocks.pictures.numbers import axis_number
from armblocks.pictures.picture import Mark, Polyline, Rectangle, Text
from armblocks.pictures.style import Tone, trace_tone
from armblocks.pictures.thinning import thin_out

_Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class Trend:
    """The data of a run at a sink: ``time`` (N,) and for every input its values (N, k)."""

    time: _Array
    inputs: tuple[_Array, ...]


def _screen(area: FaceArea) -> tuple[FaceArea, Mark]:
    box = area.shrunk(6.0, 6.0)
    return box.shrunk(3.0, 4.0), Rectangle(
        box.x, box.y, box.width, box.height, 3, Tone.SUNKEN, Tone.HAIRLINE, 1.0
    )


def scope(area: FaceArea, trend: Trend | None) -> list[Mark]:
    """Draw all signals over time."""
    box, screen = _screen(area)
    marks: list[Mark] = [screen]
    if trend is None or len(trend.time) < 2:
        points = [(u, 0.5 + 0.35 * math.sin(7 * u)) for u in (k / 24 for k in range(25))]
        line = [(box.x + u * box.width, box.y + (1 - v) * box.height) for u, v in points]
        return [screen, Polyline(line, stroke=Tone.MUTED, width=1.2)]
    several = len(trend.inputs) > 1
    columns = [
        (number if several and values.shape[1] == 1 else k, values[:, k])
        for number, values in enumerate(trend.inputs)
        for k in range(min(values.shape[1], 8))
    ]
    for index, values in columns:
        time, thin = thin_out(trend.time, values, round(box.width))
        marks.append(_curve(box, time, thin, [v for _, v in columns], index))
    return marks


def _curve(box: FaceArea, x: _Array, y: _Array, all_values: Sequence[_Array], index: int) -> Mark:
    low, high = (float(f(np.concatenate(all_values))) for f in (np.nanmin, np.nanmax))
    left, right = float(np.nanmin(x)), float(np.nanmax(x))
    px = box.x + _fraction(x, left, right, constant=0.0) * box.width
    py = box.y + (1 - _fraction(y, low, high, constant=0.5)) * box.height
    return Polyline(np.column_stack([px, py]), stroke=trace_tone(index), width=1.3)


def _fraction(values: _Array, low: float, high: float, *, constant: float) -> _Array:
    """The values as fractions of a range; ``constant`` for an empty range."""
    half = 0.5 * high - 0.5 * low  # finite for all finite ends
    return (0.5 * values - 0.5 * low) / half if half > 0.0 else np.full(len(values), constant)


def xy_graph(area: FaceArea, trend: Trend | None) -> list[Mark]:
    """Draw the second signal over the first."""
    box, screen = _screen(area)
    if trend is None or len(trend.time) < 2:
        circle = [(math.cos(a), math.sin(2 * a)) for a in (2 * math.pi * k / 40 for k in range(41))]
        x, y = box.middle
        line = [(x + 0.45 * box.width * u, y + 0.45 * box.height * v) for u, v in circle]
        return [screen, Polyline(line, stroke=Tone.MUTED, width=1.2)]
    indices = np.unique(np.linspace(0, len(trend.time) - 1, 600).astype(int))
    x, y = trend.inputs[0][indices, 0], trend.inputs[1][indices, 0]
    return [screen, _curve(box, x, y, [y], 0)]


def display(area: FaceArea, count: int, trend: Trend | None) -> list[Mark]:
    """Draw a field for each input, with the last value."""
    marks: list[Mark] = []
    height = area.height / count
    for k in range(count):
        box = FaceArea(area.x, area.y + k * height, area.width, height).shrunk(6.0, 3.5)
        marks.append(Rectangle(box.x, box.y, box.width, box.height, 3, Tone.SUNKEN, Tone.HAIRLINE, 1.0))
        text = "…"
        if trend is not None and len(trend.time):
            values = trend.inputs[k][-1]
            text = axis_number(float(f"{values[0]:.5g}")) if len(values) == 1 else f"{len(values)} values"
        size = min(11.0, box.height - 4)
        marks.append(
            Text(box.x + box.width - 5, box.middle[1] + 0.36 * size, text, size, Tone.INK, "end", mono=True)
        )
    return marks
