"""Features of a block: a conditional subsystem changes its equations according to their role."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import pytest
from casadi import SX, Function

from armblocks.blocks import Backlash, IntegratorLimited, Relay, Saturation, TransportDelay, UnitDelay
from armblocks.diagram import Block
from armblocks.diagram.conditional_equations import ON, RESTART, conditional
from armblocks.diagram.features import AT_TICKS, Arguments, Features, SlotKind, WhileOff, features_of

BLOCKS = (
    IntegratorLimited(initial=0.3),
    Relay(),
    Backlash(),
    TransportDelay(),
    Saturation(),
    UnitDelay(sample_time=0.1, initial=0.7),
)
each_block = pytest.mark.parametrize("block", BLOCKS, ids=lambda block: type(block).__name__)


def features_alone_and_gated(block: Block, *gate: str) -> tuple[Features, Features]:
    """Return the features of a block with one scalar input, alone and in a conditional subsystem."""
    alone = features_of(block, {"u": ()})
    return alone, conditional(alone, gate, clocked=block.sampled, ticking=block.sampled)


def arguments(block: Block, features: Features, hidden: Mapping[str, float]) -> Arguments:
    """Return pseudo-random states and inputs without events; hidden inputs and states are as given, or 0."""
    random = np.random.default_rng(3)
    held = (*features.states, *features.discrete, *features.modes, *features.conditions, *features.delays)
    before = (mode.before for mode in features.modes if mode.hysteresis)
    inputs = (*features.inputs, *(f"{name}'" for name in features.differentiated_inputs))

    def random_values(names: Iterator[str]) -> dict[str, SX]:
        return {
            name: SX(hidden.get(name, 0.0) if name.startswith("?") else random.uniform(0.1, 0.9))
            for name in names
        }

    states = random_values(iter((*(entry.name for entry in held), *before)))
    parameters = {rule.name: SX(block.parameter_value(rule.name)) for rule in block.inputs_of_the_run()}
    periods = {"T": SX(0.1), "T_next": SX(0.2)}
    guards = {guard.name: SX(0.0) for guard in features.guards}
    return Arguments(SX(0.37), states, random_values(iter(inputs)), parameters | periods, guards)


def number(value: SX) -> float:
    return float(Function("f", [], [SX(value)])()["o0"])


@each_block
def test_equations_of_a_disabled_block_are_zero_unchanged_or_evaluated(block: Block) -> None:
    """A mode with hysteresis returns to its previous value."""
    alone, inside = features_alone_and_gated(block, ON)
    at = arguments(block, inside, {ON: 0.0})
    previous = {mode.name: mode.before for mode in alone.modes if mode.hysteresis}
    assert set(inside.equations) == set(SlotKind)
    for kind, equation in inside.equations.items():
        plain = alone.equations[kind](at)
        evaluated = kind.while_off is WhileOff.EVALUATED or (kind in AT_TICKS and not block.sampled)
        for name, value in equation(at).items():
            if name.startswith("?"):
                continue
            off = at.x[name] if kind.while_off is WhileOff.KEPT else SX(0.0)
            if name in previous and kind is SlotKind.MODE:
                off = at.x[previous[name]]
            if name in previous and kind is SlotKind.CONTRADICTION:
                off = at.x[name] != at.x[previous[name]]
            expected = plain[name] if evaluated else off
            assert number(value) == number(expected), (kind, name)


@each_block
def test_equations_of_an_enabled_block_are_those_of_the_block_alone(block: Block) -> None:
    alone, inside = features_alone_and_gated(block, ON, RESTART)
    at = arguments(block, inside, {ON: 1.0, "?running": 1.0})
    for kind, equation in inside.equations.items():
        values = {name: number(value) for name, value in equation(at).items() if not name.startswith("?")}
        plain = {name: number(value) for name, value in alone.equations[kind](at).items()}
        if kind is SlotKind.RESET:  # a restart may change all states; without a restart they are unchanged
            plain = {name: number(at.x[name]) for name in values} | plain
        assert values == plain, kind


@each_block
def test_a_restart_sets_all_states_to_their_initial_values(block: Block) -> None:
    alone, inside = features_alone_and_gated(block, ON, RESTART)
    at = arguments(block, inside, {ON: 1.0, RESTART: 1.0, "?running": 1.0})
    after = inside.equations[SlotKind.RESET](at)
    starts = alone.initial_states(at.p)
    assert starts.keys() >= {state.name for state in (*alone.states, *alone.discrete)}
    assert {name: number(after[name]) for name in starts} == {
        name: number(start) for name, start in starts.items()
    }
