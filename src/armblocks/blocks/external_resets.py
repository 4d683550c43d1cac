"""External resets, as Simulink names them: when a signal at a port sets a block's states anew.

``rising``: it becomes positive. ``falling``: it stops being positive. ``either``: both. ``level``: it is not
0, or has just become 0; the states are held meanwhile. ``level hold``: it is not 0.
"""

from __future__ import annotations

from typing import Any

from casadi import SX, if_else, logic_and, logic_or

from armblocks.diagram import Port, State, parameter

EDGES = {"rising": 1, "falling": -1, "either": 0}
"""The direction in which the trigger passes 0 where it fires."""
LEVELS = ("level", "level hold")
EXTERNAL_RESETS = ("none", *EDGES, *LEVELS)
INITIAL_SOURCES = ("internal", "external", "external at resets")
"""Where a start value comes from: the parameter; a port; a port at resets, the parameter at the start."""

SEEN = State("seen", (), "the side of the trigger at the tick before: 1 or 0; -1 before the first")
"""What a sampled block has to remember of its trigger."""


def external_reset_parameter(default: str) -> Any:
    """Declare ``external_reset``, which adds the input ``reset``."""
    return parameter(default, choices=EXTERNAL_RESETS, doc="when the input reset sets the state anew")


def initial_source_parameter(default: str = "internal") -> Any:
    """Declare ``initial_condition_source``, which may add the input ``initial``."""
    doc = "what the state becomes at the start and at a reset: the parameter initial, or the input initial"
    return parameter(default, choices=INITIAL_SOURCES, doc=doc)


def reset_ports(external_reset: str, initial_condition_source: str) -> tuple[Port, ...]:
    """The inputs that the two parameters ask for."""
    reset = Port("reset", f"the trigger: {external_reset}", shape=())
    initial = Port("initial", "what the state becomes")
    return (
        *(() if external_reset == "none" else (reset,)),
        *(() if initial_condition_source == "internal" else (initial,)),
    )


def side_of(external_reset: str, trigger: SX) -> SX:
    """1 or 0: whether the trigger is positive, or is not 0 where its level counts."""
    return trigger != 0.0 if external_reset in LEVELS else trigger > 0.0


def fires_at_tick(external_reset: str, trigger: SX, seen: SX) -> SX:
    """Whether a sampled block starts anew at this tick; ``seen`` is the state ``SEEN``."""
    side = side_of(external_reset, trigger)
    rises, falls = logic_and(side, seen == 0.0), logic_and(side == 0.0, seen == 1.0)
    fires = {
        "rising": rises,
        "falling": falls,
        "either": logic_or(rises, falls),
        "level": logic_or(side, falls),
        "level hold": side,
    }
    return if_else(fires[external_reset], 1.0, 0.0)
