"""Cross-sections of solids that a polygon sweeps: their check, and their corners in order."""

from __future__ import annotations

from functools import lru_cache
from typing import cast

from numpy.typing import ArrayLike

from armblocks.diagram import FramePort, shape_of
from armblocks.errors import InputError
from armblocks.multibody.parts import REFERENCE
from armblocks.spatial.polygons import (
    Polygon,
    counter_clockwise,
    distinct_corners,
    first_intersection,
    integrals,
)

SMALLEST_AREA = 1e-10
"""The smallest area of a cross-section relative to its squared width."""
SECTION_FRAME = FramePort(REFERENCE, "frame of the solid, at the origin of the cross-section")


def check_cross_section(cross_section: ArrayLike, block_type: str) -> None:
    """Raise ``InputError`` unless a checked array (N, 2) has the corners of a simple polygon."""
    where, shape = f"{block_type}.cross_section", shape_of(cross_section)
    if shape[1] != 2:
        raise InputError(
            f"the cross-section has shape {shape}",
            where=where,
            allowed="a matrix (N, 2) with one row for each corner",
            fix="give the two coordinates of each corner",
        )
    corners = distinct_corners(cast("Polygon", cross_section))
    if len(corners) < 3:
        raise InputError(
            f"the cross-section has {len(set(corners)) or 1} different corners",
            where=where,
            allowed="at least 3 corners that are not on one line",
            fix="add corners",
        )
    edges = _intersection(corners)
    if edges is not None:
        first, second = (f"{corners[k]} to {corners[(k + 1) % len(corners)]}" for k in edges)
        raise InputError(
            f"the cross-section intersects itself: the edges {first} and {second} meet",
            where=where,
            allowed="a simple polygon without holes, whose edges meet only at the corner between them",
            fix="correct the order of the corners, or weld several solids together",
        )
    area, width = _area_and_width(corners)
    if not area > SMALLEST_AREA * width * width:
        raise InputError(
            f"the cross-section has almost no area: {area:.3g} m2 at a width of {width:.3g} m",
            where=where,
            allowed=f"an area above {SMALLEST_AREA:g} of the squared width",
            fix="correct the corners; near one line their rounding errors determine the inertia",
        )


def _area_and_width(corners: Polygon) -> tuple[float, float]:
    """The area, and the larger side of the bounding box."""
    xs, ys = zip(*corners)
    area = integrals(counter_clockwise(corners), corners[0]).area
    return area, max(max(xs) - min(xs), max(ys) - min(ys))


@lru_cache(maxsize=256)
def _intersection(corners: Polygon) -> tuple[int, int] | None:
    return first_intersection(corners)


def ordered_corners(cross_section: ArrayLike) -> Polygon:
    """The corners of a checked cross-section in counter-clockwise order, without repeated ones."""
    return _ordered(cast("Polygon", cross_section))


@lru_cache(maxsize=256)
def _ordered(corners: Polygon) -> Polygon:
    return counter_clockwise(distinct_corners(corners))
