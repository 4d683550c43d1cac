"""One quantity over another: tool path projections, XY graphs."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from armblocks.pictures.numbers import axis_number, nice_ticks
from armblocks.pictures.picture import Disc, Mark, Picture, Polyline, Rectangle, Text
from armblocks.pictures.style import SMALL_SIZE, TEXT_SIZE, Tone, trace_tone
from armblocks.pictures.text_width import text_width
from armblocks.report.charts.scale import Scale, padded_range

_Array = NDArray[np.float64]
_Frame = tuple[float, float, float, float]


def path_chart(
    x: _Array,
    y: _Array,
    *,
    x_label: str,
    y_label: str,
    width: float,
    height: float,
    equal: bool,
    span: float | None = None,
    index: int = 0,
) -> Picture:
    """One quantity over another, with start, end and direction. ``equal``: a unit has the same length on both
    axes.

    ``span`` is the minimum length of the longer side of the data range, for charts that share one scale.
    """
    picture = Picture(width=width, height=height, title=f"{y_label} over {x_label}")
    margin_left, margin_right, margin_top, margin_bottom = 58.0, 14.0, 26.0, 44.0
    inner_width, inner_height = width - margin_left - margin_right, height - margin_top - margin_bottom
    x_range, y_range = padded_range(x, 0.07), padded_range(y, 0.07)
    if equal:
        x_range, y_range = _equal_scale_ranges(x_range, y_range, inner_width, inner_height, span)
    x_scale = Scale(*x_range, margin_left, margin_left + inner_width)
    y_scale = Scale(*y_range, margin_top + inner_height, margin_top)
    picture.add(
        Rectangle(margin_left, margin_top, inner_width, inner_height, stroke=Tone.HAIRLINE, stroke_width=1)
    )
    for value in nice_ticks(*x_range, 4):
        at = x_scale(value)
        picture.add(
            Polyline([(at, margin_top), (at, margin_top + inner_height)], stroke=Tone.GRID, sharp=True),
            Text(at, height - margin_bottom + 16, axis_number(value), SMALL_SIZE, Tone.MUTED, "middle"),
        )
    for value in nice_ticks(*y_range, 4):
        at = y_scale(value)
        picture.add(
            Polyline([(margin_left, at), (margin_left + inner_width, at)], stroke=Tone.GRID, sharp=True),
            Text(margin_left - 7, at + 3.5, axis_number(value), SMALL_SIZE, Tone.MUTED, "end"),
        )
    picture.add(
        Text(margin_left + inner_width / 2, height - 8, x_label, size=TEXT_SIZE, anchor="middle"),
        Text(4, 14, y_label, size=TEXT_SIZE),
    )
    points = np.column_stack([x_scale.array(x), y_scale.array(y)])
    frame = (margin_left, margin_top, margin_left + inner_width, margin_top + inner_height)
    picture.extend(_path_with_direction(points, trace_tone(index), frame))
    return picture


def side_by_side(pictures: Sequence[Picture], *, title: str, description: str, gap: float = 12.0) -> Picture:
    """One picture with several pictures of equal height in a row."""
    width = sum(p.width for p in pictures) + gap * (len(pictures) - 1)
    combined = Picture(
        width=width, height=max(p.height for p in pictures), title=title, description=description
    )
    left = 0.0
    for picture in pictures:
        combined.place(picture, left, 0.0)
        left += picture.width + gap
    return combined


def _equal_scale_ranges(
    x: tuple[float, float], y: tuple[float, float], width: float, height: float, span: float | None
) -> tuple[tuple[float, float], tuple[float, float]]:
    per_px = max((x[1] - x[0]) / width, (y[1] - y[0]) / height, (span or 0.0) * 1.14 / min(width, height))

    def about(interval: tuple[float, float], length: float) -> tuple[float, float]:
        middle = (interval[0] + interval[1]) / 2
        return middle - length / 2, middle + length / 2

    return about(x, per_px * width), about(y, per_px * height)


def _path_with_direction(points: _Array, tone: Tone, frame: _Frame) -> list[Mark]:
    finite = points[np.isfinite(points).all(axis=1)]
    if len(finite) == 0:
        return []
    length_so_far = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(finite, axis=0), axis=1))])
    total = float(length_so_far[-1])
    indices = np.unique(
        np.concatenate([np.searchsorted(length_so_far, np.arange(0.0, total, 1.2)), [len(finite) - 1]])
    )
    marks: list[Mark] = [Polyline(finite[indices], stroke=tone, width=1.8)]
    if total > 60:
        for fraction in (0.25, 0.5, 0.75):
            k = min(max(int(np.searchsorted(length_so_far, fraction * total)), 1), len(finite) - 1)
            heading = finite[k] - finite[max(k - max(len(finite) // 200, 1), 0)]
            length = float(np.linalg.norm(heading))
            if length > 0:
                direction = heading / length
                side = np.array([-direction[1], direction[0]])
                tip = finite[k] + 4.5 * direction
                wings = np.stack([tip, tip - 9.5 * direction + 4 * side, tip - 9.5 * direction - 4 * side])
                marks.append(Polyline(wings, stroke=None, fill=tone, closed=True))
    (x0, y0), (x1, y1) = finite[0].tolist(), finite[-1].tolist()
    marks.append(Disc(x0, y0, 4.2, fill=Tone.SURFACE, stroke=tone, stroke_width=1.8))
    marks.append(Disc(x1, y1, 4.2, fill=tone, stroke=Tone.SURFACE, stroke_width=1.0))
    if math.hypot(x1 - x0, y1 - y0) > 30:
        for (x, y), word in (((x0, y0), "start"), ((x1, y1), "end")):
            marks += _point_label(points, x, y, word, frame)
    return marks


def _point_label(points: _Array, x: float, y: float, word: str, frame: _Frame) -> tuple[Mark, Mark]:
    """Draw a word next to a point, inside the frame and at the greatest distance from the line, on a
    translucent background."""
    width = text_width(word, SMALL_SIZE)
    candidates = [
        (x - width / 2, y - 10),
        (x - width / 2, y + 18),
        (x + 9, y + 4),
        (x - 9 - width, y + 4),
        (x + 8, y - 8),
        (x + 8, y + 16),
        (x - 8 - width, y - 8),
        (x - 8 - width, y + 16),
    ]
    left_end, top, right_end, bottom = frame

    def inside(position: tuple[float, float]) -> bool:
        left, base = position
        return left_end + 2 <= left <= right_end - width - 2 and top + SMALL_SIZE + 2 <= base <= bottom - 3

    def clearance(position: tuple[float, float]) -> float:
        left, base = position
        dx = np.maximum(np.maximum(left - points[:, 0], points[:, 0] - left - width), 0.0)
        dy = np.maximum(np.maximum(base - SMALL_SIZE - points[:, 1], points[:, 1] - base), 0.0)
        return float(np.nanmin(np.hypot(dx, dy)))

    # The position above the point is preferred; a clearance of more than a few px has no advantage.
    left, base = max(candidates, key=lambda position: (inside(position), min(clearance(position), 7.0)))
    background = Rectangle(
        left - 2, base - SMALL_SIZE + 1, width + 4, SMALL_SIZE + 2, 2, fill=Tone.SURFACE, opacity=0.8
    )
    return background, Text(left, base, word, SMALL_SIZE, Tone.MUTED)
