"""Parameter sets in the editor: their edits, their table, and their paths after edits of blocks and masks."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from armblocks.diagram import Diagram
from armblocks.diagram.parameter import Value
from armblocks.diagram.parameter_sets import (
    check_set_name,
    checked_entry,
    checked_set,
    is_tunable,
    parameter_set,
    set_location,
    settable_parameter,
)
from armblocks.errors import ArmblocksError, DiagramError, UnknownNameError
from armblocks.studio.protocol.messages.sheet_edits import (
    GroupBlocks,
    RemoveParameterSet,
    RemoveSetParameter,
    Rename,
    RenameParameterSet,
    SaveParameterSet,
    SetMask,
)
from armblocks.studio.protocol.messages.sheets import ParameterSetTable, SetParameter
from armblocks.studio.sheet.nesting import inside, with_inside
from armblocks.studio.sheet.parameter_values import parameter_json, tuned_value

_PathMap = Callable[[str], str | None]
"""Maps the path of a parameter before an edit to its path after it; ``None`` if the edit removes it."""


def saved(edit: SaveParameterSet, diagram: Diagram, _context: object) -> Diagram:
    """Return the diagram with a new parameter set, or with other values of an existing set."""
    name, sets = edit.name.strip(), diagram.parameter_sets
    if edit.replace:
        parameter_set(diagram, name)
    else:
        check_set_name(name, sets, f"diagram '{diagram.name}'")
    where = set_location(diagram, name)
    values: dict[str, Any] = {}
    if edit.all_parameters:
        for other, entries in sets.items():
            for path in entries if other != name else ():
                values[path] = settable_parameter(diagram, path)[1]
    values |= {path: _read(diagram, path, typed, where) for path, typed in edit.values.items()}
    if not values:
        raise DiagramError(
            "the parameter set would have no values",
            where=where,
            allowed="values of one or more parameters",
            fix="try other values of parameters first",
        )
    return dataclasses.replace(diagram, parameter_sets={**sets, name: checked_set(diagram, values, where)})


def _read(diagram: Diagram, path: str, typed: Any, where: str) -> Any:
    """The value of a parameter from a client; texts of choices are not formulas."""
    try:
        return checked_entry(diagram, path, typed, where)
    except ArmblocksError:
        return tuned_value(typed, path)


def renamed(edit: RenameParameterSet, diagram: Diagram, _context: object) -> Diagram:
    """Return the diagram with a renamed parameter set."""
    values, name = parameter_set(diagram, edit.name), edit.to.strip()
    others = {other: entries for other, entries in diagram.parameter_sets.items() if other != edit.name}
    check_set_name(name, others, f"diagram '{diagram.name}'")
    return dataclasses.replace(diagram, parameter_sets={**others, name: values})


def removed(edit: RemoveParameterSet, diagram: Diagram, _context: object) -> Diagram:
    """Return the diagram without a parameter set."""
    parameter_set(diagram, edit.name)
    others = {name: entries for name, entries in diagram.parameter_sets.items() if name != edit.name}
    return dataclasses.replace(diagram, parameter_sets=others)


def without_parameter(edit: RemoveSetParameter, diagram: Diagram, _context: object) -> Diagram:
    """Return the diagram without a parameter in any of its sets."""
    sets = {
        name: {path: value for path, value in entries.items() if path != edit.path}
        for name, entries in diagram.parameter_sets.items()
    }
    if sets == diagram.parameter_sets:
        all_paths = sorted({path for entries in diagram.parameter_sets.values() for path in entries})
        raise UnknownNameError("parameter of sets", edit.path, all_paths, where=f"diagram '{diagram.name}'")
    return dataclasses.replace(diagram, parameter_sets=sets)


def parameter_set_table(diagram: Diagram, also: Sequence[str] = ()) -> ParameterSetTable:
    """Return all sets of a model, and the model's values of the parameters in these sets and in ``also``."""
    paths = sorted({*also, *(path for entries in diagram.parameter_sets.values() for path in entries)})
    table = ParameterSetTable(parameters=[_row(diagram, path) for path in paths], sets={}, faults={})
    for name, entries in diagram.parameter_sets.items():
        table.sets[name] = {path: parameter_json(value) for path, value in entries.items()}
        faults = {path: _fault(diagram, path, value, name) for path, value in entries.items()}
        table.faults[name] = {path: fault for path, fault in faults.items() if fault}
    return table


