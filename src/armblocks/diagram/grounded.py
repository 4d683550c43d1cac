"""Blocks that replace commented blocks in a flat diagram; they are not in the library and never in a file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

from casadi import SX

from armblocks.diagram.block import Block, Shapes, Signals
from armblocks.diagram.parameter import parameter
from armblocks.diagram.port import Port
from armblocks.equations import Shape


@dataclass(frozen=True, kw_only=True)
class Grounded(Block):
    """Zeros in place of the outputs of a block that is commented out."""

    title: ClassVar[str] = "Commented out"

    shapes: str = parameter("{}", doc="shapes of the outputs by port, as a JSON object")

    @classmethod
    def of(cls, shapes: Mapping[str, Shape]) -> Self:
        """Zeros of these shapes, by port."""
        return cls(shapes=json.dumps({port: list(shape) for port, shape in shapes.items()}))

    def output_ports(self) -> tuple[Port, ...]:
        shape_of_port: dict[str, list[int]] = json.loads(self.shapes)
        return tuple(Port(name, "zero", "", tuple(shape)) for name, shape in shape_of_port.items())

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {port.name: SX.zeros(*(port.shape or (1,))) for port in self.output_ports()}


@dataclass(frozen=True, kw_only=True)
class Bypass(Block):
    """The ports of a commented block whose outputs are signals of other blocks."""

    title: ClassVar[str] = "Commented"
    virtual: ClassVar[bool] = True

    inputs: str = parameter("[]", doc="names of the inputs, as a JSON array")
    passed: str = parameter("[]", doc="names of the outputs, as a JSON array")

    @classmethod
    def of(cls, inputs: Sequence[str], outputs: Sequence[str]) -> Self:
        """A bypass with these ports."""
        return cls(inputs=json.dumps(list(inputs)), passed=json.dumps(list(outputs)))

    def input_ports(self) -> tuple[Port, ...]:
        return tuple(Port(name, "the signal that is passed") for name in json.loads(self.inputs))

    def output_ports(self) -> tuple[Port, ...]:
        return tuple(Port(name, "the signal at the input") for name in json.loads(self.passed))

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {}
