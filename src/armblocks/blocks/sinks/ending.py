"""Blocks that monitor a signal: one ends the run, the other checks an assertion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, if_else

from armblocks.diagram import Block, Guard, Port, Shapes, Signals, WorkedExample, driver, parameter


@dataclass(frozen=True, kw_only=True)
class StopSimulation(Block):
    """Ends the run at the exact time at which its input becomes nonzero. The run counts as complete."""

    title: ClassVar[str] = "Stop Simulation"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The run ends when the ramp exceeds 5.",
        inputs={
            "u": driver("CompareToConstant", relation=">", constant=5.0).by(u=driver("Ramp").named("ramp"))
        },
        shown=("ramp/y", "u"),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "ends the run when it is not 0"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return (Guard("stop", inputs["u"], "positive where u is not 0", 1, "stop"),)

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"stop": if_else(u["u"] == 0.0, -1.0, 1.0)}


@dataclass(frozen=True, kw_only=True)
class Assertion(Block):
    """Asserts that its input is not 0: if it becomes 0, the run fails, or its message has a warning."""

    title: ClassVar[str] = "Assertion"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The sine exceeds 0.9, so the assertion fails. The run continues, and its message reports the "
        "failure.",
        parameters={"action": "warn"},
        inputs={"u": driver("CompareToConstant", relation="<", constant=0.9).by(u=driver("SineWave"))},
        shown=("u",),
    )

    action: str = parameter("fail", choices=("fail", "warn"), doc="action when the input becomes 0")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "signal that must not be 0"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return (Guard("broken", inputs["u"], "positive where u is 0", 1, self.action),)

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"broken": if_else(u["u"] == 0.0, 1.0, -1.0)}
