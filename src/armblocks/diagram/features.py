"""The features of a block as one value: its declarations, and its equations by role.

``features_of`` collects the declarations of a block: states, modes, guards, conditions, delays and equations.
Functions from features to features change them: for a conditional subsystem
(:mod:`~armblocks.diagram.conditional_equations`), for conditions that become modes, for modes with hysteresis
(:mod:`~armblocks.diagram.generated_modes`). Tracing reads the result.

A new feature needs a new :class:`SlotKind` with its value while a conditional subsystem is off, an equation
in ``features_of``, and a use in tracing. Conditional subsystems then need no change.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Self

from casadi import SX

from armblocks.diagram.block import Block, Shapes, Signals
from armblocks.diagram.port import Condition, DelayLine, Guard, State
from armblocks.equations import Shape


class WhileOff(Enum):
    """The value of an equation in a conditional subsystem while its control is off."""

    EVALUATED = "evaluated"
    """The value of the equation."""
    ZERO = "zero"
    KEPT = "kept"
    """The present value of the state or mode of the same name."""


class SlotKind(Enum):
    """The role of an equation of a block; ``while_off`` is its value while a conditional subsystem is off."""

    OUTPUT = "output", WhileOff.ZERO
    DERIVATIVE = "derivative", WhileOff.ZERO
    RECORD = "record", WhileOff.EVALUATED
    UPDATE = "update", WhileOff.KEPT
    GUARD = "guard value", WhileOff.ZERO
    """A guard that is zero keeps its side, so that it does not fire while the block is off."""
    MODE = "mode value", WhileOff.KEPT
    CONTRADICTION = "inconsistency of a mode", WhileOff.ZERO
    RESET = "reset", WhileOff.KEPT
    DELAYED = "delayed signal", WhileOff.EVALUATED
    DELAYED_RATE = "derivative of a delayed signal", WhileOff.EVALUATED
    DELAY = "delay", WhileOff.EVALUATED
    CAPTURE = "capture", WhileOff.KEPT
    CONDITION = "quantity of a condition", WhileOff.EVALUATED

    while_off: WhileOff

    def __new__(cls, text: str, while_off: WhileOff) -> Self:
        kind = object.__new__(cls)
        kind._value_ = text
        kind.while_off = while_off
        return kind


AT_TICKS = (SlotKind.OUTPUT, SlotKind.UPDATE)
"""The roles of a sampled block that are computed at its ticks and then held. Outputs of other blocks are
evaluated while they are off, because the outputs of the subsystem are held."""


@dataclass(frozen=True)
class Arguments:
    """The arguments of equations, by name: time, states of all kinds, inputs, parameters, fired guards."""

    t: SX
    x: Signals
    u: Signals
    p: Signals
    e: Signals = field(default_factory=dict[str, SX])

    def with_states(self, values: Signals) -> Arguments:
        """The arguments with other values of some states."""
        return dataclasses.replace(self, x={**self.x, **values})


Equation = Callable[[Arguments], Signals]
"""The values of one role, by name."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Features:
    """The declarations of a block, and its equations by role.

    The fields from ``initial_states`` on depend on parameters only; see the methods of
    :class:`~armblocks.diagram.block.Block` with the same names.
    """

    inputs: Shapes
    differentiated_inputs: tuple[str, ...]
    outputs: Shapes
    """Outputs that have equations."""
    records: Shapes
    states: tuple[State, ...]
    discrete: tuple[State, ...]
    modes: tuple[State, ...]
    guards: tuple[Guard, ...]
    conditions: tuple[Condition, ...]
    delays: tuple[DelayLine, ...]
    equations: Mapping[SlotKind, Equation]
    sampled: bool
    reads_next_period: bool
    initial_states: Callable[[Signals], Signals]
    initial_history: Callable[[Signals], Signals]
    initial_outputs: Callable[[Signals], Signals]
    initial_guesses: Callable[[Signals], Signals]
    delay_bounds: Callable[[Signals], Mapping[str, tuple[SX, SX]]]
    breakpoints: Callable[[Signals], tuple[SX, ...]]

    def at_arguments(self, change: Callable[[Arguments], Arguments]) -> Features:
        """The features with all equations evaluated at changed arguments."""
        return self.with_equations(
            {kind: _composed(equation, change) for kind, equation in self.equations.items()}
        )

    def with_equations(self, equations: Mapping[SlotKind, Equation]) -> Features:
        """The features with other equations of some roles."""
        return dataclasses.replace(self, equations={**self.equations, **equations})


def _composed(equation: Equation, change: Callable[[Arguments], Arguments]) -> Equation:
    return lambda at: equation(change(at))


def features_of(block: Block, inputs: Shapes) -> Features:
    """The features of a block whose inputs have these shapes."""
    lines, modes, guards = block.delay_lines(inputs), block.modes(inputs), block.guards(inputs)
    if block.following_modes:
        modes = tuple(dataclasses.replace(mode, follows=True) for mode in modes)
        guards = tuple(dataclasses.replace(guard, locates=True) for guard in guards)
    return Features(
        inputs=inputs,
        differentiated_inputs=block.differentiated_inputs,
        outputs=_output_shapes(block, inputs),
        records={port.name: port.shape or () for port in block.record_ports()},
        states=block.states(inputs),
        discrete=block.discrete_states(inputs),
        modes=modes,
        guards=guards,
        conditions=block.conditions(inputs),
        delays=lines,
        sampled=block.sampled,
        reads_next_period=block.reads_next_period,
        equations={
            SlotKind.OUTPUT: lambda at: block.outputs(at.t, at.x, at.u, at.p),
            SlotKind.DERIVATIVE: lambda at: block.derivatives(at.t, at.x, at.u, at.p),
            SlotKind.RECORD: lambda at: block.records(at.t, at.x, at.u, at.p),
            SlotKind.UPDATE: lambda at: block.updates(at.t, at.x, at.u, at.p),
            SlotKind.GUARD: lambda at: block.guard_values(at.t, at.x, at.u, at.p),
            SlotKind.MODE: lambda at: block.mode_values(at.t, at.x, at.u, at.p),
            SlotKind.CONTRADICTION: lambda at: block.contradictions(at.t, at.x, at.u, at.p),
            SlotKind.RESET: lambda at: block.resets(at.t, at.x, at.u, at.p, at.e),
            SlotKind.DELAYED: lambda at: {line.name: at.u[line.input] for line in lines},
            SlotKind.DELAYED_RATE: lambda at: {line.name: at.u[f"{line.input}'"] for line in lines},
            SlotKind.DELAY: lambda at: block.delay_times(at.t, at.x, at.u, at.p),
            SlotKind.CAPTURE: lambda at: block.captures(at.t, at.x, at.u, at.p),
            SlotKind.CONDITION: lambda at: block.condition_values(at.t, at.x, at.u, at.p),
        },
        initial_states=block.initial_states,
        initial_history=block.initial_history,
        initial_outputs=block.initial_outputs,
        initial_guesses=block.initial_guesses,
        delay_bounds=block.delay_bounds,
        breakpoints=block.breakpoints,
    )


def _output_shapes(block: Block, inputs: Shapes) -> dict[str, Shape]:
    if block.virtual:
        return {}
    declared = {port.name: port.shape for port in block.output_ports() if port.shape is not None}
    shapes = {**declared, **block.output_shapes(inputs)}
    names = [port.name for port in block.output_ports() if port.name not in block.time_derivatives]
    return {name: shapes[name] for name in names}
