"""Systems given by zeros and poles, and filters by order and edge, continuous and sampled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from casadi import SX, dot, mtimes
from numpy.typing import ArrayLike

from armblocks.blocks.linear_systems import (
    LinearSystem,
    ZeroPoleGain,
    check_proper,
    complex_roots,
    low_pass,
    realised,
    sampled,
    shifted,
    warped,
)
from armblocks.diagram import (
    Block,
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

_DESIGNS = ("butterworth", "chebyshev1", "chebyshev2")
_KINDS = ("low_pass", "high_pass", "band_pass", "band_stop")


@dataclass(frozen=True, kw_only=True)
class SectionsByRoots(Block):
    """A chain of sections by zeros and poles, with a factor; continuous or sampled."""

    zeros: ArrayLike = parameter((1.0,), dimensions=(1, 2), tunable=False, roots=True, doc="z1 … zm, or none")
    poles: ArrayLike = parameter((0.0, -1.0), dimensions=(1, 2), tunable=False, roots=True, doc="p1 … pn")
    gain: float = parameter(1.0, doc="the factor")

    def check(self) -> None:
        check_proper(*_roots(self), where=self.type_name())

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input", shape=()),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the output", shape=()),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": p["gain"] * _output(self.system, x["x"], u["u"])}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": SX(0.0)}

    @property
    def system(self) -> LinearSystem:
        """The sections, without the factor."""
        zeros, poles = _roots(self)
        return realised(ZeroPoleGain(zeros=zeros, poles=poles, gain=1.0))


@dataclass(frozen=True, kw_only=True)
class ZeroPole(SectionsByRoots):
    """A transfer function by its roots: y = gain (s - z1) … (s - zm) / ((s - p1) … (s - pn)) u, m <= n.

    Complex zeros and poles come in conjugate pairs, as complex numbers in Python and as rows (real,
    imaginary) in files. At rest at the start; the state is that of a chain of sections with one or two poles.
    """

    family: ClassVar[str] = "continuous"
    title: ClassVar[str] = "Zero-Pole"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The step response of a zero at -2 and poles at -0.5 and -1 ± 3i.",
        parameters={"zeros": (-2.0,), "poles": ((-0.5, 0.0), (-1.0, 3.0), (-1.0, -3.0)), "gain": 2.5},
        inputs={"u": made("Step")},
    )

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (shape_of(self.poles)[0],), "the states of the sections"),)

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": _change(self.system, x["x"], u["u"])}


@dataclass(frozen=True, kw_only=True)
class DiscreteZeroPole(SectionsByRoots):
    """A sampled system by its roots: y = gain (z - z1) … (z - zm) / ((z - p1) … (z - pn)) u, m <= n.

    Complex zeros and poles come in conjugate pairs, as complex numbers in Python and as rows (real,
    imaginary) in files. At rest at the start.
    """

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Discrete Zero-Pole"
    sampled: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The step response of poles at 0.7 ± 0.5i, every 0.2 s.",
        parameters={
            "zeros": (0.0,),
            "poles": ((0.7, 0.5), (0.7, -0.5)),
            "gain": 0.34,
            "sample_time": 0.2,
        },
        inputs={"u": made("Step")},
    )

    poles: ArrayLike = parameter((0.0, 0.5), dimensions=(1, 2), tunable=False, roots=True, doc="p1 … pn")
    sample_time: ArrayLike = sample_time_parameter()

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (shape_of(self.poles)[0],), "the states of the sections"),)

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": _change(self.system, x["x"], u["u"])}


@dataclass(frozen=True, kw_only=True)
class AnalogFilter(Block):
    """A filter by order and edge: |y / u| = 1 / sqrt(1 + (w / edge)^(2 order)) for the Butterworth low pass.

    ``chebyshev1`` falls faster and ripples in the pass band, ``chebyshev2`` in the stop band, which begins
    at its edge. Bands have twice the order in poles. At rest at the start.
    """

    family: ClassVar[str] = "continuous"
    title: ClassVar[str] = "Analog Filter Design"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A square wave of 0.25 Hz behind a Butterworth low pass of 10 rad/s.",
        parameters={"order": 4, "edge": 10.0},
        inputs={"u": made("SignalGenerator", waveform="square", frequency=0.25)},
    )

    design: str = parameter("butterworth", choices=_DESIGNS, doc="the kind of filter")
    filter_type: str = parameter("low_pass", choices=_KINDS, doc="what passes")
    order: int = parameter(2, minimum=1, maximum=20, doc="order of the low pass behind it")
    edge: float = parameter(1.0, above=0.0, tunable=False, doc="the edge, of bands the lower", unit="rad/s")
    upper_edge: float = parameter(
        2.0, above=0.0, tunable=False, doc="the upper edge of a band, above the lower", unit="rad/s"
    )
    ripple: float = parameter(1.0, above=0.0, tunable=False, doc="in the pass band (chebyshev1), dB")
    attenuation: float = parameter(40.0, above=0.0, tunable=False, doc="in the stop band (chebyshev2), dB")

    def check(self) -> None:
        _check_band(self, self.filter_type, self.edge, self.upper_edge)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input", shape=()),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the filtered input", shape=()),)

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (len(self._system.B),), "the states of the sections"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": _output(self._system, x["x"], u["u"])}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": _change(self._system, x["x"], u["u"])}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": SX(0.0)}

    @property
    def _system(self) -> LinearSystem:
        base = low_pass(self.design, self.order, self.ripple, self.attenuation)
        return realised(shifted(base, self.filter_type, self.edge, self.upper_edge))


@dataclass(frozen=True, kw_only=True)
class DigitalFilter(Block):
    """A sampled filter by order and edge: the analog one under the transformation z = (1 + s) / (1 - s).

    Edges are shares of half the sampling frequency, as in MATLAB and SciPy (``butter(order, edge)``).
    """

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Digital Filter Design"
    sampled: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A noisy sine, sampled every 0.02 s, behind a low pass of 2 Hz.",
        parameters={"order": 3, "edge": 0.08, "sample_time": 0.02},
        inputs={
            "u": made("Sum").by(
                u1=made("SineWave", frequency=2.0), u2=made("RandomNumber", variance=0.1, sample_time=0.02)
            )
        },
    )

    design: str = parameter("butterworth", choices=_DESIGNS, doc="the kind of filter")
    filter_type: str = parameter("low_pass", choices=_KINDS, doc="what passes")
    order: int = parameter(2, minimum=1, maximum=20, doc="order of the low pass behind it")
    edge: float = parameter(
        0.2, above=0.0, maximum=0.9999, tunable=False, doc="the edge, of bands the lower; 1 is 1 / (2 T)"
    )
    upper_edge: float = parameter(
        0.4, above=0.0, maximum=0.9999, tunable=False, doc="the upper edge of a band, above the lower"
    )
    ripple: float = parameter(1.0, above=0.0, tunable=False, doc="in the pass band (chebyshev1), dB")
    attenuation: float = parameter(40.0, above=0.0, tunable=False, doc="in the stop band (chebyshev2), dB")
    sample_time: ArrayLike = sample_time_parameter()

    def check(self) -> None:
        _check_band(self, self.filter_type, self.edge, self.upper_edge)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input", shape=()),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the filtered input", shape=()),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (len(self._system.B),), "the states of the sections"),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": _output(self._system, x["x"], u["u"])}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": _change(self._system, x["x"], u["u"])}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": SX(0.0)}

    @property
    def _system(self) -> LinearSystem:
        base = low_pass(self.design, self.order, self.ripple, self.attenuation)
        return realised(sampled(shifted(base, self.filter_type, warped(self.edge), warped(self.upper_edge))))


def _roots(block: SectionsByRoots) -> tuple[Any, Any]:
    where = block.type_name()
    return complex_roots(block.zeros, where, "zeros"), complex_roots(block.poles, where, "poles")


def _output(system: LinearSystem, x: SX, u: SX) -> SX:
    found = dot(SX(np.asarray(system.C)), x)
    return found + system.D * u if system.D else found


def _change(system: LinearSystem, x: SX, u: SX) -> SX:
    return mtimes(SX(np.asarray(system.A)), x) + SX(np.asarray(system.B)) * u


def _check_band(block: Block, filter_type: str, edge: float, upper_edge: float) -> None:
    if filter_type.startswith("band") and upper_edge <= edge:
        raise InputError(
            f"edge is {edge} and upper_edge is {upper_edge}",
            where=block.type_name(),
            allowed="edge < upper_edge",
            fix="exchange them",
        )
