"""A delay by a variable number of ticks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, floor, fmax, fmin, if_else, vertcat
from numpy.typing import ArrayLike

from armblocks.diagram import (
    Block,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    driver,
    parameter,
    sample_time_parameter,
)
from armblocks.diagram.signs import FaceSign, Words
from armblocks.errors import InputError


@dataclass(frozen=True, kw_only=True)
class VariableIntegerDelay(Block):
    """A delay by a variable number of ticks: y(k) = u(k - d(k)), and ``initial`` where k < d(k).

    The delay d is rounded down to an integer and limited to the range 0 to ``longest``.
    """

    title: ClassVar[str] = "Variable Integer Delay"
    sign: ClassVar[FaceSign] = Words("z⁻ᵈ")
    sampled: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine whose delay grows by a tick of 0.1 s each second.",
        parameters={"longest": 10, "sample_time": 0.1},
        inputs={"u": driver("SineWave"), "d": driver("Clock")},
    )

    longest: int = parameter(10, minimum=1, doc="the longest delay, in ticks")
    initial: float = parameter(0.0, doc="the input before the first tick, for each element")
    sample_time: ArrayLike = sample_time_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "signal to delay"), Port("d", "delay in ticks", shape=()))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the delayed signal"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        if len(inputs["u"]) > 1:
            raise InputError(
                f"'u' has shape {inputs['u']}",
                allowed="a scalar or a vector",
                fix="put a Reshape before the block",
            )
        return {"y": inputs["u"]}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        width = inputs["u"][0] if inputs["u"] else 1
        return (State("past", (self.longest, width), "the last inputs, newest first"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        ticks = fmin(fmax(floor(u["d"]), 0.0), float(self.longest))
        delayed = u["u"]
        for k in range(1, self.longest + 1):
            delayed = if_else(ticks == float(k), x["past"][k - 1, :].T, delayed)
        return {"y": delayed}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"past": vertcat(u["u"].T, x["past"][:-1, :])}

    def initial_states(self, p: Signals) -> Signals:
        return {"past": p["initial"]}
