"""Generation of a readable Python program that builds and runs a diagram.

Blocks follow the sources of their inputs where possible, so that connections are arguments of ``add``; the
connections of loops follow as ``connect``. Only parameters that differ from their defaults are written. An
inner diagram is built before its block, by a separate builder; a linked block is loaded from its library.
"""

from __future__ import annotations

import keyword
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np

from armblocks.diagram import (
    Block,
    Connection,
    Diagram,
    DiagramBlock,
    Parameter,
    ParameterKind,
    Port,
    PortRef,
    Subsystem,
    TimeTable,
    UserFunction,
    mask_parameter,
)
from armblocks.diagram.parameter import kind_of
from armblocks.errors import FormatError
from armblocks.formats.robot_files import load_robot
from armblocks.formats.robot_references import shortest_reference
from armblocks.formats.shipped import list_robots
from armblocks.robot import Robot

_Named = TypeVar("_Named", Robot, str)
_RESERVED_NAMES = ("ab", "builder", "diagram", "result")
_MAX_LINE_LENGTH = 88
_FRICTION_METHODS = {
    "": "",
    "none": ".nofriction()",
    "viscous": ".nofriction(viscous=False)",
    "coulomb": ".nofriction(coulomb=False)",
}


def diagram_to_python(diagram: Diagram) -> str:
    """Lines that build the diagram as ``diagram`` and run it as ``result``.

    Robots must be shipped or from a file. Raises ``FormatError`` for another robot. Layout, description and
    unknown keys of a file are not written.
    """
    diagrams = list(_unlinked_diagrams(diagram))
    blocks = [block for level in diagrams for block in level.blocks.values()]
    kinds = sorted({block.type_name() for block in blocks if not _is_whole_link(block)})
    robots = _robots(diagrams)
    identifiers = _identifiers({robot: name for robot, (name, _) in robots.items()}, _RESERVED_NAMES)
    writer = _ProgramWriter(identifiers)
    lines = ["import armblocks as ab", *_import(kinds), ""]
    lines += [f"{identifiers[robot]} = {expression}" for robot, (_, expression) in robots.items()]
    lines += writer.lines(diagram, "builder")
    lines += ["diagram = builder.build()", "", f"result = ab.simulate({', '.join(_settings(diagram))})"]
    return "\n".join(lines) + "\n"


