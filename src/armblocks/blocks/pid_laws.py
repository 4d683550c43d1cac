"""PID control laws, in continuous time and sampled, with one and two degrees of freedom.

A law takes three errors, one for each action. With one degree of freedom all three are the input. As in
Simulink, the ideal form multiplies the integral and the derivative gain by P, so that the states have the
unit of the output in both forms.

K. J. Astrom, T. Hagglund, Advanced PID Control, 2006, sections 3.4 (set-point weighting) and 3.5 (windup,
back-calculation and tracking).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from casadi import SX, fmax, fmin, if_else, logic_and, logic_or

from armblocks.blocks.integration_rules import included_fraction, interval_of_update
from armblocks.blocks.switching import THRESHOLD_OFFSET, zone, zone_after
from armblocks.diagram import Guard, Signals, State
from armblocks.equations import Shape

FORMS = ("parallel", "ideal")
ANTI_WINDUP = ("none", "clamping", "back_calculation")
RESETS: Mapping[str, int] = {"none": 0, "rising": 1, "falling": -1, "either": 0}
METHODS = ("forward_euler", "backward_euler", "trapezoidal")


@dataclass(frozen=True, kw_only=True)
class Errors:
    """The errors of the three actions."""

    proportional: SX
    integral: SX
    derivative: SX


def one_error(u: SX) -> Errors:
    """The input as the error of all three actions (one degree of freedom)."""
    return Errors(proportional=u, integral=u, derivative=u)


def weighted_errors(r: SX, u: SX, p: Signals) -> Errors:
    """The errors with the set-point weights ``b`` (proportional) and ``c`` (derivative action)."""
    return Errors(proportional=p["b"] * r - u, integral=r - u, derivative=p["c"] * r - u)


def pid_states(shape: Shape) -> tuple[State, ...]:
    """The two states of every law."""
    return (
        State("integral", shape, "the integral action"),
        State("filter", shape, "filter state: filtered product of derivative gain and error"),
    )


def pid_start(p: Signals) -> Signals:
    """The initial values of the two states."""
    return {"integral": p["initial_integral"], "filter": p["initial_filter"]}


def _gains(form: str, p: Signals) -> tuple[SX, SX, SX]:
    """The gains P, I and D of the parallel form."""
    factor = p["P"] if form == "ideal" else SX(1.0)
    return p["P"], factor * p["I"], factor * p["D"]


@dataclass(frozen=True, kw_only=True)
class ContinuousPid:
    """The PID law in continuous time. Reaching and leaving a limit are events."""

    form: str
    limited: bool
    anti_windup: str
    external_reset: str

    @property
    def clamps(self) -> bool:
        """Whether the integral stops while it drives the output further beyond a limit."""
        return self.limited and self.anti_windup == "clamping"

    def modes(self, shape: Shape) -> tuple[State, ...]:
        """The modes: the active limit, and the direction of the integral."""
        limit = (State("limit", shape, "1 at the upper limit, -1 at the lower limit, else 0", follows=True),)
        drive = (State("drive", shape, "1 while the integral increases, else -1", follows=True),)
        return (*(limit if self.limited else ()), *(drive if self.clamps else ()))

    def guards(self, shape: Shape) -> tuple[Guard, ...]:
        """Guards of the limits, the sign of the integral's rate, and the reset."""
        declared = list[Guard]()
        if self.limited:
            declared += [
                Guard("upper", shape, "the output - upper", locates=True),
                Guard("lower", shape, "the output - lower", locates=True),
            ]
        if self.clamps:
            declared.append(Guard("drive", shape, "the rate of the integral", locates=True))
        if self.external_reset != "none":
            declared.append(Guard("reset", (), "the trigger", RESETS[self.external_reset]))
        return tuple(declared)

    def output(self, x: Signals, e: Errors, p: Signals) -> SX:
        """The controller output."""
        unlimited = self._unlimited_output(x, e, p)
        if not self.limited:
            return unlimited
        below = if_else(x["limit"] < 0.0, p["lower"], unlimited)
        return if_else(x["limit"] > 0.0, p["upper"], below)

    def derivatives(self, x: Signals, e: Errors, p: Signals, tracked: SX | None) -> Signals:
        """Rates of integral and filter."""
        _, _, D = _gains(self.form, p)
        rate = self._rate(x, e, p, tracked)
        if self.clamps:
            rate = if_else(x["limit"] * x["drive"] > 0.0, 0.0, rate)
        elif self.limited and self.anti_windup == "back_calculation":
            rate = rate + p["Kb"] * (self.output(x, e, p) - self._unlimited_output(x, e, p))
        return {"integral": rate, "filter": p["N"] * (D * e.derivative - x["filter"])}

    def guard_values(
        self, x: Signals, e: Errors, p: Signals, tracked: SX | None, trigger: SX | None
    ) -> Signals:
        """The values of :meth:`guards`."""
        values = dict[str, SX]()
        if self.limited:
            unlimited = self._unlimited_output(x, e, p)
            values |= {"upper": unlimited - p["upper"], "lower": unlimited - p["lower"]}
        if self.clamps:
            values["drive"] = self._rate(x, e, p, tracked) - THRESHOLD_OFFSET
        if trigger is not None:
            values["reset"] = trigger - THRESHOLD_OFFSET
        return values

    def mode_values(self, x: Signals, e: Errors, p: Signals, tracked: SX | None) -> Signals:
        """The modes that follow from the present values."""
        values = dict[str, SX]()
        if self.limited:
            values["limit"] = zone(self._unlimited_output(x, e, p), p["lower"], p["upper"])
        if self.clamps:
            values["drive"] = if_else(self._rate(x, e, p, tracked) > 0.0, 1.0, -1.0)
        return values

    def resets(self, x: Signals, p: Signals, fired: Signals) -> Signals:
        """The modes and states after events."""
        after = dict[str, SX]()
        if self.limited:
            after["limit"] = zone_after(x["limit"], fired)
        if self.clamps:
            after["drive"] = if_else(fired["drive"] == 0.0, x["drive"], fired["drive"])
        if self.external_reset != "none":
            untriggered = fired["reset"] == 0.0
            after |= {name: if_else(untriggered, x[name], start) for name, start in pid_start(p).items()}
        return after

    def _unlimited_output(self, x: Signals, e: Errors, p: Signals) -> SX:
        """The controller output before it is limited."""
        P, _, D = _gains(self.form, p)
        return P * e.proportional + x["integral"] + p["N"] * (D * e.derivative - x["filter"])

    def _rate(self, x: Signals, e: Errors, p: Signals, tracked: SX | None) -> SX:
        """The rate of the integral without anti-windup."""
        _, I, _ = _gains(self.form, p)  # noqa: E741
        rate = I * e.integral
        return rate if tracked is None else rate + p["Kt"] * (tracked - self.output(x, e, p))


