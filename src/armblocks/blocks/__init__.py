"""All block types: each subpackage is a family, and each class with a title is a block type.

``BLOCKS`` is the library of all block types, and each type is a name of this package: ``from armblocks.blocks
import Gain``. A new block is one class in a file of its family's folder, where the library finds it. Type
checkers and editors read the names from ``__init__.pyi``, which ``scripts/block_names.py`` writes.
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
"""The families in the order in which lists show them; within a family the types are in alphabetical order."""

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
"""The block types that passes over a diagram handle themselves; the diagram layer defines them."""


def _kinds_of(family: str) -> Iterator[type[Block]]:
    """The block types of one family. A base class that several types share has no title."""
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
"""Every block type by type name."""

globals().update(BLOCKS)
globals()["__all__"] = ["BLOCKS", *BLOCKS]
