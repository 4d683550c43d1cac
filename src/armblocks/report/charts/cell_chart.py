"""A map of square cells in colours, with a colour bar: slices of workspaces."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from armblocks.pictures.numbers import axis_number, nice_ticks
from armblocks.pictures.picture import Disc, Mark, Picture, Polyline, Raster, Rectangle, Text
from armblocks.pictures.style import SMALL_SIZE, TEXT_SIZE, Tone
from armblocks.pictures.text_width import shorten
from armblocks.report.charts.axes import LEFT, TOP, PlotArea, equal_scale_ranges, linear_area

_Array = NDArray[np.float64]

BAR, BAR_SPACE, BOTTOM = 12.0, 74.0, 46.0
"""Width of the colour bar, space for it at the right, and margin below, px."""
RAMP = np.array([(46, 74, 150), (31, 125, 160), (46, 160, 120), (142, 190, 62), (246, 213, 60)], float)
"""Colours from the smallest to the largest value; their brightness increases."""
MIN_SIDE, PIXELS = 3, 300
"""Minimum number of pixels of a side of a cell, and of the longer side of the map: viewers blur small
images."""


def cell_chart(
    values: _Array,
    first: _Array,
    second: _Array,
    *,
    span: tuple[float, float],
    labels: tuple[str, str],
    caption: str,
    plane: str,
    beyond: bool,
    unit: str,
    origin: tuple[float, ...],
    width: float,
    height: float,
) -> Picture:
    """Cells with the centres ``first`` (na,) to the right and ``second`` (nb,) upwards, equal scales.

    ``values`` (na, nb): NaN for empty cells, infinite values have the last colour. ``span``: the values of
    the first and the last colour; ``beyond``: some values are larger. ``plane``: the text of the
    plane of the cells. ``origin``: the position of the base.
    """
    cell = _side(first, second)
    box = (LEFT, TOP + 14.0, width - BAR_SPACE, height - BOTTOM)
    x_range, y_range = (
        (min(float(line[0]) - cell, at), max(float(line[-1]) + cell, at))
        for line, at in zip((first, second), origin)
    )
    x_range, y_range = equal_scale_ranges(x_range, y_range, box)
    area = linear_area(x_range, y_range, box, count=max(3, round((box[3] - box[1]) / 60)))
    picture = Picture(width=width, height=height, title=caption)
    picture.add(Text(4.0, 16.0, shorten(caption, TEXT_SIZE, width - 8.0), TEXT_SIZE, bold=True))
    frame = area.frame(x_label=labels[0], y_label=labels[1])
    picture.extend(
        Text(mark.x, mark.y + 4.0, mark.text, SMALL_SIZE, Tone.MUTED)
        if isinstance(mark, Text) and mark.bold
        else mark
        for mark in frame
    )
    picture.add(Text(box[2], box[1] - 6.0, plane, SMALL_SIZE, Tone.MUTED, "end"))
    x, y = area.x_scale, area.y_scale
    left, top = x(float(first[0]) - cell / 2), y(float(second[-1]) + cell / 2)
    right, bottom = x(float(first[-1]) + cell / 2), y(float(second[0]) - cell / 2)
    picture.add(Raster(left, top, right - left, bottom - top, _pixels(values, span)))
    outline = _outline(np.isnan(values), first, second, cell)
    picture.add(Polyline(area.points(outline[:, 0], outline[:, 1]), Tone.MUTED, 0.8, sharp=True))
    picture.add(Disc(x(origin[0]), y(origin[1]), 3.6, fill=Tone.SURFACE, stroke=Tone.INK, stroke_width=1.4))
    picture.extend(colour_bar(area, span, beyond, unit, width))
    return picture


def _side(first: _Array, second: _Array) -> float:
    for line in (first, second):
        if len(line) > 1:
            return float(line[1] - line[0])
    return 0.01


def colours(values: _Array, span: tuple[float, float]) -> NDArray[np.uint8]:
    """Pixels (…, 4) of values; NaN is transparent."""
    low, high = span
    share = np.clip((np.nan_to_num(values, posinf=high, neginf=low) - low) / ((high - low) or 1.0), 0.0, 1.0)
    at = share * (len(RAMP) - 1)
    index = np.minimum(at.astype(int), len(RAMP) - 2)
    mix = (at - index)[..., None]
    rgb = (1.0 - mix) * RAMP[index] + mix * RAMP[index + 1]
    alpha = np.where(np.isnan(values), 0.0, 255.0)[..., None]
    return np.rint(np.concatenate([rgb, alpha], axis=-1)).astype(np.uint8)


def _pixels(values: _Array, span: tuple[float, float]) -> NDArray[np.uint8]:
    """The cells as an image: rows from the top, several pixels for each cell."""
    repeat = max(MIN_SIDE, math.ceil(PIXELS / max(values.shape)))
    pixels = colours(values.T[::-1], span)
    return np.ascontiguousarray(pixels.repeat(repeat, axis=0).repeat(repeat, axis=1))


def _outline(empty: NDArray[np.bool_], first: _Array, second: _Array, cell: float) -> _Array:
    """The edges (…, 2) between cells with and without values, as lines with gaps."""
    padded = np.pad(~empty, 1)
    x = np.append(first - cell / 2, first[-1] + cell / 2)
    y = np.append(second - cell / 2, second[-1] + cell / 2)
    parts: list[tuple[float, float]] = []
    for across, (lines, marks) in enumerate(((x, y), (y, x))):
        grid = padded if across == 0 else padded.T
        changes = grid[1:, 1:-1] != grid[:-1, 1:-1]
        for i, row in enumerate(changes):
            ends = np.flatnonzero(np.diff(np.concatenate([[False], row, [False]]).astype(int)))
            for begin, end in ends.reshape(-1, 2).tolist():
                line = [(float(lines[i]), float(marks[begin])), (float(lines[i]), float(marks[end]))]
                parts += [*(line if across == 0 else [(b, a) for a, b in line]), (math.nan, math.nan)]
    return np.array(parts, dtype=np.float64).reshape(-1, 2)


def colour_bar(
    area: PlotArea, span: tuple[float, float], beyond: bool, unit: str, width: float
) -> list[Mark]:
    """The colours with their values, at the right of the map."""
    _, top, right, bottom = area.box
    left = right + 14.0
    steps = np.linspace(span[1], span[0], 256)[:, None].repeat(8, axis=1)
    marks: list[Mark] = [
        Raster(left, top, BAR, bottom - top, colours(steps, span)),
        Rectangle(left, top, BAR, bottom - top, stroke=Tone.HAIRLINE),
    ]
    low, high = span
    space = width - left - BAR - 6.0
    ticks = nice_ticks(low, high, max(2, round((bottom - top) / 50))) if high > low else [low]
    for value in ticks:
        y = bottom - (bottom - top) * ((value - low) / (high - low) if high > low else 0.5)
        text = shorten(axis_number(value, 3), SMALL_SIZE, space)
        marks.append(Text(left + BAR + 5.0, y + 3.5, text, SMALL_SIZE, Tone.MUTED))
    if beyond:
        text = shorten(f"≥ {axis_number(high, 3)}", SMALL_SIZE, space)
        marks = [mark for mark in marks if not (isinstance(mark, Text) and mark.y < top + 14.0)]
        marks.append(Text(left + BAR + 5.0, top + 3.5, text, SMALL_SIZE, Tone.MUTED))
    if unit:
        marks.append(Text(left, top - 7.0, unit, SMALL_SIZE, Tone.MUTED))
    return marks
