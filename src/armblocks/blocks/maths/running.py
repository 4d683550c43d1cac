"""The running minimum or maximum."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, fmax, fmin, if_else
from numpy.typing import ArrayLike

from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    broadcast,
    driver,
    parameter,
    sample_time_parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, Words


@dataclass(frozen=True, kw_only=True)
class MinMaxRunningResettable(Block):
    """The running minimum or maximum of the input: y(k) = min(u(k), y(k-1)) or max(u(k), y(k-1)).

    At ticks at which ``reset`` is not 0, y is ``initial``.
    """

    title: ClassVar[str] = "MinMax Running Resettable"
    sampled: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The running maximum of a sine with growing amplitude.",
        parameters={"function": "max", "sample_time": 0.1},
        inputs={
            "u": driver("Product").by(u1=driver("SineWave", frequency=2.0), u2=driver("Ramp", slope=0.1)),
            "reset": driver("Ground").named("zero"),
        },
    )

    function: str = parameter("min", choices=("min", "max"), doc="minimum or maximum")
    initial: ArrayLike = parameter(0.0, kind=ParameterKind.ARRAY, doc="value at the start and after a reset")
    sample_time: ArrayLike = sample_time_parameter()

    def face_sign(self) -> FaceSign:
        return Words(f"{self.function}(u, y)", italic=True)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the signal"), Port("reset", "resets the output while it is not 0", shape=()))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the running minimum or maximum"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast({"u": inputs["u"], "initial": shape_of(self.initial)})}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("extreme", self.output_shapes(inputs)["y"], "the output at the previous tick"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        extreme = (fmin if self.function == "min" else fmax)(u["u"], x["extreme"])
        return {"y": if_else(u["reset"] != 0.0, p["initial"], extreme)}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"extreme": self.outputs(t, x, u, p)["y"]}

    def initial_states(self, p: Signals) -> Signals:
        return {"extreme": p["initial"]}
