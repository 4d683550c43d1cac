"""Pictures as PNG, painted by matplotlib's Agg renderer."""

from __future__ import annotations

from typing import cast

import numpy as np
from numpy.typing import NDArray

from armblocks.extras import from_extra
from armblocks.pictures.painter import Painter
from armblocks.pictures.picture import Picture
from armblocks.pictures.png_file import png_bytes
from armblocks.pictures.style import Theme

PIXELS_PER_PX = 2.0
"""Picture px are CSS px (1/96 inch): 2 gives 192 dots per inch, sharp on paper and on dense screens."""


def picture_png(picture: Picture, *, theme: Theme = "light", scale: float = PIXELS_PER_PX) -> bytes:
    """The picture as an opaque PNG file with ``scale`` pixels for each px."""
    return png_bytes(picture_pixels(picture, theme=theme, scale=scale))


def picture_pixels(
    picture: Picture, *, theme: Theme = "light", scale: float = PIXELS_PER_PX
) -> NDArray[np.uint8]:
    """The picture as opaque pixels (rows, columns, 3)."""
    with from_extra("figures", "PNG figures"):
        from matplotlib.backends.backend_agg import RendererAgg

    width, height = round(picture.width * scale), round(picture.height * scale)
    renderer = RendererAgg(width, height, 72.0)
    Painter(renderer, height, theme, scale).picture(picture)
    return cast("NDArray[np.uint8]", np.asarray(renderer.buffer_rgba()))[:, :, :3]
