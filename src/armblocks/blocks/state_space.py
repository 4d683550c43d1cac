"""Linear systems by their matrices, flowing and sampled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from casadi import SX, mtimes
from numpy.typing import ArrayLike

from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    made,
    parameter,
    sample_time_parameter,
    shape_of,
)
from armblocks.errors import InputError


@dataclass(frozen=True, kw_only=True)
class LinearBlock(Block):
    """Four matrices that fit each other: what becomes of the state is A x + B u, the output is C x + D u.

    D belongs to the structure (it is not tunable), so that a zero in it leaves the output free of the input
    and the block may stand in a loop.
    """

    A: ArrayLike = parameter(((0.5,),), dimensions=(2,), doc="the system matrix (n, n)")
    B: ArrayLike = parameter(((1.0,),), dimensions=(2,), doc="the input matrix (n, m)")
    C: ArrayLike = parameter(((1.0,),), dimensions=(2,), doc="the output matrix (k, n)")
    D: ArrayLike = parameter(((0.0,),), dimensions=(2,), doc="the feedthrough (k, m)", tunable=False)
    initial: ArrayLike = parameter(
        0.0,
        kind=ParameterKind.ARRAY,
        dimensions=(0, 1),
        doc="the state (n,) at the start, or one number for all",
    )

    def check(self) -> None:
        A, B, C, D = (shape_of(self.parameter_value(name)) for name in "ABCD")
        if A[0] != A[1] or B[0] != A[0] or C[1] != A[0] or (C[0], B[1]) != D:
            raise InputError(
                f"A is {A}, B is {B}, C is {C}, D is {D}",
                where=self.type_name(),
                allowed="A (n, n), B (n, m), C (k, n), D (k, m)",
                fix="make the four matrices fit each other",
            )
        if shape_of(self.initial) not in ((), A[:1]):
            raise InputError(
                f"initial has shape {shape_of(self.initial)}",
                where=f"{self.type_name()}.initial",
                allowed=f"() or {A[:1]}",
                fix="give one number for each row of A, or one for all",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input", shape=shape_of(self.B)[1:]),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the output", shape=shape_of(self.C)[:1]),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": mtimes(p["C"], x["x"]) + mtimes(SX(np.asarray(self.D)), u["u"])}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial"]}

    @property
    def _state(self) -> State:
        return State("x", shape_of(self.A)[:1], "the state of the system")


@dataclass(frozen=True, kw_only=True)
class StateSpace(LinearBlock):
    """A linear system: x' = A x + B u, y = C x + D u, x(0) = initial.

    D belongs to the structure (it is not tunable), so that a zero in it leaves the output free of the input
    and the block may stand in a loop.
    """

    family: ClassVar[str] = "continuous"
    title: ClassVar[str] = "State-Space"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A mass on a spring with a damper, pushed from 1 s on: it swings in.",
        parameters={
            "A": ((0.0, 1.0), (-4.0, -0.8)),
            "B": ((0.0,), (4.0,)),
            "C": ((1.0, 0.0),),
            "D": ((0.0,),),
        },
        inputs={"u": made("Step")},
    )

    A: ArrayLike = parameter(((-1.0,),), dimensions=(2,), doc="the system matrix (n, n)", unit="1/s")

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (self._state,)

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": mtimes(p["A"], x["x"]) + mtimes(p["B"], u["u"])}


@dataclass(frozen=True, kw_only=True)
class DiscreteStateSpace(LinearBlock):
    """A linear sampled system: x(k+1) = A x(k) + B u(k), y(k) = C x(k) + D u(k), x(0) = initial.

    D belongs to the structure (it is not tunable), so that a zero in it leaves the output free of the input
    and the block may stand in a loop.
    """

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Discrete State-Space"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The step response of x(k+1) = 0.5 x + u: it goes to 2, half of the way with every tick.",
        inputs={"u": made("Step")},
    )
    sampled: ClassVar[bool] = True

    sample_time: ArrayLike = sample_time_parameter()

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (self._state,)

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": mtimes(p["A"], x["x"]) + mtimes(p["B"], u["u"])}
