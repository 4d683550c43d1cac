"""``armblocks diff``: the differences between two diagrams, without layout."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer
from rich.console import Console
from rich.text import Text

from armblocks.cli.completion import ModelName, complete_models
from armblocks.cli.terminal import ACCENT, ERROR, GOOD, STRONG, results_console
from armblocks.errors import counted

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from armblocks.diagram import Block, Diagram
    from armblocks.diagram.difference import (
        DiagramDifference,
        PlacedLine,
        PlacedPort,
        PlacedWire,
        ValueChange,
    )

DIFFERENT = 1
_MAX_TEXT_LENGTH = 160
"""Maximum length of a value's text that is shown in full."""


def diff(
    before: ModelName,
    after: Annotated[
        str, typer.Argument(help="The second diagram of the comparison.", autocompletion=complete_models)
    ],
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object instead of lines.")] = False,
    trust: Annotated[
        bool, typer.Option("--trust", help="Run the Python files that the diagrams name.")
    ] = False,
) -> None:
    """Show the differences between two diagrams, without layout. Exit code 0: none, 1: some."""
    import armblocks as ab

    old, new = ab.load_diagram(before, trust=trust), ab.load_diagram(after, trust=trust)
    difference = ab.diagram_difference(old, new)
    if as_json:
        typer.echo(json.dumps(difference_document(difference), indent=2, ensure_ascii=False))
    else:
        print_difference(difference, before, after, results_console())
    if difference:
        raise typer.Exit(DIFFERENT)


# -- text output --------------------------------------------------------------------------------------------


def print_difference(difference: DiagramDifference, before: str, after: str, console: Console) -> None:
    """Print a heading, then the grouped differences, one per line. A sign and a colour mark each kind."""
    if not difference:
        console.print(f"{before} and {after} are the same except for layout", style=STRONG, soft_wrap=True)
        return
    differences = counted(difference.count, "difference")
    console.print(f"{before} -> {after}: {differences}", style=STRONG, soft_wrap=True)
    added = [f"{entry.path}: {_block_text(entry.block)}" for entry in difference.added]
    removed = [f"{entry.path}: {_block_text(entry.block)}" for entry in difference.removed]
    renamed = [f"{entry.before} -> {entry.after} ({entry.block.type_name()})" for entry in difference.renamed]
    types = [f"{entry.path}: {entry.before} -> {entry.after}" for entry in difference.types]
    settings, about, parameters, masks, comments, signals, sets = (
        [_change_text(entry, "." if entry.path else "") for entry in entries]
        for entries in (
            difference.settings,
            difference.descriptions,
            difference.parameters,
            difference.masks,
            difference.comments,
            difference.signal_names,
            difference.parameter_sets,
        )
    )
    notes = [_change_text(entry, "") for entry in difference.notes]
    _print_group("Blocks", (("-", removed), ("+", added), ("~", [*renamed, *types])), console)
    _print_group("Parameters", (("~", parameters),), console)
    _print_group("Masks", (("~", masks),), console)
    _print_group("Comments", (("~", comments),), console)
    _print_group("Signal names", (("~", signals),), console)
    _print_group("Parameter sets", (("~", sets),), console)
    wires = (("-", _wires(difference.wires_removed)), ("+", _wires(difference.wires_added)))
    _print_group("Wires", wires, console)
    lines = (("-", _frame_lines(difference.lines_removed)), ("+", _frame_lines(difference.lines_added)))
    _print_group("Frame lines", lines, console)
    logged = (("-", _ports(difference.logged_removed)), ("+", _ports(difference.logged_added)))
    _print_group("Logged", logged, console)
    _print_group("Settings", (("~", settings),), console)
    _print_group("Description", (("~", about),), console)
    _print_group("Notes", (("~", notes),), console)


def _print_group(title: str, entries: Sequence[tuple[str, Sequence[str]]], console: Console) -> None:
    if not any(lines for _, lines in entries):
        return
    console.print()
    console.print(title, style=STRONG)
    styles = {"-": ERROR, "+": GOOD, "~": ACCENT}
    for sign, lines in entries:
        for line in lines:
            wrapped = Text(line).wrap(console, max(20, console.width - 4))
            for index, part in enumerate(wrapped):
                prefix = Text(f"  {sign} ", styles[sign]) if index == 0 else Text("      ")
                part.rstrip()
                console.print(Text.assemble(prefix, part), soft_wrap=True)


def _wires(wires: Sequence[PlacedWire]) -> list[str]:
    return [f"{f'in {entry.path}: ' if entry.path else ''}{entry.wire}" for entry in wires]


def _frame_lines(lines: Sequence[PlacedLine]) -> list[str]:
    return [f"{f'in {entry.path}: ' if entry.path else ''}{entry.line}" for entry in lines]


def _ports(ports: Sequence[PlacedPort]) -> list[str]:
    return [f"{f'in {entry.path}: ' if entry.path else ''}{entry.port}" for entry in ports]


def _block_text(block: Block) -> str:
    """The type, and the parameters that differ from their defaults."""
    words = [f"{name}={value_text(value)}" for name, value in non_default_values(block).items()]
    return " ".join([block.type_name(), *words])


def non_default_values(block: Block) -> dict[str, object]:
    """The parameters of a block that differ from their defaults; formulas as text."""
    rules = block.own_parameters()
    values = {rule.name: block.stated_value(rule.name) for rule in rules}
    return {
        rule.name: values[rule.name]
        for rule in rules
        if rule.required or rule.check(rule.default, rule.name) != values[rule.name]
    }


