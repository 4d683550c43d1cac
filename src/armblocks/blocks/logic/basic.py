"""Logic blocks: their outputs are 1 for true and 0 for false.

An input that is not zero counts as true. The times at which the result of a comparison or the truth of an
input changes are located exactly, as events.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import reduce
from itertools import product
from typing import ClassVar

import numpy as np
from casadi import SX, if_else, logic_and, logic_not, logic_or
from numpy.typing import ArrayLike

from armblocks.blocks.elementwise import numbered_ports
from armblocks.blocks.routing.selection import choose
from armblocks.blocks.switching import located, zero_crossing_parameter
from armblocks.diagram import (
    Block,
    Condition,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    WorkedExample,
    broadcast,
    driver,
    parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, Words, graph, value_text
from armblocks.equations import Shape
from armblocks.errors import InputError, counted

_MAX_CONDITIONS = 12
_RELATIONS = {"==": "=", "~=": "≠", "<": "<", "<=": "≤", ">": ">", ">=": "≥"}
"""Relations in MATLAB's spelling, each with its mathematical sign."""
_GATES: Mapping[str, tuple[Callable[[SX, SX], SX], bool]] = {
    "AND": (logic_and, False),
    "OR": (logic_or, False),
    "NAND": (logic_and, True),
    "NOR": (logic_or, True),
    "XOR": (lambda left, right: left != right, False),
    "NXOR": (lambda left, right: left != right, True),
}


@dataclass(frozen=True, kw_only=True)
class RelationalOperator(Block):
    """A comparison of two signals, element by element: y = 1 if u1 (relation) u2 is true, else 0."""

    title: ClassVar[str] = "Relational Operator"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The output is 1 while the sine is at most 0.5.",
        inputs={"u1": driver("SineWave"), "u2": driver("Constant", value=0.5)},
    )

    relation: str = parameter("<=", choices=tuple(_RELATIONS), doc="the relation")
    zero_crossing: bool = zero_crossing_parameter()

    def face_sign(self) -> FaceSign:
        return Words(_RELATIONS[self.relation])

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u1", "the left operand"), Port("u2", "the right operand"))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "1 for true, 0 for false"),)

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        return located(self, *_sides(self.relation, self.output_shapes(inputs)["y"]))

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return _side_values(self.relation, u["u1"] - u["u2"])

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": _related(self.relation, x)}


@dataclass(frozen=True, kw_only=True)
class LogicalOperator(Block):
    """A logic gate, element by element: y = u1 AND u2 AND …; NOT has one input.

    XOR is true if an odd number of inputs is true; NAND, NOR and NXOR are the negations of AND, OR and XOR.
    An input is true if it is not 0.
    """

    title: ClassVar[str] = "Logical Operator"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The output is 1 while both pulses are 1.",
        inputs={
            "u1": driver("PulseGenerator", period=4.0).named("slow"),
            "u2": driver("PulseGenerator", period=1.0).named("fast"),
        },
    )

    operator: str = parameter("AND", choices=(*_GATES, "NOT"), doc="the gate")
    inputs: int = parameter(2, minimum=1, doc="number of inputs; NOT always has one")
    zero_crossing: bool = zero_crossing_parameter()

    def face_sign(self) -> FaceSign:
        return Words(self.operator)

    def input_ports(self) -> tuple[Port, ...]:
        return numbered_ports("u", 1 if self.operator == "NOT" else self.inputs, "condition")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "1 for true, 0 for false"),)

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        return located(self, *_truth_conditions(inputs))

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return _truth_values(u)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        conditions = [_truth(x, name) for name in u]
        if self.operator == "NOT":
            return {"y": logic_not(conditions[0])}
        gate, opposite = _GATES[self.operator]
        result = reduce(gate, conditions)
        return {"y": logic_not(result) if opposite else result}


