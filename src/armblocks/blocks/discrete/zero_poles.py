"""Sampled systems from zeros, poles and gain; digital filters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX
from numpy.typing import ArrayLike

from armblocks.blocks.linear_blocks import (
    FilterByBand,
    SectionsByRoots,
    section_change,
)
from armblocks.blocks.linear_systems import (
    LinearSystem,
    frequency_transformed,
    realised,
    sampled,
    warped,
)
from armblocks.diagram import (
    Shapes,
    Signals,
    State,
    WorkedExample,
    driver,
    parameter,
    sample_time_parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, ratio_of_roots


@dataclass(frozen=True, kw_only=True)
class DiscreteZeroPole(SectionsByRoots):
    """A sampled transfer function: y = gain (z - z1) … (z - zm) / ((z - p1) … (z - pn)) u, m <= n.

    Complex zeros and poles come in conjugate pairs. Files contain them as rows (real, imaginary); Python also
    accepts complex numbers. The block is initially at rest.
    """

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
        inputs={"u": driver("Step")},
    )

    poles: ArrayLike = parameter((0.0, 0.5), dimensions=(1, 2), tunable=False, roots=True, doc="p1 … pn")
    sample_time: ArrayLike = sample_time_parameter()

    def face_sign(self) -> FaceSign:
        return ratio_of_roots(self.zeros, self.poles, self.gain, "z")

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (shape_of(self.poles)[0],), "the states of the sections"),)

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": section_change(self.system, x["x"], u["u"])}


@dataclass(frozen=True, kw_only=True)
class DigitalFilter(FilterByBand):
    """A sampled low-pass, high-pass, band-pass or band-stop filter, initially at rest.

    The designs are those of the block Analog Filter Design. The bilinear transformation
    s = (z - 1) / (z + 1) converts the filter, and its edges are exactly at the given frequencies. Edge
    frequencies are fractions of half the sampling frequency, as in MATLAB and SciPy (``butter(order,
    edge)``).
    """

    title: ClassVar[str] = "Digital Filter Design"
    sampled: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A noisy sine, sampled every 0.02 s, after a low-pass filter with its edge at 2 Hz.",
        parameters={"order": 3, "edge": 0.08, "sample_time": 0.02},
        inputs={
            "u": driver("Sum").by(
                u1=driver("SineWave", frequency=2.0),
                u2=driver("RandomNumber", variance=0.1, sample_time=0.02),
            )
        },
    )

    edge: float = parameter(
        0.2,
        above=0.0,
        maximum=0.9999,
        tunable=False,
        doc="edge frequency (for band filters, the lower edge), in units of 1 / (2 T)",
    )
    upper_edge: float = parameter(
        0.4,
        above=0.0,
        maximum=0.9999,
        tunable=False,
        doc="upper edge frequency of a band, in units of 1 / (2 T)",
    )
    sample_time: ArrayLike = sample_time_parameter()

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (self.section_states,)

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": section_change(self.system, x["x"], u["u"])}

    @property
    def system(self) -> LinearSystem:
        return realised(
            sampled(
                frequency_transformed(
                    self.prototype, self.filter_type, warped(self.edge), warped(self.upper_edge)
                )
            )
        )
