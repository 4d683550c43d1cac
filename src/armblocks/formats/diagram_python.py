"""A diagram as the lines of Python that build and run it, as a person would type them.

Blocks stand after what feeds them where they can, so that a wire is an argument of ``add``; the wires of
loops follow as ``connect``. Only parameters that differ from their defaults are written.
"""

from __future__ import annotations

import keyword
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TypeVar, cast

import numpy as np

from armblocks.diagram import Block, Connection, Diagram, Port, PortRef, TimeTable, UserFunction
from armblocks.errors import FormatError
from armblocks.formats.robot_files import list_robots, load_robot
from armblocks.formats.robot_references import shortest_reference
from armblocks.robot import Robot

_Named = TypeVar("_Named", Robot, str)
_PACKAGE_NAMES = ("ab", "builder", "diagram", "result")
_WIDTH = 92
_WITHOUT_FRICTION = {
    "": "",
    "none": ".nofriction()",
    "viscous": ".nofriction(viscous=False)",
    "coulomb": ".nofriction(coulomb=False)",
}


def diagram_to_python(diagram: Diagram) -> str:
    """Lines that build the diagram as ``diagram`` and run it as ``result``.

    Robots must be shipped ones, or those of a file. Raises ``FormatError`` for another robot. Layout,
    description and unknown keys of a file are not written.
    """
    order = _reading_order(diagram)
    kinds = sorted({diagram.blocks[name].type_name() for name in order})
    robots = _robots(diagram)
    shown = _identifiers({robot: name for robot, (name, _) in robots.items()}, _PACKAGE_NAMES)
    names = _identifiers({name: name for name in order}, [*_PACKAGE_NAMES, *shown.values()])
    lines = ["import armblocks as ab", *_import(kinds), ""]
    lines += [f"{shown[robot]} = {expression}" for robot, (_, expression) in robots.items()]
    lines.append(f"builder = ab.DiagramBuilder({_text(diagram.name)})")
    added: set[str] = set()
    late = _late(diagram, order)
    used = {wire.source.block for wire in diagram.connections} | {wire.target.block for wire in late}
    used |= {ref.block for ref in diagram.logged}
    for name in order:
        block = diagram.blocks[name]
        arguments = [_text(name), _construction(block, shown), *_sources(diagram, name, added, names)]
        target = f"{names[name]} = " if name in used else ""
        lines += _call(f"{target}builder.add", arguments)
        added.add(name)
    for wire in late:
        source = _end(diagram, wire.source, names)
        lines.append(f'builder.connect({source}, {names[wire.target.block]}["{wire.target.port}"])')
    lines += [f"builder.log({_end(diagram, ref, names)})" for ref in diagram.logged]
    lines += ["diagram = builder.build()", "", f"result = ab.simulate({', '.join(_settings(diagram))})"]
    return "\n".join(lines) + "\n"


def _reading_order(diagram: Diagram) -> list[str]:
    """Sources first: depth first from the inputs, loops broken where they are met."""
    order: dict[str, None] = {}
    begun: set[str] = set()
    inputs = {name: [port.name for port in block.input_ports()] for name, block in diagram.blocks.items()}
    for first in sorted(diagram.blocks, key=lambda name: (not diagram.blocks[name].views(), name)):
        stack: list[tuple[str, Iterator[str]]] = [(first, iter(inputs[first]))]
        if first in begun:
            continue
        begun.add(first)
        while stack:
            name, ports = stack[-1]
            for port in ports:
                source = diagram.drivers[PortRef(name, port)].block
                if source not in begun:
                    begun.add(source)
                    stack.append((source, iter(inputs[source])))
                    break
            else:
                order[name] = None
                stack.pop()
    return list(order)


def _late(diagram: Diagram, order: list[str]) -> list[Connection]:
    """The wires that lead to a block that stands before their source."""
    place = {name: number for number, name in enumerate(order)}
    return [wire for wire in diagram.connections if place[wire.source.block] >= place[wire.target.block]]


def _sources(diagram: Diagram, name: str, added: set[str], names: Mapping[str, str]) -> list[str]:
    """What feeds the block, as arguments: in order as long as that tells the port, then by port name."""
    arguments: list[str] = []
    in_order = True
    for port in diagram.blocks[name].input_ports():
        source = diagram.drivers[PortRef(name, port.name)]
        if source.block not in added:
            in_order = False
            continue
        text = _end(diagram, source, names)
        arguments.append(text if in_order else f"{port.name}={text}")
    return arguments


