"""A pinhole camera with a lens shift, placed so that given points fill a panel."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]

AZIMUTH = -58.0
"""Azimuth, degrees: the camera is between +x and -y, as in textbook drawings of arms."""
ELEVATION = 20.0
"""Elevation above the horizon, degrees."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Camera:
    """A pinhole camera: px = scale X / depth + shift.

    Rows of ``axes`` are right, up and towards the viewer in the world frame; ``eye`` is in m.
    """

    axes: _Array
    eye: _Array
    scale: float
    shift: tuple[float, float]

    @classmethod
    def framing(
        cls,
        points: _Array,
        width: float,
        height: float,
        *,
        margin: float = 12.0,
        azimuth: float = AZIMUTH,
        elevation: float = ELEVATION,
        distance: float = 4.2,
    ) -> Camera:
        """The camera that shows ``points`` (N, 3) m as large as possible in a panel with a margin, px.

        Its distance is ``distance`` times the extent of the points, so the perspective distortion is small.
        """
        a, e = math.radians(azimuth), math.radians(elevation)
        toward_viewer = np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
        right = np.array([-math.sin(a), math.cos(a), 0.0])
        axes = np.stack([right, np.cross(toward_viewer, right), toward_viewer])
        low, high = points.min(axis=0), points.max(axis=0)
        extent = max(float(np.linalg.norm(high - low)), 1e-9)
        eye = (low + high) / 2 + distance * extent * toward_viewer
        unit_camera = cls(axes=axes, eye=eye, scale=1.0, shift=(0.0, 0.0))
        x, y, _ = unit_camera.project(points)
        scale = min(
            (width - 2 * margin) / max(float(np.ptp(x)), 1e-9),
            (height - 2 * margin) / max(float(np.ptp(y)), 1e-9),
        )
        shift = (
            width / 2 - scale * float(x.min() + x.max()) / 2,
            height / 2 - scale * float(y.min() + y.max()) / 2,
        )
        return cls(axes=axes, eye=eye, scale=scale, shift=shift)

    def project(self, points: _Array) -> tuple[_Array, _Array, _Array]:
        """Positions to the right and downwards (px), and 1/depth (1/m, larger is nearer) of points."""
        local = (points - self.eye) @ self.axes.T
        inverse_depth = -1.0 / local[..., 2]
        return (
            self.scale * local[..., 0] * inverse_depth + self.shift[0],
            -self.scale * local[..., 1] * inverse_depth + self.shift[1],
            inverse_depth,
        )

    def to_pixels(self, points: _Array) -> _Array:
        """Position in px (..., 2) of points (..., 3)."""
        x, y, _ = self.project(points)
        return np.stack([x, y], axis=-1)
