"""PID controllers in Simulink's forms, with one and two degrees of freedom, continuous and sampled."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from casadi import SX
from numpy.typing import ArrayLike

from armblocks.blocks.pid_laws import (
    ContinuousPid,
    Errors,
    SampledPid,
    one_error,
    pid_start,
    pid_states,
    weighted_errors,
)
from armblocks.blocks.pid_parameters import (
    anti_windup_parameter,
    bandwidth_parameter,
    external_reset_parameter,
    form_parameter,
    gain_parameter,
    limit_output_parameter,
    lower_limit_parameter,
    method_parameter,
    tracking_parameter,
    upper_limit_parameter,
)
from armblocks.blocks.switching import limits_in_order
from armblocks.diagram import (
    Block,
    Guard,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    broadcast,
    made,
    sample_time_parameter,
    shape_of,
)
from armblocks.equations import Shape
from armblocks.errors import InputError

_TWO_INPUTS = (Port("r", "the reference"), Port("u", "the measured output of the plant"))


def _answer(kind: str, **parameters: Any) -> WorkedExample:
    """The step of a loop with two lags."""
    plant = made("SecondOrderLag", natural_frequency=2.0, damping=0.8).named("plant")
    step = made("Step")
    feeds = (
        {"r": step, "u": plant.by(u="y")}
        if kind == "two"
        else {"u": made("Sum", signs="+-").by(u1=step, u2=plant.by(u="y"))}
    )
    return WorkedExample(
        shows="The plant follows a step of the reference; below it what the controller gives.",
        parameters=parameters,
        inputs=feeds,
        shown=(step, "plant/y", "y"),
    )


@dataclass(frozen=True, kw_only=True)
class ContinuousPidBlock(Block):
    """What continuous PID controllers have in common: all but what the actions work on."""

    P: ArrayLike = gain_parameter(1.0, "proportional gain")
    I: ArrayLike = gain_parameter(1.0, "integral gain", "1/s")  # noqa: E741
    D: ArrayLike = gain_parameter(0.0, "derivative gain", "s")
    N: ArrayLike = bandwidth_parameter()
    limit_output: bool = limit_output_parameter()
    lower: ArrayLike = lower_limit_parameter()
    upper: ArrayLike = upper_limit_parameter()
    anti_windup: str = anti_windup_parameter()
    Kb: ArrayLike = gain_parameter(1.0, "back-calculation gain", "1/s")
    initial_integral: ArrayLike = gain_parameter(0.0, "integral action at the start")
    initial_filter: ArrayLike = gain_parameter(0.0, "filter state at the start")
    form: str = form_parameter()
    external_reset: str = external_reset_parameter()
    tracking: bool = tracking_parameter()
    Kt: ArrayLike = gain_parameter(1.0, "tracking gain", "1/s")

    def check(self) -> None:
        _check(self, limited=self.limit_output)

    def further_ports(self) -> tuple[Port, ...]:
        """The inputs that parameters ask for."""
        reset = (Port("reset", "the trigger", shape=()),) if self.external_reset != "none" else ()
        tracking = (Port("tracking", "what the output shall be close to"),) if self.tracking else ()
        return (*reset, *tracking)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the control action"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": _shape(self, inputs)}

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return pid_states(_shape(self, inputs))

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return self._law.modes(_shape(self, inputs))

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return self._law.guards(_shape(self, inputs))

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
        """What each of the three actions works on."""

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

    That is Simulink's PID Controller; in the ideal form y = P (1 + I/s + D N s/(s + N)) u. States:
    ``integral`` and ``filter`` (filter' = N (D u - filter)). With ``limit_output`` the output stays between
    two limits; ``clamping`` then stops the integral while it would drive the output further out, and
    ``back_calculation`` adds Kb (y - unlimited y) to its rate. ``tracking`` adds Kt (tracking - y) to it,
    for a smooth change over from another controller.
    """

    family: ClassVar[str] = "continuous"
    title: ClassVar[str] = "PID Controller"
    example: ClassVar[WorkedExample] = _answer("one", I=1.5, D=0.4)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the error"), *self.further_ports())

    def errors(self, u: Signals, p: Signals) -> Errors:
        return one_error(u["u"])


@dataclass(frozen=True, kw_only=True)
class PID2DOF(ContinuousPidBlock):
    """PID with two degrees of freedom: y = P (b r - u) + I/s (r - u) + D N s/(s + N) (c r - u).

    The weights b and c let a step of the reference r pass softly while disturbances are still fought hard.
    Forms, limits, reset and tracking are those of the PID Controller.
    """

    family: ClassVar[str] = "continuous"
    title: ClassVar[str] = "PID Controller (2DOF)"
    example: ClassVar[WorkedExample] = _answer("two", P=4.0, I=3.0, D=1.0, b=0.4, c=0.0)

    b: ArrayLike = gain_parameter(1.0, "weight of the reference in the proportional action")
    c: ArrayLike = gain_parameter(1.0, "weight of the reference in the derivative action")

    def input_ports(self) -> tuple[Port, ...]:
        return (*_TWO_INPUTS, *self.further_ports())

    def errors(self, u: Signals, p: Signals) -> Errors:
        return weighted_errors(u["r"], u["u"], p)