class _ProgramWriter:
    """Writes diagrams, inner diagrams before their blocks. Every name in the program is unique."""

    def __init__(self, robots: Mapping[Robot, str]) -> None:
        self._robots = robots
        self._used_names = {*_RESERVED_NAMES, *robots.values()}

    def lines(self, diagram: Diagram, builder: str, *, is_inner: bool = False) -> list[str]:
        """The lines that add the blocks and connections to a builder of this name."""
        order = _reading_order(diagram)
        names = _identifiers({name: name for name in order}, self._used_names)
        self._used_names |= set(names.values())
        written = [f"{builder} = ab.DiagramBuilder({_text(diagram.name)})"]
        for rule in diagram.mask:
            written += _call(f"{builder}.parameter", self._declaration(diagram, rule, is_inner=is_inner))
        added: set[str] = set()
        backward_connections = _backward_connections(diagram, order)
        used = {wire.source.block for wire in diagram.connections} | {
            wire.target.block for wire in backward_connections
        }
        used |= {end.block for line in diagram.frame_lines for end in line.ends}
        used |= {ref.block for ref in (*diagram.logged, *diagram.signal_names)} | set(diagram.commented)
        before: list[str] = []
        for name in order:
            block = diagram.blocks[name]
            construction = self._construction(block, names[name], before)
            arguments = [_text(name), construction, *_sources(diagram, name, added, names)]
            target = f"{names[name]} = " if name in used else ""
            written += _call(f"{target}{builder}.add", arguments)
            added.add(name)
        for wire in backward_connections:
            source = _output_expression(diagram, wire.source, names)
            written.append(f'{builder}.connect({source}, {names[wire.target.block]}["{wire.target.port}"])')
        written += [
            f"{builder}.draw_line({', '.join(_frame_expression(diagram, end, names) for end in line.ends)})"
            for line in diagram.frame_lines
        ]
        written += [f"{builder}.log({_output_expression(diagram, ref, names)})" for ref in diagram.logged]
        written += [
            f"{builder}.name_signal({_output_expression(diagram, ref, names)}, {_text(name)})"
            for ref, name in diagram.signal_names.items()
        ]
        for name, values in diagram.parameter_sets.items():
            entries = ", ".join(f"{_text(path)}: {_value(value)}" for path, value in values.items())
            written += _call(f"{builder}.parameter_set", [_text(name), f"{{{entries}}}"])
        written += [f"{builder}.comment_{mark}({names[name]})" for name, mark in diagram.commented.items()]
        return [*before, *written]

    def _construction(self, block: Block, name: str, before: list[str]) -> str:
        """The expression that creates a block. Appends the lines of its inner diagram to ``before``."""
        formulas = dict(block.formulas)

        def written(rule: Parameter) -> str:
            if rule.name in formulas:
                return f"ab.formula({_text(formulas[rule.name])})"
            value = block.parameter_value(rule.name)
            return self._robots[value] if isinstance(value, Robot) else _value(value)

        def keyword_arguments(rules: Iterable[Parameter]) -> list[str]:
            return [
                f"{rule.name}={written(rule)}"
                for rule in rules
                if rule.kind is not ParameterKind.DIAGRAM and _is_written(block, rule)
            ]

        argument_texts = keyword_arguments(block.parameters())
        if not isinstance(block, DiagramBlock):
            return _block_call(block.type_name(), argument_texts)
        if _is_whole_link(block):
            expression = _library_block(block.diagram.link)
        elif block.diagram.link:
            linked = f"diagram={_library_block(block.diagram.link)}.diagram"
            expression = f"{block.type_name()}({', '.join([linked, *argument_texts])})"
        else:
            inner = next(iter(_identifiers({"": f"{name} inside"}, self._used_names).values()))
            self._used_names.add(inner)
            before += [*self.lines(block.diagram, inner, is_inner=True), ""]
            expression = f"{block.type_name()}({', '.join([f'diagram={inner}.build()', *argument_texts])})"
        masked = keyword_arguments(block.diagram.mask)
        return f"{expression}.with_parameters({', '.join(masked)})" if masked else expression

    def _declaration(self, diagram: Diagram, rule: Parameter, *, is_inner: bool) -> list[str]:
        def shown(value: object) -> str:
            return self._robots[value] if isinstance(value, Robot) else _value(value)

        argument_texts = [_text(rule.name), shown(rule.default)]
        if not is_inner and diagram.mask_values[rule.name] != rule.default:
            argument_texts.append(f"value={shown(diagram.mask_values[rule.name])}")
        if rule.kind is not kind_of(rule.default, {"choices": rule.choices} if rule.choices else {}):
            argument_texts.append(f"kind={_text(rule.kind.value)}")
        default_rule = mask_parameter(rule.name, rule.default, kind=rule.kind, **_required_fields(rule))
        return argument_texts + [
            f"{key}={_value(getattr(rule, key))}"
            for key in ("unit", "doc", "minimum", "above", "maximum", "choices", "dimensions")
            if getattr(rule, key) != getattr(default_rule, key) or key in _required_fields(rule)
        ]


def _required_fields(rule: Parameter) -> dict[str, Any]:
    """The fields of a declared parameter that its kind requires: the choices of a choice."""
    return {"choices": rule.choices} if rule.choices else {}


def _is_written(block: Block, rule: Parameter) -> bool:
    """Whether a parameter must be written: it has a formula, or differs from its default."""
    if rule.required or rule.name in dict(block.formulas):
        return True
    return rule.check(rule.default, "") != block.parameter_value(rule.name)


