"""Pictures as PDF: one page of the picture's size, with vector lines, text and embedded fonts."""

from __future__ import annotations

from io import BytesIO
from typing import Any

from armblocks.extras import from_extra
from armblocks.pictures.painter import Painter
from armblocks.pictures.picture import Picture
from armblocks.pictures.style import Theme

_POINTS_PER_PX = 0.75
"""Picture px are CSS px (1/96 inch), the unit of a page is 1/72 inch."""


def picture_pdf(picture: Picture, *, theme: Theme = "light") -> bytes:
    """The picture as a PDF file; the same picture always gives the same bytes, because no date is written."""
    with from_extra("figures", "PDF drawings"):
        from matplotlib.backends.backend_pdf import PdfFile, RendererPdf

    width, height = picture.width * _POINTS_PER_PX, picture.height * _POINTS_PER_PX
    target = BytesIO()
    text = {"Title": picture.title, "Creator": "armblocks", "CreationDate": None}
    file: Any = PdfFile(target, metadata=text)  # untyped in matplotlib's stubs
    file.newPage(width / 72.0, height / 72.0)
    renderer = RendererPdf(file, 72.0, height / 72.0, width / 72.0)
    Painter(renderer, height, theme, _POINTS_PER_PX).picture(picture)
    renderer.finalize()
    file.finalize()
    file.close()
    return target.getvalue()
