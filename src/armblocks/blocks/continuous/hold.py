"""The first-order hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, fmax, if_else
from numpy.typing import ArrayLike

from armblocks.blocks.periodic import (
    COUNT,
    INSTANT,
    ODD,
    RESAMPLE,
    UP_TO_DATE,
    WHEN,
    sample_time,
    sampled,
    sampling_contradictions,
    sampling_guards,
)
from armblocks.diagram import (
    Block,
    Guard,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    driver,
    parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, graph


@dataclass(frozen=True, kw_only=True)
class FirstOrderHold(Block):
    """A first-order hold: y(t) = u(t_k) + (u(t_k) - u(t_(k-1))) (t - t_k) / T until t_(k+1).

    - ``extrapolation``, as in Simulink's First Order Hold, continues the straight line through the last two
      samples, as above. It is exact for a linear input. At each sample time y may jump to the new sample.
    - ``interpolation`` connects the samples without a jump, one period late: y(t) = u(t_(k-1)) + (u(t_k) -
      u(t_(k-1))) (t - t_k) / T.
    - ``initial`` is the sample before the first sample, and y before ``offset``.

    A sampled block that ticks at t_k reads the left limit of y. The block takes no samples while its
    subsystem is disabled; y is then constant until the next sample time.
    """

    title: ClassVar[str] = "First Order Hold"
    sign: ClassVar[FaceSign] = graph((0, 0.1), (0.33, 0.5), (0.33, 0.35), (0.67, 0.95), (0.67, 0.8), (1, 1))
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("initial",)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A sine, sampled every second; straight lines connect the samples, one second late.",
        parameters={"method": "interpolation", "period": 1.0},
        inputs={"u": driver("SineWave")},
    )

    method: str = parameter(
        "extrapolation", choices=("extrapolation", "interpolation"), doc="extrapolate or interpolate"
    )
    period: float = parameter(0.1, above=0.0, doc="sampling period T", unit="s")
    offset: float = parameter(0.0, minimum=0.0, doc="time of the first sample", unit="s")
    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="value of the sample before the first sample"
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "sampled signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the piecewise linear signal"),)

    def assumed_output_shapes(self) -> Shapes:
        return {"y": shape_of(self.initial)}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        shape = self.output_shapes(inputs)["y"]
        samples = (
            State("last", shape, "the last sample"),
            State("before", shape, "the last sample but one"),
        )
        return (COUNT, WHEN, ODD, *samples)

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (UP_TO_DATE,)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return INSTANT, RESAMPLE

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        start = x["last"] if self.method == "extrapolation" else x["before"]
        elapsed_periods = fmax(t - sample_time(p, x["count"] - 1.0), 0.0) / p["period"]
        line = start + (x["last"] - x["before"]) * elapsed_periods
        return {"y": if_else(x["count"] > 0.0, line, x["last"])}

    def initial_states(self, p: Signals) -> Signals:
        return {
            **dict.fromkeys(("count", "when", "odd"), SX(0.0)),
            "last": p["initial"],
            "before": p["initial"],
        }

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return sampling_guards(t, x, p, u["u"], x["last"])

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"up_to_date": SX(1.0)}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return sampling_contradictions(t, x, p, u["u"], x["last"])

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        sampling = sampled(t, x, p, e)
        return {
            **sampling.states,
            "last": if_else(sampling.samples, u["u"], x["last"]),
            "before": if_else(sampling.begins, x["last"], x["before"]),
        }
