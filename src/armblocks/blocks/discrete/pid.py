"""PID controllers in Simulink's forms, with one and two degrees of freedom, sampled."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX
from numpy.typing import ArrayLike

from armblocks.blocks.pid_laws import (
    Errors,
    SampledPid,
    one_error,
    weighted_errors,
)
from armblocks.blocks.pid_parameters import (
    TWO_INPUTS,
    anti_windup_parameter,
    bandwidth_parameter,
    check_limits,
    external_reset_parameter,
    form_parameter,
    further_inputs,
    gain_parameter,
    lower_limit_parameter,
    method_parameter,
    pid_example,
    pid_shape,
    tracking_parameter,
    upper_limit_parameter,
)
from armblocks.diagram import (
    Block,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    sample_time_parameter,
)
from armblocks.diagram.signs import FaceSign, Lines, Words


@dataclass(frozen=True, kw_only=True)
class SampledPidBlock(Block):
    """Base class of the sampled PID controllers; subclasses define the errors of the three actions."""

    reads_next_period: ClassVar[bool] = True

    P: ArrayLike = gain_parameter(1.0, "proportional gain")
    I: ArrayLike = gain_parameter(1.0, "integral gain", "1/s")  # noqa: E741
    D: ArrayLike = gain_parameter(0.0, "derivative gain", "s")
    N: ArrayLike = bandwidth_parameter()
    lower: ArrayLike = lower_limit_parameter()
    upper: ArrayLike = upper_limit_parameter()
    anti_windup: str = anti_windup_parameter()
    Kb: ArrayLike = gain_parameter(1.0, "back-calculation gain", "1/s")
    initial_integral: ArrayLike = gain_parameter(0.0, "initial integral action")
    initial_filter: ArrayLike = gain_parameter(0.0, "initial filter state")
    form: str = form_parameter()
    external_reset: str = external_reset_parameter()
    tracking: bool = tracking_parameter()
    Kt: ArrayLike = gain_parameter(1.0, "tracking gain", "1/s")
    integrator_method: str = method_parameter("integration rule of the integral")
    filter_method: str = method_parameter("integration rule of the filter")
    sample_time: ArrayLike = sample_time_parameter()

    def check(self) -> None:
        check_limits(self, limited=True)

    def further_ports(self) -> tuple[Port, ...]:
        """The inputs that the parameters enable."""
        return further_inputs(self.external_reset, self.tracking)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the control action"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": pid_shape(self, inputs)}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return self._law.states(pid_shape(self, inputs))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": self._law.output(x, self.errors(u, p), p, u.get("reset"))}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return self._law.updates(x, self.errors(u, p), p, u.get("reset"), u.get("tracking"))

    def initial_states(self, p: Signals) -> Signals:
        return self._law.start(p)

    @abstractmethod
    def errors(self, u: Signals, p: Signals) -> Errors:
        """The errors at the inputs of the proportional, integral and derivative actions."""

    @property
    def _law(self) -> SampledPid:
        return SampledPid(
            form=self.form,
            anti_windup=self.anti_windup,
            external_reset=self.external_reset,
            integrator_method=self.integrator_method,
            filter_method=self.filter_method,
        )


@dataclass(frozen=True, kw_only=True)
class DiscretePID(SampledPidBlock):
    """Sampled PID: y = limit(P u + i + N (D u - f)), i(k+1) = i + T I u, f(k+1) = f + T N (D u - f).

    u is the error, i the integral action and f the state of the derivative filter. This is Simulink's
    Discrete PID Controller with forward Euler rules. The integral and the filter may each use
    ``backward_euler`` or ``trapezoidal`` instead.

    While the output is limited, the integral changes according to ``anti_windup``:

    - ``clamping`` stops the integral if it drives the output further beyond the limit.
    - ``back_calculation`` adds T Kb (y - unlimited y) to the integral.

    ``tracking`` adds T Kt (tracking - y) to the integral.

    A reset happens at the first tick after the trigger has crossed zero. In a triggered subsystem, T is
    t(k+1) - t(k).
    """

    title: ClassVar[str] = "Discrete PID Controller"
    sign: ClassVar[FaceSign] = Words("PID(z)")
    sampled: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = pid_example("one", I=1.5, sample_time=0.1)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the error"), *self.further_ports())

    def errors(self, u: Signals, p: Signals) -> Errors:
        return one_error(u["u"])


@dataclass(frozen=True, kw_only=True)
class DiscretePID2DOF(SampledPidBlock):
    """Sampled PID with two degrees of freedom: P acts on b r - u, I on r - u, D on c r - u.

    Set-point weights b, c < 1 reduce the control action and the overshoot after a step of r; the response to
    disturbances is unchanged. Rules, forms, limits, reset and tracking are the same as in the Discrete PID
    Controller.
    """

    title: ClassVar[str] = "Discrete PID Controller (2DOF)"
    sign: ClassVar[FaceSign] = Lines(("PID(z)", "2DOF"))
    sampled: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = pid_example("two", P=4.0, I=3.0, D=1.0, N=8.0, b=0.4, sample_time=0.1)

    b: ArrayLike = gain_parameter(1.0, "weight of the reference in the proportional action")
    c: ArrayLike = gain_parameter(1.0, "weight of the reference in the derivative action")

    def input_ports(self) -> tuple[Port, ...]:
        return (*TWO_INPUTS, *self.further_ports())

    def errors(self, u: Signals, p: Signals) -> Errors:
        return weighted_errors(u["r"], u["u"], p)
