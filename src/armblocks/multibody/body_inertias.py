"""The inertia of a drawn body in a flat diagram, as a function of its tunable parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, cast

from casadi import SX, vertcat

from armblocks.diagram import Block, Parameter, ParameterKind, Port, Signals, parameter
from armblocks.diagram.parameter import Value
from armblocks.multibody.joint_states import structure_of
from armblocks.multibody.parts import InertiaLaw

INERTIA_SIZE = 10
"""Numbers of an inertia: mass, first moment x y z, second moment xx yy zz xy yz xz."""


@dataclass(frozen=True, kw_only=True)
class BodyInertias(Block):
    """The inertia of a drawn body in its frame R. It has the path and the parameters of the drawn block."""

    title: ClassVar[str] = "Body"

    body: Block = parameter(kind=ParameterKind.DIAGRAM, of_type=Block, doc="the drawn block")

    def inputs_of_the_run(self) -> tuple[Parameter, ...]:
        """The tunable parameters of the drawn block."""
        return self.body.inputs_of_the_run()

    def parameter_value(self, name: str) -> Value:
        if name == "body":  # tunable parameters do not change the equations
            return structure_of(self.body)
        return self.body.parameter_value(name)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("inertia", "mass, first and second moments", "", (INERTIA_SIZE,), internal=True),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        mass, first, second = cast("InertiaLaw", cast("Any", self.body)).inertia(p)
        return {"inertia": SX(vertcat(mass, *first, *second))}
