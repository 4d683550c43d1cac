"""Positions of the blocks of an incomplete diagram: stored, or from the automatic layout."""

from __future__ import annotations

import dataclasses

from armblocks.diagram import Diagram, DiagramBlock
from armblocks.drawing.diagram_layout import arranged_layout


def placed(diagram: Diagram) -> Diagram:
    """Return the diagram, subsystems included, with all positions; lay it out if a position is missing."""
    for name, block in diagram.blocks.items():
        if isinstance(block, DiagramBlock) and (inner := placed(block.diagram)) is not block.diagram:
            changed = dataclasses.replace(block, diagram=inner)
            diagram = dataclasses.replace(diagram, blocks={**diagram.blocks, name: changed})
    return diagram if set(diagram.blocks) <= set(diagram.layout) else arranged(diagram)


def arranged(diagram: Diagram) -> Diagram:
    """Return the diagram with a new automatic layout: the forward path from left to right, feedback below."""
    return dataclasses.replace(diagram, layout=arranged_layout(diagram), bends={})
