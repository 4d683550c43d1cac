"""All kinds of blocks: each folder of this package is a family, each class with a title in it is a kind.

``BLOCKS`` is the library of all kinds, and each kind is a name of this package: ``from armblocks.blocks
import Gain``. A new block is one class in a file of its family's folder; it is found there. Type checkers and
editors know the names from ``__init__.pyi``, which ``scripts/block_names.py`` writes.
"""

import importlib
import pkgutil
from collections.abc import Iterator

from armblocks.diagram import Block, BlockLibrary
from armblocks.diagram.conditional import (
    ActionSubsystem,
    EnabledSubsystem,
    EnabledTriggeredSubsystem,
    Merge,
    ResettableSubsystem,
    TriggeredSubsystem,
)
from armblocks.diagram.structure import Inport, Outport, Subsystem
from armblocks.diagram.virtual_wiring import BusAssignment, BusCreator, BusSelector, From, Goto

FAMILIES = (
    "sources",
    "maths",
    "continuous",
    "discrete",
    "discontinuities",
    "routing",
    "structure",
    "transforms",
    "robots",
    "sinks",
    "matrices",
    "logic",
    "lookup",
    "functions",
)
"""The families in the order of lists; within a family the kinds stand by the alphabet."""

_KNOWN_TO_THE_DIAGRAM: dict[str, tuple[type[Block], ...]] = {
    "routing": (BusAssignment, BusCreator, BusSelector, From, Goto, Merge),
    "structure": (
        ActionSubsystem,
        EnabledSubsystem,
        EnabledTriggeredSubsystem,
        Inport,
        Outport,
        ResettableSubsystem,
        Subsystem,
        TriggeredSubsystem,
    ),
}
"""The kinds that the passes over a diagram handle: the layer of the diagram defines them."""


def _kinds_of(family: str) -> Iterator[type[Block]]:
    """The kinds of one family. A class that several kinds share has no title of its own."""
    yield from _KNOWN_TO_THE_DIAGRAM.get(family, ())
    folder = importlib.import_module(f"{__name__}.{family}")
    for file in pkgutil.iter_modules(folder.__path__, f"{folder.__name__}."):
        classes = [
            value for value in vars(importlib.import_module(file.name)).values() if isinstance(value, type)
        ]
        for value in classes:
            if value.__module__ == file.name and issubclass(value, Block) and "title" in vars(value):
                yield value


BLOCKS = BlockLibrary(
    {family: sorted(_kinds_of(family), key=lambda kind: kind.type_name().casefold()) for family in FAMILIES}
)
"""Every kind of block by type name."""

globals().update(BLOCKS)
globals()["__all__"] = ["BLOCKS", *BLOCKS]
