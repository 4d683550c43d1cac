"""Blocks that replace conditional subsystems in a flat diagram: controls, held outputs, merged outputs.

They are not in the library and never in a file. An event has two iterations. In the first, the control's mode
follows its signal, and ``restart`` or ``fire`` becomes 1. In the second, the guard ``changed`` triggers: the
blocks inside are reset or executed, and the state ``previous`` stores the new value of the control. At a
tick the modes follow immediately, so that one iteration is sufficient."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, fabs, if_else, logic_and, logic_not, logic_or
from numpy.typing import ArrayLike

from armblocks.diagram.block import Block, Shapes, Signals
from armblocks.diagram.parameter import ParameterKind, parameter, shape_of
from armblocks.diagram.port import Guard, Port, State
from armblocks.diagram.shape_rules import broadcast

THRESHOLD_OFFSET = 1e-300
"""Offset below the resolution of all signals. With it, a signal of exactly zero has a definite sign."""
_STATES = ("held", "reset")
_RESET_PORT = Port("outer_restart", "whether the enclosing subsystem is reset", "", ())
_EDGES = ("rising", "falling", "either")


def _outer_ports(block: EnableControl | TriggerControl) -> tuple[Port, ...]:
    ports = (
        (block.outer, Port("outer", "whether the enclosing subsystem is active", "", ())),
        (block.resettable, _RESET_PORT),
    )
    return tuple(port for needed, port in ports if needed)


def _held_value(block: HeldOutput | MergedOutput, x: Signals, u: Signals, p: Signals) -> SX:
    """The held value of an output; a reset of the enclosing subsystem sets it to the initial value."""
    return if_else(u["outer_restart"], p["initial"], x["held"]) if block.resettable else x["held"]


def _outer_active(u: Signals) -> SX:
    return u.get("outer", SX(1.0))


def _is_positive(u: SX) -> SX:
    """1 where a control signal is positive, else 0."""
    return if_else(u > 0.0, 1.0, 0.0)


def _start_pending(on: SX, x: Signals) -> SX:
    """Whether a control has turned on at this instant, and the blocks inside have not started yet."""
    return logic_and(on, x["previous"] == 0.0)


@dataclass(frozen=True, kw_only=True)
class EnableControl(Block):
    """Whether an enabled subsystem is active, and whether its states are reset at this time: on = u > 0.

    ``running`` follows ``on`` after the blocks inside have consistent modes and initial states. Events
    outside the subsystem therefore never read outputs of old modes and states.
    """

    title: ClassVar[str] = "Enable"

    outer: bool = parameter(False, doc="whether the block is inside a subsystem that can be inactive")
    resettable: bool = parameter(
        False, doc="whether the block is inside a subsystem whose states can be reset"
    )
    restarts: bool = parameter(False, doc="whether states are reset when the subsystem is enabled")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the control signal", "", ()), *_outer_ports(self))

    def output_ports(self) -> tuple[Port, ...]:
        return (
            Port("on", "1 while the subsystem is active", "", ()),
            Port("running", "1 while the subsystem is active and its blocks have started", "", ()),
            Port("restart", "1 where states are reset", "", ()),
        )

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("previous", (), "value of on at the last action; -1 before the first"),)

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        running = State("running", (), "1 while on is 1 and the blocks inside have started", follows=True)
        return (State("side", (), "1 where u is positive, else 0", follows=True), running)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return (Guard("side", (), "u passes zero", locates=True), Guard("changed", (), "on has changed", 1))

    def initial_states(self, p: Signals) -> Signals:
        return {"previous": SX(-1.0)}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        on, outer_reset = x["side"] * _outer_active(u), u.get("outer_restart", SX(0.0))
        start = _start_pending(on, x) if self.restarts else SX(0.0)
        return {"on": on, "running": x["running"], "restart": logic_or(start, outer_reset)}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        changed = fabs(x["side"] * _outer_active(u) - x["previous"])
        return {
            "side": u["u"] - THRESHOLD_OFFSET,
            "changed": if_else(x["previous"] < 0.0, 0.0, changed) - 0.5,
        }

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        side = _is_positive(u["u"])
        return {"side": side, "running": side * _outer_active(u)}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        on = x["side"] * _outer_active(u)
        inconsistent = logic_and(x["running"] != on, logic_not(_start_pending(on, x)))
        return {"side": x["side"] != _is_positive(u["u"]), "running": inconsistent}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        side = if_else(e["side"] == 0.0, x["side"], if_else(e["side"] > 0.0, 1.0, 0.0))
        start = _is_positive(u["u"]) * _outer_active(u)
        previous = if_else(e["changed"] == 0.0, x["previous"], x["side"] * _outer_active(u))
        return {
            "side": side,
            "previous": if_else(logic_or(x["previous"] < 0.0, t <= 0.0), start, previous),
            "running": if_else(e["changed"] == 0.0, x["running"], x["side"] * _outer_active(u)),
        }


@dataclass(frozen=True, kw_only=True)
class TriggerControl(Block):
    """Whether a trigger fires at this time, and the time since the previous trigger event.

    The trigger does not fire at an instant at which the enclosing subsystem is reset: ``restarted`` is 1 from
    the reset to the end of the instant.
    """

    title: ClassVar[str] = "Trigger"

    outer: bool = parameter(False, doc="whether the block is inside a subsystem that can be inactive")
    resettable: bool = parameter(
        False, doc="whether the block is inside a subsystem whose states can be reset"
    )
    edge: str = parameter("rising", choices=_EDGES, doc="when the trigger fires")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the trigger", "", ()), *_outer_ports(self))

    def output_ports(self) -> tuple[Port, ...]:
        return (
            Port("fire", "1 when the trigger fires", "", ()),
            Port(
                "restart", "1 where states are reset, by this trigger or by the enclosing subsystem", "", ()
            ),
            Port("elapsed", "time since the previous trigger event, the start or a reset", "s", ()),
        )

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (
            State("previous", (), "sign of u at the last action; -1 before the first"),
            State("last", (), "time of the last trigger event or reset", "s"),
            *(
                (State("restarted", (), "1 from a reset to the end of its instant", momentary=True),)
                * self.resettable
            ),
        )

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("side", (), "1 where u is positive, else 0", follows=True),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return (
            Guard("side", (), "u passes zero", locates=True),
            Guard("changed", (), "the sign has changed", 1),
        )

    def initial_states(self, p: Signals) -> Signals:
        return {"previous": SX(-1.0), "last": SX(0.0)}

    def _outer_reset(self, x: Signals, u: Signals) -> SX:
        """Whether the enclosing subsystem is or was reset at this instant."""
        return logic_or(u["outer_restart"], x["restarted"]) if self.resettable else SX(0.0)

    def _fires(self, x: Signals, u: Signals) -> SX:
        rises = logic_and(x["side"] == 1.0, x["previous"] == 0.0)
        falls = logic_and(x["side"] == 0.0, x["previous"] == 1.0)
        fires = {"rising": rises, "falling": falls, "either": logic_or(rises, falls)}[self.edge]
        return logic_and(logic_and(fires, _outer_active(u)), logic_not(self._outer_reset(x, u)))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        fires = self._fires(x, u)
        return {
            "fire": fires,
            "restart": logic_or(fires, u.get("outer_restart", SX(0.0))),
            "elapsed": t - x["last"],
        }

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        changed = logic_and(x["previous"] >= 0.0, x["side"] != x["previous"])
        return {"side": u["u"] - THRESHOLD_OFFSET, "changed": if_else(changed, 0.5, -0.5)}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"side": _is_positive(u["u"])}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        side = if_else(e["side"] == 0.0, x["side"], if_else(e["side"] > 0.0, 1.0, 0.0))
        changed = e["changed"] != 0.0
        previous = if_else(changed, x["side"], x["previous"])
        starts = logic_or(logic_and(changed, self._fires(x, u)), u.get("outer_restart", SX(0.0)))
        after = {
            "side": side,
            "previous": if_else(logic_or(x["previous"] < 0.0, t <= 0.0), _is_positive(u["u"]), previous),
            "last": if_else(starts, t, x["last"]),
        }
        return {**after, "restarted": self._outer_reset(x, u)} if self.resettable else after


@dataclass(frozen=True, kw_only=True)
class HeldOutput(Block):
    """An output of a conditional subsystem: y = u while active, else its previous value or ``initial``.

    A reset of the enclosing subsystem sets the previous value to ``initial``, as at the start of a run.
    """

    title: ClassVar[str] = "Out"

    resettable: bool = parameter(
        False, doc="whether the block is inside a subsystem whose states can be reset"
    )
    pulsed: bool = parameter(False, doc="whether running is 1 at single instants only")
    when_off: str = parameter("held", choices=_STATES, doc="whether y is held or reset to initial")
    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="y before the subsystem has been active"
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (
            Port("u", "the output inside the subsystem"),
            Port("running", "1 while or when the subsystem is active", "", ()),
            *((_RESET_PORT,) * self.resettable),
        )

    def bus_inputs(self) -> tuple[str, ...]:
        return ("u",)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "signal to hold"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast({"u": inputs["u"], "initial": shape_of(self.initial)})}

    def assumed_output_shapes(self) -> Shapes:
        return {"y": shape_of(self.initial)}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("held", self.output_shapes(inputs)["y"], "previous value of y"),)

    def initial_states(self, p: Signals) -> Signals:
        return {"held": p["initial"]}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        held = self.pulsed or self.when_off == "held"
        return {"y": if_else(u["running"], u["u"], _held_value(self, x, u, p) if held else p["initial"])}

    def captures(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {} if self.pulsed else {"held": if_else(u["running"], u["u"], x["held"])}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        held = _held_value(self, x, u, p)
        if self.pulsed:
            return {"held": if_else(u["running"], u["u"], held)}
        return {"held": held} if self.resettable else {}


@dataclass(frozen=True, kw_only=True)
class MergedOutput(Block):
    """Merged outputs of conditional subsystems: y is the output of the subsystem that was active last.

    A reset of the enclosing subsystem sets y to ``initial``, as at the start of a run.
    """

    title: ClassVar[str] = "Merge"

    resettable: bool = parameter(
        False, doc="whether the block is inside a subsystem whose states can be reset"
    )
    inputs: int = parameter(2, minimum=1, doc="number of inputs")
    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, doc="y before any subsystem has been active"
    )

    def input_ports(self) -> tuple[Port, ...]:
        numbers = range(1, self.inputs + 1)
        return (
            *(Port(f"u{number}", "an output") for number in numbers),
            *(
                Port(f"running{number}", "1 while or when its subsystem is active", "", ())
                for number in numbers
            ),
            *((_RESET_PORT,) * self.resettable),
        )

    def bus_inputs(self) -> tuple[str, ...]:
        return tuple(f"u{number}" for number in range(1, self.inputs + 1))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the output of the subsystem that was active last"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        wide = {name: inputs[name] for name in self.bus_inputs()}
        return {"y": broadcast({**wide, "initial": shape_of(self.initial)})}

    def assumed_output_shapes(self) -> Shapes:
        return {"y": shape_of(self.initial)}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("held", self.output_shapes(inputs)["y"], "previous value of y"),)

    def initial_states(self, p: Signals) -> Signals:
        return {"held": p["initial"]}

    def _selected_output(self, x: Signals, u: Signals, p: Signals) -> SX:
        chosen = _held_value(self, x, u, p)
        for number in range(self.inputs, 0, -1):
            chosen = if_else(u[f"running{number}"], u[f"u{number}"], chosen)
        return chosen

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": self._selected_output(x, u, p)}

    def captures(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"held": self._selected_output(x, u, p)}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        # At t = 0 the controls may still change during the mode iteration.
        held = if_else(t <= 0.0, p["initial"], x["held"])
        return {"held": self._selected_output({**x, "held": held}, u, p)}
