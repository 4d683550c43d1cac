"""Figures with fewer points, which reduce the size of the pages in the wheel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from armblocks.pictures.picture import Group, Mark, Picture, Polyline

TOLERANCE = 0.1
"""Maximum distance of an omitted point from the drawn line, px."""
MIN_POINTS = 24
"""Lines with fewer points are unchanged."""


def simplified(picture: Picture) -> Picture:
    """The picture with fewer points in its long lines, within ``TOLERANCE``."""
    return replace(picture, marks=[_simplified_mark(mark) for mark in picture.marks])


def _simplified_mark(mark: Mark) -> Mark:
    if isinstance(mark, Group):
        return replace(
            mark, marks=tuple(_simplified_mark(inner) for inner in mark.marks)
        )
    if isinstance(mark, Polyline):
        points = np.asarray(mark.points, dtype=np.float64)
        if len(points) > MIN_POINTS and np.isfinite(points).all():
            return replace(mark, points=points[selected_points(points)])
    return mark


def selected_points(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mask (N,) of the points of a line (N, 2) that the simplified line has: its ends and its corners.

    Source: Douglas and Peucker, "Algorithms for the reduction of the number of points", 1973.
    """
    mask = np.zeros(len(points), dtype=np.bool_)
    mask[[0, -1]] = True
    spans = [(0, len(points) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        inner = points[first + 1 : last] - points[first]
        chord = points[last] - points[first]
        squared = chord @ chord
        along = (
            np.clip(inner @ chord / squared, 0.0, 1.0)
            if squared
            else np.zeros(len(inner))
        )
        distances = np.linalg.norm(inner - along[:, None] * chord, axis=1)
        farthest = int(distances.argmax())
        if distances[farthest] > TOLERANCE:
            middle = first + 1 + farthest
            mask[middle] = True
            spans += [(first, middle), (middle, last)]
    return mask
