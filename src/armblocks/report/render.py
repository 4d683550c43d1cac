"""A small software renderer: triangles with normals to shaded pixels with transparency and depth.

All triangles are rasterised at once with array operations: every triangle becomes rows, every row becomes
pixels, and the nearest fragment of each pixel is shaded. Passes are numbered in :func:`render`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.report.camera import Camera
from armblocks.report.style import rgb
from armblocks.robot.shapes import Material
from armblocks.robot.triangles import TriangleMesh

_Array = NDArray[np.float64]
_Index = NDArray[np.intp]

SUPERSAMPLES = 2
"""Rendered pixels per output pixel, each way."""

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
    """``pixels`` (rows, columns, 4) uint8 straight alpha; ``nearness`` 1/depth seen there, or 0."""

    pixels: NDArray[np.uint8]
    nearness: _Array


def render(
    meshes: Sequence[TriangleMesh], camera: Camera, width: float, height: float, scale: float
) -> Rendering:
    """Shaded pixels of world-frame meshes over ``width`` x ``height`` px, ``scale`` pixels each px.

    Lambert shading with a key and a fill light and a sky dome, a Blinn highlight, dark lines where a body
    ends before another; after Foley et al., *Computer Graphics*, chapter 16.
    """
    factor = scale * SUPERSAMPLES
    columns, rows = round(width * scale) * SUPERSAMPLES, round(height * scale) * SUPERSAMPLES
    corners = np.concatenate([mesh.corners for mesh in meshes])
    normals = np.concatenate([mesh.normals for mesh in meshes])
    counts = [len(mesh.corners) for mesh in meshes]
    material = np.repeat([_MATERIALS.index(mesh.material) for mesh in meshes], counts)

    # Pass 1: project, drop what faces away.
    x, y, nearness = camera.project(corners)
    x, y = x * factor, y * factor
    doubled_area = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    seen = doubled_area < -1e-9  # y runs downwards: anticlockwise is negative
    x, y, nearness, doubled_area = x[seen], y[seen], nearness[seen], doubled_area[seen]
    normals, material = normals[seen], material[seen]

    # Pass 2: fragments, and the nearest of each pixel.
    triangle, column, row = _fragments(x, y, columns, rows)
    weights = _barycentric(x, y, doubled_area, triangle, column, row)
    depth = np.einsum("ij,ij->i", weights, nearness[triangle])
    pixel = row * columns + column
    nearest = np.zeros(rows * columns)
    np.maximum.at(nearest, pixel, depth)
    visible = depth == nearest[pixel]
    triangle, pixel, weights = triangle[visible], pixel[visible], weights[visible]

    # Pass 3: shade, in camera axes.
    normal = np.einsum("ij,ijk->ik", weights, normals[triangle]) @ camera.axes.T
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    colour = _shade(normal, material[triangle])
    image = np.zeros((rows * columns, 4))
    image[pixel, :3] = colour
    image[pixel, 3] = 1.0
    facing = np.zeros((rows * columns, 3))
    facing[pixel] = normal
    nearest = nearest.reshape(rows, columns)
    image = image.reshape(rows, columns, 4)
    image[..., :3] *= _outlines(nearest, facing.reshape(rows, columns, 3))[..., None]

    # Pass 4: average the supersamples (colours weighted by coverage) and encode.
    blocks = image.reshape(rows // SUPERSAMPLES, SUPERSAMPLES, columns // SUPERSAMPLES, SUPERSAMPLES, 4)
    averaged = blocks.mean(axis=(1, 3))
    alpha = averaged[..., 3:]
    linear = averaged[..., :3] / np.maximum(alpha, 1e-9)
    encoded = np.concatenate([_to_srgb(linear), alpha], axis=-1)
    return Rendering(
        pixels=np.rint(encoded * 255).astype(np.uint8), nearness=nearest[::SUPERSAMPLES, ::SUPERSAMPLES]
    )


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
    """A soft black shadow on the floor ``z = floor`` (m), pixels (rows, columns, 4), at ``scale`` a px.

    The sun stands high over the left shoulder of the viewer: the shadow lies behind and right of the arm.
    """
    columns, rows = round(width * scale), round(height * scale)
    right, up = camera.axes[0], np.array([0.0, 0.0, 1.0])
    away = np.cross(up, right)  # horizontal, away from the viewer
    fall = -up + 0.30 * right + 0.26 * away
    corners = np.concatenate([mesh.corners for mesh in meshes])
    drop = np.maximum(corners[..., 2:] - floor, 0.0)
    x, y, _ = camera.project(corners + drop * fall)
    mask = np.zeros(rows * columns)
    x, y = x * scale, y * scale
    _, column, row = _fragments(x, y, columns, rows)
    mask[row * columns + column] = 1.0
    soft = mask.reshape(rows, columns)
    for _ in range(3):  # three box filters make a smooth bell (central limit theorem)
        soft = _box_filter(_box_filter(soft, blur).T, blur).T
    pixels = np.zeros((rows, columns, 4), dtype=np.uint8)
    pixels[..., 3] = np.rint(soft * 72)
    return pixels


def over(front: NDArray[np.uint8], back: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """``front`` laid over ``back``, both straight alpha (Porter and Duff 1984)."""
    f, b = front.astype(np.float64) / 255, back.astype(np.float64) / 255
    alpha = f[..., 3:] + b[..., 3:] * (1 - f[..., 3:])
    colour = (f[..., :3] * f[..., 3:] + b[..., :3] * b[..., 3:] * (1 - f[..., 3:])) / np.maximum(alpha, 1e-9)
    return np.rint(np.concatenate([colour, alpha], axis=-1) * 255).astype(np.uint8)


def faded(pixels: NDArray[np.uint8], strength: float) -> NDArray[np.uint8]:
    """The same pixels with their opacity multiplied by ``strength``, 0..1."""
    result = pixels.copy()
    result[..., 3] = np.rint(pixels[..., 3] * strength).astype(np.uint8)
    return result


def cropped(pixels: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], int, int]:
    """The part of the pixels that is not transparent, with its first column and row."""
    rows, columns = np.any(pixels[..., 3], axis=1), np.any(pixels[..., 3], axis=0)
    if not rows.any():
        return pixels[:1, :1], 0, 0
    top, bottom = int(np.argmax(rows)), len(rows) - int(np.argmax(rows[::-1]))
    left, right = int(np.argmax(columns)), len(columns) - int(np.argmax(columns[::-1]))
    return pixels[top:bottom, left:right], left, top


def _fragments(x: _Array, y: _Array, columns: int, rows: int) -> tuple[_Index, _Index, _Index]:
    """Triangle, column and row of every pixel centre inside a triangle; corners (F, 3) in pixels."""
    first = np.clip(np.ceil(y.min(axis=1) - 0.5), 0, rows).astype(np.intp)
    last = np.clip(np.floor(y.max(axis=1) - 0.5), -1, rows - 1).astype(np.intp)
    triangle, row = _ranges(first, np.maximum(last - first + 1, 0))
    centre = row + 0.5
    left, right = np.full(len(row), np.inf), np.full(len(row), -np.inf)
    for i, j in ((0, 1), (1, 2), (2, 0)):
        xi, yi, xj, yj = x[triangle, i], y[triangle, i], x[triangle, j], y[triangle, j]
        crossed = ((yi <= centre) & (centre < yj)) | ((yj <= centre) & (centre < yi))
        with np.errstate(divide="ignore", invalid="ignore"):
            at = xi + (xj - xi) * (centre - yi) / (yj - yi)
        left = np.where(crossed, np.minimum(left, at), left)
        right = np.where(crossed, np.maximum(right, at), right)
    some = right >= left
    triangle, row, left, right = triangle[some], row[some], left[some], right[some]
    first = np.clip(np.ceil(left - 0.5), 0, columns).astype(np.intp)
    last = np.clip(np.ceil(right - 0.5) - 1, -1, columns - 1).astype(np.intp)
    span, column = _ranges(first, np.maximum(last - first + 1, 0))
    return triangle[span], column, row[span]


def _ranges(first: _Index, counts: _Index) -> tuple[_Index, _Index]:
    """For ranges ``first[k] .. first[k] + counts[k] - 1`` laid end to end: which range, and the number."""
    owner = np.repeat(np.arange(len(first)), counts)
    begin = np.cumsum(counts) - counts
    return owner, np.arange(len(owner)) - begin[owner] + first[owner]


def _barycentric(
    x: _Array, y: _Array, doubled_area: _Array, triangle: _Index, column: _Index, row: _Index
) -> _Array:
    px, py = column + 0.5, row + 0.5
    # The weights are linear in the pixel: gradients once a triangle, then two multiply-adds a fragment.
    gx1, gy1 = (y[:, 2] - y[:, 0]) / doubled_area, -(x[:, 2] - x[:, 0]) / doubled_area
    gx2, gy2 = -(y[:, 1] - y[:, 0]) / doubled_area, (x[:, 1] - x[:, 0]) / doubled_area
    dx, dy = px - x[triangle, 0], py - y[triangle, 0]
    w1 = gx1[triangle] * dx + gy1[triangle] * dy
    w2 = gx2[triangle] * dx + gy2[triangle] * dy
    return np.stack([1 - w1 - w2, w1, w2], axis=1)


def _shade(normal: _Array, material: _Index) -> _Array:
    """Linear colours (P, 3) of surface points with unit normals in camera axes."""
    base = np.array([_to_linear(rgb(_FINISH[m][0])) for m in _MATERIALS])[material]
    gloss = np.array([_FINISH[m][1] for m in _MATERIALS])[material]
    sharpness = np.array([_FINISH[m][2] for m in _MATERIALS])[material]
    key, fill = _KEY / np.linalg.norm(_KEY), _FILL / np.linalg.norm(_FILL)
    dome = _GROUND + (_SKY - _GROUND) * (0.5 + 0.5 * normal[:, 1])
    light = (
        dome + _KEY_STRENGTH * np.maximum(normal @ key, 0.0) + _FILL_STRENGTH * np.maximum(normal @ fill, 0.0)
    )
    halfway = key + np.array([0.0, 0.0, 1.0])
    halfway /= np.linalg.norm(halfway)
    highlight = gloss * np.maximum(normal @ halfway, 0.0) ** sharpness
    # Dark bodies keep a rim of light, so that graphite stands off a dark ground.
    rim = 0.10 * (1.0 - np.clip(normal[:, 2], 0.0, 1.0)) ** 3
    return np.clip(base * light[:, None] + (highlight + rim)[:, None], 0.0, 1.0)


def _outlines(nearness: _Array, facing: _Array) -> _Array:
    """A factor (rows, columns) below 1 where depth or direction jumps between neighbouring pixels."""
    factor = np.ones_like(nearness)
    for axis in (0, 1):
        other = np.roll(nearness, -1, axis=axis)
        both = (nearness > 0) & (other > 0)
        jump = both & (np.abs(other - nearness) > 0.006 * nearness)
        bend = both & (np.einsum("ijk,ijk->ij", facing, np.roll(facing, -1, axis=axis)) < 0.55)
        factor[jump] *= 0.45
        factor[bend & ~jump] *= 0.72
    return factor


def _box_filter(values: _Array, radius: int) -> _Array:
    padded = np.pad(values, ((radius + 1, radius), (0, 0)))
    total = np.cumsum(padded, axis=0)
    return (total[2 * radius + 1 :] - total[: -2 * radius - 1]) / (2 * radius + 1)


def _to_linear(colour: tuple[float, float, float]) -> _Array:
    c = np.array(colour)
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def _to_srgb(linear: _Array) -> _Array:
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
