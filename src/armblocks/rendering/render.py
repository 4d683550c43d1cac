"""A small software renderer: converts triangles with normals to shaded pixels with transparency and depth.

The triangles of a band of rows are rasterised together with array operations. Every triangle is divided into
rows and every row into pixels, and the nearest fragment of each pixel is shaded. The passes are numbered.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armblocks.pictures.style import rgb
from armblocks.rendering.camera import Camera
from armblocks.robot.shapes import Material
from armblocks.robot.triangles import TriangleMesh

_Array = NDArray[np.float64]
_Index = NDArray[np.intp]

SUPERSAMPLES = 2
"""Rendered pixels per output pixel in each direction."""
_BAND = 32 * SUPERSAMPLES
"""Rows of supersamples that are drawn together: their arrays remain in the cache of the processor."""

# Colour (sRGB), strength and sharpness of the highlight.
_FINISH: dict[Material, tuple[str, float, float]] = {
    Material.PAINT: ("#f0701a", 0.22, 26.0),
    Material.JOINT: ("#4a4f58", 0.16, 14.0),
    Material.FLANGE: ("#b9bfc7", 0.30, 22.0),
    Material.BASE: ("#6a7079", 0.12, 12.0),
}
_MATERIALS = tuple(Material)

# Directions towards the lights in camera axes (right, up, towards the viewer), with their strengths.
_KEY, _KEY_STRENGTH = np.array([-0.48, 0.74, 0.58]), 0.98
_FILL, _FILL_STRENGTH = np.array([0.85, 0.10, 0.50]), 0.20
_SKY, _GROUND = 0.40, 0.17


@dataclass(frozen=True, eq=False)
class Rendering:
    """The pixels that a set of bodies covers, as a window of the panel.

    ``pixels``: (rows, columns, 4) uint8, straight alpha. ``inverse_depth``: (rows, columns), 1/depth of the
    visible surface, or 0. ``left`` and ``top``: the window's first column and row. ``scale``: pixels per px.
    """

    pixels: NDArray[np.uint8]
    inverse_depth: _Array
    left: int
    top: int
    scale: float

    def inverse_depth_at(self, x: _Array, y: _Array) -> _Array:
        """1/depth of the bodies at points of the panel (px), 0 without a body."""
        column = np.floor(x * self.scale).astype(np.intp) - self.left
        row = np.floor(y * self.scale).astype(np.intp) - self.top
        rows, columns = self.inverse_depth.shape
        inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        inverse_depth = self.inverse_depth[np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)]
        return np.where(inside, inverse_depth, 0.0)


def render(
    meshes: Sequence[TriangleMesh], camera: Camera, width: float, height: float, scale: float
) -> Rendering:
    """Shaded pixels of world-frame meshes over ``width`` x ``height`` px, with ``scale`` pixels per px.

    The shading is Lambert's with a key light, a fill light and a sky dome, and a Blinn highlight. Dark lines
    separate a body from a body behind it. Source: Foley et al., *Computer Graphics*, chapter 16.
    """
    corners = np.concatenate([mesh.corners for mesh in meshes])
    normals = np.concatenate([mesh.normals for mesh in meshes]) @ camera.axes.T
    counts = [len(mesh.corners) for mesh in meshes]
    material = np.repeat([_MATERIALS.index(mesh.material) for mesh in meshes], counts)

    # Pass 1: project, remove back faces, and determine the window that the bodies cover.
    x, y, inverse_depth = camera.project(corners)
    x, y = x * scale, y * scale
    left, right = _extent(x, round(width * scale))
    top, bottom = _extent(y, round(height * scale))
    columns, rows = (right - left) * SUPERSAMPLES, (bottom - top) * SUPERSAMPLES
    x, y = (x - left) * SUPERSAMPLES, (y - top) * SUPERSAMPLES
    doubled_area = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    front = doubled_area < -1e-9  # y runs downwards: anticlockwise is negative
    x, y, inverse_depth, doubled_area = x[front], y[front], inverse_depth[front], doubled_area[front]
    surface = _Surface(x, y, doubled_area, inverse_depth, normals[front], material[front])

    # Passes 2 to 4, in bands of rows.
    n = SUPERSAMPLES
    pixels = np.zeros((rows // n, columns // n, 4), dtype=np.uint8)
    depths = np.zeros((rows // n, columns // n))
    for begin in range(0, rows, _BAND):
        end = min(begin + _BAND, rows)
        target = slice(begin // n, end // n)
        _draw_band(surface, range(begin, min(end + 1, rows)), end, pixels[target], depths[target])
    return Rendering(pixels=pixels, inverse_depth=depths, left=left, top=top, scale=scale)


class _Surface(NamedTuple):
    """Visible triangles: corners (F, 3) in supersamples, with doubled areas, normals and materials."""

    x: _Array
    y: _Array
    doubled_area: _Array
    inverse_depth: _Array
    normals: _Array
    material: _Index

    def touching(self, rows: range) -> _Surface:
        """The triangles that may cover some of the rows."""
        is_near = (self.y.max(axis=1) >= rows.start) & (self.y.min(axis=1) <= rows.stop)
        return _Surface(
            x=self.x[is_near],
            y=self.y[is_near],
            doubled_area=self.doubled_area[is_near],
            inverse_depth=self.inverse_depth[is_near],
            normals=self.normals[is_near],
            material=self.material[is_near],
        )

    def plane(self, values: _Array) -> Callable[[_Index, _Index, _Index], _Array]:
        """The interpolation of corner values (F, 3)."""
        return _linear_in_pixels(self.x, self.y, self.doubled_area, values)


def _draw_band(surface: _Surface, rows: range, end: int, pixels: NDArray[np.uint8], depths: _Array) -> None:
    """Draw the supersamples of ``rows`` up to the row ``end`` into the output ``pixels`` and ``depths``.

    ``rows`` includes one row after ``end``, unless it is the last, because outlines depend on it.
    """
    # Pass 2: fragments, and the nearest of each supersample.
    n, columns = SUPERSAMPLES, pixels.shape[1] * SUPERSAMPLES
    surface = surface.touching(rows)
    triangle, column, row = _fragments(surface.x, surface.y, columns, rows)
    sample = (row - rows.start) * columns + column
    depth = surface.plane(surface.inverse_depth)(triangle, column, row)
    nearest = np.zeros(len(rows) * columns)
    np.maximum.at(nearest, sample, depth)
    fragment = np.full(len(nearest), -1, dtype=np.intp)  # of several at one depth the last
    visible = np.flatnonzero(depth == nearest[sample])
    fragment[sample[visible]] = visible
    sample = np.flatnonzero(fragment >= 0)
    visible = fragment[sample]
    triangle, column, row = triangle[visible], column[visible], row[visible]
    depths[:] = nearest.reshape(len(rows), columns)[: end - rows.start : n, ::n]

    # Pass 3: shade, in camera axes. Arrays have one entry for each covered supersample.
    planes = [surface.plane(surface.normals[:, :, k]) for k in range(3)]
    normal = np.stack([plane(triangle, column, row) for plane in planes])
    normal /= np.sqrt(np.einsum("ij,ij->j", normal, normal)) + 1e-12
    colour = _shade(normal, surface.material[triangle])
    colour *= _outlines(nearest.reshape(len(rows), columns), normal, sample)

    # Pass 4: average the supersamples (colours weighted by coverage) and encode.
    count = int(np.count_nonzero(sample < (end - rows.start) * columns))
    column, row = column[:count], row[:count] - rows.start
    target = (row // n) * (columns // n) + column // n
    shown, averaged = _block_means(colour[:, :count], target, (row % n) * n + column % n, depths.size)
    alpha = averaged[3]
    encoded = np.empty((len(shown), 4), dtype=np.uint8)
    for k in range(3):
        encoded[:, k] = _SRGB[np.rint(averaged[k] / alpha * _SRGB_STEPS).astype(np.intp)]
    encoded[:, 3] = np.rint(alpha * 255)
    pixels.reshape(-1, 4)[shown] = encoded


def _block_means(colour: _Array, target: _Index, place: _Index, count: int) -> tuple[_Index, _Array]:
    """The covered output pixels (M,) of ``count``, and the means (4, M) of their colours and coverage.

    ``colour`` (3, P), ``target`` (P,) and ``place`` (P,): of each covered supersample the colour, the output
    pixel and the number within the output pixel.
    """
    is_shown = np.zeros(count, dtype=bool)
    is_shown[target] = True
    shown = np.flatnonzero(is_shown)
    number = np.cumsum(is_shown) - 1
    samples = np.zeros((4, SUPERSAMPLES**2, len(shown)))
    where = place * len(shown) + number[target]
    for plane, values in zip(samples, (*colour, 1.0)):
        plane.reshape(-1)[where] = values
    total = samples[:, 0].copy()
    for k in range(1, SUPERSAMPLES**2):
        total += samples[:, k]
    return shown, total / SUPERSAMPLES**2


def _extent(values: _Array, limit: int) -> tuple[int, int]:
    """The visible pixels along one side of the panel: the first, and one after the last; at least one."""
    low = min(max(int(np.floor(values.min())) - 1, 0), limit - 1)
    return low, max(min(int(np.ceil(values.max())) + 1, limit), low + 1)


def shadow(
    meshes: Sequence[TriangleMesh],
    camera: Camera,
    floor: float,
    width: float,
    height: float,
    scale: float,
    *,
    blur: int = 3,
) -> NDArray[np.uint8]:
    """A soft black shadow on the floor ``z = floor`` (m), pixels (rows, columns, 4), ``scale`` per px.

    The light comes from above, left of and behind the camera, so the shadow is behind the arm, on its right.
    """
    columns, rows = round(width * scale), round(height * scale)
    right, up = camera.axes[0], np.array([0.0, 0.0, 1.0])
    away = np.cross(up, right)  # horizontal, away from the viewer
    light_direction = -up + 0.30 * right + 0.26 * away
    corners = np.concatenate([mesh.corners for mesh in meshes])
    heights = np.maximum(corners[..., 2:] - floor, 0.0)
    x, y, _ = camera.project(corners + heights * light_direction)
    mask = np.zeros(rows * columns)
    x, y = x * scale, y * scale
    _, column, row = _fragments(x, y, columns, range(rows))
    mask[row * columns + column] = 1.0
    blurred = mask.reshape(rows, columns)
    for _ in range(3):  # three box filters approximate a Gaussian filter (central limit theorem)
        blurred = _box_filter(_box_filter(blurred, blur).T, blur).T
    pixels = np.zeros((rows, columns, 4), dtype=np.uint8)
    pixels[..., 3] = np.rint(blurred * 72)
    return pixels


def composite(front: NDArray[np.uint8], back: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """``front`` composited over ``back``, both with straight alpha (Porter and Duff 1984)."""
    result = back.copy()
    result[back[..., 3] == 0] = 0
    strength = front[..., 3]  # outside of the window, ``back`` is unchanged
    opaque = strength == 255
    result[opaque] = front[opaque]
    covered = (strength > 0) & ~opaque
    f, b = front[covered] / 255, back[covered] / 255
    alpha = f[:, 3:] + b[:, 3:] * (1 - f[:, 3:])
    colour = (f[:, :3] * f[:, 3:] + b[:, :3] * b[:, 3:] * (1 - f[:, 3:])) / np.maximum(alpha, 1e-9)
    result[covered] = np.rint(np.concatenate([colour, alpha], axis=-1) * 255).astype(np.uint8)
    return result


def with_opacity(pixels: NDArray[np.uint8], strength: float) -> NDArray[np.uint8]:
    """The same pixels with their opacity multiplied by ``strength``, 0..1."""
    result = pixels.copy()
    result[..., 3] = np.rint(pixels[..., 3] * strength).astype(np.uint8)
    return result


def crop(pixels: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], int, int]:
    """The part of the pixels that is not transparent, with its first column and row."""
    rows, columns = np.any(pixels[..., 3], axis=1), np.any(pixels[..., 3], axis=0)
    if not rows.any():
        return pixels[:1, :1], 0, 0
    top, bottom = int(np.argmax(rows)), len(rows) - int(np.argmax(rows[::-1]))
    left, right = int(np.argmax(columns)), len(columns) - int(np.argmax(columns[::-1]))
    return pixels[top:bottom, left:right], left, top


def _fragments(x: _Array, y: _Array, columns: int, rows: range) -> tuple[_Index, _Index, _Index]:
    """Triangle, column and row of every pixel centre inside a triangle; corners (F, 3) in pixels."""
    first = np.clip(np.ceil(y.min(axis=1) - 0.5), rows.start, rows.stop).astype(np.intp)
    last = np.clip(np.floor(y.max(axis=1) - 0.5), rows.start - 1, rows.stop - 1).astype(np.intp)
    triangle, row = _ranges(first, np.maximum(last - first + 1, 0))
    centre = row + 0.5
    left, right = np.full(len(row), np.inf), np.full(len(row), -np.inf)
    corners = [(x[triangle, k], y[triangle, k]) for k in range(3)]
    for i, j in ((0, 1), (1, 2), (2, 0)):
        (xi, yi), (xj, yj) = corners[i], corners[j]
        crossed = ((yi <= centre) & (centre < yj)) | ((yj <= centre) & (centre < yi))
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = xi + (xj - xi) * (centre - yi) / (yj - yi)
        left = np.where(crossed, np.minimum(left, crossing), left)
        right = np.where(crossed, np.maximum(right, crossing), right)
    not_empty = right >= left
    triangle, row, left, right = triangle[not_empty], row[not_empty], left[not_empty], right[not_empty]
    first = np.clip(np.ceil(left - 0.5), 0, columns).astype(np.intp)
    last = np.clip(np.ceil(right - 0.5) - 1, -1, columns - 1).astype(np.intp)
    span, column = _ranges(first, np.maximum(last - first + 1, 0))
    return triangle[span], column, row[span]


def _ranges(first: _Index, counts: _Index) -> tuple[_Index, _Index]:
    """Range index and number of each entry of the ranges ``first[k] .. first[k] + counts[k] - 1``."""
    owner = np.repeat(np.arange(len(first)), counts)
    begin = np.cumsum(counts) - counts
    return owner, np.arange(len(owner)) + (first - begin)[owner]


def _linear_in_pixels(
    x: _Array, y: _Array, doubled_area: _Array, values: _Array
) -> Callable[[_Index, _Index, _Index], _Array]:
    """Interpolation of corner values (F, 3): a plane for each triangle, evaluated at pixel centres."""
    d1, d2 = values[:, 1] - values[:, 0], values[:, 2] - values[:, 0]
    gx = (d1 * (y[:, 2] - y[:, 0]) - d2 * (y[:, 1] - y[:, 0])) / doubled_area
    gy = (d2 * (x[:, 1] - x[:, 0]) - d1 * (x[:, 2] - x[:, 0])) / doubled_area
    at_origin = values[:, 0] + gx * (0.5 - x[:, 0]) + gy * (0.5 - y[:, 0])

    def evaluate(triangle: _Index, column: _Index, row: _Index) -> _Array:
        return at_origin[triangle] + gx[triangle] * column + gy[triangle] * row

    return evaluate


def _shade(normal: _Array, material: _Index) -> _Array:
    """Linear colours (3, P) of surface points with unit normals (3, P) in camera axes."""
    key, fill = _KEY / np.linalg.norm(_KEY), _FILL / np.linalg.norm(_FILL)
    halfway = key + np.array([0.0, 0.0, 1.0])
    halfway /= np.linalg.norm(halfway)
    light = _GROUND + (_SKY - _GROUND) * (0.5 + 0.5 * normal[1])
    light += _KEY_STRENGTH * np.maximum(key @ normal, 0.0)
    light += _FILL_STRENGTH * np.maximum(fill @ normal, 0.0)
    # A light rim makes dark (graphite) bodies visible on a dark background.
    white = 0.10 * (1.0 - np.clip(normal[2], 0.0, 1.0)) ** 3
    white += _GLOSS[material] * np.exp(_SHARPNESS[material] * np.log(np.maximum(halfway @ normal, 1e-6)))
    return np.clip(_BASE[:, material] * light + white, 0.0, 1.0)


def _outlines(inverse_depth: _Array, normal: _Array, pixel: _Index) -> _Array:
    """A factor (P,) that is below 1 where depth or normal jumps to the next pixel, below or on the right.

    ``normal`` (3, P): normals of the surface at the covered pixels ``pixel`` (P,), which ascend.
    """
    rows, columns = inverse_depth.shape
    depth = inverse_depth.ravel()
    number = np.full(rows * columns, -1, dtype=np.intp)
    number[pixel] = np.arange(len(pixel))
    factor = np.ones(len(pixel))
    not_last: _Index = np.flatnonzero(pixel % columns < columns - 1)
    not_lowest: _Index = np.flatnonzero(pixel < (rows - 1) * columns)
    for begin, step in ((not_lowest, columns), (not_last, 1)):
        neighbour = number[pixel[begin] + step]
        is_covered = neighbour >= 0
        here, other = begin[is_covered], neighbour[is_covered]
        near, far = depth[pixel[here]], depth[pixel[other]]
        aligned = normal[0, here] * normal[0, other]
        aligned += normal[1, here] * normal[1, other]
        aligned += normal[2, here] * normal[2, other]
        factor[here[aligned < 0.55]] *= 0.72
        factor[here[np.abs(far - near) > 0.006 * near]] *= 0.6
    return factor


def _box_filter(values: _Array, radius: int) -> _Array:
    padded = np.pad(values, ((radius + 1, radius), (0, 0)))
    total = np.cumsum(padded, axis=0)
    return (total[2 * radius + 1 :] - total[: -2 * radius - 1]) / (2 * radius + 1)


def _to_linear(colour: tuple[float, float, float]) -> _Array:
    c = np.array(colour)
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


_GLOSS = np.array([_FINISH[m][1] for m in _MATERIALS])
_SHARPNESS = np.array([_FINISH[m][2] for m in _MATERIALS])
_BASE = np.stack([_to_linear(rgb(_FINISH[m][0])) for m in _MATERIALS], axis=1)

_SRGB_STEPS = 4095
"""Number of steps of linear light, 12 bits: finer than 8 bits of sRGB everywhere."""


def _srgb_table() -> NDArray[np.uint8]:
    linear = np.arange(_SRGB_STEPS + 1) / _SRGB_STEPS
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.rint(encoded * 255).astype(np.uint8)


_SRGB = _srgb_table()