@dataclass(frozen=True, kw_only=True)
class CompareToConstant(Block):
    """A comparison with a constant, element by element: y = 1 if u (relation) constant is true, else 0."""

    title: ClassVar[str] = "Compare To Constant"
    broadcast_parameters: ClassVar[tuple[str, ...]] = ("constant",)
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The output is 1 while the sine is above 0.5.",
        parameters={"relation": ">", "constant": 0.5},
    )

    relation: str = parameter("<=", choices=tuple(_RELATIONS), doc="the relation")
    zero_crossing: bool = zero_crossing_parameter()
    constant: ArrayLike = parameter(3.0, kind=ParameterKind.ARRAY, doc="the right operand")

    def face_sign(self) -> FaceSign:
        return Words(f"{_RELATIONS[self.relation]} {value_text(self.constant)}")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the left operand"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "1 for true, 0 for false"),)

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        return located(self, *_sides(self.relation, self.output_shapes(inputs)["y"]))

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return _side_values(self.relation, u["u"] - p["constant"])

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": _related(self.relation, x)}


@dataclass(frozen=True, kw_only=True)
class CompareToZero(Block):
    """A comparison with zero, element by element: y = 1 if u (relation) 0 is true, else 0."""

    title: ClassVar[str] = "Compare To Zero"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The output is 1 while the sine is not above 0.",
    )

    relation: str = parameter("<=", choices=tuple(_RELATIONS), doc="the relation")
    zero_crossing: bool = zero_crossing_parameter()

    def face_sign(self) -> FaceSign:
        return Words(f"{_RELATIONS[self.relation]} 0")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the left operand"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "1 for true, 0 for false"),)

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        return located(self, *_sides(self.relation, self.output_shapes(inputs)["y"]))

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return _side_values(self.relation, u["u"])

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": _related(self.relation, x)}


@dataclass(frozen=True, kw_only=True)
class IntervalTest(Block):
    """A test of a signal against a constant interval: y = 1 if lower <= u <= upper, else 0.

    Each end belongs to the interval unless ``lower_closed`` or ``upper_closed`` is false.
    """

    title: ClassVar[str] = "Interval Test"
    sign: ClassVar[FaceSign] = graph((0, 0), (0.3, 0), (0.3, 1), (0.7, 1), (0.7, 0), (1, 0))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The output is 1 while the sine is between -0.5 and 0.5.",
    )

    lower: ArrayLike = parameter(-0.5, kind=ParameterKind.ARRAY, finite=False, doc="the lower end")
    upper: ArrayLike = parameter(0.5, kind=ParameterKind.ARRAY, finite=False, doc="the upper end")
    lower_closed: bool = parameter(True, doc="whether the lower end belongs to the interval")
    upper_closed: bool = parameter(True, doc="whether the upper end belongs to the interval")
    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the tested signal"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "1 for true, 0 for false"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast({**inputs, "lower": shape_of(self.lower), "upper": shape_of(self.upper)})}

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        shape = self.output_shapes(inputs)["y"]
        above = Condition("above", shape, "1 while u is above the lower end", closed=self.lower_closed)
        below = Condition("below", shape, "1 while u is below the upper end", closed=self.upper_closed)
        return located(self, above, below)

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"above": u["u"] - p["lower"], "below": p["upper"] - u["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": logic_and(x["above"], x["below"])}