def _end(diagram: Diagram, source: PortRef, names: Mapping[str, str]) -> str:
    outputs: tuple[Port, ...] = diagram.blocks[source.block].output_ports()
    return names[source.block] if len(outputs) == 1 else f'{names[source.block]}["{source.port}"]'


def _robots(diagram: Diagram) -> dict[Robot, tuple[str, str]]:
    """A name for every robot that a block has, and the expression that gives it."""
    found: dict[Robot, tuple[str, str]] = {}
    for name, block in diagram.blocks.items():
        for rule in block.parameters():
            robot = block.parameter_value(rule.name)
            if isinstance(robot, Robot) and robot not in found:
                found[robot] = _loading(robot, f"block '{name}'")
    return found


def _loading(robot: Robot, where: str) -> tuple[str, str]:
    """The name of a shipped robot or of a robot's file, and the expression that gives the robot."""
    entry = shortest_reference(robot, None, load_robot)
    stated: Mapping[str, object] = {"robot": entry} if isinstance(entry, str) else entry
    if "robot" not in stated:
        raise FormatError(
            f"the robot '{robot.name}' is neither a shipped one nor that of a file",
            where=where,
            allowed=", ".join(list_robots()),
            fix="write the diagram as JSON, which holds any robot",
        )
    reference = str(stated["robot"])
    model = f", friction_model={_value(stated['friction_model'])}" if "friction_model" in stated else ""
    without = _WITHOUT_FRICTION[str(stated.get("friction", ""))]
    return Path(reference).stem, f"ab.load_robot({_text(reference)}{model}).robot{without}"


def _identifiers(names: Mapping[_Named, str], others: Iterable[str]) -> dict[_Named, str]:
    """A Python name for each block or robot, near to its own and unlike the ``others``."""
    taken = set(others)
    found: dict[_Named, str] = {}
    for key, name in names.items():
        stem = re.sub(r"\W+", "_", name).strip("_").lower() or "block"
        if stem[0].isdigit() or keyword.iskeyword(stem):
            stem = f"block_{stem}"
        wish, number = stem, 2
        while wish in taken:
            wish, number = f"{stem}_{number}", number + 1
        taken.add(wish)
        found[key] = wish
    return found


def _construction(block: Block, robots: Mapping[Robot, str]) -> str:
    stated: list[str] = []
    for rule in block.parameters():
        value = block.parameter_value(rule.name)
        if not rule.required and rule.check(rule.default, "") == value:
            continue
        stated.append(f"{rule.name}={robots[value] if isinstance(value, Robot) else _value(value)}")
    return f"{block.type_name()}({', '.join(stated)})"


def _value(value: object) -> str:
    if isinstance(value, UserFunction):
        raise FormatError(
            f"the function {value.name} has no place in a listing",
            allowed="diagrams without Python functions",
            fix="write the diagram as JSON, which names the function's file",
        )
    if isinstance(value, TimeTable):
        return f"ab.load_table({_text(value.source)})" if value.source else _value(_nested(value))
    if isinstance(value, tuple):
        return f"[{', '.join(_value(entry) for entry in cast('tuple[object, ...]', value))}]"
    if isinstance(value, float):
        if math.isinf(value):
            return f'float("{value}")'
        return str(int(value)) + ".0" if value.is_integer() and abs(value) < 1e15 else repr(value)
    return _text(value) if isinstance(value, str) else repr(value)


def _nested(table: TimeTable) -> tuple[object, ...]:
    return tuple(tuple(row) for row in np.asarray(table).tolist())


def _text(text: str) -> str:
    """A string as people quote it."""
    return f'"{text}"' if text.isprintable() and not set(text) & {'"', "\\"} else repr(text)


def _settings(diagram: Diagram) -> Iterator[str]:
    yield "diagram"
    for name in ("stop_time", "solver", "step", "sample_time", "max_step", "rtol", "atol"):
        value = getattr(diagram.settings, name)
        if name == "stop_time" or value != getattr(type(diagram.settings)(), name):
            yield f"{name}={_value(value)}"


def _import(kinds: list[str]) -> list[str]:
    line = f"from armblocks.blocks import {', '.join(kinds)}"
    return [line] if len(line) <= _WIDTH else [f"from armblocks.blocks import ({_wrapped(kinds)}", ")"]


def _call(head: str, arguments: list[str]) -> list[str]:
    line = f"{head}({', '.join(arguments)})"
    if len(line) <= _WIDTH:
        return [line]
    return [f"{head}(", *(f"    {argument}," for argument in arguments), ")"]


def _wrapped(kinds: list[str]) -> str:
    return "".join(f"\n    {kind}," for kind in kinds)
