"""Blocks that combine and split signals."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, vertcat

from armblocks.blocks.elementwise import common_unit, numbered_ports
from armblocks.blocks.example_signals import CIRCLING
from armblocks.diagram import Block, Port, Shapes, Signals, WorkedExample, parameter
from armblocks.diagram.signs import Outline
from armblocks.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Mux(Block):
    """Concatenation of scalars and vectors: y = [u1; u2; …]."""

    title: ClassVar[str] = "Mux"
    outline: ClassVar[Outline] = Outline.BAR
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Two scalars become one vector.",
        shown=("y",),
    )

    inputs: int = parameter(2, minimum=1, doc="number of inputs")

    def input_ports(self) -> tuple[Port, ...]:
        return numbered_ports("u", self.inputs, "part")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "all inputs in one vector"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        for name, shape in inputs.items():
            if len(shape) > 1:
                raise InputError(
                    f"'{name}' has shape {shape}",
                    allowed="scalars and vectors",
                    fix="put a Reshape before it, or use a MatrixConcatenate",
                )
        return {"y": (sum(math.prod(shape) for shape in inputs.values()),)}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": common_unit(inputs)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": vertcat(*u.values())}


@dataclass(frozen=True, kw_only=True)
class Demux(Block):
    """A vector split into equal parts: [y1; y2; …] = u; parts of one element are scalars."""

    title: ClassVar[str] = "Demux"
    outline: ClassVar[Outline] = Outline.BAR
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The elements of a vector as scalars.",
        inputs={"u": CIRCLING},
        shown=("y1", "y2"),
    )

    parts: int = parameter(2, minimum=1, doc="number of outputs")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the vector"),)

    def output_ports(self) -> tuple[Port, ...]:
        return numbered_ports("y", self.parts, "part")

    def output_shapes(self, inputs: Shapes) -> Shapes:
        size = math.prod(inputs["u"])
        if len(inputs["u"]) > 1 or size % self.parts:
            raise InputError(
                f"'u' has shape {inputs['u']}",
                allowed=f"a vector whose length {self.parts} divides",
                fix="change the number of outputs",
            )
        part = size // self.parts
        return {port.name: (part,) if part > 1 else () for port in self.output_ports()}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {port.name: inputs["u"] for port in self.output_ports()}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        part = u["u"].numel() // self.parts
        return {port.name: u["u"][k * part : (k + 1) * part] for k, port in enumerate(self.output_ports())}
