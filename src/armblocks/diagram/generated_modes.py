"""Modes, guards and states that are generated for conditions and for modes with hysteresis.

Each function returns changed features.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from casadi import SX, densify, if_else, substitute

from armblocks.diagram.block import Signals
from armblocks.diagram.features import Arguments, Features, SlotKind
from armblocks.diagram.flat_values import broadcast_column
from armblocks.diagram.port import Condition, Guard, State
from armblocks.equations import Slot, unflatten


def with_previous_modes(features: Features, *, clocked: bool) -> Features:
    """Add a discrete state for every mode with hysteresis: its value before the event time.

    The mode is computed from this value, not from values during the mode iteration. ``clocked``: the block is
    active at the ticks of a clock; a tick does not change the previous value.
    """
    hysteresis_modes = [mode for mode in features.modes if mode.hysteresis]
    if not hysteresis_modes:
        return features
    modes, updates = features.equations[SlotKind.MODE], features.equations[SlotKind.UPDATE]

    def earlier(at: Arguments) -> Signals:
        return modes(at.with_states({mode.name: at.x[mode.before] for mode in hysteresis_modes}))

    def updated(at: Arguments) -> Signals:
        return {**updates(at), **{mode.before: at.x[mode.before] for mode in hysteresis_modes}}

    before = (dataclasses.replace(mode, name=mode.before) for mode in hysteresis_modes)
    return dataclasses.replace(
        features.with_equations({SlotKind.MODE: earlier, **({SlotKind.UPDATE: updated} if clocked else {})}),
        discrete=(*features.discrete, *before),
    )


def with_modes_of_conditions(features: Features, located: Sequence[Condition]) -> Features:
    """Add a mode and a guard for each of these conditions: a change of the condition is an event."""
    if not located:
        return features
    equations = features.equations

    def guards(at: Arguments) -> Signals:
        quantities = equations[SlotKind.CONDITION](at)
        sides = {entry.name: _with_offset(quantities[entry.name], entry.closed) for entry in located}
        return {**equations[SlotKind.GUARD](at), **sides}

    def evaluated(at: Arguments) -> dict[str, SX]:
        quantities = equations[SlotKind.CONDITION](at)
        return {entry.name: _positive(quantities[entry.name], entry.closed) for entry in located}

    def contradictions(at: Arguments) -> Signals:
        inconsistent = {name: SX(truth) != at.x[name] for name, truth in evaluated(at).items()}
        return {**equations[SlotKind.CONTRADICTION](at), **inconsistent}

    def resets(at: Arguments) -> Signals:
        after = {
            entry.name: if_else(at.e[entry.name] == 0.0, at.x[entry.name], at.e[entry.name] > 0.0)
            for entry in located
        }
        return {**equations[SlotKind.RESET](at), **after}

    modes = (State(entry.name, entry.shape, entry.doc, follows=True) for entry in located)
    added = (Guard(entry.name, entry.shape, entry.doc, locates=True) for entry in located)
    changed = features.with_equations(
        {
            SlotKind.GUARD: guards,
            SlotKind.MODE: lambda at: {**equations[SlotKind.MODE](at), **evaluated(at)},
            SlotKind.CONTRADICTION: contradictions,
            SlotKind.RESET: resets,
        }
    )
    return dataclasses.replace(changed, modes=(*features.modes, *modes), guards=(*features.guards, *added))


def evaluated_conditions(features: Features, requested: Sequence[Condition], at: Arguments) -> Signals:
    """The conditions at the present values; the value of each is substituted into the conditions after it."""
    if not requested:
        return {}
    unknown = {
        entry.name: unflatten(SX.sym(entry.name, Slot(entry.name, entry.shape).size), entry.shape)
        for entry in requested
    }
    quantities = features.equations[SlotKind.CONDITION](at.with_states(unknown))
    values: dict[str, SX] = {}
    for entry in requested:
        quantity = SX(quantities[entry.name])
        for name, value in values.items():
            quantity = substitute(quantity, unknown[name], value)
        truth = densify(SX(_positive(quantity, entry.closed)))
        values[entry.name] = unflatten(broadcast_column(truth, entry.shape), entry.shape)
    return values


def _positive(quantity: SX, closed: bool) -> SX:
    return quantity >= 0.0 if closed else quantity > 0.0


def _with_offset(quantity: SX, closed: bool) -> SX:
    """The quantity with an offset below the resolution of all signals; zero then has a definite sign."""
    return quantity + 1e-300 if closed else quantity - 1e-300
