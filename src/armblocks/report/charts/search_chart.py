"""The chart of the history of an optimisation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from armblocks.pictures.picture import Disc, Mark, Picture, Polyline, Text
from armblocks.pictures.style import FIGURE_WIDTH, TEXT_SIZE, TITLE_SIZE, Tone, trace_dash, trace_tone
from armblocks.pictures.text_width import shorten
from armblocks.report.charts.axes import LEFT, RIGHT, PlotArea, legend, linear_area
from armblocks.report.charts.scale import padded_range

_Array = NDArray[np.float64]

MOST_DOTS, MOST_VARIABLES = 1500, 8
FEASIBLE = 1e-6
"""Largest relative violation of a constraint of points that count as feasible."""
_UPPER, _LOWER = 250.0, 150.0


def search_chart(
    objective: _Array, violation: _Array, variables: _Array, names: Sequence[str], title: str
) -> Picture:
    """The objective of all evaluated points ``(K,)``, the best one so far, and its variables ``(K, n)``.

    Points that violate constraints are muted; points without a value are omitted.
    """
    numbers = np.arange(1, objective.size + 1, dtype=np.float64)
    best = best_so_far(objective, violation)
    known = best >= 0
    line = np.where(known, objective[np.maximum(best, 0)], np.nan)
    height = 30.0 + _UPPER + (_LOWER + 40.0 if known.any() else 0.0)
    picture = Picture(
        width=FIGURE_WIDTH,
        height=height,
        title=title,
        description="The objective of all evaluated points, and the best value so far.",
    )
    picture.add(Text(4.0, 18.0, shorten(title, TITLE_SIZE, FIGURE_WIDTH - 8.0), TITLE_SIZE, bold=True))
    right = FIGURE_WIDTH - RIGHT
    x_range = (0.5, max(numbers.size, 1) + 0.5)
    area = linear_area(x_range, _value_range(objective, line), (LEFT, 54.0, right, 30.0 + _UPPER - 44.0))
    picture.extend(area.frame(x_label="evaluation", y_label="objective", numbers=not known.any()))
    picture.extend(_dots(area, numbers, objective, violation <= FEASIBLE))
    if not known.any():
        return picture
    picture.add(Polyline(_steps(area, numbers[known], line[known]), Tone.ACCENT, 2.0))
    top = 30.0 + _UPPER
    picture.extend(_variables(numbers, variables[np.maximum(best, 0)], known, names, (LEFT, top, right)))
    return picture


def best_so_far(objective: _Array, violation: _Array) -> NDArray[np.intp]:
    """The index of the best feasible point up to each point, -1 before the first one."""
    best = np.full(objective.size, -1, dtype=np.intp)
    current = -1
    for k, (value, broken) in enumerate(zip(objective.tolist(), violation.tolist())):
        valid = np.isfinite(value) and broken <= FEASIBLE
        if valid and (current < 0 or value < objective[current]):
            current = k
        best[k] = current
    return best


def _value_range(objective: _Array, line: _Array) -> tuple[float, float]:
    """A range that shows the best values and most of the others."""
    finite = objective[np.isfinite(objective)]
    if not finite.size:
        return 0.0, 1.0
    shown = finite[finite <= np.percentile(finite, 90.0)]
    return padded_range(np.concatenate([shown, line[np.isfinite(line)]]), 0.06)


def _dots(area: PlotArea, x: _Array, y: _Array, feasible: NDArray[np.bool_]) -> list[Mark]:
    low, high = area.y_scale.low, area.y_scale.high
    places = np.flatnonzero(np.isfinite(y) & (y >= low) & (y <= high))
    places = places[:: max(1, -(-places.size // MOST_DOTS))]
    points = area.points(x[places], y[places]).tolist()
    return [
        Disc(px, py, 2.0, fill=Tone.TRACE_0 if good else Tone.MUTED, opacity=0.6 if good else 0.35)
        for (px, py), good in zip(points, feasible[places].tolist())
    ]


def _steps(area: PlotArea, x: _Array, y: _Array) -> _Array:
    """A line of steps: each value holds until the next one."""
    return area.points(np.repeat(x, 2)[1:], np.repeat(y, 2)[:-1])


def _variables(
    x: _Array,
    values: _Array,
    known: NDArray[np.bool_],
    names: Sequence[str],
    box: tuple[float, float, float],
) -> list[Mark]:
    """The variables of the best point, each from 0 to 1 between its smallest and its largest value."""
    left, top, right = box
    shown = list(names[:MOST_VARIABLES])
    marks, height = legend(shown, left, top + 4.0, right - left)
    bounds = (left, top + 24.0 + height, right, top + _LOWER + 4.0)
    area = linear_area((0.5, max(x.size, 1) + 0.5), (-0.05, 1.05), bounds, count=3)
    marks += area.frame(
        x_label="evaluation", y_label=shorten("best variables, share of their range", TEXT_SIZE, 300)
    )
    for k in range(len(shown)):
        column = values[known, k]
        width = float(np.ptp(column))
        share = (column - column.min()) / width if width > 0.0 else np.full(column.size, 0.5)
        marks.append(Polyline(_steps(area, x[known], share), trace_tone(k), 1.8, trace_dash(k)))
    return marks
