"""Painting of a picture by a renderer of matplotlib: pixels (:mod:`.png`) or pages (:mod:`.pdf`).

Only the renderers of matplotlib are used, not its figures, because the marks already have their positions,
and importing pyplot and axes takes longer than the painting. Text is in DejaVu Sans, which is part of
matplotlib and whose widths are in :mod:`.text_width`.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from armblocks.pictures.picture import Curve, Disc, Group, Mark, Picture, Polyline, Raster, Rectangle, Text
from armblocks.pictures.style import PALETTE, Theme, Tone, rgb
from armblocks.pictures.text_width import printable

if TYPE_CHECKING:
    from matplotlib.path import Path

_KAPPA = 0.5522847498  # control points of a quarter circle as a cubic Bezier curve


@dataclass(frozen=True, eq=False)
class Painter:
    """Paints marks with a ``renderer`` of 72 dpi and ``height`` units; a px has ``scale`` units."""

    renderer: Any  # a matplotlib RendererBase, whose stubs leave its methods untyped
    height: float
    theme: Theme
    scale: float

    def picture(self, picture: Picture) -> None:
        """Paint the background and all marks of a picture."""
        self.paint([Rectangle(0, 0, picture.width, picture.height, fill=Tone.SURFACE)])
        with warnings.catch_warnings():
            # Characters that the font lacks are painted as boxes, without a warning; the SVG shows them
            # correctly.
            warnings.filterwarnings("ignore", message="(?s)Glyph .* missing from font")
            self.paint(picture.marks)

    def paint(self, marks: Iterable[Mark]) -> None:
        """Paint marks in their order."""
        for mark in marks:
            match mark:
                case Polyline():
                    self._polyline(mark)
                case Curve():
                    self._stroke_and_fill(
                        _curve_path(mark), mark.fill, mark.stroke, mark.width, mark.opacity, mark.dash
                    )
                case Rectangle():
                    self._stroke_and_fill(
                        _rounded_path(mark),
                        mark.fill,
                        mark.stroke,
                        mark.stroke_width,
                        mark.opacity,
                        sharp=True,
                    )
                case Disc():
                    self._stroke_and_fill(
                        _disc_path(mark), mark.fill, mark.stroke, mark.stroke_width, mark.opacity
                    )
                case Text():
                    self._text(mark)
                case Raster():
                    self._raster(mark)
                case Group():
                    self.paint(mark.marks)

    def _colour(self, tone: Tone, opacity: float) -> tuple[float, float, float, float]:
        return (*rgb(PALETTE[tone].of(self.theme)), opacity)

    def _polyline(self, mark: Polyline) -> None:
        from matplotlib.path import Path

        points = np.asarray(mark.points, dtype=np.float64)
        if mark.closed:
            points = np.concatenate([points, points[:1]])
        path = Path(points)
        if mark.closed:
            codes = np.full(len(points), Path.LINETO, dtype=Path.code_type)
            codes[0], codes[-1] = Path.MOVETO, Path.CLOSEPOLY
            path = Path(points, codes)
        self._stroke_and_fill(
            path, mark.fill, mark.stroke, mark.width, mark.opacity, mark.dash, sharp=mark.sharp
        )

    def _stroke_and_fill(
        self,
        path: Path,
        fill: Tone | None,
        stroke: Tone | None,
        width: float,
        opacity: float,
        dash: tuple[float, ...] = (),
        *,
        sharp: bool = False,
    ) -> None:
        from matplotlib.transforms import Affine2D

        gc = self.renderer.new_gc()
        gc.set_linewidth(width * self.scale if stroke is not None else 0.0)
        if stroke is not None:
            gc.set_foreground(self._colour(stroke, opacity), isRGBA=True)
        if dash:
            gc.set_dashes(0, [length * self.scale for length in dash])
        gc.set_joinstyle("miter" if sharp else "round")
        gc.set_capstyle("butt" if sharp or dash else "round")
        gc.set_snap(None if not sharp else False)
        # In paths y is upwards for all renderers.
        flip = Affine2D.from_values(self.scale, 0.0, 0.0, -self.scale, 0.0, float(self.height))
        self.renderer.draw_path(gc, path, flip, self._colour(fill, opacity) if fill is not None else None)
        gc.restore()

    def _text(self, mark: Text) -> None:
        text = printable(mark.text)
        if not text.strip():
            return
        from matplotlib.font_manager import FontProperties

        font = FontProperties(
            family="DejaVu Sans Mono" if mark.mono else "DejaVu Sans",
            size=mark.size * self.scale,
            weight="bold" if mark.bold else "normal",
            style="oblique" if mark.italic else "normal",
        )
        offset = 0.0
        if mark.anchor != "start":  # measuring a text takes as long as drawing it
            width, _, _ = self.renderer.get_text_width_height_descent(text, font, False)
            offset = {"middle": 0.5, "end": 1.0}[mark.anchor] * width
        x, y = mark.x * self.scale, mark.y * self.scale
        x, y = (x, y + offset) if mark.rotation else (x - offset, y)
        if not self.renderer.flipy():
            y = self.height - y  # in texts y is downwards for pixels and upwards for pages
        gc = self.renderer.new_gc()
        gc.set_foreground(self._colour(mark.tone, 1.0), isRGBA=True)
        self.renderer.draw_text(gc, x, y, text, font, float(mark.rotation), ismath=False)
        gc.restore()

    def _raster(self, mark: Raster) -> None:
        gc = self.renderer.new_gc()
        left, bottom = round(mark.x * self.scale), self.height - round((mark.y + mark.height) * self.scale)
        columns, rows = round(mark.width * self.scale), round(mark.height * self.scale)
        pixels = resampled(mark.pixels, rows, columns)
        self.renderer.draw_image(gc, left, bottom, np.ascontiguousarray(pixels[::-1]))
        gc.restore()


def resampled(pixels: NDArray[np.uint8], rows: int, columns: int) -> NDArray[np.uint8]:
    """The nearest pixels on another grid; the same array if the grid is the same."""
    if pixels.shape[:2] == (rows, columns):
        return pixels
    row = ((np.arange(rows) + 0.5) * pixels.shape[0] / rows).astype(np.intp)
    column = ((np.arange(columns) + 0.5) * pixels.shape[1] / columns).astype(np.intp)
    return pixels[row[:, None], column[None, :]]


def _curve_path(mark: Curve) -> Path:
    from matplotlib.path import Path

    code_of = {"M": Path.MOVETO, "L": Path.LINETO, "Q": Path.CURVE3, "C": Path.CURVE4, "Z": Path.CLOSEPOLY}
    vertices: list[tuple[float, float]] = []
    codes: list[int] = []
    for command in mark.commands:
        code = code_of[cast("Literal['M', 'L', 'Q', 'C', 'Z']", command[0])]
        values = [float(value) for value in command[1:]] or [0.0, 0.0]
        for x, y in zip(values[::2], values[1::2]):
            vertices.append((x, y))
            codes.append(int(code))
    return Path(vertices, codes)


def _rounded_path(mark: Rectangle) -> Path:
    x0, y0, x1, y1 = mark.x, mark.y, mark.x + mark.width, mark.y + mark.height
    r = min(mark.radius, mark.width / 2, mark.height / 2)
    if r <= 0:
        return _curve_path(Curve((("M", x0, y0), ("L", x1, y0), ("L", x1, y1), ("L", x0, y1), ("Z",))))
    k = r * (1 - _KAPPA)
    return _curve_path(
        Curve(
            (
                ("M", x0 + r, y0),
                ("L", x1 - r, y0),
                ("C", x1 - k, y0, x1, y0 + k, x1, y0 + r),
                ("L", x1, y1 - r),
                ("C", x1, y1 - k, x1 - k, y1, x1 - r, y1),
                ("L", x0 + r, y1),
                ("C", x0 + k, y1, x0, y1 - k, x0, y1 - r),
                ("L", x0, y0 + r),
                ("C", x0, y0 + k, x0 + k, y0, x0 + r, y0),
                ("Z",),
            )
        )
    )


def _disc_path(mark: Disc) -> Path:
    side = 2 * mark.radius
    return _rounded_path(
        Rectangle(mark.x - mark.radius, mark.y - mark.radius, side, side, radius=mark.radius)
    )
