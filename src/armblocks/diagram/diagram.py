"""A checked, frozen diagram: blocks by name, connections, layout and simulation settings."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from operator import itemgetter
from types import MappingProxyType
from typing import Any, TypeVar, cast

from armblocks.argument_errors import ArgumentErrors
from armblocks.diagram.block import Block
from armblocks.diagram.bookmarks import Bookmark
from armblocks.diagram.frames import FrameLine
from armblocks.diagram.mask import Scope, checked_mask, values_of
from armblocks.diagram.names import check_signal_names
from armblocks.diagram.parameter import Parameter, Value
from armblocks.diagram.port import PortRef
from armblocks.diagram.scope_trigger import ScopeTrigger
from armblocks.equations import SimulationOptions
from armblocks.errors import ArmblocksError, DiagramError, UnknownNameError, counted
from armblocks.lazy_exports import display_method

_Result = TypeVar("_Result")


@dataclass(frozen=True, order=True)
class Connection(metaclass=ArgumentErrors):
    """A connection from an output port to an input port."""

    source: PortRef
    target: PortRef

    def __str__(self) -> str:
        return f"{self.source} -> {self.target}"


@dataclass(frozen=True, kw_only=True)
class Placement(metaclass=ArgumentErrors):
    """Position and appearance of a block on the sheet: top left corner and size in pixels, y downwards.

    ``width`` and ``height`` ``None``: chosen by the drawing code. ``flipped``: inputs on the right.
    ``rotation``: degrees clockwise, one of 0, 90, 180 and 270, after the flip. ``name_side``: the side of the
    name, one of ``NAME_SIDES``; for ``auto``, or a side with ports, the drawing uses a side without ports.
    ``colour``: the background, one of ``BLOCK_COLOURS``. Raises ``DiagramError`` for other values.
    """

    x: float
    y: float
    width: float | None = None
    height: float | None = None
    flipped: bool = False
    rotation: int = 0
    name_side: str = "auto"
    colour: str = "none"

    def __post_init__(self) -> None:
        if self.rotation in ROTATIONS and self.name_side in NAME_SIDES and self.colour in BLOCK_COLOURS:
            return  # fast path: every edit creates the placements of all blocks
        for name, allowed in _APPEARANCE.items():
            value = getattr(self, name)
            if value not in allowed:
                raise DiagramError(
                    f"the {name} of a block is {value!r}",
                    where=f"position ({self.x:g}, {self.y:g})",
                    allowed=", ".join(map(str, allowed)),
                    fix="use one of them",
                )


@dataclass(frozen=True, kw_only=True)
class Note:
    """An annotation on the sheet, of one line or more, with its top left corner in pixels."""

    x: float
    y: float
    text: str


ROTATIONS = (0, 90, 180, 270)
"""Allowed rotations of a block, degrees."""
NAME_SIDES = ("auto", "below", "above", "left", "right", "hidden")
"""Allowed sides of a block's name."""
BLOCK_COLOURS = ("none", "red", "orange", "yellow", "green", "cyan", "blue", "purple", "grey")
"""Allowed backgrounds of a block; ``none`` is the default."""
_APPEARANCE = {"rotation": ROTATIONS, "name_side": NAME_SIDES, "colour": BLOCK_COLOURS}

_READ_ONLY = {
    **dict.fromkeys(
        (
            *("blocks", "layout", "bends", "notes", "bookmarks"),
            *("extras", "mask_values", "commented", "signal_names"),
        ),
        1,
    ),
    "parameter_sets": 2,
}
"""The fields of a diagram that are read-only mappings, each with its number of levels."""


def _read_only(mapping: Mapping[Any, Any], levels: int) -> Mapping[Any, Any]:
    """A read-only copy of a mapping, sorted by key; with two levels, its values are copied likewise."""
    ordered = sorted(mapping.items(), key=itemgetter(0))
    return MappingProxyType(
        {key: value if levels == 1 else _read_only(value, levels - 1) for key, value in ordered}
    )


def _copied(mapping: Mapping[Any, Any], levels: int) -> dict[Any, Any]:
    """The mapping as nested dictionaries, which can be pickled."""
    return {key: value if levels == 1 else _copied(value, levels - 1) for key, value in mapping.items()}


