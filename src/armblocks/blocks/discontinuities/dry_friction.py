"""Friction and backlash, with exactly located events for sticking, slipping and reversal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, fabs, fmax, fmin, if_else, logic_and, logic_or, sign
from numpy.typing import ArrayLike

from armblocks.blocks.switching import SMALLEST_JUMP, THRESHOLD_OFFSET, limits_in_order, same_instant
from armblocks.diagram import (
    Block,
    Guard,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    broadcast,
    driver,
    parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, graph


@dataclass(frozen=True, kw_only=True)
class CoulombFriction(Block):
    """Coulomb and viscous friction: y = sign(u) (offset + gain |u|), and 0 at rest."""

    following_modes: ClassVar[bool] = True
    title: ClassVar[str] = "Coulomb and Viscous Friction"
    sign: ClassVar[FaceSign] = graph((0, 0), (0.5, 0.3), (0.5, 0.7), (1, 1))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Friction for a sinusoidal speed: it jumps when the speed changes its sign.",
        parameters={"gain": 0.5},
        inputs={"u": driver("SineWave")},
    )

    offset: ArrayLike = parameter(1.0, kind=ParameterKind.ARRAY, minimum=0.0, doc="Coulomb friction force")
    gain: ArrayLike = parameter(
        1.0, kind=ParameterKind.ARRAY, minimum=0.0, doc="viscous friction coefficient"
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the speed"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the force against the motion"),)

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return {"y": broadcast({**inputs, "offset": shape_of(self.offset), "gain": shape_of(self.gain)})}

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("mode", inputs["u"], "the sign of the speed"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        shape = inputs["u"]
        return (Guard("forward", shape, "u > 0"), Guard("backward", shape, "u < 0"))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": x["mode"] * p["offset"] + p["gain"] * u["u"]}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"forward": u["u"] - THRESHOLD_OFFSET, "backward": u["u"] + THRESHOLD_OFFSET}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"mode": sign(u["u"])}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        forward = if_else(e["forward"] == 0.0, x["mode"] > 0.0, e["forward"] > 0.0)
        backward = if_else(e["backward"] == 0.0, x["mode"] < 0.0, e["backward"] < 0.0)
        return {"mode": forward - backward}


@dataclass(frozen=True, kw_only=True)
class Backlash(Block):
    """Backlash between two parts: y is constant while u moves within the play, and follows u at its ends.

    y' = u' while y = u - width/2 and u' > 0, or y = u + width/2 and u' < 0; else y' = 0. If u jumps beyond
    the play, y jumps to the end of the play.
    """

    title: ClassVar[str] = "Backlash"
    sign: ClassVar[FaceSign] = graph((0, 0), (0.55, 1), (1, 1), (0.45, 0), (0, 0))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=(
            "A gear with play 1: the output follows at half the play and is constant while "
            "the input crosses the play."
        ),
        inputs={"u": driver("SineWave", amplitude=2.0)},
    )
    differentiated_inputs: ClassVar[tuple[str, ...]] = ("u",)

    width: float = parameter(1.0, minimum=0.0, doc="the width of the play")
    initial: float = parameter(0.0, doc="the output at t = 0, if it is within the play around u")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the driving part"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the driven part"),)

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        return {"y": inputs["u"]}

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        doc = "the output just before the latest instant, or before the latest event at that instant"
        return (State("rest", inputs["u"], doc, hysteresis=True),)

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        doc = "1 driven upwards, -1 downwards, 0 at rest"
        return (State("mode", inputs["u"], doc, follows=True, hysteresis=True),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        shape = inputs["u"]
        return (
            Guard("upper", shape, "u reaches the upper end of the play", 1, locates=True),
            Guard("lower", shape, "u reaches the lower end of the play", -1, locates=True),
            Guard("turn", shape, "u turns back", locates=True),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        driven = u["u"] - x["mode"] * p["width"] / 2.0
        return {"y": if_else(x["mode"] == 0.0, x["rest"], driven)}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        ahead = u["u"] - x["rest"]
        # At rest, reversals of u have no effect. While the part is driven, the ends of the play have no
        # effect.
        free = x["mode"] == 0.0
        return {
            "upper": if_else(free, ahead - p["width"] / 2.0 - THRESHOLD_OFFSET, -1.0),
            "lower": if_else(free, ahead + p["width"] / 2.0 + THRESHOLD_OFFSET, 1.0),
            "turn": if_else(free, 0.0, u["u'"]),
        }

    def captures(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"rest": self.outputs(t, x, u, p)["y"]}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        ahead, half = u["u"] - x["rest"], p["width"] / 2.0
        band = SMALLEST_JUMP * fmax(1.0, fabs(u["u"]))
        # When u reverses at an end of the play, rounding must not drive the output in the old direction
        # again.
        above, below = if_else(u["u'"] < 0.0, band, 0.0), if_else(u["u'"] > 0.0, -band, 0.0)
        by_position = if_else(ahead - half > above, 1.0, if_else(ahead + half < below, -1.0, 0.0))
        # A driven output stops when u reverses or jumps back; beyond the other end it is driven back.
        released = logic_or(u["u'"] < 0.0, ahead < half - band)
        released_down = logic_or(u["u'"] > 0.0, ahead > band - half)
        upwards = if_else(released, fmin(by_position, 0.0), 1.0)
        downwards = if_else(released_down, fmax(by_position, 0.0), -1.0)
        return {"mode": if_else(x["mode"] > 0.0, upwards, if_else(x["mode"] < 0.0, downwards, by_position))}

    def initial_states(self, p: Signals) -> Signals:
        return {"rest": p["initial"]}


@dataclass(frozen=True, kw_only=True)
class StickSlipFriction(Block):
    """A mass with dry friction: mass v' = F - sign(v) coulomb - viscous v, and v = 0 while |F| <= static.

    If the mass stops while the force is within static friction, it sticks: its speed is exactly 0 until the
    force exceeds static friction.
    """

    title: ClassVar[str] = "Stick-Slip Friction"
    sign: ClassVar[FaceSign] = graph((0, 0.12), (0.4, 0.22), (0.5, 0), (0.5, 1), (0.6, 0.78), (1, 0.88))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=(
            "The force grows linearly. Friction balances it, and the mass rests, until the force "
            "exceeds 1.2 N. In motion the friction is 1 N."
        ),
        inputs={"F": driver("Ramp", slope=0.2)},
    )

    mass: float = parameter(1.0, above=0.0, doc="the mass", unit="kg")
    coulomb: float = parameter(1.0, minimum=0.0, doc="friction in motion", unit="N")
    static: float = parameter(1.2, minimum=0.0, doc="friction at rest, at least coulomb", unit="N")
    viscous: float = parameter(0.0, minimum=0.0, doc="viscous friction coefficient", unit="N s/m")
    initial_position: float = parameter(0.0, doc="the position at t = 0", unit="m")
    initial_speed: float = parameter(0.0, doc="the speed at t = 0", unit="m/s")

    def check(self) -> None:
        limits_in_order(self, "coulomb", "static")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("F", "the driving force", "N", shape=()),)

    def output_ports(self) -> tuple[Port, ...]:
        return (
            Port("x", "the position", "m", shape=()),
            Port("v", "the speed", "m/s", shape=()),
            Port("friction", "the force against the motion", "N", shape=()),
        )

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("x", (), "the position", "m"), State("v", (), "the speed", "m/s"))

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("mode", (), "0 at rest, 1 sliding forwards, -1 backwards"),)

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        return (State("instant", (), "the latest tick, event or breakpoint", "s"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return (
            Guard("stop", (), "the speed"),
            Guard("forwards", (), "F exceeds static friction", 1),
            Guard("backwards", (), "-F exceeds static friction", -1),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        sliding = x["mode"] * p["coulomb"] + p["viscous"] * x["v"]
        # After a jump of the force beyond static friction, the friction is Coulomb friction at once.
        breaking = logic_and(same_instant(t, x["instant"]), fabs(u["F"]) > p["static"])
        holding = if_else(breaking, sign(u["F"]) * p["coulomb"], u["F"])
        return {"x": x["x"], "v": x["v"], "friction": if_else(x["mode"] == 0.0, holding, sliding)}

    def captures(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"instant": t}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        sliding = (u["F"] - x["mode"] * p["coulomb"] - p["viscous"] * x["v"]) / p["mass"]
        return {"x": x["v"], "v": if_else(x["mode"] == 0.0, 0.0, sliding)}

    def initial_states(self, p: Signals) -> Signals:
        return {"x": p["initial_position"], "v": p["initial_speed"], "instant": SX(0.0)}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {
            "stop": x["v"],
            "forwards": u["F"] - p["static"] - THRESHOLD_OFFSET,
            "backwards": u["F"] + p["static"] + THRESHOLD_OFFSET,
        }

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"mode": if_else(x["v"] == 0.0, self._breaking(u, p), sign(x["v"]))}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        stops = logic_and(x["mode"] != 0.0, e["stop"] * x["mode"] < 0.0)
        broken = if_else(e["forwards"] > 0.0, 1.0, if_else(e["backwards"] < 0.0, -1.0, 0.0))
        moving = if_else(x["mode"] == 0.0, broken, x["mode"])
        # The speed of a mass at rest does not depend on the parameters: its sensitivities are 0 too.
        rests = logic_and(x["v"] == 0.0, self._breaking(u, p) == 0.0)
        return {
            "mode": if_else(stops, self._breaking(u, p), moving),
            "v": if_else(logic_or(stops, rests), 0.0, x["v"]),
        }

    def _breaking(self, u: Signals, p: Signals) -> SX:
        """The direction in which the force moves a mass at rest; 0 if friction holds it."""
        return if_else(fabs(u["F"]) > p["static"], sign(u["F"]), 0.0)
