"""Charts of the tables of sweeps: response curves, tornado, scatter matrix, parallel coordinates, bands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from armblocks.pictures.numbers import axis_number, table_number
from armblocks.pictures.picture import Disc, Mark, Picture, Polyline, Raster, Rectangle, Text
from armblocks.pictures.style import FIGURE_WIDTH, SMALL_SIZE, TEXT_SIZE, TITLE_SIZE, Tone
from armblocks.pictures.text_width import shorten, text_width
from armblocks.report.charts.axes import PlotArea, linear_area
from armblocks.report.charts.cell_chart import colour_bar, colours
from armblocks.report.charts.scale import padded_range

_Array = NDArray[np.float64]
_Columns = Mapping[str, _Array]

DOTS, LINES = 1500, 400
"""Maximum number of dots of a panel, and of lines of parallel coordinates."""
GROUPS = 16
"""Maximum number of groups of runs along a parameter."""
RUNS_OF_A_GROUP = 12
"""Minimum number of runs of a group with percentiles."""
HIGHEST = 0.1
"""The share of runs with the highest values that parallel coordinates emphasise."""
PANEL_HEIGHT = 250.0
CELLS = 120
"""Maximum number of values of a parameter for one row or column of cells for each value."""


def response_chart(parameters: _Columns, name: str, values: _Array) -> Picture:
    """A measure over each parameter: dots, the median, and the bands of the percentiles."""
    columns = min(3, len(parameters))
    rows = -(-len(parameters) // columns)
    picture = _picture(rows * PANEL_HEIGHT + 30.0, f"{name} over the parameters")
    width = FIGURE_WIDTH / columns
    y_range = padded_range(values, 0.06)
    for k, (parameter, x) in enumerate(parameters.items()):
        left, top = (k % columns) * width, 30.0 + (k // columns) * PANEL_HEIGHT
        box = (left + 62.0, top + 24.0, left + width - 16.0, top + PANEL_HEIGHT - 44.0)
        area = linear_area(padded_range(x, 0.03), y_range, box, count=4)
        picture.extend(_frame(area, x_label=parameter, y_label=name if k % columns == 0 else ""))
        chosen = _thinned(len(x), DOTS)
        picture.extend(_dots(area, x[chosen], values[chosen], 0.35))
        middles, percentiles = grouped_percentiles(x, values, (5.0, 25.0, 50.0, 75.0, 95.0))
        if len(middles) > 1:
            for low, high in ((0, 4), (1, 3)):
                picture.add(_band(area, middles, percentiles[:, low], percentiles[:, high]))
        picture.add(Polyline(area.points(middles, percentiles[:, 2]), Tone.ACCENT, 2.0))
    return picture


def grouped_percentiles(x: _Array, values: _Array, shares: Sequence[float]) -> tuple[_Array, _Array]:
    """Percentiles of the values in groups of neighbouring ``x``: medians of ``x`` and ``(groups, shares)``.

    The groups have equal numbers of runs; runs with equal ``x`` are in one group.
    """
    valid = np.isfinite(x) & np.isfinite(values)
    order = np.argsort(x[valid], kind="stable")
    x, values = x[valid][order], values[valid][order]
    levels, starts = np.unique(x, return_index=True)
    if levels.size > GROUPS:
        groups = max(1, min(GROUPS, x.size // RUNS_OF_A_GROUP))
        starts = np.unique(np.searchsorted(x, x[np.arange(groups) * x.size // groups], side="left"))
    ends = [*starts[1:].tolist(), x.size]
    parts = [slice(begin, end) for begin, end in zip(starts.tolist(), ends) if end > begin]
    middles = np.array([np.median(x[part]) for part in parts])
    percentiles = np.array([np.percentile(values[part], shares) for part in parts])
    return middles, percentiles.reshape(len(parts), len(shares))


def tornado_ranges(parameters: _Columns, values: _Array) -> list[tuple[str, float, float]]:
    """For each parameter the medians of the measure in the runs with its lowest and its highest values.

    These runs are the lowest and the highest tenth. The parameter with the largest range is the first.
    """
    found: list[tuple[str, float, float]] = []
    for name, x in parameters.items():
        valid = np.isfinite(x) & np.isfinite(values)
        if not valid.any() or np.ptp(x[valid]) == 0.0:
            continue
        low, high = np.quantile(x[valid], (0.1, 0.9))
        first, last = (float(np.median(values[valid & part])) for part in (x <= low, x >= high))
        found.append((name, first, last))
    return sorted(found, key=lambda entry: -abs(entry[2] - entry[1]))


def tornado_chart(parameters: _Columns, name: str, values: _Array) -> Picture:
    """The bars of :func:`tornado_ranges` about the median of all runs."""
    ranges = tornado_ranges(parameters, values)
    middle = float(np.median(values[np.isfinite(values)])) if np.isfinite(values).any() else 0.0
    picture = _picture(len(ranges) * 34.0 + 120.0, f"{name}: medians at low and high parameters")
    labels = max((text_width(entry[0], TEXT_SIZE) for entry in ranges), default=0.0)
    left = min(320.0, labels + 24.0)
    box = (left, 44.0, FIGURE_WIDTH - 20.0, picture.height - 60.0)
    numbers = np.array([middle, *(value for entry in ranges for value in entry[1:])])
    area = linear_area(padded_range(numbers, 0.3), (0.0, float(max(1, len(ranges)))), box)
    bare = PlotArea(x_scale=area.x_scale, y_scale=area.y_scale, x_ticks=area.x_ticks, y_ticks=())
    picture.extend(bare.frame(x_label=name, y_label=""))
    for k, (parameter, low, high) in enumerate(ranges):
        y = area.y_scale(len(ranges) - k - 0.5)
        text = shorten(parameter, TEXT_SIZE, left - 12.0)
        picture.add(Text(left - 10.0, y + 4.0, text, TEXT_SIZE, anchor="end"))
        for value, tone in ((low, Tone.TRACE_0), (high, Tone.ACCENT)):
            x0, x1 = sorted((area.x_scale(middle), area.x_scale(value)))
            picture.add(Rectangle(x0, y - 10.0, x1 - x0, 20.0, fill=tone, opacity=0.75))
        texts = (f"low {table_number(low, 4)}", f"high {table_number(high, 4)}")
        sides = [
            (value >= middle) if value != middle else right for value, right in ((low, False), (high, True))
        ]
        for right in (False, True):
            here = [k for k, side in enumerate(sides) if side == right]
            if here:
                ends = [area.x_scale((low, high)[k]) for k in here]
                at = max(ends) + 5.0 if right else min(ends) - 5.0
                text = ", ".join(texts[k] for k in here)
                picture.add(Text(at, y + 4.0, text, SMALL_SIZE, Tone.MUTED, "start" if right else "end"))
    x = area.x_scale(middle)
    picture.add(Polyline([(x, box[1]), (x, box[3])], Tone.INK, 1.2, sharp=True))
    return picture


def scatter_matrix(columns: _Columns) -> Picture:
    """Each column over each other column, and histograms on the diagonal."""
    names, count = list(columns), len(columns)
    side = (FIGURE_WIDTH - 70.0) / count
    picture = _picture(count * side + 80.0, "Scatter matrix")
    ranges = {name: padded_range(values, 0.05) for name, values in columns.items()}
    chosen = _thinned(len(next(iter(columns.values()))), DOTS)
    for i, row in enumerate(names):
        for j, column in enumerate(names):
            box = (62.0 + j * side, 36.0 + i * side, 56.0 + (j + 1) * side, 30.0 + (i + 1) * side)
            y_range = ranges[row] if i != j else (0.0, 1.05)
            area = linear_area(ranges[column], y_range, box, count=3)
            picture.add(Rectangle(box[0], box[1], box[2] - box[0], box[3] - box[1], stroke=Tone.HAIRLINE))
            if i == j:
                picture.extend(_histogram(area, columns[row]))
                text = shorten(row, SMALL_SIZE, side - 14.0)
                picture.add(Text(box[0] + 5.0, box[1] + 14.0, text, SMALL_SIZE, bold=True))
            else:
                picture.extend(_dots(area, columns[column][chosen], columns[row][chosen], 0.4, 1.3))
            if i == count - 1:
                picture.extend(_x_numbers(area, box, 2 if side < 150.0 else 3))
            if j == 0 and i > 0:
                for value in area.y_ticks:
                    y = area.y_scale(value) + 3.5
                    picture.add(Text(56.0, y, axis_number(value), SMALL_SIZE, Tone.MUTED, "end"))
    return picture


def parallel_chart(columns: _Columns, name: str, values: _Array) -> Picture:
    """A line for each run over an axis for each column; the runs with the highest measure are emphasised."""
    names = [*columns, name]
    tables = [*columns.values(), values]
    picture = _picture(430.0, f"Parallel coordinates: the tenth with the highest {name} in colour")
    top, bottom = 66.0, 388.0
    ranges = [padded_range(table, 0.0) for table in tables]
    x = np.linspace(70.0, FIGURE_WIDTH - 90.0, len(names))
    heights = np.stack(
        [bottom - (t - low) / (high - low) * (bottom - top) for t, (low, high) in zip(tables, ranges)]
    )
    valid = np.flatnonzero(np.isfinite(heights).all(axis=0))
    if valid.size:
        highest = values >= np.quantile(values[valid], 1.0 - HIGHEST)
        shown = valid[_thinned(valid.size, LINES)]
        for emphasised in (False, True):
            tone, opacity = (Tone.ACCENT, 0.7) if emphasised else (Tone.MUTED, 0.18)
            for run in shown[highest[shown] == emphasised].tolist():
                points = np.column_stack([x, heights[:, run]])
                picture.add(Polyline(points, tone, 1.1 if emphasised else 0.8, opacity=opacity))
    room = float(x[1] - x[0]) - 12.0
    for place, text, (low, high) in zip(x.tolist(), names, ranges):
        picture.add(
            Polyline([(place, top), (place, bottom)], Tone.INK, 1.2, sharp=True),
            Text(place, top - 22.0, shorten(text, SMALL_SIZE, room), SMALL_SIZE, anchor="middle", bold=True),
            Text(place, top - 7.0, table_number(high, 4), SMALL_SIZE, Tone.MUTED, "middle"),
            Text(place, bottom + 16.0, table_number(low, 4), SMALL_SIZE, Tone.MUTED, "middle"),
        )
    return picture


def bands_chart(time: _Array, samples: _Array, name: str) -> Picture:
    """The median of a signal over time, and the bands of the percentiles of all runs ``(runs, N)``."""
    picture = _picture(400.0, f"{name}: median, and percentiles 25 to 75 and 5 to 95")
    known = np.isfinite(samples).any(axis=0)
    time, samples = time[known], samples[:, known]
    shares = (5.0, 25.0, 50.0, 75.0, 95.0)
    percentiles = np.nanpercentile(samples, shares, axis=0) if time.size else np.empty((5, 0))
    box = (70.0, 54.0, FIGURE_WIDTH - 20.0, 350.0)
    area = linear_area(padded_range(time, 0.0), padded_range(percentiles, 0.05), box)
    picture.extend(_frame(area, x_label="time, s", y_label=name))
    for low, high in ((0, 4), (1, 3)):
        picture.add(_band(area, time, percentiles[low], percentiles[high]))
    picture.add(Polyline(area.points(time, percentiles[2]), Tone.ACCENT, 2.0))
    return picture


def map_chart(columns: _Columns, name: str, values: _Array, limit: float | None) -> Picture:
    """The medians of a measure in cells of two parameters, in colours; a line around the cells above a
    limit."""
    (x_name, x), (y_name, y) = columns.items()
    title = f"{name} over {x_name} and {y_name}"
    picture = _picture(560.0, title if limit is None else f"{title}; the line is {table_number(limit, 4)}")
    x_edges, y_edges = _edges(x), _edges(y)
    cells = cell_medians(x, y, values, x_edges, y_edges)
    box = (70.0, 54.0, FIGURE_WIDTH - 110.0, 510.0)
    ranges = [(float(edges[0]), float(edges[-1])) for edges in (x_edges, y_edges)]
    area = linear_area(ranges[0], ranges[1], box)
    picture.extend(_frame(area, x_label=x_name, y_label=y_name))
    finite = cells[np.isfinite(cells)]
    span = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    # One image; the cells may have different sizes.
    columns_of = _cells_of_pixels(x_edges, round(box[2] - box[0]))
    rows_of = _cells_of_pixels(y_edges, round(box[3] - box[1]))[::-1]
    pixels = colours(cells[columns_of][:, rows_of].T, span)
    picture.add(Raster(box[0], box[1], box[2] - box[0], box[3] - box[1], np.ascontiguousarray(pixels)))
    if limit is not None:
        picture.extend(_limit_line(area, cells > limit, np.isfinite(cells), x_edges, y_edges))
    picture.extend(colour_bar(area, span, False, "", FIGURE_WIDTH))
    return picture


def cell_medians(x: _Array, y: _Array, values: _Array, x_edges: _Array, y_edges: _Array) -> _Array:
    """The median of the finite values in each cell ``(nx, ny)``; NaN in cells without values."""
    valid = np.isfinite(x) & np.isfinite(y) & np.isfinite(values)
    places = [
        np.clip(np.searchsorted(edges, c[valid], side="right") - 1, 0, len(edges) - 2)
        for edges, c in ((x_edges, x), (y_edges, y))
    ]
    shape = (len(x_edges) - 1, len(y_edges) - 1)
    cell = np.ravel_multi_index((places[0], places[1]), shape)
    order = np.lexsort((values[valid], cell))
    sorted_values, sorted_cells = values[valid][order], cell[order]
    found, first, counts = np.unique(sorted_cells, return_index=True, return_counts=True)
    medians = np.full(shape[0] * shape[1], np.nan)
    low, high = sorted_values[first + (counts - 1) // 2], sorted_values[first + counts // 2]
    medians[found] = 0.5 * (low + high)
    return medians.reshape(shape)


def _edges(values: _Array) -> _Array:
    """The edges of cells: around each value of a grid, else at equal distances."""
    finite = values[np.isfinite(values)]
    levels = np.unique(finite)
    if 2 <= levels.size <= CELLS:
        inner = 0.5 * (levels[1:] + levels[:-1])
        return np.concatenate(
            [[1.5 * levels[0] - 0.5 * levels[1]], inner, [1.5 * levels[-1] - 0.5 * levels[-2]]]
        )
    count = max(2, min(24, round(np.sqrt(finite.size / RUNS_OF_A_GROUP))))
    low, high = padded_range(finite, 0.0)
    return np.linspace(low, high, count + 1)


def _cells_of_pixels(edges: _Array, count: int) -> NDArray[np.intp]:
    """The cell in which the centre of each of ``count`` pixels is."""
    low, high = float(edges[0]), float(edges[-1])
    centres: _Array = low + (np.arange(count) + 0.5) / count * (high - low)
    cells: NDArray[np.intp] = np.searchsorted(edges, centres, side="right") - 1
    return np.clip(cells, 0, len(edges) - 2)


def _limit_line(
    area: PlotArea, above: NDArray[np.bool_], known: NDArray[np.bool_], x_edges: _Array, y_edges: _Array
) -> list[Mark]:
    """The edges between cells below and above the limit."""
    marks: list[Mark] = []
    for axis in (0, 1):
        first, second = (np.take(above, range(k, above.shape[axis] - 1 + k), axis) for k in (0, 1))
        both = [np.take(known, range(k, known.shape[axis] - 1 + k), axis) for k in (0, 1)]
        for i, j in zip(*np.nonzero((first != second) & both[0] & both[1])):
            if axis == 0:
                at = area.x_scale(float(x_edges[i + 1]))
                ends = [(at, area.y_scale(float(edge))) for edge in y_edges[j : j + 2]]
            else:
                at = area.y_scale(float(y_edges[j + 1]))
                ends = [(area.x_scale(float(edge)), at) for edge in x_edges[i : i + 2]]
            marks.append(Polyline(ends, Tone.INK, 2.0))
    return marks


def _picture(height: float, title: str) -> Picture:
    picture = Picture(width=FIGURE_WIDTH, height=height, title=title, description=title)
    picture.add(Text(4.0, 18.0, shorten(title, TITLE_SIZE, FIGURE_WIDTH - 8.0), TITLE_SIZE, bold=True))
    return picture


def _frame(area: PlotArea, *, x_label: str, y_label: str) -> list[Mark]:
    """The frame with labels that fit into the area."""
    left, _, right, _ = area.box
    return area.frame(
        x_label=shorten(x_label, TEXT_SIZE, right - left), y_label=shorten(y_label, TEXT_SIZE, right - left)
    )


def _x_numbers(area: PlotArea, box: tuple[float, float, float, float], count: int) -> list[Mark]:
    """At most ``count`` numbers below a panel of a matrix."""
    ticks = area.x_ticks[:: max(1, -(-len(area.x_ticks) // count))]
    return [
        Text(area.x_scale(value), box[3] + 15.0, axis_number(value), SMALL_SIZE, Tone.MUTED, "middle")
        for value in ticks
    ]


def _thinned(count: int, most: int) -> NDArray[np.intp]:
    """At most ``most`` indices at equal distances."""
    return np.arange(count) if count <= most else np.arange(most) * count // most


def _dots(area: PlotArea, x: _Array, y: _Array, opacity: float, radius: float = 1.6) -> list[Mark]:
    valid = np.isfinite(x) & np.isfinite(y)
    places = area.points(x[valid], y[valid]).tolist()
    return [Disc(px, py, radius, fill=Tone.TRACE_0, opacity=opacity) for px, py in places]


def _band(area: PlotArea, x: _Array, low: _Array, high: _Array) -> Mark:
    outline = np.concatenate([area.points(x, low), area.points(x[::-1], high[::-1])])
    return Polyline(outline, stroke=None, fill=Tone.ACCENT, closed=True, opacity=0.22)


def _histogram(area: PlotArea, values: _Array) -> list[Mark]:
    finite = values[np.isfinite(values)]
    if not finite.size:
        return []
    low, high = area.x_scale.low, area.x_scale.high
    counts, edges = np.histogram(finite, bins=24, range=(low, high))
    marks: list[Mark] = []
    for count, begin, end in zip(counts.tolist(), edges[:-1].tolist(), edges[1:].tolist()):
        left, right, top = area.x_scale(begin), area.x_scale(end), area.y_scale(0.82 * count / counts.max())
        marks.append(
            Rectangle(left, top, right - left, area.y_scale(0.0) - top, fill=Tone.TRACE_0, opacity=0.5)
        )
    return marks
