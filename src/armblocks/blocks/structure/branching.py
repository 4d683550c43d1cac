"""Blocks that select the active action subsystem."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, fabs, floor, if_else, logic_or, vertcat

from armblocks.blocks.elementwise import numbered_ports
from armblocks.diagram import Block, Guard, Port, Shapes, Signals, State, WorkedExample, driver, parameter
from armblocks.errors import InputError, counted
from armblocks.matlab.formula import Formula

THRESHOLD_OFFSET = 1e-300
"""An offset below the resolution of any signal, which assigns the boundary itself to one side."""


@dataclass(frozen=True, kw_only=True)
class If(Block):
    """Activates the action subsystem of the first condition that is true, else the last subsystem.

    The conditions are formulas over the inputs (``u``; with several inputs ``u1``, ``u2``, …), written
    as in the Expression block and separated by semicolons: ``u > 0.5; u > 0``. The output of the active
    branch is 1, and the others are 0.
    """

    following_modes: ClassVar[bool] = True
    title: ClassVar[str] = "If"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The first output is 1 while the sine is above 0.5, the second while it is between 0 and 0.5.",
        parameters={"expressions": "u > 0.5; u > 0"},
    )

    expressions: str = parameter("u > 0", doc="formulas, separated by semicolons")
    inputs: int = parameter(1, minimum=1, maximum=100, doc="number of inputs")

    def check(self) -> None:
        for text in self._texts():
            Formula(text, "If.expressions")

    def _texts(self) -> list[str]:
        return [text.strip() for text in self.expressions.split(";")]

    def input_ports(self) -> tuple[Port, ...]:
        return numbered_ports("u", self.inputs, "input")

    def output_ports(self) -> tuple[Port, ...]:
        chosen = [
            Port(f"if{number}", f"1 where '{text}' is the first true condition", "", ())
            for number, text in enumerate(self._texts(), start=1)
        ]
        return (*chosen, Port("else", "1 where no condition is true", "", ()))

    def output_shapes(self, inputs: Shapes) -> Shapes:
        u = {name: SX.sym(name, math.prod(shape)) for name, shape in inputs.items()}
        for text in self._texts():
            size = Formula(text, "If.expressions").trace({**u, "t": SX.sym("t")}).numel()
            if size != 1:
                raise InputError(
                    f"the condition '{text}' has {counted(size, 'value')}",
                    allowed="one value: true or false",
                    fix="compare an element, such as u[1]",
                )
        return {}

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("case", (), "index of the output that is 1, from 1"),)

    def _switching_functions(self, t: SX, u: Signals) -> SX:
        names = {**u, "t": t}
        return vertcat(
            *(part for text in self._texts() for part in Formula(text, "").switching_functions(names))
        )

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        u = {name: SX.sym(name, math.prod(shape)) for name, shape in inputs.items()}
        return (
            Guard("borders", (self._switching_functions(SX.sym("t"), u).numel(),), "a comparison changes"),
        )

    def _case(self, t: SX, u: Signals) -> SX:
        """The number of the first true condition, from 1; the number of outputs if none is true."""
        texts = self._texts()
        case = SX(len(texts) + 1.0)
        for number in range(len(texts), 0, -1):
            holds = Formula(texts[number - 1], "").trace({**u, "t": t})
            case = if_else(holds != 0.0, float(number), case)
        return case

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {
            port.name: if_else(x["case"] == float(number), 1.0, 0.0)
            for number, port in enumerate(self.output_ports(), start=1)
        }

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"borders": self._switching_functions(t, u)}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"case": self._case(t, u)}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"case": self._case(t, u)}


@dataclass(frozen=True, kw_only=True)
class SwitchCase(Block):
    """Activates the action subsystem whose case contains the integer part of u.

    Cases are separated by semicolons, and a case may have several numbers: ``1; 2 3; 4``. The output of the
    case that contains the number is 1. If no case contains it, the output ``default`` is 1.
    """

    following_modes: ClassVar[bool] = True
    title: ClassVar[str] = "Switch Case"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The ramp passes 1, 2 and 3, and activates the cases one after another.",
        parameters={"cases": "1; 2 3"},
        inputs={"u": driver("Ramp", slope=0.5)},
    )

    cases: str = parameter("1; 2", doc="integers of each case; cases separated by semicolons")

    def check(self) -> None:
        cases = [number for case in self._texts() for number in case]
        invalid = [text for text in cases if not text.removeprefix("-").isdecimal() or not text.isascii()]
        duplicates = [text for text in cases if cases.count(text) > 1]
        if invalid or duplicates or not all(self._texts()):
            message = (
                f"'{(invalid or duplicates)[0]}' is not allowed"
                if invalid or duplicates
                else "a case has no number"
            )
            raise InputError(
                f"the cases are '{self.cases}': {message}",
                where="SwitchCase.cases",
                allowed="distinct integers, such as 1; 2 3; 4",
                fix="correct the list",
            )

    def _texts(self) -> list[list[str]]:
        return [case.replace(",", " ").split() for case in self.cases.split(";")]

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the number of the case", "", ()),)

    def output_ports(self) -> tuple[Port, ...]:
        chosen = [
            Port(f"case{number}", f"1 where u is {' or '.join(case)}", "", ())
            for number, case in enumerate(self._texts(), start=1)
        ]
        return (*chosen, Port("default", "1 where no case contains the integer part of u", "", ()))

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("case", (), "index of the output that is 1, from 1"),)

    def _edges(self) -> list[tuple[float, float]]:
        """The interval of u for each integer after truncation: 0 covers the interval from -1 to 1."""
        numbers = [float(number) for case in self._texts() for number in case]
        return [(n if n > 0.0 else n - 1.0, n if n < 0.0 else n + 1.0) for n in numbers]

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return (Guard("borders", (2 * len(self._edges()),), "u passes an integer"),)

    def _case(self, u: SX) -> SX:
        """The number of the case that contains the integer part of u; the number of outputs if none does."""
        integer_part = if_else(u < 0.0, -floor(fabs(u)), floor(u))
        texts = self._texts()
        case = SX(len(texts) + 1.0)
        for number in range(len(texts), 0, -1):
            matches = SX(0.0)
            for text in texts[number - 1]:
                matches = logic_or(matches, integer_part == float(text))
            case = if_else(matches, float(number), case)
        return case

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {
            port.name: if_else(x["case"] == float(number), 1.0, 0.0)
            for number, port in enumerate(self.output_ports(), start=1)
        }

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        # A positive boundary belongs to the integer above it, a negative boundary to the integer below it.
        return {
            "borders": vertcat(
                *(
                    u["u"] - edge + (THRESHOLD_OFFSET if edge > 0.0 else -THRESHOLD_OFFSET)
                    for edges in self._edges()
                    for edge in edges
                )
            )
        }

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"case": self._case(u["u"])}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return {"case": self._case(u["u"])}