def _is_whole_link(block: Block) -> bool:
    """Whether a block can be loaded from a library: a linked ``Subsystem``."""
    return isinstance(block, Subsystem) and bool(block.diagram.link)


def _library_block(link: str) -> str:
    file, _, entry = link.partition("#")
    return f"ab.load_library({_text(file)})[{_text(entry)}]"


def _unlinked_diagrams(diagram: Diagram) -> Iterator[Diagram]:
    """A diagram and the diagrams inside its blocks, without diagrams of libraries."""
    yield diagram
    for block in diagram.blocks.values():
        if isinstance(block, DiagramBlock) and not block.diagram.link:
            yield from _unlinked_diagrams(block.diagram)


def _reading_order(diagram: Diagram) -> list[str]:
    """The blocks sorted with sources first, by a depth-first search that breaks loops."""
    order: dict[str, None] = {}
    visited: set[str] = set()
    inputs = {name: [port.name for port in block.input_ports()] for name, block in diagram.blocks.items()}
    for first in sorted(diagram.blocks, key=lambda name: (not diagram.blocks[name].views(), name)):
        stack: list[tuple[str, Iterator[str]]] = [(first, iter(inputs[first]))]
        if first in visited:
            continue
        visited.add(first)
        while stack:
            name, ports = stack[-1]
            for port in ports:
                driver = diagram.drivers.get(PortRef(name, port))
                if driver is not None and driver.block not in visited:
                    visited.add(driver.block)
                    stack.append((driver.block, iter(inputs[driver.block])))
                    break
            else:
                order[name] = None
                stack.pop()
    return list(order)


def _backward_connections(diagram: Diagram, order: list[str]) -> list[Connection]:
    """The connections to a block that precedes their source."""
    position = {name: number for number, name in enumerate(order)}
    return [
        wire for wire in diagram.connections if position[wire.source.block] >= position[wire.target.block]
    ]


def _sources(diagram: Diagram, name: str, added: set[str], names: Mapping[str, str]) -> list[str]:
    """The sources of a block's inputs as arguments: positional as long as they follow the order of the ports,
    then by port name."""
    arguments: list[str] = []
    in_order = True
    for port in diagram.blocks[name].input_ports():
        source = diagram.drivers.get(PortRef(name, port.name))
        if source is None or source.block not in added:
            in_order = False
            continue
        text = _output_expression(diagram, source, names)
        arguments.append(text if in_order else f"{port.name}={text}")
    return arguments


def _output_expression(diagram: Diagram, source: PortRef, names: Mapping[str, str]) -> str:
    outputs: tuple[Port, ...] = diagram.blocks[source.block].output_ports()
    return names[source.block] if len(outputs) == 1 else f'{names[source.block]}["{source.port}"]'


def _frame_expression(diagram: Diagram, end: PortRef, names: Mapping[str, str]) -> str:
    frames = diagram.blocks[end.block].frame_ports()
    return names[end.block] if len(frames) == 1 else f'{names[end.block]}["{end.port}"]'


def _robots(diagrams: Iterable[Diagram]) -> dict[Robot, tuple[str, str]]:
    """A name for every robot of the blocks, and the expression that loads it."""
    load_expressions: dict[Robot, tuple[str, str]] = {}
    for name, block in ((name, block) for diagram in diagrams for name, block in diagram.blocks.items()):
        for rule in block.own_parameters():
            robot = block.parameter_value(rule.name)
            if isinstance(robot, Robot) and robot not in load_expressions:
                load_expressions[robot] = _load_expression(robot, f"block '{name}'")
    return load_expressions


