"""Blocks that select one of their inputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce
from typing import ClassVar

from casadi import SX, if_else

from armblocks.blocks.elementwise import common_unit, numbered_ports
from armblocks.blocks.routing.selection import COUNTING
from armblocks.blocks.switching import (
    THRESHOLD_OFFSET,
    located,
    zero_crossing_parameter,
)
from armblocks.diagram import (
    Block,
    Condition,
    Guard,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    broadcast,
    driver,
    parameter,
)


@dataclass(frozen=True, kw_only=True)
class Switch(Block):
    """One of two signals: y = u1 where the control input meets the criterion, else u3.

    The criterion is u2 >= threshold or u2 > threshold.
    """

    following_modes: ClassVar[bool] = True
    title: ClassVar[str] = "Switch"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A fast sine while the control input is at least 0.5, else a constant.",
        parameters={"threshold": 0.5},
        inputs={
            "u1": driver("SineWave", frequency=5.0),
            "u2": driver("PulseGenerator", period=5.0),
            "u3": driver("Constant", value=-0.5),
        },
    )

    criterion: str = parameter(
        ">=", choices=(">=", ">"), doc="comparison of the control input with the threshold"
    )
    threshold: float = parameter(0.0, doc="threshold of the control input")

    def input_ports(self) -> tuple[Port, ...]:
        return (
            Port("u1", "output where the criterion is met"),
            Port("u2", "the control input"),
            Port("u3", "output where the criterion is not met"),
        )

    def bus_inputs(self) -> tuple[str, ...]:
        return ("u1", "u3")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the selected input"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u1"] if inputs["u1"] == inputs["u3"] else ""}

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("mode", inputs["u2"], "1 where the criterion is met, else 0"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return (Guard("control", inputs["u2"], "u2 - threshold"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": if_else(x["mode"] > 0.0, u["u1"], u["u3"])}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {
            "control": u["u2"]
            - p["threshold"]
            + (THRESHOLD_OFFSET if self.criterion == ">=" else -THRESHOLD_OFFSET)
        }

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"mode": self.guard_values(t, x, u, p)["control"] > 0.0}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"mode": if_else(e["control"] == 0.0, x["mode"], e["control"] > 0.0)}


@dataclass(frozen=True, kw_only=True)
class MultiportSwitch(Block):
    """The input at a variable index: y = u1 for index 1, u2 for index 2, …

    The index is rounded down to an integer and limited to the range of the inputs. All inputs have the same
    shape; scalars are broadcast.
    """

    title: ClassVar[str] = "Multiport Switch"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A counter selects the inputs, one after another.",
        parameters={"counting": "zero-based"},
        inputs={
            "index": driver("CounterLimited", upper=2),
            "u1": driver("SineWave"),
            "u2": driver("Constant", value=2.0),
            "u3": driver("Ramp", slope=-0.2),
        },
    )

    inputs: int = parameter(3, minimum=1, doc="number of inputs to select from")
    counting: str = parameter("one-based", choices=COUNTING, doc="whether the first index is 1 or 0")
    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("index", "index of the input", shape=()), *numbered_ports("u", self.inputs, "input"))

    def bus_inputs(self) -> tuple[str, ...]:
        return tuple(f"u{k}" for k in range(1, self.inputs + 1))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the selected input"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast({name: shape for name, shape in inputs.items() if name != "index"})}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": common_unit({name: unit for name, unit in inputs.items() if name != "index"})}

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        doc = "1 where the index is at least the index of input {}"
        return located(self, *(Condition(f"from{k}", (), doc.format(k)) for k in range(2, self.inputs + 1)))

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        shift = 1.0 if self.counting == "zero-based" else 0.0
        return {f"from{k}": u["index"] + shift - float(k) for k in range(2, self.inputs + 1)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        _, *candidates = u.values()
        largest = reduce(lambda left, right: left if left.numel() > 1 else right, candidates)
        broadcast_values = [value * SX.ones(*largest.shape) for value in candidates]
        chosen = broadcast_values[0]
        for k, value in enumerate(broadcast_values[1:], 2):
            chosen = if_else(x[f"from{k}"], value, chosen)
        return {"y": chosen}


@dataclass(frozen=True, kw_only=True)
class ManualSwitch(Block):
    """A manual switch: y = u1 for position 1 and u2 for position 2.

    The position is tunable, so that it can change without compiling again; values of at least 1.5 select u2.
    """

    title: ClassVar[str] = "Manual Switch"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The first of two signals passes. The position is a parameter that can change during a run.",
    )

    position: float = parameter(1.0, minimum=1.0, maximum=2.0, doc="1 or 2")

    def input_ports(self) -> tuple[Port, ...]:
        return numbered_ports("u", 2, "input")

    def bus_inputs(self) -> tuple[str, ...]:
        return ("u1", "u2")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the selected input"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": common_unit(inputs)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        first, second = p["position"] < 1.5, p["position"] >= 1.5
        return {"y": if_else(first, u["u1"], 0.0) + if_else(second, u["u2"], 0.0)}
