"""Transfer functions from zeros and poles; analog filters from order and edge frequency."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX

from armblocks.blocks.linear_blocks import (
    FilterByBand,
    SectionsByRoots,
    section_change,
)
from armblocks.blocks.linear_systems import (
    LinearSystem,
    frequency_transformed,
    realised,
)
from armblocks.diagram import (
    Shapes,
    Signals,
    State,
    WorkedExample,
    driver,
    parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, ratio_of_roots


@dataclass(frozen=True, kw_only=True)
class ZeroPole(SectionsByRoots):
    """A transfer function: y = gain (s - z1) … (s - zm) / ((s - p1) … (s - pn)) u, m <= n.

    Complex zeros and poles come in conjugate pairs. Files contain them as rows (real, imaginary); Python also
    accepts complex numbers. The block is initially at rest. The states belong to a cascade of sections with
    one or two poles.
    """

    title: ClassVar[str] = "Zero-Pole"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The step response of a system with a zero at -2 and poles at -0.5 and -1 ± 3i.",
        parameters={"zeros": (-2.0,), "poles": ((-0.5, 0.0), (-1.0, 3.0), (-1.0, -3.0)), "gain": 2.5},
        inputs={"u": driver("Step")},
    )

    def face_sign(self) -> FaceSign:
        return ratio_of_roots(self.zeros, self.poles, self.gain, "s")

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (shape_of(self.poles)[0],), "the states of the sections"),)

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": section_change(self.system, x["x"], u["u"])}


@dataclass(frozen=True, kw_only=True)
class AnalogFilter(FilterByBand):
    """A low-pass, high-pass, band-pass or band-stop filter for continuous signals, initially at rest.

    ``design`` selects the frequency response:

    - ``butterworth`` has no ripple. The low pass has |y / u| = 1 / sqrt(1 + (w / edge)^(2 order)) at the
      angular frequency w (rad/s).
    - ``chebyshev1`` has a steeper roll-off and ripple in the pass band.
    - ``chebyshev2`` has ripple in the stop band, and its edge is the beginning of the stop band.

    Band filters have twice as many poles as the order.
    """

    title: ClassVar[str] = "Analog Filter Design"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A square wave of 0.25 Hz after a Butterworth low-pass filter with its edge at 10 rad/s.",
        parameters={"order": 4, "edge": 10.0},
        inputs={"u": driver("SignalGenerator", waveform="square", frequency=0.25)},
    )

    edge: float = parameter(
        1.0, above=0.0, tunable=False, doc="edge frequency; for band filters, the lower edge", unit="rad/s"
    )
    upper_edge: float = parameter(
        2.0, above=0.0, tunable=False, doc="upper edge frequency of a band", unit="rad/s"
    )

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (self.section_states,)

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"x": section_change(self.system, x["x"], u["u"])}

    @property
    def system(self) -> LinearSystem:
        return realised(frequency_transformed(self.prototype, self.filter_type, self.edge, self.upper_edge))