@dataclass(frozen=True, kw_only=True)
class SampledPidBlock(Block):
    """What sampled PID controllers have in common: all but what the actions work on."""

    P: ArrayLike = gain_parameter(1.0, "proportional gain")
    I: ArrayLike = gain_parameter(1.0, "integral gain", "1/s")  # noqa: E741
    D: ArrayLike = gain_parameter(0.0, "derivative gain", "s")
    N: ArrayLike = bandwidth_parameter()
    lower: ArrayLike = lower_limit_parameter()
    upper: ArrayLike = upper_limit_parameter()
    anti_windup: str = anti_windup_parameter()
    Kb: ArrayLike = gain_parameter(1.0, "back-calculation gain", "1/s")
    initial_integral: ArrayLike = gain_parameter(0.0, "integral action at the start")
    initial_filter: ArrayLike = gain_parameter(0.0, "filter state at the start")
    form: str = form_parameter()
    external_reset: str = external_reset_parameter()
    tracking: bool = tracking_parameter()
    Kt: ArrayLike = gain_parameter(1.0, "tracking gain", "1/s")
    integrator_method: str = method_parameter("rule of the integral")
    filter_method: str = method_parameter("rule of the filter")
    sample_time: ArrayLike = sample_time_parameter()

    def check(self) -> None:
        _check(self, limited=True)

    def further_ports(self) -> tuple[Port, ...]:
        """The inputs that parameters ask for."""
        reset = (Port("reset", "the trigger", shape=()),) if self.external_reset != "none" else ()
        tracking = (Port("tracking", "what the output shall be close to"),) if self.tracking else ()
        return (*reset, *tracking)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the control action"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": _shape(self, inputs)}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return self._law.states(_shape(self, inputs))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": self._law.output(x, self.errors(u, p), p, u.get("reset"))}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return self._law.updates(x, self.errors(u, p), p, u.get("reset"), u.get("tracking"))

    def initial_states(self, p: Signals) -> Signals:
        return self._law.start(p)

    @abstractmethod
    def errors(self, u: Signals, p: Signals) -> Errors:
        """What each of the three actions works on."""

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

    That is Simulink's Discrete PID Controller with forward Euler rules; ``backward_euler`` and
    ``trapezoidal`` are its other two, for the integral and the filter each. Where the output is limited,
    ``clamping`` stops the integral while it would drive the output further out, and ``back_calculation``
    adds T Kb (y - unlimited y) to it. ``tracking`` adds T Kt (tracking - y). A reset happens at the tick
    that finds the trigger on the other side of zero.
    """

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Discrete PID Controller"
    sampled: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = _answer("one", I=1.5, sample_time=0.1)

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the error"), *self.further_ports())

    def errors(self, u: Signals, p: Signals) -> Errors:
        return one_error(u["u"])


@dataclass(frozen=True, kw_only=True)
class DiscretePID2DOF(SampledPidBlock):
    """Sampled PID with two degrees of freedom: P acts on b r - u, I on r - u, D on c r - u.

    The weights b and c let a step of the reference r pass softly while disturbances are still fought hard.
    Rules, forms, limits, reset and tracking are those of the Discrete PID Controller.
    """

    family: ClassVar[str] = "discrete"
    title: ClassVar[str] = "Discrete PID Controller (2DOF)"
    sampled: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = _answer("two", P=4.0, I=3.0, D=1.0, N=8.0, b=0.4, sample_time=0.1)

    b: ArrayLike = gain_parameter(1.0, "weight of the reference in the proportional action")
    c: ArrayLike = gain_parameter(1.0, "weight of the reference in the derivative action")

    def input_ports(self) -> tuple[Port, ...]:
        return (*_TWO_INPUTS, *self.further_ports())

    def errors(self, u: Signals, p: Signals) -> Errors:
        return weighted_errors(u["r"], u["u"], p)


def _check(block: Block, limited: bool) -> None:
    limits_in_order(block, "lower", "upper")
    ends = [np.ravel(np.asarray(block.parameter_value(name))) for name in ("lower", "upper")]
    if not limited and np.isfinite(np.concatenate(ends)).any():
        raise InputError(
            "there are limits, but limit_output is false",
            where=block.type_name(),
            allowed="limits together with limit_output=True",
            fix="set limit_output, or leave lower and upper out",
        )


def _shape(block: Block, inputs: Shapes) -> Shape:
    wide = {name: shape for name, shape in inputs.items() if name != "reset"}
    own = {
        rule.name: shape_of(block.parameter_value(rule.name)) for rule in block.parameters() if rule.tunable
    }
    return broadcast({**wide, **own})