Gate = Mapping[str, PortRef]
"""The drivers of the hidden inputs of a block inside a conditional subsystem, such as ``?on``."""


def block_in_scope(name: str, block: Block, scope: Scope) -> Block:
    """A block of a diagram with its formulas evaluated.

    Raises ``DiagramError`` or ``UnknownNameError`` that name the block.
    """
    where = f"block '{name}' ({block.title})"
    try:
        return block.in_scope(scope, where)
    except (DiagramError, UnknownNameError):
        raise
    except ArmblocksError as error:
        location = error.where if error.where.startswith(where) else f"{where}, {error.where}"
        raise DiagramError(error.what, where=location, allowed=error.allowed, fix=error.fix) from None


@dataclass(frozen=True, kw_only=True)
class Diagram(metaclass=ArgumentErrors):
    """An immutable diagram of blocks and connections. ``DiagramBuilder.build`` creates and checks it.

    - ``blocks``, ``connections``: sorted by name and by ends, so that equal diagrams compare equal.
    - ``layout``: the places of blocks; it may name only some of them.
    - ``bends``: the user-drawn routes of connections, see :func:`armblocks.drawing.wires.bent`.
    - ``notes``: annotations by name.
    - ``mask``: the parameters that the diagram declares, see :mod:`armblocks.diagram.mask`.
    - ``mask_values``: their values, by default the default values. The values of block parameters that are
      formulas are computed from them.
    - ``link``: the entry of a library file from which the diagram comes, ``servos.json#JointServo``, or
      empty.
    - ``extras``: unknown keys of a file, so that they are not lost. It has the keys ``""`` (the document),
      ``"blocks"`` (by block name), and further keys that a file format adds.
    """

    name: str
    blocks: Mapping[str, Block]
    connections: tuple[Connection, ...] = ()
    layout: Mapping[str, Placement] = field(default_factory=dict[str, Placement])
    bends: Mapping[Connection, tuple[float, ...]] = field(default_factory=dict[Connection, tuple[float, ...]])
    notes: Mapping[str, Note] = field(default_factory=dict[str, Note])
    settings: SimulationOptions = field(default_factory=SimulationOptions)
    extras: Mapping[str, object] = field(default_factory=dict[str, object])
    description: str = ""
    """A one-line description of the diagram."""
    logged: tuple[PortRef, ...] = ()
    """Outputs that are logged without a Scope: each gets a separate view."""
    gates: Mapping[str, Gate] = field(default_factory=dict[str, Gate])
    """The gates of each block of a flat diagram, see :mod:`armblocks.diagram.conditional_equations`."""
    mask: tuple[Parameter, ...] = ()
    mask_values: Mapping[str, Value] = field(default_factory=dict[str, Value])
    link: str = ""
    commented: Mapping[str, str] = field(default_factory=dict[str, str])
    """Commented blocks, by name: ``"out"`` or ``"through"``, see
    :mod:`armblocks.diagram.comments`."""
    signal_names: Mapping[PortRef, str] = field(default_factory=dict[PortRef, str])
    """Names of the signals at outputs, see :mod:`armblocks.diagram.signal_names`."""
    parameter_sets: Mapping[str, Mapping[str, Value]] = field(default_factory=dict[str, Mapping[str, Value]])
    """Values of parameters by path, under the name of their set, see
    :mod:`armblocks.diagram.parameter_sets`."""
    bookmarks: Mapping[str, Bookmark] = field(default_factory=dict[str, Bookmark])
    """Parts of this sheet by name, see :mod:`armblocks.diagram.bookmarks`."""
    scope_trigger: ScopeTrigger | None = None
    """The trigger of the scopes of the studio; ``None`` for the default, which is off."""
    frame_lines: tuple[FrameLine, ...] = ()
    """The lines between frame ports, sorted, see :mod:`armblocks.diagram.frames`."""
    shares: Mapping[str, str] = field(default_factory=dict[str, str])
    """For a flat diagram: blocks that share the parameters of the block of the given name."""
    _cache: dict[str, object] = field(
        init=False, repr=False, compare=False, default_factory=dict[str, object]
    )

    def __post_init__(self) -> None:
        where = f"diagram '{self.name}'"
        if self.mask or self.mask_values:
            object.__setattr__(self, "mask", checked_mask(self.mask, where))
            object.__setattr__(self, "mask_values", values_of(self.mask, self.mask_values, where))
        if any(block.formulas for block in self.blocks.values()):
            blocks = {
                name: block_in_scope(name, block, self.mask_values) for name, block in self.blocks.items()
            }
            object.__setattr__(self, "blocks", blocks)
        if self.bends:  # drop the bends of removed connections
            bends = {wire: self.bends[wire] for wire in self.connections if self.bends.get(wire)}
            object.__setattr__(self, "bends", bends)
        if self.commented:
            present = {name: comment for name, comment in self.commented.items() if name in self.blocks}
            object.__setattr__(self, "commented", present)
        if self.signal_names:
            named = {ref: name for ref, name in self.signal_names.items() if ref.block in self.blocks}
            object.__setattr__(self, "signal_names", named)
            check_signal_names(self.blocks, named, where)
        for name, levels in _READ_ONLY.items():
            object.__setattr__(self, name, _read_only(getattr(self, name), levels))
        object.__setattr__(self, "connections", tuple(sorted(self.connections)))
        object.__setattr__(self, "logged", tuple(sorted(self.logged)))
        if self.frame_lines:
            object.__setattr__(self, "frame_lines", tuple(sorted(set(self.frame_lines))))

    def __getstate__(self) -> dict[str, Any]:
        """Return the state for pickling and copying: the fields without cached results."""
        state = {entry.name: getattr(self, entry.name) for entry in dataclasses.fields(self) if entry.init}
        return state | {name: _copied(state[name], levels) for name, levels in _READ_ONLY.items()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        read_only = {name: _read_only(state[name], levels) for name, levels in _READ_ONLY.items()}
        for name, value in (state | read_only).items():
            object.__setattr__(self, name, value)
        object.__setattr__(self, "_cache", {})

    def with_mask_values(self, values: Mapping[str, object]) -> Diagram:
        """A copy with other values of some mask parameters, and of all parameters that depend on them.

        Raises ``UnknownNameError`` for an unknown name, ``InputError`` or ``DiagramError`` for an invalid
        value.
        """
        if all(name in self.mask_values and self.mask_values[name] == values[name] for name in values):
            return self
        return dataclasses.replace(self, mask_values={**self.mask_values, **cast("Any", values)})

    _repr_svg_ = display_method("armblocks.face.notebook_views", "diagram_svg")

    def __hash__(self) -> int:
        return hash((self.name, tuple(self.blocks.items()), self.connections, self.settings))

    def __str__(self) -> str:
        return f"diagram '{self.name}' of {counted(len(self.blocks), 'block')}"

    def clocked(self, name: str) -> bool:
        """Whether a block has a clock: a sampled block that is not in a triggered subsystem."""
        return self.blocks[name].sampled and "?fire" not in self.gates.get(name, {})

    def owner(self, name: str) -> str:
        """The prefix of a block's parameter paths: its name, or the owner's name for shared parameters."""
        return self.shares.get(name, name)

    def source(self, name: str, port: str) -> PortRef:
        """The output port that drives an input port of a flat diagram; the input may be hidden."""
        if port.startswith("?"):
            return self.gates[name][port]
        return self.drivers[PortRef(name, port)]

    @cached_property
    def drivers(self) -> Mapping[PortRef, PortRef]:
        """The output port that drives each input port."""
        return {wire.target: wire.source for wire in self.connections}

    def block(self, name: str) -> Block:
        """The block of this name; raises ``UnknownNameError`` with the nearest name."""
        if name not in self.blocks:
            raise UnknownNameError("block", name, self.blocks, where=f"diagram '{self.name}'")
        return self.blocks[name]

    def cached(self, name: str, compute: Callable[[], _Result]) -> _Result:
        """The result of a pure function of this diagram, cached with the diagram under a name."""
        if name not in self._cache:
            self._cache[name] = compute()
        return cast("_Result", self._cache[name])