@dataclass(frozen=True, kw_only=True)
class IntervalTestDynamic(Block):
    """A test of a signal against an interval with variable ends: y = 1 if lower <= u <= upper, else 0."""

    title: ClassVar[str] = "Interval Test Dynamic"
    sign: ClassVar[FaceSign] = graph((0, 0), (0.3, 0), (0.3, 1), (0.7, 1), (0.7, 0), (1, 0))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The output is 1 while the sine is between a constant lower and a rising upper limit.",
        inputs={
            "upper": driver("Ramp", slope=0.1),
            "u": driver("SineWave"),
            "lower": driver("Constant", value=-0.5),
        },
    )

    lower_closed: bool = parameter(True, doc="whether the lower end belongs to the interval")
    upper_closed: bool = parameter(True, doc="whether the upper end belongs to the interval")
    zero_crossing: bool = zero_crossing_parameter()

    def input_ports(self) -> tuple[Port, ...]:
        return (
            Port("upper", "the upper end"),
            Port("u", "the tested signal"),
            Port("lower", "the lower end"),
        )

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "1 for true, 0 for false"),)

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        shape = self.output_shapes(inputs)["y"]
        above = Condition("above", shape, "1 while u is above the lower end", closed=self.lower_closed)
        below = Condition("below", shape, "1 while u is below the upper end", closed=self.upper_closed)
        return located(self, above, below)

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"above": u["u"] - u["lower"], "below": u["upper"] - u["u"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": logic_and(x["above"], x["below"])}


@dataclass(frozen=True, kw_only=True)
class CombinatorialLogic(Block):
    """A truth table: y is the row with the number 1 + u1 2^(m-1) + … + um, for m conditions 0 or 1.

    The table has 2^m rows, one for each combination of conditions. An input that is not 0 counts as 1. A
    table of one column gives a scalar. The default is the AND of two conditions.
    """

    title: ClassVar[str] = "Combinatorial Logic"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The truth table of exclusive or: 1 while exactly one of the two pulses is 1.",
        parameters={"table": ((0.0,), (1.0,), (1.0,), (0.0,))},
        inputs={
            "u": driver("Mux").by(
                u1=driver("PulseGenerator", period=4.0).named("slow"),
                u2=driver("PulseGenerator", period=1.0).named("fast"),
            )
        },
    )

    table: ArrayLike = parameter(
        ((0.0,), (0.0,), (0.0,), (1.0,)), dimensions=(2,), doc="one row for each combination of conditions"
    )
    zero_crossing: bool = zero_crossing_parameter()

    def check(self) -> None:
        rows = shape_of(self.table)[0]
        if rows & (rows - 1) or rows < 2:
            raise InputError(
                f"the table has {counted(rows, 'row')}",
                where="CombinatorialLogic",
                allowed="2, 4, 8, … rows: one for each combination of conditions",
                fix="add the missing rows",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the conditions (m,)", shape=(shape_of(self.table)[0].bit_length() - 1,)),)

    def output_ports(self) -> tuple[Port, ...]:
        columns = shape_of(self.table)[1]
        return (Port("y", "the row of the table", shape=(columns,) if columns > 1 else ()),)

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        return located(self, *_truth_conditions(inputs))

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return _truth_values(u)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        row = SX(0.0)
        true = _truth(x, "u")
        for k in range(true.numel()):
            row = 2.0 * row + true[k]
        return {"y": choose(row, [p["table"][k, :].T for k in range(p["table"].shape[0])])}


@dataclass(frozen=True, kw_only=True)
class TruthTable(Block):
    """A decision table: y = the actions of the first decision whose conditions are all met.

    Each row of ``decisions`` is a decision: it states for every condition whether it must be true (1), false
    (0) or may be either (-1). The row of ``actions`` with the same number is the output of this decision.
    Every combination of conditions must be decided; a last row of -1 covers all others.
    """

    title: ClassVar[str] = "Truth Table"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The output is 2 while the slow pulse is 1, else 1 while the fast pulse is 1, else 0.",
        parameters={
            "decisions": ((1.0, -1.0), (0.0, 1.0), (-1.0, -1.0)),
            "actions": ((2.0,), (1.0,), (0.0,)),
        },
        inputs={
            "u": driver("Mux").by(
                u1=driver("PulseGenerator", period=4.0).named("slow"),
                u2=driver("PulseGenerator", period=1.0).named("fast"),
            )
        },
    )

    decisions: ArrayLike = parameter(
        ((1.0, 1.0), (-1.0, -1.0)),
        dimensions=(2,),
        tunable=False,
        minimum=-1.0,
        maximum=1.0,
        doc="one row for each decision: 1 true, 0 false, -1 either",
    )
    actions: ArrayLike = parameter(
        ((1.0,), (0.0,)), dimensions=(2,), doc="the outputs, one row for each decision"
    )
    zero_crossing: bool = zero_crossing_parameter()

    def check(self) -> None:
        rows = np.asarray(self.decisions, dtype=np.float64)
        if rows.shape[0] != shape_of(self.actions)[0] or not np.isin(rows, (-1.0, 0.0, 1.0)).all():
            raise InputError(
                f"there are {rows.shape[0]} decisions and {shape_of(self.actions)[0]} actions",
                where="TruthTable",
                allowed="one action for each decision; the entries of a decision are 1, 0 or -1",
                fix="correct the table",
            )
        if rows.shape[1] > _MAX_CONDITIONS:
            raise InputError(
                f"there are {rows.shape[1]} conditions",
                where="TruthTable.decisions",
                allowed=f"at most {_MAX_CONDITIONS}",
                fix="use several tables",
            )
        table = rows.tolist()
        for combination in product((0, 1), repeat=rows.shape[1]):
            if any(
                all(required in (-1.0, value) for required, value in zip(row, combination)) for row in table
            ):
                continue
            raise InputError(
                f"the conditions {list(combination)} are not decided",
                where="TruthTable.decisions",
                allowed="a decision for every combination of conditions",
                fix="add a last row of -1 for all others",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the conditions (m,)", shape=(shape_of(self.decisions)[1],)),)

    def output_ports(self) -> tuple[Port, ...]:
        columns = shape_of(self.actions)[1]
        return (Port("y", "the action", shape=(columns,) if columns > 1 else ()),)

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        return located(self, *_truth_conditions(inputs))

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return _truth_values(u)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        rows: list[list[float]] = np.asarray(self.decisions, dtype=np.float64).tolist()
        action, true = p["actions"][len(rows) - 1, :].T, _truth(x, "u")
        for k in reversed(range(len(rows) - 1)):
            fulfilled = [true[i] == required for i, required in enumerate(rows[k]) if required >= 0.0]
            action = if_else(reduce(logic_and, fulfilled, SX(1.0)), p["actions"][k, :].T, action)
        return {"y": action}


def _truth_conditions(inputs: Shapes) -> tuple[Condition, ...]:
    """Two conditions for each input: above 0 and below 0. The input is true if either holds."""
    return tuple(
        Condition(f"{name} {side}", shape, f"1 where {name} is {side} 0", closed=False)
        for name, shape in inputs.items()
        for side in ("above", "below")
    )


def _truth_values(u: Signals) -> Signals:
    above = {f"{name} above": value for name, value in u.items()}
    return above | {f"{name} below": -value for name, value in u.items()}


def _truth(x: Signals, name: str) -> SX:
    """1 if an input is true, else 0; from its conditions."""
    return logic_or(x[f"{name} above"], x[f"{name} below"])


def _sides(relation: str, shape: Shape) -> tuple[Condition, ...]:
    """The conditions of a relation on the difference of its operands; equality needs two."""
    above = Condition("above", shape, "1 where the left operand is greater", closed=False)
    below = Condition("below", shape, "1 where the left operand is less", closed=False)
    if relation in (">", "<="):
        return (above,)
    return (below,) if relation in ("<", ">=") else (above, below)


def _side_values(relation: str, difference: SX) -> Signals:
    values = {"above": difference, "below": -difference}
    return {entry.name: values[entry.name] for entry in _sides(relation, ())}


def _related(relation: str, x: Signals) -> SX:
    """The truth of a relation, from its conditions."""
    if relation in ("==", "~="):
        different = logic_or(x["above"], x["below"])
        return logic_not(different) if relation == "==" else different
    result = x["above"] if relation in (">", "<=") else x["below"]
    return result if relation in (">", "<") else logic_not(result)