@dataclass(frozen=True, kw_only=True)
class SampledPid:
    """The PID law at the ticks of a clock with the period T, or at trigger events.

    Sums are forward Euler T / (z - 1), backward Euler T z / (z - 1), or trapezoidal T (z + 1) / (2 (z - 1)).
    With the last two rules, the output contains the newest increment of the integral. The increment of
    back-calculation then depends on the output itself. This equation is piecewise linear and is solved here,
    so that there is no algebraic loop.
    """

    form: str
    anti_windup: str
    external_reset: str
    integrator_method: str
    filter_method: str

    def states(self, shape: Shape) -> tuple[State, ...]:
        """The states of every law, and the previous sign of the trigger."""
        if self.external_reset == "none":
            return pid_states(shape)
        side = State(
            "trigger",
            (),
            "1 if the trigger was positive at the previous tick, else -1; 0 before the first tick",
        )
        return (*pid_states(shape), side)

    def start(self, p: Signals) -> Signals:
        """Initial values of the states."""
        return pid_start(p) if self.external_reset == "none" else {**pid_start(p), "trigger": SX(0.0)}

    def output(self, x: Signals, e: Errors, p: Signals, trigger: SX | None) -> SX:
        """The controller output."""
        return self._limited(self._unlimited_output(self._at_tick(x, p, trigger), e, p), p)

    def updates(self, x: Signals, e: Errors, p: Signals, trigger: SX | None, tracked: SX | None) -> Signals:
        """The next states."""
        states = self._at_tick(x, p, trigger)
        _, I, D = _gains(self.form, p)  # noqa: E741
        rate, unlimited = I * e.integral, self._unlimited_output(states, e, p)
        limited = self._limited(unlimited, p)
        if self.anti_windup == "clamping":
            outwards = (unlimited - limited) * rate > 0.0
            rate = if_else(outwards, SX(0.0), rate)
        elif self.anti_windup == "back_calculation":
            fraction = included_fraction(self.integrator_method) * p["T"] * p["Kb"]
            rate = rate + p["Kb"] * (limited - unlimited) / (1.0 + fraction)
        if tracked is not None:
            rate = rate + p["Kt"] * (tracked - limited)
        after = {
            "integral": states["integral"] + interval_of_update(self.integrator_method, p) * rate,
            "filter": states["filter"]
            + interval_of_update(self.filter_method, p) * self._derivative(states, D * e.derivative, p),
        }
        if trigger is not None:
            after["trigger"] = if_else(trigger > 0.0, 1.0, -1.0)
        return after

    def _unlimited_output(self, states: Signals, e: Errors, p: Signals) -> SX:
        """The controller output before it is limited."""
        P, I, D = _gains(self.form, p)  # noqa: E741
        unlimited = P * e.proportional + states["integral"] + self._derivative(states, D * e.derivative, p)
        fraction = included_fraction(self.integrator_method)
        return unlimited + fraction * p["T"] * I * e.integral if fraction else unlimited

    def _derivative(self, states: Signals, weighted: SX, p: Signals) -> SX:
        """The filtered derivative d = N (D e - f), where f is the sum of d."""
        rate, fraction = p["N"] * (weighted - states["filter"]), included_fraction(self.filter_method)
        return rate / (1.0 + fraction * p["T"] * p["N"]) if fraction else rate

    def _at_tick(self, x: Signals, p: Signals, trigger: SX | None) -> Signals:
        """The states at this tick, after a possible reset."""
        if trigger is None:
            return x
        rises = logic_and(x["trigger"] < 0.0, trigger > 0.0)
        falls = logic_and(x["trigger"] > 0.0, trigger <= 0.0)
        is_reset = {"rising": rises, "falling": falls, "either": logic_or(rises, falls)}[self.external_reset]
        return {name: if_else(is_reset, start, x[name]) for name, start in pid_start(p).items()}

    def _limited(self, value: SX, p: Signals) -> SX:
        return fmin(fmax(value, p["lower"]), p["upper"])
