"""Base classes of linear blocks in continuous and discrete time: matrices, coefficients, roots, filters."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from casadi import SX, dot, mtimes, vertcat
from numpy.typing import ArrayLike

from armblocks.blocks.linear_systems import (
    LinearSystem,
    ZeroPoleGain,
    check_proper,
    complex_roots,
    low_pass,
    realised,
)
from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Signals,
    State,
    parameter,
    shape_of,
)
from armblocks.diagram.signs import BANDS, FaceSign
from armblocks.errors import InputError, counted

_FILTER_DESIGNS = ("butterworth", "chebyshev1", "chebyshev2")
_FILTER_TYPES = ("low_pass", "high_pass", "band_pass", "band_stop")


@dataclass(frozen=True, kw_only=True)
class LinearBlock(Block):
    """A linear system: the state's derivative or next value is A x + B u, the output C x + D u.

    D is not tunable: where D is zero the output has no feedthrough, and the block may be part of a feedback
    loop.
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
                fix="correct the shapes of the four matrices",
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
class RationalBlock(Block):
    """A rational transfer function in direct form II, initially at rest.

    Let v be u filtered by 1/denominator. The states of a continuous block are the derivatives of v, highest
    order first. The states of a sampled block are the values of v at the last ticks, newest first.
    """

    numerator: ArrayLike = parameter((1.0,), dimensions=(1,), doc="b0 … bm, highest power first")
    denominator: ArrayLike = parameter((1.0, 1.0), dimensions=(1,), doc="a0 … an, highest power first")

    def check(self) -> None:
        b, a = np.asarray(self.numerator), np.asarray(self.denominator)
        if a[0] == 0.0 or len(a) < 2 or len(b) > len(a):
            raise InputError(
                f"the denominator is {a.tolist()} and the numerator has {counted(len(b), 'coefficient')}",
                where=self.type_name(),
                allowed="a0 not zero, at least two coefficients in a, and at most as many in b",
                fix="remove leading zeros; a transfer function with more zeros than poles is not causal",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input", shape=()),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the output", shape=()),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        b, a = self._normalised(p)
        # y = b0 u + sum (b_i - b0 a_i) x_i; for a strictly proper system b0 is 0, so there is no feedthrough.
        return {"y": b[0] * u["u"] + dot(b[1:] - b[0] * a[1:], x["x"])}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": SX(0.0)}

    @property
    def degree(self) -> int:
        """Number of states."""
        return shape_of(self.denominator)[0] - 1

    def _coefficients(self, p: Signals) -> tuple[SX, SX]:
        """Numerator and denominator, padded to the same length."""
        missing = p["denominator"].numel() - p["numerator"].numel()
        return vertcat(SX(missing, 1), p["numerator"]), p["denominator"]

    def _normalised(self, p: Signals) -> tuple[SX, SX]:
        b, a = self._coefficients(p)
        return b / a[0], a / a[0]

    def _shifted(self, x: Signals, u: Signals, p: Signals) -> Signals:
        """The next state (or derivative): u filtered by 1/denominator, then the states without the last."""
        a = self._normalised(p)[1]
        return {"x": vertcat(u["u"] - dot(a[1:], x["x"]), x["x"])[: self.degree]}


@dataclass(frozen=True, kw_only=True)
class SectionsByRoots(Block):
    """A cascade of sections from zeros, poles and a gain; continuous or sampled."""

    zeros: ArrayLike = parameter((1.0,), dimensions=(1, 2), tunable=False, roots=True, doc="z1 … zm, or none")
    poles: ArrayLike = parameter((0.0, -1.0), dimensions=(1, 2), tunable=False, roots=True, doc="p1 … pn")
    gain: float = parameter(1.0, doc="the gain")

    def check(self) -> None:
        check_proper(*roots_of(self), where=self.type_name())

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input", shape=()),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the output", shape=()),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["gain"] * section_output(self.system, x["x"], u["u"])}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": SX(0.0)}

    @property
    def system(self) -> LinearSystem:
        """The sections, without the gain."""
        zeros, poles = roots_of(self)
        return realised(ZeroPoleGain(zeros=zeros, poles=poles, gain=1.0))


def roots_of(block: SectionsByRoots) -> tuple[Any, Any]:
    """Zeros and poles as complex numbers."""
    where = block.type_name()
    return complex_roots(block.zeros, where, "zeros"), complex_roots(block.poles, where, "poles")


def section_output(system: LinearSystem, x: SX, u: SX) -> SX:
    """The output C x + D u; without feedthrough the input does not appear."""
    output = dot(SX(np.asarray(system.C)), x)
    return output + system.D * u if system.D else output


def section_change(system: LinearSystem, x: SX, u: SX) -> SX:
    """A x + B u: the derivative of the state, or the state at the next tick."""
    return mtimes(SX(np.asarray(system.A)), x) + SX(np.asarray(system.B)) * u


@dataclass(frozen=True, kw_only=True)
class FilterByBand(Block):
    """A scalar filter from a design, an order and edge frequencies; analog or digital, initially at rest.

    Subclasses define ``system``, and redefine ``edge`` and ``upper_edge`` with their units.
    """

    design: str = parameter("butterworth", choices=_FILTER_DESIGNS, doc="the design of the filter")
    filter_type: str = parameter("low_pass", choices=_FILTER_TYPES, doc="type of the filter by its pass band")
    order: int = parameter(2, minimum=1, maximum=20, doc="order of the low-pass prototype")
    edge: float = parameter(
        1.0, above=0.0, tunable=False, doc="edge frequency; for band filters, the lower edge"
    )
    upper_edge: float = parameter(2.0, above=0.0, tunable=False, doc="upper edge frequency of a band")
    ripple: float = parameter(1.0, above=0.0, tunable=False, doc="ripple in the pass band (chebyshev1), dB")
    attenuation: float = parameter(
        40.0, above=0.0, tunable=False, doc="attenuation in the stop band (chebyshev2), dB"
    )

    def face_sign(self) -> FaceSign:
        return BANDS[self.filter_type]

    def check(self) -> None:
        if self.filter_type.startswith("band") and self.upper_edge <= self.edge:
            raise InputError(
                f"edge is {self.edge} and upper_edge is {self.upper_edge}",
                where=self.type_name(),
                allowed="edge < upper_edge",
                fix="exchange the two values",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input", shape=()),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the filtered input", shape=()),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": section_output(self.system, x["x"], u["u"])}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": SX(0.0)}

    @property
    @abstractmethod
    def system(self) -> LinearSystem:
        """The sections of the filter."""

    @property
    def prototype(self) -> ZeroPoleGain:
        """The low-pass prototype with its edge at 1 rad/s."""
        return low_pass(self.design, self.order, self.ripple, self.attenuation)

    @property
    def section_states(self) -> State:
        """The states of all sections."""
        return State("x", (len(self.system.B),), "the states of the sections")
