"""Export of a sheet to a file, for the command line, Python and the studio."""

from __future__ import annotations

import os
from pathlib import Path

from armblocks.diagram import Diagram
from armblocks.drawing.diagram_drawing import diagram_picture
from armblocks.errors import UnknownNameError
from armblocks.files import write_atomically
from armblocks.pictures.style import Theme
from armblocks.pictures.svg import svg_file
from armblocks.simulation.result import SimulationResult

DRAWING_FORMATS = ("svg", "png", "pdf")
"""SVG and PDF have vector lines and text; PNG has 192 dots per inch. Text in PDF and PNG is in DejaVu
Sans."""


def draw_diagram(
    path: str | os.PathLike[str],
    diagram: Diagram,
    result: SimulationResult | None = None,
    *,
    sheet: str = "",
    theme: Theme | None = None,
    rates: bool = False,
) -> Path:
    """Write a sheet as ``….svg``, ``….png`` or ``….pdf``, atomically; returns the path.

    See :func:`drawing_bytes` for the arguments. Raises UnknownNameError for an unsupported suffix or an
    unknown sheet.
    """
    target = Path(path)
    kind = target.suffix.removeprefix(".").lower()
    write_atomically(target, drawing_bytes(diagram, kind, result, sheet=sheet, theme=theme, rates=rates))
    return target


def drawing_bytes(
    diagram: Diagram,
    kind: str,
    result: SimulationResult | None = None,
    *,
    sheet: str = "",
    theme: Theme | None = None,
    rates: bool = False,
) -> bytes:
    """A sheet in one of ``DRAWING_FORMATS``.

    ``sheet``: the path of a subsystem, ``""`` is the top level. ``result``: the data that sinks show.
    ``rates``: clocks in colours, with a legend. ``theme`` ``None``: SVG follows the viewer's preference,
    other formats are light. Incomplete diagrams with unconnected inputs are drawn, too. Raises
    UnknownNameError for an unsupported format or an unknown sheet.
    """
    if kind not in DRAWING_FORMATS:
        raise UnknownNameError("drawing format", kind, DRAWING_FORMATS)
    picture = diagram_picture(diagram, result, sheet=sheet, rates=rates)
    if kind == "svg":
        return svg_file(picture, theme=theme).encode()
    if kind == "png":
        from armblocks.pictures.png import picture_png

        return picture_png(picture, theme=theme or "light")
    from armblocks.pictures.pdf import picture_pdf

    return picture_pdf(picture, theme=theme or "light")
