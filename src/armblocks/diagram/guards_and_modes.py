"""The guards and modes of a diagram in the flat vectors of its system: indices, ranks, inconsistencies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from casadi import SX

from armblocks.diagram.controls import EnableControl, TriggerControl
from armblocks.diagram.features import SlotKind
from armblocks.diagram.model import Model
from armblocks.diagram.port import Guard
from armblocks.diagram.tracing import Symbols, Tracing
from armblocks.equations import EventRanks, signature


def guards_of(model: Model, flow: Tracing) -> list[tuple[str, Guard, SX]]:
    """The guards with the names of their blocks and their values."""
    return [
        (name, guard, flow.value(model.flow.slot(name, SlotKind.GUARD, guard.name)))
        for name, equations in model.flow.equations.items()
        for guard in equations.guards
    ]


def mode_contradictions(
    model: Model, symbols: Symbols, flow: Tracing
) -> tuple[tuple[int, ...], tuple[bool, ...], list[SX]]:
    """The indices of all modes in ``z``; whether each is a following mode; whether each is inconsistent."""
    ranges = signature(*symbols.discrete_slots).ranges
    indices: list[int] = []
    follows: list[bool] = []
    contradictions: list[SX] = []
    for name, equations in model.flow.equations.items():
        for mode in equations.modes:
            entries = ranges[f"{name}/{mode.name}"]
            indices += range(entries.start, entries.stop)
            follows += [mode.follows] * (entries.stop - entries.start)
            contradictions.append(flow.value(model.flow.slot(name, SlotKind.CONTRADICTION, mode.name)))
    return tuple(indices), tuple(follows), contradictions


def hysteresis_modes(model: Model, symbols: Symbols) -> tuple[tuple[int, int, int], ...]:
    """Indices in ``z`` of each hysteresis mode, its previous value, and its ``stored_while`` mode (or -1)."""
    ranges = signature(*symbols.discrete_slots).ranges
    return tuple(
        (own, before, ranges[f"{name}/{mode.stored_while}"].start if mode.stored_while else -1)
        for name, equations in model.flow.equations.items()
        for mode in equations.modes
        if mode.hysteresis
        for own, before in zip(
            _indices(ranges[f"{name}/{mode.name}"]), _indices(ranges[f"{name}/{mode.before}"])
        )
    )


def recaptured_states(model: Model, symbols: Symbols) -> tuple[int, ...]:
    """The indices in ``z`` of discrete states that are captured together with modes with hysteresis."""
    ranges = signature(*symbols.discrete_slots).ranges
    return tuple(
        index
        for name, equations in model.flow.equations.items()
        for state in equations.discrete
        if state.hysteresis and (SlotKind.CAPTURE, state.name) in equations.group_of
        for index in _indices(ranges[f"{name}/{state.name}"])
    )


def event_ranks(model: Model, symbols: Symbols, guards: Sequence[tuple[str, Guard]]) -> EventRanks | None:
    """The ranks of all events; ``None`` if all events are processed together."""
    order = model.events
    if order is None:
        return None
    rank_of = order.rank_of
    names = [name for slot in symbols.discrete_slots for name in [slot.name.rpartition("/")[0]] * slot.size]
    ranges = signature(*symbols.discrete_slots).ranges
    return EventRanks(
        before_ticks=order.before_ticks,
        guards=tuple(rank_of[name] for name, _ in guards),
        hysteresis_modes=tuple(rank_of[names[mode]] for mode, _, _ in hysteresis_modes(model, symbols)),
        recaptured_states=tuple(rank_of[names[index]] for index in recaptured_states(model, symbols)),
        controls=tuple(
            (ranges[f"{name}/side"].start, ranges[f"{name}/previous"].start, rank_of[name])
            for name, block in model.flow.diagram.blocks.items()
            if isinstance(block, EnableControl | TriggerControl)
        ),
    )


def momentary_states(model: Model, symbols: Symbols) -> dict[tuple[str, str], int]:
    """The indices in ``z`` of the discrete states that become 0 at the end of an instant."""
    ranges = signature(*symbols.discrete_slots).ranges
    return {
        (name, state.name): ranges[f"{name}/{state.name}"].start
        for name, equations in model.flow.equations.items()
        for state in equations.discrete
        if state.momentary
    }


def disabled_guards(
    guards: Sequence[tuple[str, Guard]], momentary: Mapping[tuple[str, str], int]
) -> tuple[tuple[int, int], ...]:
    """The guards that a momentary state disables, each with the index of this state in ``z``."""
    return tuple(
        (number, momentary[name, guard.disabled_by])
        for number, (name, guard) in enumerate(guards)
        if guard.disabled_by
    )


def _indices(entries: slice) -> range:
    return range(entries.start, entries.stop)
