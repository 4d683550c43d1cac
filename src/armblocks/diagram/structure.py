"""Blocks that give a diagram its structure: a diagram inside a block, and its ends.

A virtual block stands for wires only. It has no equations, and :mod:`armblocks.diagram.hierarchy` replaces it
by the wires that it means before a diagram is traced.
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
from armblocks.diagram.diagram import Connection, Diagram
from armblocks.diagram.parameter import Parameter, ParameterKind, Value, parameter
from armblocks.diagram.port import Port, PortRef
from armblocks.diagram.signs import Outline
from armblocks.equations import Shape
from armblocks.errors import DiagramError, InputError

MOST_BLOCKS = 100_000
"""Blocks of a diagram, those inside subsystems included: more than is drawn, less than fills a memory."""


ANY = -1.0
"""The dimensions of a port that takes whatever is connected."""


def stated_shape(block: Inport | Outport) -> Shape | None:
    """The shape that an end of a diagram asks for; ``None`` where it takes any."""
    given = np.atleast_1d(np.asarray(block.dimensions, dtype=np.float64)).tolist()
    if given == [ANY]:
        return None
    return () if given == [1.0] else tuple(int(size) for size in given)


def _check_dimensions(block: Inport | Outport) -> None:
    given = np.atleast_1d(np.asarray(block.dimensions, dtype=np.float64))
    whole = bool(np.all((given >= 1.0) & (given == np.floor(given))))
    if given.tolist() != [ANY] and not (whole and given.size <= 2):
        raise InputError(
            f"the dimensions are {given.tolist()}",
            where=f"{block.type_name()}.dimensions",
            allowed="-1 (any), 1 (a scalar), n (a vector), or (m, n) (a matrix)",
            fix="give whole numbers from 1",
        )


_DIMENSIONS = "what passes: 1 a scalar, n a vector, (m, n) a matrix; -1 takes what is connected"


@dataclass(frozen=True, kw_only=True)
class Inport(Block):
    """What enters a subsystem: y = the signal at the subsystem's input of this name.

    At the top of the hierarchy nothing is connected from outside, and it gives ``value``.
    """

    title: ClassVar[str] = "In"
    outline: ClassVar[Outline] = Outline.OVAL

    port: int = parameter(0, minimum=0, doc="its place among the inputs, from 1; 0 takes the next free one")
    dimensions: ArrayLike = parameter(
        ANY, kind=ParameterKind.ARRAY, dimensions=(0, 1), tunable=False, doc=_DIMENSIONS
    )
    unit: str = parameter("", doc="SI unit of the signal, for people")
    value: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="what it gives where nothing is around the diagram"
    )

    def check(self) -> None:
        _check_dimensions(self)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "what enters", self.unit, stated_shape(self)),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        stated = stated_shape(self)
        return {"y": np.shape(self.value) if stated is None else stated}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        value, stated = p["value"], stated_shape(self)
        if stated is not None and value.numel() not in (1, math.prod(stated)):
            raise InputError(
                f"the value has {value.numel()} entries",
                where="Inport.value",
                allowed=f"one, or the dimensions {stated}",
                fix="change value or dimensions",
            )
        return {"y": value}


@dataclass(frozen=True, kw_only=True)
class Outport(Block):
    """What leaves a subsystem: the subsystem's output of this name = u.

    Of a subsystem that works only at times, it says what the output is while it does not: held as it was, or
    ``initial``, which it also is before the subsystem has worked.
    """

    title: ClassVar[str] = "Out"
    outline: ClassVar[Outline] = Outline.OVAL

    port: int = parameter(0, minimum=0, doc="its place among the outputs, from 1; 0 takes the next free one")
    dimensions: ArrayLike = parameter(
        ANY, kind=ParameterKind.ARRAY, dimensions=(0, 1), tunable=False, doc=_DIMENSIONS
    )
    unit: str = parameter("", doc="SI unit of the signal, for people")

    when_off: str = parameter(
        "held", choices=("held", "reset"), doc="what a conditional subsystem gives while it does not work"
    )
    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="the output of a conditional subsystem before it works"
    )

    def check(self) -> None:
        _check_dimensions(self)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "what leaves", self.unit, stated_shape(self)),)


PASS_THROUGH = Diagram(
    name="Subsystem",
    blocks={"In1": Inport(port=1), "Out1": Outport(port=1)},
    connections=(Connection(PortRef("In1", "y"), PortRef("Out1", "u")),),
)
"""What a new subsystem holds: its input is its output."""


@dataclass(frozen=True, kw_only=True)
class DiagramBlock(Block):
    """What all blocks with a diagram inside have in common: its ends are ports, its mask is their parameters.

    Subclasses say which inputs they have besides, to control when the diagram works.
    """

    virtual: ClassVar[bool] = True
    card_size: ClassVar[tuple[float, float]] = (104.0, 64.0)

    diagram: Diagram = parameter(
        PASS_THROUGH, kind=ParameterKind.DIAGRAM, of_type=Diagram, doc="the diagram inside"
    )

    def control_ports(self) -> tuple[Port, ...]:
        """Inputs besides those of the diagram inside."""
        return ()

    def check(self) -> None:
        ends(self.diagram, Inport)
        ends(self.diagram, Outport)
        for port in self.control_ports():
            if port.name in self.diagram.blocks:
                raise DiagramError(
                    f"a block inside is named '{port.name}', as an input of the subsystem is",
                    where=f"diagram '{self.diagram.name}'",
                    allowed="other names",
                    fix="rename the block",
                )
        taken = {rule.name for rule in self.parameters()}
        twice = next((rule.name for rule in self.diagram.mask if rule.name in taken), None)
        if twice is not None:
            raise InputError(
                f"the mask has a parameter '{twice}', and so has every {self.title}",
                where=f"diagram '{self.diagram.name}'",
                allowed=f"other names than {', '.join(sorted(taken))}",
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


@dataclass(frozen=True, kw_only=True)
class Subsystem(DiagramBlock):
    """A diagram inside a block, whose In and Out blocks are the ports; signals are name/block/port."""

    title: ClassVar[str] = "Subsystem"


def ends(diagram: Diagram, kind: type[Inport] | type[Outport]) -> tuple[tuple[str, Inport | Outport], ...]:
    """The In or Out blocks of a diagram with their names, in the order of their numbers.

    Raises ``DiagramError`` for a number given twice.
    """
    found = [(name, block) for name, block in diagram.blocks.items() if isinstance(block, kind)]
    found.sort(key=lambda entry: (entry[1].port or math.inf, entry[0]))
    for (one, first), (two, second) in pairwise(found):
        if first.port and first.port == second.port:
            raise DiagramError(
                f"'{one}' and '{two}' are both {kind.title} number {first.port}",
                where=f"diagram '{diagram.name}'",
                allowed="every number once",
                fix="give one of them another port number",
            )
    return tuple(found)


def block_count(diagram: Diagram) -> int:
    """How many blocks a diagram has, those inside its subsystems included."""
    return diagram.keep(
        "block count",
        lambda: sum(
            1 + (block_count(block.diagram) if isinstance(block, DiagramBlock) else 0)
            for block in diagram.blocks.values()
        ),
    )


def check_block_count(count: int, where: str) -> None:
    """Raise ``DiagramError`` for more blocks, those inside subsystems included, than a diagram may have."""
    if count > MOST_BLOCKS:
        raise DiagramError(
            f"the diagram has {count} blocks, those inside subsystems included",
            where=where,
            allowed=f"at most {MOST_BLOCKS}",
            fix="give blocks vectors: one Gain of 1000 elements does what 1000 blocks do",
        )


def inner_inputs(diagram: Diagram) -> tuple[Port, ...]:
    """The ports that the In blocks of a diagram are from outside."""
    return diagram.keep(
        "inner inputs",
        lambda: tuple(
            Port(name, f"In block '{name}'", block.unit, stated_shape(block))
            for name, block in ends(diagram, Inport)
        ),
    )


def inner_outputs(diagram: Diagram) -> tuple[Port, ...]:
    """The ports that the Out blocks of a diagram are from outside."""
    return diagram.keep(
        "inner outputs",
        lambda: tuple(
            Port(name, f"Out block '{name}'", block.unit, stated_shape(block))
            for name, block in ends(diagram, Outport)
        ),
    )
