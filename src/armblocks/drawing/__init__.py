"""Drawings of diagrams: faces of blocks, layout, routing of wires."""

from typing import TYPE_CHECKING

from armblocks.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from armblocks.drawing.diagram_drawing import block_picture, diagram_picture, diagram_svg
    from armblocks.drawing.diagram_file import DRAWING_FORMATS, draw_diagram, drawing_bytes
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "DRAWING_FORMATS": "armblocks.drawing.diagram_file",
            "block_picture": "armblocks.drawing.diagram_drawing",
            "diagram_picture": "armblocks.drawing.diagram_drawing",
            "diagram_svg": "armblocks.drawing.diagram_drawing",
            "draw_diagram": "armblocks.drawing.diagram_file",
            "drawing_bytes": "armblocks.drawing.diagram_file",
        },
    )

__all__ = [
    "DRAWING_FORMATS",
    "block_picture",
    "diagram_picture",
    "diagram_svg",
    "draw_diagram",
    "drawing_bytes",
]
