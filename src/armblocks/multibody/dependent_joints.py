"""A joint whose motion a coupling determines: it has no states, and passes its forces to the mechanism."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

from casadi import SX

from armblocks.diagram import Port, Shapes, Signals, State
from armblocks.multibody.joint_states import JointStates

INPUTS_OF_STATES = ("q rates", "qd rates")
OUTPUTS_OF_STATES = ("state q", "state qd")


@dataclass(frozen=True, kw_only=True)
class DependentJointStates(JointStates):
    """A joint without states: the mechanism computes its motion from the joints on which it depends."""

    title: ClassVar[str] = "Dependent joint"

    def input_ports(self) -> tuple[Port, ...]:
        return tuple(port for port in super().input_ports() if port.name not in INPUTS_OF_STATES)

    def output_ports(self) -> tuple[Port, ...]:
        return self._own_outputs

    @cached_property
    def _own_outputs(self) -> tuple[Port, ...]:
        return tuple(port for port in super().output_ports() if port.name not in OUTPUTS_OF_STATES)

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return ()

    def initial_states(self, p: Signals) -> Signals:
        return {}

    def state_of(self, x: Signals, u: Signals) -> tuple[SX, SX]:
        return u["mechanism q"], u["mechanism qd"]

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {}