def _load_expression(robot: Robot, where: str) -> tuple[str, str]:
    """The name of a shipped robot or of a robot's file, and the expression that loads the robot."""
    entry = shortest_reference(robot, None, load_robot)
    reference_members: Mapping[str, object] = {"robot": entry} if isinstance(entry, str) else entry
    if "robot" not in reference_members:
        raise FormatError(
            f"the robot '{robot.name}' is neither shipped nor loaded from a file",
            where=where,
            allowed=", ".join(list_robots()),
            fix="write the diagram as JSON, which can contain any robot",
        )
    reference = str(reference_members["robot"])
    model = (
        f", friction_model={_value(reference_members['friction_model'])}"
        if "friction_model" in reference_members
        else ""
    )
    without = _FRICTION_METHODS[str(reference_members.get("friction", ""))]
    return Path(reference).stem, f"ab.load_robot({_text(reference)}{model}).robot{without}"


def _identifiers(names: Mapping[_Named, str], others: Iterable[str]) -> dict[_Named, str]:
    """A unique Python name for each block or robot, similar to its name and different from the ``others``."""
    used_names = set(others)
    identifiers: dict[_Named, str] = {}
    for key, name in names.items():
        stem = re.sub(r"\W+", "_", name).strip("_").lower() or "block"
        if stem[0].isdigit() or keyword.iskeyword(stem):
            stem = f"block_{stem}"
        identifier, number = stem, 2
        while identifier in used_names:
            identifier, number = f"{stem}_{number}", number + 1
        used_names.add(identifier)
        identifiers[key] = identifier
    return identifiers


def _value(value: object) -> str:
    if isinstance(value, UserFunction):
        raise FormatError(
            f"the function {value.name} cannot be written into a Python program",
            allowed="diagrams without Python functions",
            fix="write the diagram as JSON, which names the function's file",
            where=f"function {value.name}",
        )
    if isinstance(value, TimeTable):
        return _table(value) if value.source else _value(_nested(value))
    if isinstance(value, tuple):
        return f"[{', '.join(_value(entry) for entry in cast('tuple[object, ...]', value))}]"
    if isinstance(value, float):
        if math.isinf(value):
            return f'float("{value}")'
        return str(int(value)) + ".0" if value.is_integer() and abs(value) < 1e15 else repr(value)
    return _text(value) if isinstance(value, str) else repr(value)


def _table(table: TimeTable) -> str:
    selection = f", time={_text(table.time)}" if table.time else ""
    if table.columns:
        selection += f", columns=[{', '.join(map(_text, table.columns))}]"
    return f"ab.load_table({_text(table.source)}{selection})"


def _nested(table: TimeTable) -> tuple[object, ...]:
    return tuple(tuple(row) for row in np.asarray(table).tolist())


def _text(text: str) -> str:
    """A string literal in double quotes if possible."""
    return f'"{text}"' if text.isprintable() and not set(text) & {'"', "\\"} else repr(text)


def _settings(diagram: Diagram) -> Iterator[str]:
    yield "diagram"
    for name in ("stop_time", "solver", "step", "sample_time", "max_step", "rtol", "atol", "record_jumps"):
        value = getattr(diagram.settings, name)
        if name == "stop_time" or value != getattr(type(diagram.settings)(), name):
            yield f"{name}={_value(value)}"


def _import(kinds: list[str]) -> list[str]:
    line = f"from armblocks.blocks import {', '.join(kinds)}"
    return (
        [line] if len(line) <= _MAX_LINE_LENGTH else [f"from armblocks.blocks import ({_wrapped(kinds)}", ")"]
    )


def _call(head: str, arguments: list[str]) -> list[str]:
    line = f"{head}({', '.join(arguments)})"
    if len(line) <= _MAX_LINE_LENGTH:
        return [line]
    return [f"{head}(", *(f"    {argument}," for argument in arguments), ")"]


def _block_call(name: str, arguments: list[str]) -> str:
    """The call of a block type as an argument of ``add``: one line, or one line for each parameter."""
    line = f"{name}({', '.join(arguments)})"
    if len("    " + line + ",") <= _MAX_LINE_LENGTH:
        return line
    return "\n".join([f"{name}(", *(f"        {argument}," for argument in arguments), "    )"])


def _wrapped(kinds: list[str]) -> str:
    return "".join(f"\n    {kind}," for kind in kinds)
