"""External resets with Simulink's names: when a trigger signal resets the states of a block.

``rising``: the trigger becomes positive. ``falling``: it stops being positive. ``either``: both events.
``level``: the trigger is not 0, or has just become 0. ``level hold``: the trigger is not 0. In both
level modes the states are held while the trigger is not 0.
"""

from __future__ import annotations

from typing import Any

from casadi import SX, if_else, logic_and, logic_or

from armblocks.diagram import Port, State, parameter

EDGES = {"rising": 1, "falling": -1, "either": 0}
"""The direction of the zero crossing at which the trigger fires."""
LEVELS = ("level", "level hold")
EXTERNAL_RESETS = ("none", *EDGES, *LEVELS)
INITIAL_SOURCES = ("internal", "external", "external at resets")
"""Source of the initial value: the parameter; a port; or the parameter at the start and a port at resets."""

PREVIOUS_TRIGGER = State(
    "previous", (), "trigger state at the previous tick: 1 or 0; -1 before the first tick"
)
"""The state of a sampled block that holds its previous :func:`trigger_state`."""


def external_reset_parameter(default: str) -> Any:
    """Declare ``external_reset``, which adds the input ``reset``."""
    return parameter(
        default, choices=EXTERNAL_RESETS, doc="edge or level at the input reset that resets the state"
    )


def initial_source_parameter(default: str = "internal") -> Any:
    """Declare ``initial_condition_source``, which adds the input ``initial`` for some values."""
    doc = "source of the initial value: the parameter initial, or the input initial"
    return parameter(default, choices=INITIAL_SOURCES, doc=doc)


def reset_ports(external_reset: str, initial_condition_source: str) -> tuple[Port, ...]:
    """The inputs that the two parameters enable."""
    reset = Port("reset", f"the trigger: {external_reset}", shape=())
    initial = Port("initial", "state at the start and after a reset")
    return (
        *(() if external_reset == "none" else (reset,)),
        *(() if initial_condition_source == "internal" else (initial,)),
    )


def trigger_state(external_reset: str, trigger: SX) -> SX:
    """1 if the trigger is positive (for the level modes, not 0), else 0."""
    return trigger != 0.0 if external_reset in LEVELS else trigger > 0.0


def fires_at_tick(external_reset: str, trigger: SX, previous: SX) -> SX:
    """Whether a sampled block is reset at this tick; ``previous`` is the state ``PREVIOUS_TRIGGER``."""
    state = trigger_state(external_reset, trigger)
    rises, falls = logic_and(state, previous == 0.0), logic_and(state == 0.0, previous == 1.0)
    reset_conditions = {
        "rising": rises,
        "falling": falls,
        "either": logic_or(rises, falls),
        "level": logic_or(state, falls),
        "level hold": state,
    }
    return if_else(reset_conditions[external_reset], 1.0, 0.0)
