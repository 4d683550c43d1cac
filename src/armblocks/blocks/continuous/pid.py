"""PID controllers in Simulink's forms, with one and two degrees of freedom, in continuous time."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX
from numpy.typing import ArrayLike

from armblocks.blocks.pid_laws import (
    ContinuousPid,
    Errors,
    one_error,
    pid_start,
    pid_states,
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
    limit_output_parameter,
    lower_limit_parameter,
    pid_example,
    pid_shape,
    tracking_parameter,
    upper_limit_parameter,
)
from armblocks.diagram import (
    Block,
    Guard,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
)
from armblocks.diagram.signs import FaceSign, Lines, Words


@dataclass(frozen=True, kw_only=True)
class ContinuousPidBlock(Block):
    """Base class of the continuous PID controllers; subclasses define the errors of the three actions."""

    P: ArrayLike = gain_parameter(1.0, "proportional gain")
    I: ArrayLike = gain_parameter(1.0, "integral gain", "1/s")  # noqa: E741
    D: ArrayLike = gain_parameter(0.0, "derivative gain", "s")
    N: ArrayLike = bandwidth_parameter()
    limit_output: bool = limit_output_parameter()
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

    def check(self) -> None:
        check_limits(self, limited=self.limit_output)

    def further_ports(self) -> tuple[Port, ...]:
        """The inputs that the parameters enable."""
        return further_inputs(self.external_reset, self.tracking)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the control action"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": pid_shape(self, inputs)}

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return pid_states(pid_shape(self, inputs))

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return self._law.modes(pid_shape(self, inputs))

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return self._law.guards(pid_shape(self, inputs))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": self._law.output(x, self.errors(u, p), p)}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return self._law.derivatives(x, self.errors(u, p), p, u.get("tracking"))

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return self._law.guard_values(x, self.errors(u, p), p, u.get("tracking"), u.get("reset"))

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return self._law.mode_values(x, self.errors(u, p), p, u.get("tracking"))

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return self._law.resets(x, p, e)

    def initial_states(self, p: Signals) -> Signals:
        return pid_start(p)

    @abstractmethod
    def errors(self, u: Signals, p: Signals) -> Errors:
        """The errors at the inputs of the proportional, integral and derivative actions."""

    @property
    def _law(self) -> ContinuousPid:
        return ContinuousPid(
            form=self.form,
            limited=self.limit_output,
            anti_windup=self.anti_windup,
            external_reset=self.external_reset,
        )


@dataclass(frozen=True, kw_only=True)
class PID(ContinuousPidBlock):
    """Proportional, integral and filtered derivative action: y = (P + I/s + D N s/(s + N)) u.

    This is the parallel form of Simulink's PID Controller. In the ideal form y = P (1 + I/s + D N s/(s + N))
    u. States: ``integral`` and ``filter`` (filter' = N (D u - filter)).

    With ``limit_output`` the output stays between two limits. The integral then changes according to
    ``anti_windup``:

    - ``clamping`` stops the integral while it drives the output further beyond a limit.
    - ``back_calculation`` adds Kb (y - unlimited y) to the rate of the integral.

    ``tracking`` adds Kt (tracking - y) to this rate, for a bumpless transfer from another controller.
    """

    title: ClassVar[str] = "PID Controller"
    sign: ClassVar[FaceSign] = Words("PID(s)")
    example: ClassVar[WorkedExample] = pid_example("one", I=1.5, D=0.4, N=8.0)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the error"), *self.further_ports())

    def errors(self, u: Signals, p: Signals) -> Errors:
        return one_error(u["u"])


@dataclass(frozen=True, kw_only=True)
class PID2DOF(ContinuousPidBlock):
    """PID with two degrees of freedom: y = P (b r - u) + I/s (r - u) + D N s/(s + N) (c r - u).

    Set-point weights b, c < 1 reduce the control action and the overshoot after a step of r; the response to
    disturbances is unchanged. Forms, limits, reset and tracking are the same as in the PID Controller.
    """

    title: ClassVar[str] = "PID Controller (2DOF)"
    sign: ClassVar[FaceSign] = Lines(("PID(s)", "2DOF"))
    example: ClassVar[WorkedExample] = pid_example("two", P=4.0, I=3.0, D=1.0, b=0.4, c=0.0)

    b: ArrayLike = gain_parameter(1.0, "weight of the reference in the proportional action")
    c: ArrayLike = gain_parameter(1.0, "weight of the reference in the derivative action")

    def input_ports(self) -> tuple[Port, ...]:
        return (*TWO_INPUTS, *self.further_ports())

    def errors(self, u: Signals, p: Signals) -> Errors:
        return weighted_errors(u["r"], u["u"], p)
