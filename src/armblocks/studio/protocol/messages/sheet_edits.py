"""The edits of diagrams; :mod:`armblocks.studio.sheet.edits` applies them."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from armblocks.studio.protocol.message import Edit, Message

Px = Annotated[float, Field(ge=-1e7, le=1e7)]
"""A coordinate on the sheet, px; the bound keeps the drawing exact."""
Size = Annotated[float, Field(gt=0, le=1e5)]
NameSide = Literal["auto", "below", "above", "left", "right", "hidden"]
BlockColour = Literal["none", "red", "orange", "yellow", "green", "cyan", "blue", "purple", "grey"]


class Place(Message):
    """Position and appearance of a block: top left corner, and its size if it is not the default, px."""

    x: Px
    y: Px
    width: Size | None = None
    height: Size | None = None
    flipped: bool = False
    rotation: Literal[0, 90, 180, 270] = 0
    """Degrees clockwise."""
    name_side: NameSide = "auto"
    colour: BlockColour = "none"


class SheetNote(Message):
    """A note on the sheet: its text, and its top left corner in px."""

    x: Px
    y: Px
    text: Annotated[str, Field(max_length=10_000)]


class NewBlock(Message):
    """A block to be added. ``parameters`` contains the values that differ from the defaults."""

    name: str
    type: str
    parameters: dict[str, Any] = Field(default_factory=dict[str, Any])
    place: Place


class Wire(Message):
    """A wire between two ports, written ``block/port``.

    ``bends``: the corners of a route drawn by the user, see :func:`armblocks.drawing.wires.bent`.
    """

    source: str
    target: str
    bends: tuple[Px, ...] = ()


class DiagramEdit(Edit):
    """An edit of the displayed sheet, or of the whole model if it is a :class:`ModelEdit`."""


class AddBlocks(DiagramEdit):
    """Add blocks and connect them; without blocks, only add wires.

    ``instead``: wires that are removed, for example the wire on which a block is dropped.
    """

    kind: Literal["add"] = "add"
    blocks: list[NewBlock]
    wires: list[Wire] = Field(default_factory=list[Wire])
    instead: list[Wire] = Field(default_factory=list[Wire])


class PasteBlocks(DiagramEdit):
    """Paste blocks: ``text`` is a diagram in the file format.

    ``names``: new names of its blocks and notes, where they differ. ``shift``: displacement to the right and
    down, px; one number if both are equal.
    """

    kind: Literal["paste"] = "paste"
    text: str
    names: dict[str, str] = Field(default_factory=dict[str, str])
    shift: Px | tuple[Px, Px] = 0.0


class RemoveBlocks(DiagramEdit):
    """Remove blocks, wires and notes; the wires of the removed blocks are removed with them.

    ``reconnections``: wires that are added between the former neighbours of the removed blocks.
    """

    kind: Literal["remove"] = "remove"
    blocks: list[str] = Field(default_factory=list[str])
    wires: list[Wire] = Field(default_factory=list[Wire])
    notes: list[str] = Field(default_factory=list[str])
    reconnections: list[Wire] = Field(default_factory=list[Wire])


class Connect(DiagramEdit):
    """Add a wire. With ``replace`` the present wire of the input is removed.

    ``instead``: wires that are removed, for example the wire whose end is moved to another input.
    """

    kind: Literal["connect"] = "connect"
    wire: Wire
    replace: bool = False
    instead: list[Wire] = Field(default_factory=list[Wire])


class MoveBlocks(DiagramEdit):
    """Move blocks and notes, or rotate blocks; one drag is one edit.

    User-drawn routes between blocks that move by the same amount move with them. ``wires`` are added and the
    wires of ``instead`` removed, when a block is inserted into a wire or disconnected from its wires.
    """

    kind: Literal["move"] = "move"
    places: dict[str, Place] = Field(default_factory=dict[str, Place])
    notes: dict[str, SheetNote] = Field(default_factory=dict[str, SheetNote])
    wires: list[Wire] = Field(default_factory=list[Wire])
    instead: list[Wire] = Field(default_factory=list[Wire])


class SetAppearance(DiagramEdit):
    """Set the side of the names of blocks, or their background; ``None`` leaves it unchanged."""

    kind: Literal["appearance"] = "appearance"
    blocks: list[str]
    name_side: NameSide | None = None
    colour: BlockColour | None = None


class BendWires(DiagramEdit):
    """Set the bends of wires; a wire without bends is routed automatically."""

    kind: Literal["bend"] = "bend"
    wires: list[Wire]


class SetNotes(DiagramEdit):
    """Add notes or change their text."""

    kind: Literal["notes"] = "notes"
    notes: dict[Annotated[str, Field(pattern=r"^/\S+$", max_length=100)], SheetNote]


class Rename(DiagramEdit):
    """Rename a block; its wires and its position remain."""

    kind: Literal["rename"] = "rename"
    block: str
    name: str


class SetParameters(DiagramEdit):
    """Change parameters of one block. Wires to ports that no longer exist are removed."""

    kind: Literal["parameters"] = "parameters"
    block: str
    values: dict[str, Any]


class MaskParameter(Message):
    """A parameter of a mask. ``default`` is the typed text; ``was`` the former name.

    ``minimum``, ``above`` and ``maximum`` bound its numbers; ``choices`` are the allowed values of a choice.
    """

    name: Annotated[str, Field(max_length=100)]
    was: str = ""
    kind: Literal["number", "array", "integer", "boolean", "choice", "string", "robot"] = "number"
    default: Any
    unit: Annotated[str, Field(max_length=40)] = ""
    doc: Annotated[str, Field(max_length=2000)] = ""
    minimum: float | None = None
    above: float | None = None
    maximum: float | None = None
    choices: list[str] = Field(default_factory=list[str])


class SetMask(DiagramEdit):
    """Declare the parameters of a subsystem, in this order, or of the sheet itself if ``block`` is empty.

    ``name`` is the text on its face; empty leaves the text unchanged.
    """

    kind: Literal["mask"] = "mask"
    block: str = ""
    name: Annotated[str, Field(max_length=100)] = ""
    parameters: Annotated[list[MaskParameter], Field(max_length=200)]


class ArrangeBlocks(DiagramEdit):
    """Lay out the blocks of a sheet again, from left to right."""

    kind: Literal["arrange"] = "arrange"


class LogSignal(DiagramEdit):
    """Start or stop logging an output ``block/port``, whose signal is then recorded without a Scope."""

    kind: Literal["log"] = "log"
    port: str
    logged: bool


class NameSignal(DiagramEdit):
    """Name the signal at an output ``block/port``; an empty name removes the name."""

    kind: Literal["name_signal"] = "name_signal"
    port: str
    name: Annotated[str, Field(max_length=200)]


class CommentBlocks(DiagramEdit):
    """Comment blocks out or through, or remove their comments; see :mod:`armblocks.diagram.comments`."""

    kind: Literal["comment"] = "comment"
    blocks: list[str]
    comment: Literal["out", "through", ""]


class GroundPorts(DiagramEdit):
    """Add a Ground or a Terminator at every unconnected port of these blocks; without blocks, of the
    sheet."""

    kind: Literal["ground"] = "ground"
    blocks: list[str] = Field(default_factory=list[str])


BookmarkName = Annotated[str, Field(max_length=200)]


class SheetPart(Message):
    """A part of a sheet, px: top left corner and size."""

    x: Px
    y: Px
    width: Annotated[float, Field(ge=1, le=1e6)]
    height: Annotated[float, Field(ge=1, le=1e6)]


class AddBookmark(DiagramEdit):
    """Store a part of the sheet under a name. ``replace``: the bookmark exists, and gets this part."""

    kind: Literal["add_bookmark"] = "add_bookmark"
    name: BookmarkName
    part: SheetPart
    replace: bool = False


class RenameBookmark(DiagramEdit):
    """Rename a bookmark of the sheet."""

    kind: Literal["rename_bookmark"] = "rename_bookmark"
    name: BookmarkName
    to: BookmarkName


class RemoveBookmark(DiagramEdit):
    """Remove a bookmark of the sheet."""

    kind: Literal["remove_bookmark"] = "remove_bookmark"
    name: BookmarkName


class ModelEdit(DiagramEdit):
    """An edit of the whole model, independent of the displayed sheet."""


class KeepTuned(ModelEdit):
    """Write tuned values of a run, by ``block.parameter``, into the model, as one undo step."""

    kind: Literal["keep_tuned"] = "keep_tuned"
    values: dict[str, Any]


SetName = Annotated[str, Field(max_length=200)]
"""The name of a parameter set, see :mod:`armblocks.diagram.parameter_sets`."""


class SaveParameterSet(ModelEdit):
    """Store values of parameters, by ``block.parameter``, under a name.

    ``all_parameters``: the model's values of the parameters that only other sets have are stored, too.
    ``replace``: the values replace the values of a set with this name, which must exist.
    """

    kind: Literal["save_parameter_set"] = "save_parameter_set"
    name: SetName
    values: dict[str, Any]
    all_parameters: bool = False
    replace: bool = False


class RenameParameterSet(ModelEdit):
    """Rename a parameter set."""

    kind: Literal["rename_parameter_set"] = "rename_parameter_set"
    name: SetName
    to: SetName


class RemoveParameterSet(ModelEdit):
    """Remove a parameter set."""

    kind: Literal["remove_parameter_set"] = "remove_parameter_set"
    name: SetName


class RemoveSetParameter(ModelEdit):
    """Remove a parameter from all parameter sets, also one that does not exist in the model."""

    kind: Literal["remove_set_parameter"] = "remove_set_parameter"
    path: str


class ApplyParameterSet(ModelEdit):
    """Write the values of a parameter set into the model."""

    kind: Literal["apply_parameter_set"] = "apply_parameter_set"
    name: SetName


class GroupBlocks(DiagramEdit):
    """Move blocks into a new subsystem; its ports are the wires that cross its boundary."""

    kind: Literal["group"] = "group"
    blocks: list[str]
    name: str


class BreakLink(DiagramEdit):
    """Replace the link to a library by a copy of the library block, which can be edited."""

    kind: Literal["break_link"] = "break_link"
    block: str


class SetSettings(ModelEdit):
    """Change run settings, by the names of ``SimulationOptions``; ``None`` restores the default."""

    kind: Literal["settings"] = "settings"
    values: dict[str, bool | float | str | None]


class ScopeTriggerSettings(Message):
    """The trigger of the scopes, see :class:`~armblocks.diagram.ScopeTrigger`."""

    on: bool
    signal: Annotated[str, Field(max_length=10_000)]
    element: Annotated[int, Field(ge=0, le=1_000_000)]
    edge: Literal["rising", "falling", "either"]
    level: float
    mode: Literal["normal", "auto", "single"]
    span: Annotated[float, Field(gt=0)]
    position: Annotated[float, Field(ge=0, le=1)]
    hold_off: Annotated[float, Field(ge=0)]


class SetScopeTrigger(ModelEdit):
    """Set the trigger of the scopes; ``None`` restores the default, which is off."""

    kind: Literal["scope_trigger"] = "scope_trigger"
    trigger: ScopeTriggerSettings | None


class Describe(DiagramEdit):
    """Change the model's one-line description."""

    kind: Literal["describe"] = "describe"
    text: Annotated[str, Field(max_length=2000)]
