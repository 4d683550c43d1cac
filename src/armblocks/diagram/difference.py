"""Differences between two diagrams that can change their behaviour; layout is not compared."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import cast

from armblocks.argument_errors import ArgumentErrors
from armblocks.diagram.block import Block
from armblocks.diagram.diagram import Connection, Diagram
from armblocks.diagram.frames import FrameLine
from armblocks.diagram.parameter import Parameter, ParameterKind
from armblocks.diagram.port import PortRef
from armblocks.equations import SimulationOptions
from armblocks.errors import check_type

_SETTINGS = tuple(entry.name for entry in dataclasses.fields(SimulationOptions))


@dataclass(frozen=True, kw_only=True)
class PlacedBlock:
    """A block that only one of two diagrams has, by its path, such as ``controller/pid``."""

    path: str
    block: Block


@dataclass(frozen=True, kw_only=True)
class Renaming:
    """A renamed block: identical, with the same connections; both names are paths."""

    before: str
    after: str
    block: Block


@dataclass(frozen=True, kw_only=True)
class ValueChange:
    """A changed value.

    ``path`` is the path of the block, with the names of the later diagram. For settings, descriptions and
    notes it is the path of the subsystem (``""`` for the top level). ``None``: one diagram has no such value.
    """

    path: str
    name: str
    before: object
    after: object


@dataclass(frozen=True, kw_only=True)
class PlacedWire:
    """A connection that only one of two diagrams has, in the subsystem at ``path`` (``""`` for the top
    level).

    Its ends have the names of the later diagram where the blocks still exist.
    """

    path: str
    wire: Connection


@dataclass(frozen=True, kw_only=True)
class PlacedLine:
    """A frame line that only one of two diagrams has, named like a :class:`PlacedWire`."""

    path: str
    line: FrameLine


@dataclass(frozen=True, kw_only=True)
class PlacedPort:
    """An output that only one of two diagrams logs, named like the ends of a :class:`PlacedWire`."""

    path: str
    port: PortRef


@dataclass(frozen=True, kw_only=True)
class DiagramDifference(metaclass=ArgumentErrors):
    """All differences between two diagrams and their subsystems; false if there are none.

    - ``types``: blocks of another type under the same name. Their parameters are listed too, with ``None``
      where one type has no such parameter.
    - ``parameters``: changed values. A formula is compared as text.
    - ``masks``: changed mask declarations of the diagram at ``path``.
    - ``comments``, ``signal_names``: changed comments of blocks, and changed names of signals.
    - ``parameter_sets``: values of parameter sets, with the name ``set: path``.
    - ``logged_added``, ``logged_removed``: outputs that are recorded without a Scope.
    - ``notes``: annotations, without their positions.
    """

    added: tuple[PlacedBlock, ...] = ()
    removed: tuple[PlacedBlock, ...] = ()
    renamed: tuple[Renaming, ...] = ()
    types: tuple[ValueChange, ...] = ()
    parameters: tuple[ValueChange, ...] = ()
    masks: tuple[ValueChange, ...] = ()
    comments: tuple[ValueChange, ...] = ()
    signal_names: tuple[ValueChange, ...] = ()
    parameter_sets: tuple[ValueChange, ...] = ()
    wires_added: tuple[PlacedWire, ...] = ()
    wires_removed: tuple[PlacedWire, ...] = ()
    lines_added: tuple[PlacedLine, ...] = ()
    lines_removed: tuple[PlacedLine, ...] = ()
    logged_added: tuple[PlacedPort, ...] = ()
    logged_removed: tuple[PlacedPort, ...] = ()
    settings: tuple[ValueChange, ...] = ()
    descriptions: tuple[ValueChange, ...] = ()
    notes: tuple[ValueChange, ...] = ()

    @property
    def count(self) -> int:
        """The number of differences."""
        return sum(len(getattr(self, entry.name)) for entry in dataclasses.fields(self))

    def __bool__(self) -> bool:
        return self.count > 0


def diagram_difference(before: Diagram, after: Diagram) -> DiagramDifference:
    """The changes that lead from ``before`` to ``after``.

    - Compared are blocks with their types, parameters and comments, connections, frame lines, logged outputs,
      settings, descriptions and the text of annotations, including subsystems.
    - Not compared are the layout, the bookmarks, the trigger of the scopes, the name of the diagram (a file
      without one is named after the file) and unknown keys of a file.

    A removed and an added block count as one renamed block if type, parameters and all connections agree. The
    connected blocks may be renamed too.
    """
    for diagram in (before, after):
        check_type(diagram, Diagram, "a Diagram", where="diagram_difference")
    findings = _Findings()
    _compare_levels(before, after, "", findings)
    for name in {**before.mask_values, **after.mask_values}:
        old, new = before.mask_values.get(name), after.mask_values.get(name)
        if old != new:
            findings.parameters.append(ValueChange(path="", name=name, before=old, after=new))
    return DiagramDifference(**{name: tuple(entries) for name, entries in vars(findings).items()})


@dataclass
class _Findings:
    """The differences found so far, by field of :class:`DiagramDifference`."""

    added: list[PlacedBlock] = field(default_factory=list[PlacedBlock])
    removed: list[PlacedBlock] = field(default_factory=list[PlacedBlock])
    renamed: list[Renaming] = field(default_factory=list[Renaming])
    types: list[ValueChange] = field(default_factory=list[ValueChange])
    parameters: list[ValueChange] = field(default_factory=list[ValueChange])
    masks: list[ValueChange] = field(default_factory=list[ValueChange])
    comments: list[ValueChange] = field(default_factory=list[ValueChange])
    signal_names: list[ValueChange] = field(default_factory=list[ValueChange])
    parameter_sets: list[ValueChange] = field(default_factory=list[ValueChange])
    wires_added: list[PlacedWire] = field(default_factory=list[PlacedWire])
    wires_removed: list[PlacedWire] = field(default_factory=list[PlacedWire])
    lines_added: list[PlacedLine] = field(default_factory=list[PlacedLine])
    lines_removed: list[PlacedLine] = field(default_factory=list[PlacedLine])
    logged_added: list[PlacedPort] = field(default_factory=list[PlacedPort])
    logged_removed: list[PlacedPort] = field(default_factory=list[PlacedPort])
    settings: list[ValueChange] = field(default_factory=list[ValueChange])
    descriptions: list[ValueChange] = field(default_factory=list[ValueChange])
    notes: list[ValueChange] = field(default_factory=list[ValueChange])


def _compare_levels(before: Diagram, after: Diagram, path: str, findings: _Findings) -> None:
    names = _renamings(before, after)

    def at(name: str) -> str:
        return f"{path}/{name}" if path else name

    for old, new in names.items():
        findings.renamed.append(Renaming(before=at(old), after=at(new), block=after.blocks[new]))
    for name, block in before.blocks.items():
        if name in after.blocks:
            _compare_blocks(block, after.blocks[name], at(name), findings)
        elif name not in names:
            findings.removed.append(PlacedBlock(path=at(name), block=block))
    for name, block in after.blocks.items():
        if name not in before.blocks and name not in names.values():
            findings.added.append(PlacedBlock(path=at(name), block=block))
    wires_before = {
        Connection(_renamed(wire.source, names), _renamed(wire.target, names)) for wire in before.connections
    }
    wires_after = set(after.connections)
    findings.wires_added += (PlacedWire(path=path, wire=wire) for wire in sorted(wires_after - wires_before))
    findings.wires_removed += (
        PlacedWire(path=path, wire=wire) for wire in sorted(wires_before - wires_after)
    )
    lines_before, lines_after = {line.renamed(names) for line in before.frame_lines}, set(after.frame_lines)
    findings.lines_added += (PlacedLine(path=path, line=line) for line in sorted(lines_after - lines_before))
    findings.lines_removed += (
        PlacedLine(path=path, line=line) for line in sorted(lines_before - lines_after)
    )
    old_comments = {names.get(name, name): comment for name, comment in before.commented.items()}
    for name in {**old_comments, **after.commented}:
        if name in after.blocks and old_comments.get(name) != after.commented.get(name):
            change = {"before": old_comments.get(name), "after": after.commented.get(name)}
            findings.comments.append(ValueChange(path=at(name), name="commented", **change))
    old_names = {_renamed(ref, names): name for ref, name in before.signal_names.items()}
    for ref in sorted({**old_names, **after.signal_names}):
        old_name, new_name = old_names.get(ref), after.signal_names.get(ref)
        if old_name != new_name:
            findings.signal_names.append(
                ValueChange(path=at(str(ref)), name="name", before=old_name, after=new_name)
            )
    logged_before, logged_after = {_renamed(port, names) for port in before.logged}, set(after.logged)
    findings.logged_added += (
        PlacedPort(path=path, port=port) for port in sorted(logged_after - logged_before)
    )
    findings.logged_removed += (
        PlacedPort(path=path, port=port) for port in sorted(logged_before - logged_after)
    )
    _compare_sheets(before, after, path, findings)


def _compare_sheets(before: Diagram, after: Diagram, path: str, findings: _Findings) -> None:
    """Compare settings, masks, parameter sets, descriptions and notes of two diagrams of a hierarchy."""
    for name in _SETTINGS:
        old_value, new_value = getattr(before.settings, name), getattr(after.settings, name)
        if old_value != new_value:
            findings.settings.append(ValueChange(path=path, name=name, before=old_value, after=new_value))
    old_mask, new_mask = ({rule.name: rule for rule in diagram.mask} for diagram in (before, after))
    for name in {**old_mask, **new_mask}:
        old_rule, new_rule = old_mask.get(name), new_mask.get(name)
        if old_rule != new_rule:
            findings.masks.append(ValueChange(path=path, name=name, before=old_rule, after=new_rule))
    old_sets, new_sets = _set_values(before), _set_values(after)
    for name in sorted({**old_sets, **new_sets}):
        old_value, new_value = old_sets.get(name), new_sets.get(name)
        if old_value != new_value:
            findings.parameter_sets.append(
                ValueChange(path=path, name=name, before=old_value, after=new_value)
            )
    if before.description != after.description:
        findings.descriptions.append(
            ValueChange(path=path, name="description", before=before.description, after=after.description)
        )
    old_notes, new_notes = (
        {name: note.text for name, note in diagram.notes.items()} for diagram in (before, after)
    )
    for name in sorted({**old_notes, **new_notes}):
        old_text, new_text = old_notes.get(name), new_notes.get(name)
        if old_text != new_text:
            findings.notes.append(ValueChange(path=path, name=name, before=old_text, after=new_text))


def _set_values(diagram: Diagram) -> dict[str, object]:
    """All values of the parameter sets, ``"set: path"``; a set without values is ``"set"``."""
    values: dict[str, object] = {}
    for name, entries in diagram.parameter_sets.items():
        values |= {f"{name}: {path}": value for path, value in entries.items()} or {name: ()}
    return values


def _compare_blocks(before: Block, after: Block, path: str, findings: _Findings) -> None:
    if before.type_name() != after.type_name():
        findings.types.append(
            ValueChange(path=path, name="type", before=before.type_name(), after=after.type_name())
        )
    old_rules, new_rules = _rules(before), _rules(after)
    for name in {**old_rules, **new_rules}:
        old = before.stated_value(name) if name in old_rules else None
        new = after.stated_value(name) if name in new_rules else None
        if isinstance(old, Diagram) and isinstance(new, Diagram):
            if old.link != new.link:
                findings.parameters.append(
                    ValueChange(path=path, name="library", before=old.link or None, after=new.link or None)
                )
            _compare_levels(old, new, path, findings)
        elif old != new:
            findings.parameters.append(ValueChange(path=path, name=name, before=old, after=new))


def _rules(block: Block) -> Mapping[str, Parameter]:
    return {rule.name: rule for rule in block.own_parameters()}


# -- renamed blocks ------------------------------------------------------------------------------------------


_Colours = dict[str, int]
"""A colour for each block name, which depends on the block and its neighbours, not on the name."""
_Ends = list[tuple[str, str, PortRef]]
"""The connections of a block: own port, direction, port at the other end."""


def _renamings(before: Diagram, after: Diagram) -> dict[str, str]:
    """Later names of blocks by earlier names (colour refinement).

    A block that only one diagram has starts with a colour of its content. Each round refines its colour by
    the colours of its neighbours. A block that both diagrams have keeps a unique colour. Blocks of equal
    colour in both diagrams are the same block. Where several blocks have equal colours, one pair is matched
    and refinement continues; any choice is valid.
    """
    removed = {
        name: hash(_content(block)) for name, block in before.blocks.items() if name not in after.blocks
    }
    added = {name: hash(_content(block)) for name, block in after.blocks.items() if name not in before.blocks}
    removed_ends, added_ends = _ends_of(before, removed), _ends_of(after, added)
    pairs: dict[str, str] = {}
    while removed and added:
        paired = {later: hash(("paired", later)) for later in pairs.values()}
        removed_paired = {old: paired[later] for old, later in pairs.items()}
        old_colours, new_colours = _refined_colours(
            removed, added, (removed_ends, removed_paired), (added_ends, paired)
        )
        old_names, new_names = _by_colour(old_colours), _by_colour(new_colours)
        shared = [colour for colour in old_names if colour in new_names]
        certain = [colour for colour in shared if len(old_names[colour]) == len(new_names[colour]) == 1]
        for colour in certain or shared[:1]:
            old, later = old_names[colour][0], new_names[colour][0]
            pairs[old] = later
            del removed[old], added[later]
        if not shared:
            break
    return pairs


def _ends_of(diagram: Diagram, names: Mapping[str, object]) -> dict[str, _Ends]:
    ends: dict[str, _Ends] = {name: [] for name in names}
    for wire in diagram.connections:
        if wire.source.block in ends:
            ends[wire.source.block].append((wire.source.port, "out", wire.target))
        if wire.target.block in ends:
            ends[wire.target.block].append((wire.target.port, "in", wire.source))
    for line in diagram.frame_lines:
        for own, other in (line.ends, line.ends[::-1]):
            if own.block in ends:
                ends[own.block].append((own.port, "line", other))
    return ends


def _by_colour(colours: _Colours) -> dict[int, list[str]]:
    names: dict[int, list[str]] = {}
    for name in sorted(colours):
        names.setdefault(colours[name], []).append(name)
    return names


_Surroundings = tuple[dict[str, _Ends], _Colours]


def _refined_colours(
    old: _Colours, new: _Colours, old_surroundings: _Surroundings, new_surroundings: _Surroundings
) -> tuple[_Colours, _Colours]:
    """The stable colours of both diagrams, after equally many rounds."""
    count = 0
    while (colour_count := len({*old.values(), *new.values()})) > count:
        count = colour_count
        old, new = _refinement_round(old, *old_surroundings), _refinement_round(new, *new_surroundings)
    return old, new


def _refinement_round(colours: _Colours, ends: Mapping[str, _Ends], paired: _Colours) -> _Colours:
    known = {**paired, **colours}

    def colour_of(end: PortRef) -> object:
        return (known.get(end.block, end.block), end.port)

    return {
        name: hash(
            (own, frozenset((port, direction, colour_of(other)) for port, direction, other in ends[name]))
        )
        for name, own in colours.items()
    }


def _content(block: Block) -> tuple[object, ...]:
    """The content of a block without name and layout, as a hashable value."""
    values = ((rule.name, _value_content(block, rule)) for rule in block.own_parameters())
    return (block.type_name(), *values)


def _value_content(block: Block, rule: Parameter) -> object:
    value = block.stated_value(rule.name)
    if rule.kind is not ParameterKind.DIAGRAM:
        return value
    inside = cast("Diagram", value)
    blocks = frozenset((name, _content(inner)) for name, inner in inside.blocks.items())
    comments = tuple(inside.commented.items())
    signals = tuple(inside.signal_names.items())
    whole = (inside.settings, inside.description, inside.mask, inside.link, inside.logged, comments, signals)
    return (blocks, inside.connections, inside.frame_lines, *whole)


def _renamed(port: PortRef, names: Mapping[str, str]) -> PortRef:
    return PortRef(names.get(port.block, port.block), port.port)