def _change_text(entry: ValueChange, separator: str) -> str:
    before, after = value_text(entry.before), value_text(entry.after)
    note = ""
    if before == after:
        note = f" (differs in {_where_different(entry.before, entry.after)})"
    return f"{entry.path}{separator}{entry.name}: {before} -> {after}{note}"


def _where_different(before: object, after: object) -> str:
    """For two values with equal short texts: the array entries or fields that differ."""
    if isinstance(before, tuple) and isinstance(after, tuple):
        old, new = _as_array(cast("Any", before)), _as_array(cast("Any", after))
        if old.shape == new.shape:
            return f"{(old != new).sum()} of {counted(old.size, 'entry', 'entries')}"
        return "its content"
    return ", ".join(_different_fields(cast("Any", before), cast("Any", after))) or "its content"


def _different_fields(before: object, after: object) -> list[str]:
    if dataclasses.is_dataclass(before) and type(before) is type(after):
        import numpy as np

        fields = [entry.name for entry in dataclasses.fields(before) if entry.compare and entry.init]
        return [name for name in fields if np.any(getattr(before, name) != getattr(after, name))]
    return []


def _as_array(value: Any) -> NDArray[np.float64]:
    import numpy as np

    return np.asarray(value, dtype=np.float64)


def value_text(value: object) -> str:
    """The short text of a value: arrays as for ``--set``, robots and functions by name."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        short = f"{value:g}"
        return short if float(short) == value else repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, tuple):
        rows = cast("tuple[object, ...]", value)
        text = _array_text(rows)
        if len(text) <= _MAX_TEXT_LENGTH:
            return text
        import numpy as np

        return f"{text[:_MAX_TEXT_LENGTH]}… of shape {np.shape(cast('Any', rows))}"
    return _object_text(value)


def _array_text(rows: tuple[object, ...]) -> str:
    if rows and all(isinstance(row, tuple) for row in rows):
        inner = (_array_text(cast("tuple[object, ...]", row))[1:-1] for row in rows)
        return "[" + "; ".join(inner) + "]"
    return "[" + " ".join(value_text(entry) for entry in rows) + "]"


def _object_text(value: object) -> str:
    from armblocks.diagram import Parameter, ParameterFormula

    if isinstance(value, ParameterFormula):
        return value.text
    if isinstance(value, Parameter):
        rest = " ".join(filter(None, (value.unit, f"({value.doc})" if value.doc else "")))
        return f"{value.kind.value} {value_text(value.default)} {rest}".rstrip()
    blocks = getattr(value, "blocks", None)
    if isinstance(blocks, Mapping):
        return f"({counted(len(cast('Diagram', value).blocks), 'block')} inside)"
    kind = type(value).__name__
    name = getattr(value, "name", None) or getattr(value, "source", None)
    return f"{kind} {name}" if name else kind


# -- JSON output --------------------------------------------------------------------------------------------


def difference_document(difference: DiagramDifference) -> dict[str, object]:
    """The differences as a JSON object: all lists are present, possibly empty."""
    return {
        "same": not difference,
        "added": [_placed_block(entry.path, entry.block) for entry in difference.added],
        "removed": [_placed_block(entry.path, entry.block) for entry in difference.removed],
        "renamed": [
            {"before": entry.before, "after": entry.after, "type": entry.block.type_name()}
            for entry in difference.renamed
        ],
        "types": [_change(entry) for entry in difference.types],
        "parameters": [_change(entry) for entry in difference.parameters],
        "masks": [_change(entry) for entry in difference.masks],
        "comments": [_change(entry) for entry in difference.comments],
        "signal_names": [_change(entry) for entry in difference.signal_names],
        "parameter_sets": [_change(entry) for entry in difference.parameter_sets],
        "wires_added": [{"path": entry.path, "wire": str(entry.wire)} for entry in difference.wires_added],
        "wires_removed": [
            {"path": entry.path, "wire": str(entry.wire)} for entry in difference.wires_removed
        ],
        "lines_added": [{"path": entry.path, "line": str(entry.line)} for entry in difference.lines_added],
        "lines_removed": [
            {"path": entry.path, "line": str(entry.line)} for entry in difference.lines_removed
        ],
        "logged_added": [{"path": entry.path, "port": str(entry.port)} for entry in difference.logged_added],
        "logged_removed": [
            {"path": entry.path, "port": str(entry.port)} for entry in difference.logged_removed
        ],
        "settings": [_change(entry) for entry in difference.settings],
        "descriptions": [_change(entry) for entry in difference.descriptions],
        "notes": [_change(entry) for entry in difference.notes],
    }


def _placed_block(path: str, block: Block) -> dict[str, object]:
    values = {name: _json_value(value) for name, value in non_default_values(block).items()}
    return {"path": path, "type": block.type_name(), "parameters": values}


def _change(entry: ValueChange) -> dict[str, object]:
    before, after = _json_value(entry.before), _json_value(entry.after)
    return {"path": entry.path, "name": entry.name, "before": before, "after": after}


def _json_value(value: object) -> object:
    """The value if JSON can represent it, else its text (an infinity is the text ``inf``)."""
    if isinstance(value, tuple):
        return [_json_value(entry) for entry in cast("tuple[object, ...]", value)]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value if value is None or isinstance(value, bool | int | float | str) else value_text(value)
