"""The edits of diagrams; each is a pure function from one diagram to the next.

An edited diagram is an unchecked :class:`~armblocks.diagram.Diagram`: inputs may be unconnected and
shapes may disagree. The background check reports such errors at the blocks; they do not prevent the edit. An
edit is refused only if the result cannot be drawn: a name in use, an unknown port, a second driver of an
input, a parameter value that the block does not allow.

Parameters arrive as JSON values and are checked by the declarations of the block. No code is executed.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from armblocks.blocks import BLOCKS
from armblocks.diagram import (
    Block,
    Connection,
    Diagram,
    DiagramBlock,
    Note,
    ParameterKind,
    Placement,
    PortRef,
    check_comment,
    lines_without,
    with_parameter_set,
    with_parameters,
)
from armblocks.diagram.diagram import block_in_scope
from armblocks.diagram.mask import Scope
from armblocks.diagram.names import folded
from armblocks.drawing.wires import moved_bends
from armblocks.errors import DiagramError, UnknownNameError
from armblocks.formats.data_files import DataFiles
from armblocks.studio.documents.edit_table import EditTable
from armblocks.studio.protocol.messages.sheet_edits import (
    AddBlocks,
    AddBookmark,
    ApplyParameterSet,
    ArrangeBlocks,
    BendWires,
    BreakLink,
    CommentBlocks,
    Connect,
    Describe,
    DiagramEdit,
    GroundPorts,
    GroupBlocks,
    KeepTuned,
    LogSignal,
    MoveBlocks,
    NameSignal,
    NewBlock,
    PasteBlocks,
    Place,
    RemoveBlocks,
    RemoveBookmark,
    RemoveParameterSet,
    RemoveSetParameter,
    Rename,
    RenameBookmark,
    RenameParameterSet,
    SaveParameterSet,
    SetAppearance,
    SetMask,
    SetNotes,
    SetParameters,
    SetScopeTrigger,
    SetSettings,
    SheetNote,
    Wire,
)
from armblocks.studio.sheet import bookmarks, edit_titles, parameter_sets, scope_triggers
from armblocks.studio.sheet.clipping import ReadDiagram, leaves_horizontally, pasted, reader
from armblocks.studio.sheet.frame_lines import split_wires, with_lines, without_lines
from armblocks.studio.sheet.grounding import grounded
from armblocks.studio.sheet.mask_edits import with_mask
from armblocks.studio.sheet.nesting import check_free, grouped, unlinked, with_block
from armblocks.studio.sheet.parameter_values import ResolveRobot, parameter_value, tuned_value
from armblocks.studio.sheet.placing import arranged, placed
from armblocks.studio.sheet.typed_settings import with_settings

DEFAULT_ROBOT = "puma560"
"""The robot of a new robot block."""
MAX_BLOCKS = 20_000
"""Largest number of blocks on a sheet in the editor."""


@dataclasses.dataclass(frozen=True)
class EditContext:
    """The functions that edits need: search for robots, reading of copied blocks and of data files."""

    resolve_robot: ResolveRobot
    read_diagram: ReadDiagram
    data: DataFiles | None = None


EDITS: EditTable[Diagram, [EditContext]] = EditTable()


def applied(
    edit: DiagramEdit,
    diagram: Diagram,
    resolve_robot: ResolveRobot,
    read_diagram: ReadDiagram | None = None,
) -> Diagram:
    """Return the diagram after an edit. ``resolve_robot`` finds the robots that the edit names.

    ``read_diagram`` reads copied blocks; without it, only blocks that need no project files can be pasted.
    Raises ``DiagramError``, ``UnknownNameError`` or ``InputError`` if the edit cannot be applied.
    """
    context = EditContext(resolve_robot, read_diagram or reader(resolve_robot))
    return EDITS.applied(edit, diagram, context)


# -- blocks --------------------------------------------------------------------------------------------------


@EDITS.on(AddBlocks, edit_titles.addition_title)
def _add(edit: AddBlocks, diagram: Diagram, context: EditContext) -> Diagram:
    where = f"diagram '{diagram.name}'"
    blocks, layout = dict(diagram.blocks), dict(diagram.layout)
    _check_room(diagram, len(edit.blocks))
    used_names = {folded(name): name for name in blocks}
    for new in edit.blocks:
        check_free(new.name, used_names, where)
        used_names[folded(new.name)] = new.name
        blocks[new.name] = _new_block(new, diagram.mask_values, context)
        layout[new.name] = _placement(new.place)
    added = dataclasses.replace(diagram, blocks=blocks, layout=layout)
    return _with_wires(edit.wires, _without_removed(RemoveBlocks(wires=edit.instead), added), replace=False)


@EDITS.on(PasteBlocks, edit_titles.paste_title)
def _paste(edit: PasteBlocks, diagram: Diagram, context: EditContext) -> Diagram:
    copied = context.read_diagram(edit.text, "the copied blocks")
    _check_room(diagram, len(copied.blocks))
    shift = edit.shift if isinstance(edit.shift, tuple) else (edit.shift, edit.shift)
    return pasted(diagram, copied, edit.names, shift)


def _check_room(diagram: Diagram, count: int) -> None:
    if len(diagram.blocks) + count > MAX_BLOCKS:
        raise DiagramError(
            f"the sheet would have {len(diagram.blocks) + count} blocks",
            where=f"diagram '{diagram.name}'",
            allowed=f"at most {MAX_BLOCKS}",
            fix="group some blocks into subsystems",
        )


def _new_block(new: NewBlock, scope: Scope, context: EditContext) -> Block:
    resolve_robot, where = context.resolve_robot, f"block '{new.name}'"
    block_type = BLOCKS[new.type]
    rules = {rule.name: rule for rule in block_type.parameters()}
    values: dict[str, Any] = {}
    for name, value in new.parameters.items():
        if name not in rules:
            raise UnknownNameError(f"parameter of {new.type}", name, rules, where=where)
        values[name] = parameter_value(rules[name], value, where, resolve_robot, scope, context.data)
    for name, rule in rules.items():
        if rule.required and name not in values:
            default = DEFAULT_ROBOT if rule.kind is ParameterKind.ROBOT else None
            values[name] = parameter_value(rule, default, where, resolve_robot)
    block = block_type(**values)
    # The sheet of a new subsystem must be drawable as well.
    if isinstance(block, DiagramBlock):
        return dataclasses.replace(block, diagram=placed(block.diagram))
    return block


@EDITS.on(RemoveBlocks, edit_titles.removal_title)
def _remove(edit: RemoveBlocks, diagram: Diagram, _: EditContext) -> Diagram:
    return _with_wires(edit.reconnections, _without_removed(edit, diagram), replace=False)


def _without_removed(edit: RemoveBlocks, diagram: Diagram) -> Diagram:
    removed = {_checked_block(name, diagram) for name in edit.blocks}
    wires, lines = split_wires(edit.wires, diagram)
    diagram = without_lines(diagram, lines)
    removed_wires = {_checked_wire(connection(wire), diagram) for wire in wires}
    return dataclasses.replace(
        diagram,
        blocks={name: block for name, block in diagram.blocks.items() if name not in removed},
        layout={name: place for name, place in diagram.layout.items() if name not in removed},
        notes={name: note for name, note in diagram.notes.items() if name not in edit.notes},
        connections=tuple(
            wire
            for wire in diagram.connections
            if wire not in removed_wires
            and wire.source.block not in removed
            and wire.target.block not in removed
        ),
        frame_lines=lines_without(diagram.frame_lines, lambda end: end.block in removed),
        logged=tuple(ref for ref in diagram.logged if ref.block not in removed),
    )


def _checked_wire(wire: Connection, diagram: Diagram) -> Connection:
    if wire not in diagram.connections:
        raise DiagramError(
            f"the wire {wire} does not exist",
            where=f"diagram '{diagram.name}'",
            allowed="a wire of this sheet",
            fix="reload the page if it shows this wire",
        )
    return wire


@EDITS.on(LogSignal, lambda edit: f"{'log' if edit.logged else 'stop logging'} {edit.port}")
def _log(edit: LogSignal, diagram: Diagram, _: EditContext) -> Diagram:
    ref = _port(edit.port)
    _check_port(ref, diagram, output=True)
    others = tuple(other for other in diagram.logged if other != ref)
    return dataclasses.replace(diagram, logged=(*others, ref) if edit.logged else others)


@EDITS.on(Connect, lambda edit: f"connect {edit.wire.source} to {edit.wire.target}")
def _connect(edit: Connect, diagram: Diagram, _: EditContext) -> Diagram:
    remaining = _without_removed(RemoveBlocks(wires=edit.instead), diagram)
    return _with_wires([edit.wire], remaining, replace=edit.replace)


def _with_wires(wires: Sequence[Wire], diagram: Diagram, *, replace: bool) -> Diagram:
    wires, lines = split_wires(wires, diagram)
    diagram = with_lines(diagram, lines)
    connections = {wire.target: wire for wire in diagram.connections}
    for wire in wires:
        added = connection(wire)
        _check_port(added.source, diagram, output=True)
        _check_port(added.target, diagram, output=False)
        present = connections.get(added.target)
        if present is not None and not replace:
            raise DiagramError(
                f"input '{added.target}' is already driven by '{present.source}'",
                where=f"diagram '{diagram.name}'",
                allowed="one wire for each input",
                fix="delete that wire first, or join the signals with a Sum or a Mux",
            )
        connections[added.target] = added
    if not wires:
        return diagram
    connected = dataclasses.replace(diagram, connections=tuple(connections.values()))
    return _with_bends([wire for wire in wires if wire.bends], connected)


def connection(wire: Wire) -> Connection:
    """Return the connection of a wire in a message; raise ``DiagramError`` for an invalid port name."""
    return Connection(_port(wire.source), _port(wire.target))


def _port(text: str) -> PortRef:
    block, slash, port = text.rpartition("/")
    if not slash:
        raise DiagramError(
            f"'{text}' is not a port",
            allowed="block/port",
            fix="name the block and the port",
            where="connection",
        )
    return PortRef(block, port)


def _check_port(ref: PortRef, diagram: Diagram, *, output: bool) -> None:
    block = diagram.blocks[_checked_block(ref.block, diagram)]
    ports = [port.name for port in (block.output_ports() if output else block.input_ports())]
    if ref.port not in ports:
        side = "output" if output else "input"
        raise UnknownNameError(f"{side} port", ref.port, ports, where=f"block '{ref.block}' ({block.title})")


@EDITS.on(MoveBlocks, edit_titles.move_title)
def _move(edit: MoveBlocks, diagram: Diagram, _: EditContext) -> Diagram:
    layout = dict(diagram.layout)
    shifts: dict[str, tuple[float, float]] = {}
    for name, place in edit.places.items():
        before, after = layout[_checked_block(name, diagram)], _placement(place)
        layout[name] = after
        if dataclasses.replace(before, x=after.x, y=after.y) == after:
            shifts[name] = (after.x - before.x, after.y - before.y)
    bends = dict(diagram.bends)
    for wire, values in diagram.bends.items():
        shift = shifts.get(wire.source.block)
        if shift is not None and shift == shifts.get(wire.target.block):
            bends[wire] = moved_bends(values, leaves_horizontally(wire, diagram), shift)
    moved = _with_notes(edit.notes, dataclasses.replace(diagram, layout=layout, bends=bends), known=True)
    return _with_wires(edit.wires, _without_removed(RemoveBlocks(wires=edit.instead), moved), replace=False)


@EDITS.on(SetAppearance, edit_titles.appearance_title)
def _set_appearance(edit: SetAppearance, diagram: Diagram, _: EditContext) -> Diagram:
    changes = edit.model_dump(include={"name_side", "colour"}, exclude_none=True)
    changed = {
        name: dataclasses.replace(diagram.layout[_checked_block(name, diagram)], **changes)
        for name in edit.blocks
    }
    return dataclasses.replace(diagram, layout={**diagram.layout, **changed})


@EDITS.on(BendWires, lambda edit: f"bend {edit_titles.count_text(edit.wires, 'wire')}")
def _bend(edit: BendWires, diagram: Diagram, _: EditContext) -> Diagram:
    return _with_bends(edit.wires, diagram)


def _with_bends(wires: Sequence[Wire], diagram: Diagram) -> Diagram:
    bends = dict(diagram.bends)
    for wire in wires:
        bends[_checked_wire(connection(wire), diagram)] = tuple(wire.bends)
    return dataclasses.replace(diagram, bends=bends)


@EDITS.on(SetNotes, lambda edit: f"write {edit_titles.count_text(edit.notes, 'note')}")
def _write_notes(edit: SetNotes, diagram: Diagram, _: EditContext) -> Diagram:
    return _with_notes(edit.notes, diagram)


def _with_notes(notes: Mapping[str, SheetNote], diagram: Diagram, *, known: bool = False) -> Diagram:
    if not notes:
        return diagram
    for name in notes if known else ():
        if name not in diagram.notes:
            raise UnknownNameError("note", name, diagram.notes, where=f"diagram '{diagram.name}'")
    changed = {name: Note(**note.model_dump()) for name, note in notes.items()}
    return dataclasses.replace(diagram, notes={**diagram.notes, **changed})


def _placement(place: Place) -> Placement:
    return Placement(**place.model_dump())


@EDITS.on(Rename, lambda edit: f"rename {edit.block}")
def _rename(edit: Rename, diagram: Diagram, _: EditContext) -> Diagram:
    _checked_block(edit.block, diagram)
    used_names = {folded(name): name for name in diagram.blocks if name != edit.block}
    check_free(edit.name, used_names, f"diagram '{diagram.name}'")

    def renamed(name: str) -> str:
        return edit.name if name == edit.block else name

    def moved(ref: PortRef) -> PortRef:
        return PortRef(renamed(ref.block), ref.port)

    wires = {wire: Connection(moved(wire.source), moved(wire.target)) for wire in diagram.connections}
    return dataclasses.replace(
        diagram,
        blocks={renamed(name): block for name, block in diagram.blocks.items()},
        layout={renamed(name): place for name, place in diagram.layout.items()},
        connections=tuple(wires.values()),
        bends={wires[wire]: bends for wire, bends in diagram.bends.items()},
        frame_lines=tuple(line.renamed({edit.block: edit.name}) for line in diagram.frame_lines),
        logged=tuple(moved(ref) for ref in diagram.logged),
        commented={renamed(name): comment for name, comment in diagram.commented.items()},
        signal_names={moved(ref): name for ref, name in diagram.signal_names.items()},
    )


@EDITS.on(NameSignal, lambda edit: f"name {edit.port}" if edit.name else f"remove the name of {edit.port}")
def _name_signal(edit: NameSignal, diagram: Diagram, _: EditContext) -> Diagram:
    ref = _port(edit.port)
    _check_port(ref, diagram, output=True)
    other_names = {other: name for other, name in diagram.signal_names.items() if other != ref}
    if edit.name.strip():
        other_names[ref] = edit.name.strip()
    return dataclasses.replace(diagram, signal_names=other_names)


@EDITS.on(GroundPorts, lambda edit: "ground and terminate ports")
def _ground(edit: GroundPorts, diagram: Diagram, _: EditContext) -> Diagram:
    return grounded(diagram, {_checked_block(name, diagram) for name in edit.blocks} or set(diagram.blocks))


_COMMENTED = {"out": "comment out", "through": "comment through", "": "uncomment"}


@EDITS.on(CommentBlocks, lambda edit: f"{_COMMENTED[edit.comment]} {edit_titles.name_list(edit.blocks)}")
def _comment(edit: CommentBlocks, diagram: Diagram, _: EditContext) -> Diagram:
    block_names = {_checked_block(name, diagram) for name in edit.blocks}
    commented = {name: comment for name, comment in diagram.commented.items() if name not in block_names}
    if edit.comment:
        for name in sorted(block_names):
            check_comment(name, diagram.blocks[name], edit.comment)
        commented |= dict.fromkeys(block_names, edit.comment)
    return dataclasses.replace(diagram, commented=commented)


@EDITS.on(SetParameters, lambda edit: f"change {edit.block}")
def _set_parameters(edit: SetParameters, diagram: Diagram, context: EditContext) -> Diagram:
    old = diagram.blocks[_checked_block(edit.block, diagram)]
    rules = {rule.name: rule for rule in old.own_parameters()}
    where = f"block '{edit.block}' ({old.title})"
    values: dict[str, Any] = {}
    for name, value in edit.values.items():
        if name not in rules:
            raise UnknownNameError("parameter", name, rules, where=where)
        values[name] = parameter_value(
            rules[name], value, where, context.resolve_robot, diagram.mask_values, context.data
        )
    changed = block_in_scope(edit.block, old.with_parameters(**values), diagram.mask_values)
    return with_block(diagram, edit.block, changed)


@EDITS.on(ArrangeBlocks, lambda edit: "arrange")
def _arrange(edit: ArrangeBlocks, diagram: Diagram, _: EditContext) -> Diagram:
    return arranged(diagram)


@EDITS.on(GroupBlocks, lambda edit: f"group {edit_titles.count_text(edit.blocks, 'block')}")
def _group(edit: GroupBlocks, diagram: Diagram, _: EditContext) -> Diagram:
    return grouped(edit.blocks, edit.name, diagram)


@EDITS.on(BreakLink, lambda edit: f"break the link of {edit.block}")
def _break_link(edit: BreakLink, diagram: Diagram, _: EditContext) -> Diagram:
    return unlinked(diagram, _checked_block(edit.block, diagram))


EDITS.on(AddBookmark, bookmarks.addition_title)(bookmarks.added)
EDITS.on(RenameBookmark, lambda edit: f"rename the bookmark {edit.name}")(bookmarks.renamed)
EDITS.on(RemoveBookmark, lambda edit: f"remove the bookmark {edit.name}")(bookmarks.removed)
EDITS.on(SetScopeTrigger, lambda edit: "change the trigger of the scopes")(scope_triggers.with_trigger)


# -- the whole model -----------------------------------------------------------------------------------------


@EDITS.on(SetMask, lambda edit: f"mask {edit.block}" if edit.block else "mask the model")
def _set_mask(edit: SetMask, diagram: Diagram, context: EditContext) -> Diagram:
    return with_mask(edit, diagram, context.resolve_robot)


@EDITS.on(KeepTuned, lambda edit: f"keep {edit_titles.count_text(edit.values, 'tuned value')}")
def _keep_tuned(edit: KeepTuned, diagram: Diagram, _: EditContext) -> Diagram:
    return with_parameters(diagram, {path: tuned_value(value, path) for path, value in edit.values.items()})


EDITS.on(SaveParameterSet, lambda edit: f"save the parameter set {edit.name.strip()}")(parameter_sets.saved)
EDITS.on(RenameParameterSet, lambda edit: f"rename the parameter set {edit.name}")(parameter_sets.renamed)
EDITS.on(RemoveParameterSet, lambda edit: f"remove the parameter set {edit.name}")(parameter_sets.removed)
EDITS.on(RemoveSetParameter, lambda edit: f"remove {edit.path} from the parameter sets")(
    parameter_sets.without_parameter
)


@EDITS.on(ApplyParameterSet, lambda edit: f"apply the parameter set {edit.name}")
def _apply_parameter_set(edit: ApplyParameterSet, diagram: Diagram, _: EditContext) -> Diagram:
    return with_parameter_set(diagram, edit.name)


@EDITS.on(SetSettings, lambda edit: "change the settings")
def _set_settings(edit: SetSettings, diagram: Diagram, _: EditContext) -> Diagram:
    return dataclasses.replace(diagram, settings=with_settings(diagram.settings, edit.values))


@EDITS.on(Describe, lambda edit: "change the description")
def _describe(edit: Describe, diagram: Diagram, _: EditContext) -> Diagram:
    return dataclasses.replace(diagram, description=edit.text)


# -- names ---------------------------------------------------------------------------------------------------


def _checked_block(name: str, diagram: Diagram) -> str:
    if name not in diagram.blocks:
        raise UnknownNameError("block", name, diagram.blocks, where=f"diagram '{diagram.name}'")
    return name