def _row(diagram: Diagram, path: str) -> SetParameter:
    try:
        rule, value = settable_parameter(diagram, path)
        return SetParameter(
            path=path,
            unit=rule.unit,
            doc=rule.doc,
            value=parameter_json(value),
            tunable=is_tunable(diagram, path),
        )
    except ArmblocksError:
        return SetParameter(path=path, unit="", doc="", value=None, tunable=False)


def _fault(diagram: Diagram, path: str, value: Value, name: str) -> str:
    try:
        checked_entry(diagram, path, value, set_location(diagram, name))
    except ArmblocksError as error:
        return error.what
    return ""


# -- edits of blocks and masks -------------------------------------------------------------------------------


def with_consistent_sets(before: Diagram, after: Diagram, edit: object, path: Sequence[str]) -> Diagram:
    """Return the diagram after an edit of the sheet at a path, with the parameter sets adapted to it.

    Parameters of renamed or grouped blocks and renamed mask parameters get their new paths. Parameters that
    the edit has removed are removed from all sets. This applies to the sets of every enclosing diagram.
    """
    for depth in range(len(path) + 1):
        old, new = inside(before, path[:depth]), inside(after, path[:depth])
        if not new.parameter_sets:
            continue
        path_map = _enclosing_path_map("/".join(path[depth:]), _path_map(edit, inside(before, path)))
        sets = {name: _adapted(entries, old, new, path_map) for name, entries in new.parameter_sets.items()}
        if sets != new.parameter_sets:
            after = with_inside(after, path[:depth], dataclasses.replace(new, parameter_sets=sets))
    return after


def _adapted(
    entries: Mapping[str, Value], old: Diagram, new: Diagram, path_map: _PathMap
) -> dict[str, Value]:
    """The entries of a set at their new paths, without entries of removed parameters."""
    adapted: dict[str, Value] = {}
    for path, value in entries.items():
        moved = path_map(path)
        if moved is not None and (_exists(new, moved) or not _exists(old, path)):
            adapted[moved] = value
    return adapted


def _exists(diagram: Diagram, path: str) -> bool:
    try:
        settable_parameter(diagram, path)
    except UnknownNameError:
        return False
    except ArmblocksError:  # a formula determines it, for example
        return True
    return True


def _path_map(edit: object, sheet: Diagram) -> _PathMap:
    """Return the map of the parameter paths of a sheet for an edit."""
    match edit:
        case Rename():
            return _block_path_map({edit.block: edit.name})
        case GroupBlocks():
            return _block_path_map({name: f"{edit.name}/{name}" for name in edit.blocks})
        case SetMask():
            return _mask_path_map(edit, sheet)
        case _:
            return lambda path: path


def _block_path_map(names: Mapping[str, str]) -> _PathMap:
    def path_map(path: str) -> str:
        block, _, parameter = path.rpartition(".")
        first, slash, rest = block.partition("/")
        return f"{names.get(first, first)}{slash}{rest}.{parameter}" if block else path

    return path_map


def _mask_path_map(edit: SetMask, sheet: Diagram) -> _PathMap:
    """Return the map for an edited mask; parameters of the block type itself keep their paths."""
    names = {rule.was: rule.name for rule in edit.parameters if rule.was}
    owner = inside(sheet, [edit.block]) if edit.block else sheet
    declared = {rule.name for rule in owner.mask}

    def path_map(path: str) -> str | None:
        block, dot, parameter = path.rpartition(".")
        if block != edit.block or parameter not in declared:
            return path
        return f"{block}{dot}{names[parameter]}" if parameter in names else None

    return path_map


def _enclosing_path_map(sheet: str, path_map: _PathMap) -> _PathMap:
    """Return the same map for paths of an enclosing diagram, in which the sheet has the path ``sheet``."""
    if not sheet:
        return path_map

    def moved(path: str) -> str | None:
        block, dot, parameter = path.rpartition(".")
        if block != sheet and not block.startswith(f"{sheet}/"):
            return path
        within = f"{block[len(sheet) + 1 :]}{dot if block != sheet else ''}{parameter}"
        after = path_map(within)
        if after is None:
            return None
        block, _, parameter = after.rpartition(".")
        return f"{sheet}/{block}.{parameter}" if block else f"{sheet}.{parameter}"

    return moved
