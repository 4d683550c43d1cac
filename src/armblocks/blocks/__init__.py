"""All block types: each subpackage is a family, and each class with a title is a block type.

``BLOCKS`` is the library of all block types, and each type is a name of this package: ``from armblocks.blocks
import Gain``. A new block is one class in a file of its family's folder, where the library finds it. Type
checkers and editors read the names from ``__init__.pyi``, which ``scripts/block_names.py`` writes.
"""

from collections.abc import Iterator

from armblocks.diagram import Block, BlockLibrary, UnimportedBlock
from armblocks.diagram.conditional import (
    ActionSubsystem,
    EnabledSubsystem,
    EnabledTriggeredSubsystem,
    Merge,
    ResettableSubsystem,
    TriggeredSubsystem,
)
from armblocks.diagram.connection_port import ConnectionPort
from armblocks.diagram.structure import Inport, Outport, Subsystem
from armblocks.diagram.virtual_wiring import BusAssignment, BusCreator, BusSelector, From, Goto
from armblocks.package_folder import classes_with

FAMILIES = (
    "sources",
    "maths",
    "continuous",
    "discrete",
    "discontinuities",
    "routing",
    "structure",
    "transforms",
    "mechanics",
    "robots",
    "sinks",
    "matrices",
    "logic",
    "lookup",
    "functions",
)
"""The families in their order in lists. Within a family the types are in alphabetical order."""

_DIAGRAM_LAYER_TYPES: dict[str, tuple[type[Block], ...]] = {
    "routing": (BusAssignment, BusCreator, BusSelector, From, Goto, Merge),
    "structure": (
        ActionSubsystem,
        ConnectionPort,
        EnabledSubsystem,
        EnabledTriggeredSubsystem,
        Inport,
        Outport,
        ResettableSubsystem,
        Subsystem,
        TriggeredSubsystem,
    ),
}
"""The block types that the diagram layer defines, because its passes over a diagram process them."""


def _types_of(family: str) -> Iterator[type[Block] | UnimportedBlock]:
    """The block types of one family. A base class that several types share has no title."""
    yield from _DIAGRAM_LAYER_TYPES.get(family, ())
    for name, module in classes_with(f"{__name__}.{family}", "title"):
        yield UnimportedBlock(name, module)


BLOCKS = BlockLibrary(
    {family: sorted(_types_of(family), key=lambda kind: kind.type_name().casefold()) for family in FAMILIES}
)
"""Every block type by type name."""

globals()["__all__"] = ["BLOCKS", *BLOCKS]


def __getattr__(name: str) -> type[Block]:
    """A block type, imported at its first use (PEP 562)."""
    if name not in BLOCKS:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'", name=name)
    globals()[name] = kind = BLOCKS[name]
    return kind
