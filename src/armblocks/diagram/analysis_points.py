"""Linearisation points of a diagram: perturbed inputs and loop openings.

Both are ordinary blocks that are inserted into connections, so that no other module depends on them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from casadi import SX
from numpy.typing import ArrayLike

from armblocks.diagram import (
    Block,
    Connection,
    Diagram,
    ParameterKind,
    Port,
    PortRef,
    Signals,
    infer_shapes,
    parameter,
    shape_of,
)
from armblocks.diagram.hierarchy import FlatForm, flatten_hierarchy
from armblocks.diagram.mask_tuning import mask_parameters
from armblocks.equations import Shape
from armblocks.errors import InputError, UnknownNameError, counted


@dataclass(frozen=True, kw_only=True)
class InputPoint(Block):
    """An input perturbation: y = u + offset."""

    title: ClassVar[str] = "Input Point"

    offset: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="perturbation")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the signal", shape=shape_of(self.offset)),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the perturbed signal", shape=shape_of(self.offset)),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["u"] + p["offset"]}


@dataclass(frozen=True, kw_only=True)
class LoopOpening(Block):
    """A loop opening: the input is not used, and the output is y = level + offset."""

    title: ClassVar[str] = "Loop Opening"

    level: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="the signal at the operating point")
    offset: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="perturbation")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the signal", shape=shape_of(self.level)),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the perturbed level", shape=shape_of(self.level)),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["level"] + p["offset"]}


@dataclass(frozen=True, kw_only=True)
class PreparedDiagram:
    """A diagram with linearisation points: flat, or the given diagram if it needs no points.

    ``inputs``: for every requested input, the path of the parameter that perturbs it. ``levels``: for every
    opened connection, the parameter that holds its signal, and the path of the signal in the original
    diagram.
    """

    diagram: Diagram
    inputs: Mapping[str, str]
    levels: Mapping[str, str]


def with_analysis_points(
    diagram: Diagram, inputs: Sequence[str] = (), openings: Sequence[str] = ()
) -> PreparedDiagram:
    """Insert the linearisation points into a diagram.

    An input or opening is an output port ``block/port`` (all its connections), an input port (its
    connection), or a block with a single output. An input may also be a tunable parameter,
    ``block.parameter``, or a mask parameter, for which
    :func:`~armblocks.diagram.mask_tuning.with_mask_parameters` adds the equations. Where a signal is an input
    and an opening, the perturbation is inserted after the opening. Raises ``UnknownNameError`` for unknown
    names and ``InputError`` for duplicate or unsuitable names.
    """
    form = flatten_hierarchy(diagram)
    hierarchy, diagram = diagram, form.diagram
    parameters: dict[str, str] = {}
    perturbed: dict[PortRef, str] = {}
    masked = mask_parameters(hierarchy)
    for name in _checked_unique(inputs, "input"):
        path = name if name in masked and name not in diagram.blocks else _parameter(diagram, name)
        if path is None:
            perturbed[_port(form, name, "input")] = name
        else:
            parameters[name] = path
    opened = {_port(form, name, "opening") for name in _checked_unique(openings, "opening")}
    if not perturbed and not opened:
        return PreparedDiagram(diagram=hierarchy, inputs=parameters, levels={})
    shapes = infer_shapes(hierarchy)
    blocks, wires = dict(diagram.blocks), list(diagram.connections)
    levels: dict[str, str] = {}
    chosen_ports = {*perturbed, *opened}
    # Output ports first: a point at an input port is then inserted after the point of its driver.
    for ref in sorted(chosen_ports, key=lambda ref: (not _is_output(diagram, ref), ref)):
        source = ref if _is_output(diagram, ref) else diagram.drivers[ref]
        name = _new_name(ref, blocks)
        shape = shapes.outputs[source.block][source.port]
        blocks[name] = _point(shape, ref in opened)
        if ref in opened:
            levels[f"{name}.level"] = str(source)
        if ref in perturbed:
            parameters[perturbed[ref]] = f"{name}.offset"
        wires = _rewired(wires, ref, name, source)
    prepared = dataclasses.replace(diagram, blocks=blocks, connections=tuple(wires))
    return PreparedDiagram(
        diagram=prepared, inputs={name: parameters[name] for name in inputs}, levels=levels
    )


def _checked_unique(names: Sequence[str], kind: str) -> Sequence[str]:
    for index, name in enumerate(names):
        if name in names[:index]:
            raise InputError(
                f"the {kind} '{name}' is given twice",
                allowed="each point once",
                where="analysis points",
                fix="remove one of them",
            )
    return names


def _parameter(diagram: Diagram, name: str) -> str | None:
    """The path of a tunable parameter, or ``None`` if the name is not a parameter."""
    block, dot, parameter_name = name.rpartition(".")
    if not dot or "/" in parameter_name:
        return None
    tunable_names = [rule.name for rule in diagram.block(block).parameters() if rule.tunable]
    if parameter_name not in tunable_names:
        raise UnknownNameError("tunable parameter", parameter_name, tunable_names, where=f"block '{block}'")
    return name


def _port(form: FlatForm, name: str, kind: str) -> PortRef:
    if name in form.aliases:
        return form.aliases[name]
    whole = name in form.diagram.blocks or "/" not in name
    block_name, _, port = (name, "", "") if whole else name.rpartition("/")
    block = form.diagram.block(block_name)
    outputs = [entry.name for entry in block.output_ports()]
    if port:
        port_names = [*outputs, *(entry.name for entry in block.input_ports())]
        if port not in port_names:
            raise UnknownNameError("port", port, port_names, where=f"block '{block_name}'")
        return PortRef(block_name, port)
    if len(outputs) != 1:
        raise InputError(
            f"the {kind} '{name}' is a block with {counted(len(outputs), 'output')}",
            allowed=", ".join(
                f"{name}/{entry.name}" for entry in (*block.output_ports(), *block.input_ports())
            ),
            fix="name the port",
            where="analysis points",
        )
    return PortRef(block_name, outputs[0])


def _is_output(diagram: Diagram, ref: PortRef) -> bool:
    return any(port.name == ref.port for port in diagram.blocks[ref.block].output_ports())


def _point(shape: Shape, opened: bool) -> Block:
    zeros = np.zeros(shape)
    return LoopOpening(level=zeros, offset=zeros) if opened else InputPoint(offset=zeros)


def _new_name(ref: PortRef, blocks: Mapping[str, Block]) -> str:
    name = f"{ref.block}:{ref.port}"
    while name in blocks:
        name += "'"
    return name


def _rewired(wires: Sequence[Connection], ref: PortRef, point: str, source: PortRef) -> list[Connection]:
    """The connections, with the point inserted where they start or end at a port."""
    point_input, point_output = PortRef(point, "u"), PortRef(point, "y")
    if ref == source:
        changed = [
            dataclasses.replace(wire, source=point_output) if wire.source == ref else wire for wire in wires
        ]
        return [*changed, Connection(source, point_input)]
    before = next(wire for wire in wires if wire.target == ref)
    others = [wire for wire in wires if wire.target != ref]
    return [*others, Connection(before.source, point_input), Connection(point_output, ref)]
