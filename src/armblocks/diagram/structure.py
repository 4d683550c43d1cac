"""Subsystems: a diagram inside a block, and its In and Out blocks.

A virtual block represents connections only. It has no equations, and :mod:`armblocks.diagram.hierarchy`
replaces it by direct connections before a diagram is traced.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar, Self

import numpy as np
from casadi import SX
from numpy.typing import ArrayLike

from armblocks.diagram.block import Block, Shapes, Signals
from armblocks.diagram.connection_port import ConnectionPort
from armblocks.diagram.diagram import Connection, Diagram
from armblocks.diagram.frames import FramePort
from armblocks.diagram.parameter import Parameter, ParameterKind, Value, parameter
from armblocks.diagram.port import Port, PortRef
from armblocks.diagram.signs import Outline
from armblocks.diagram.worked_example import WorkedExample
from armblocks.equations import Shape
from armblocks.errors import DiagramError, InputError

MAX_BLOCKS = 100_000
"""Maximum number of blocks of a diagram, including subsystems; limits the memory use."""


ANY = -1.0
"""The dimensions of a port that accepts any shape."""


def declared_shape(block: Inport | Outport) -> Shape | None:
    """The declared shape of an In or Out block; ``None`` for any shape."""
    dimensions = np.atleast_1d(np.asarray(block.dimensions, dtype=np.float64)).tolist()
    if dimensions == [ANY]:
        return None
    return () if dimensions == [1.0] else tuple(int(size) for size in dimensions)


def _check_dimensions(block: Inport | Outport) -> None:
    dimensions = np.atleast_1d(np.asarray(block.dimensions, dtype=np.float64))
    whole = bool(np.all((dimensions >= 1.0) & (dimensions == np.floor(dimensions))))
    if dimensions.tolist() != [ANY] and not (whole and dimensions.size <= 2):
        raise InputError(
            f"the dimensions are {dimensions.tolist()}",
            where=f"{block.type_name()}.dimensions",
            allowed="-1 (any), 1 (a scalar), n (a vector), or (m, n) (a matrix)",
            fix="give integers, at least 1",
        )


_DIMENSIONS = "shape of the signal: 1 a scalar, n a vector, (m, n) a matrix; -1 any shape"


@dataclass(frozen=True, kw_only=True)
class Inport(Block):
    """An input of a subsystem: y = the signal at the subsystem's input port of this name.

    At the top level of the hierarchy, where nothing is connected, y = ``value``.
    """

    title: ClassVar[str] = "In"
    outline: ClassVar[Outline] = Outline.OVAL
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="At the top level of a diagram, an In block outputs its parameter value, here 1.",
        parameters={"value": 1.0},
    )

    port: int = parameter(
        0, minimum=0, doc="port number among the inputs, from 1; 0 takes the next free number"
    )
    dimensions: ArrayLike = parameter(
        ANY, kind=ParameterKind.ARRAY, dimensions=(0, 1), tunable=False, doc=_DIMENSIONS
    )
    unit: str = parameter("", doc="SI unit of the signal, for display")
    value: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="output at the top level of the hierarchy"
    )

    def check(self) -> None:
        _check_dimensions(self)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the input of the subsystem", self.unit, declared_shape(self)),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        declared = declared_shape(self)
        return {"y": np.shape(self.value) if declared is None else declared}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        value, declared = p["value"], declared_shape(self)
        if declared is not None and value.numel() not in (1, math.prod(declared)):
            raise InputError(
                f"the value has {value.numel()} entries",
                where="Inport.value",
                allowed=f"a scalar, or the dimensions {declared}",
                fix="change value or dimensions",
            )
        return {"y": value}


@dataclass(frozen=True, kw_only=True)
class Outport(Block):
    """An output of a subsystem: the output port of this name = u.

    In a conditional subsystem, parameters determine the output while the subsystem is inactive: held, or
    ``initial``. Before the subsystem has been active, the output is ``initial``.
    """

    title: ClassVar[str] = "Out"
    outline: ClassVar[Outline] = Outline.OVAL
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine at an Out block. In a subsystem, it would be the signal at the output port."
    )

    port: int = parameter(
        0, minimum=0, doc="port number among the outputs, from 1; 0 takes the next free number"
    )
    dimensions: ArrayLike = parameter(
        ANY, kind=ParameterKind.ARRAY, dimensions=(0, 1), tunable=False, doc=_DIMENSIONS
    )
    unit: str = parameter("", doc="SI unit of the signal, for display")

    when_off: str = parameter(
        "held", choices=("held", "reset"), doc="output of a conditional subsystem while it is inactive"
    )
    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="output of a conditional subsystem before it has been active"
    )

    def check(self) -> None:
        _check_dimensions(self)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the output of the subsystem", self.unit, declared_shape(self)),)


PASS_THROUGH = Diagram(
    name="Subsystem",
    blocks={"In1": Inport(port=1), "Out1": Outport(port=1)},
    connections=(Connection(PortRef("In1", "y"), PortRef("Out1", "u")),),
)
"""The content of a new subsystem: the output equals the input."""


@dataclass(frozen=True, kw_only=True)
class DiagramBlock(Block):
    """Base class of blocks with an inner diagram.

    Its In and Out blocks define the ports, and its mask declares parameters. Subclasses define the
    control inputs.
    """

    virtual: ClassVar[bool] = True
    card_size: ClassVar[tuple[float, float]] = (104.0, 64.0)

    diagram: Diagram = parameter(
        PASS_THROUGH, kind=ParameterKind.DIAGRAM, of_type=Diagram, doc="the inner diagram"
    )

    def control_ports(self) -> tuple[Port, ...]:
        """Inputs in addition to the inputs of the inner diagram."""
        return ()

    def check(self) -> None:
        port_blocks(self.diagram, Inport)
        port_blocks(self.diagram, Outport)
        for port in self.control_ports():
            if port.name in (*self.diagram.blocks, *self.diagram.signal_names.values()):
                raise DiagramError(
                    f"an inner block or signal is named '{port.name}', like an input of the subsystem",
                    where=f"diagram '{self.diagram.name}'",
                    allowed="other names",
                    fix="rename it",
                )
        used_names = {rule.name for rule in self.parameters()}
        duplicate = next((rule.name for rule in self.diagram.mask if rule.name in used_names), None)
        if duplicate is not None:
            raise InputError(
                f"the mask parameter '{duplicate}' is also a parameter of every {self.title}",
                where=f"diagram '{self.diagram.name}'",
                allowed=f"other names than {', '.join(sorted(used_names))}",
                fix="choose another name",
            )

    def own_parameters(self) -> tuple[Parameter, ...]:
        return (*self.parameters(), *self.diagram.mask)

    def parameter_value(self, name: str) -> Value:
        values = self.diagram.mask_values
        return values[name] if name in values else getattr(self, name)

    def replaced(self, values: Mapping[str, Any]) -> Self:
        masked = {rule.name for rule in self.diagram.mask}
        inside = {name: value for name, value in values.items() if name in masked}
        plain = {name: value for name, value in values.items() if name not in masked}
        if inside:
            plain["diagram"] = plain.get("diagram", self.diagram).with_mask_values(inside)
        return dataclasses.replace(self, **plain)

    def input_ports(self) -> tuple[Port, ...]:
        return (*inner_inputs(self.diagram), *self.control_ports())

    def output_ports(self) -> tuple[Port, ...]:
        return inner_outputs(self.diagram)

    def frame_ports(self) -> tuple[FramePort, ...]:
        return inner_frames(self.diagram)


@dataclass(frozen=True, kw_only=True)
class Subsystem(DiagramBlock):
    """A diagram inside a block. Its ports are In and Out blocks; its signals have paths name/block/port."""

    title: ClassVar[str] = "Subsystem"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The default content of a subsystem connects its input directly to its output."
    )


def port_blocks(
    diagram: Diagram, kind: type[Inport] | type[Outport]
) -> tuple[tuple[str, Inport | Outport], ...]:
    """The In or Out blocks of a diagram with their names, in the order of their numbers.

    Raises ``DiagramError`` for duplicate numbers.
    """
    ports = [(name, block) for name, block in diagram.blocks.items() if isinstance(block, kind)]
    ports.sort(key=lambda entry: (entry[1].port or math.inf, entry[0]))
    for (one, first), (two, second) in pairwise(ports):
        if first.port and first.port == second.port:
            raise DiagramError(
                f"'{one}' and '{two}' are both {kind.title} number {first.port}",
                where=f"diagram '{diagram.name}'",
                allowed="unique port numbers",
                fix="give one of them another port number",
            )
    return tuple(ports)


def block_count(diagram: Diagram) -> int:
    """The number of blocks of a diagram, including its subsystems."""
    return diagram.cached(
        "block count",
        lambda: sum(
            1 + (block_count(block.diagram) if isinstance(block, DiagramBlock) else 0)
            for block in diagram.blocks.values()
        ),
    )


def check_block_count(count: int, where: str) -> None:
    """Raise ``DiagramError`` for too many blocks, including subsystems."""
    if count > MAX_BLOCKS:
        raise DiagramError(
            f"the diagram has {count} blocks, including subsystems",
            where=where,
            allowed=f"at most {MAX_BLOCKS}",
            fix="use vectors: one Gain of 1000 elements replaces 1000 blocks",
        )


def inner_inputs(diagram: Diagram) -> tuple[Port, ...]:
    """The input ports of a subsystem, from its In blocks."""
    return diagram.cached(
        "inner inputs",
        lambda: tuple(
            Port(name, f"In block '{name}'", block.unit, declared_shape(block))
            for name, block in port_blocks(diagram, Inport)
        ),
    )


def inner_outputs(diagram: Diagram) -> tuple[Port, ...]:
    """The output ports of a subsystem, from its Out blocks."""
    return diagram.cached(
        "inner outputs",
        lambda: tuple(
            Port(name, f"Out block '{name}'", block.unit, declared_shape(block))
            for name, block in port_blocks(diagram, Outport)
        ),
    )


def inner_frames(diagram: Diagram) -> tuple[FramePort, ...]:
    """The frame ports of a subsystem, from its Connection Port blocks."""
    return diagram.cached(
        "inner frames",
        lambda: tuple(
            FramePort(name, f"Connection Port block '{name}'", "left" if block.side == "left" else "right")
            for name, block in diagram.blocks.items()
            if isinstance(block, ConnectionPort)
        ),
    )
