"""The equations of a block inside a conditional subsystem: those of the block, gated by its control.

While the control is off, continuous and sampled states keep their values. At a restart all states are reset
to their initial values. When the control turns on, modes become consistent with the present values, as at the
start of a run, and guards are evaluated from then on. A triggered block executes when the trigger fires, as a
sampled block does at a tick. The equations of the block are unchanged; only their use is changed here.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, if_else, logic_and

from armblocks.diagram.block import Block, Shapes, Signals
from armblocks.diagram.port import Condition, DelayLine, Guard, Port, State, name_before

ON, RESTART, FIRE, ELAPSED = "?on", "?restart", "?fire", "?elapsed"
"""Hidden inputs: whether the block is active; whether its states are reset now; whether the trigger fires
now; and the time since it fired before, s."""
_DONE, _BEGUN, _WORKS, _TURNED = "?done", "?begun", "?works", "?turned"
"""Kept and guarded beside the block's own: whether this tick has restarted it; whether this instant has;
whether its modes have settled since the control is on; and the guard of the control itself."""


@dataclass(frozen=True, kw_only=True)
class ConditionalBlock(Block):
    """A block with hidden inputs, for the tracing of its equations only: it is in no library and no file.

    ``clocked``: it works at the ticks of a clock. ``ticking``: the equations are those of a tick, where a
    restart has to act before anything else. (At an event it acts through ``resets``, one turn after the
    control has changed; ``?done`` keeps it from acting twice where a tick was first.)
    """

    title: ClassVar[str] = ""

    block: Block
    hidden: Collection[str]
    clocked: bool
    ticking: bool

    def __post_init__(self) -> None:
        """No check: the inner block is already checked."""

    def _plain(self, values: Mapping[str, SX]) -> dict[str, SX]:
        return {
            name: value for name, value in values.items() if name not in (*self.hidden, _DONE, _BEGUN, _WORKS)
        }

    def _shapes(self, shapes: Shapes) -> Shapes:
        return {name: shape for name, shape in shapes.items() if name not in self.hidden}

    @property
    def _restarted(self) -> bool:
        return RESTART in self.hidden

    @property
    def _notes_restarts(self) -> bool:
        return self._restarted and self.clocked

    def _arguments(self, t: SX, x: Signals, u: Signals, p: Signals) -> tuple[SX, Signals, Signals, Signals]:
        """The arguments of the inner block's equations."""
        own = self._plain(x)
        if self._restarted and self.ticking:
            own |= {
                name: if_else(u[RESTART] != 0.0, start, own[name])
                for name, start in self._starts(x, p).items()
            }
        if ELAPSED in self.hidden:
            p = {**p, "T": u[ELAPSED]}
        return t, own, self._plain(u), p

    def _starts(self, x: Signals, p: Signals) -> Signals:
        """What a restart makes of the states; modes have no past then."""
        before = {name_before(name) for name in x} & set(x)
        return {**self.block.initial_states(p), **{name: SX(0.0) for name in sorted(before)}}

    def _first_modes(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """The modes at a restart, from the states that start: as at the start of a run, where modes are 0."""
        found = self.block.mode_values(*self._arguments(t, x, u, p))
        zero = {name: SX(x[name]) * 0.0 for name in found}
        return self.block.mode_values(*self._arguments(t, {**x, **zero}, u, p))

    def input_ports(self) -> tuple[Port, ...]:
        return (*self.block.input_ports(), *(Port(name, "", "", ()) for name in self.hidden))

    def output_ports(self) -> tuple[Port, ...]:
        return self.block.output_ports()

    def record_ports(self) -> tuple[Port, ...]:
        return self.block.record_ports()

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return self.block.states(self._shapes(inputs))

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        shapes = self._shapes(inputs)
        found = list(self.block.discrete_states(shapes))
        if self._notes_restarts:
            found.append(State(_DONE, (), "whether this tick has reset the block"))
        if self._restarted and self.block.all_guards(shapes):
            found.append(State(_BEGUN, (), "1 from a restart to the end of its instant", momentary=True))
        return tuple(found)

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        own = self.block.all_modes(self._shapes(inputs))
        return (
            (*own, State(_WORKS, (), "whether the modes are consistent"))
            if own and ON in self.hidden
            else own
        )

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        own = self.block.all_guards(self._shapes(inputs))
        if self._restarted:
            own = tuple(dataclasses.replace(guard, silenced_by=_BEGUN) for guard in own)
        settles = self.block.modes(self._shapes(inputs)) and ON in self.hidden
        return (*own, Guard(_TURNED, (), "the control")) if settles else own

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        return self.block.conditions(self._shapes(inputs))

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return self.block.condition_values(*self._arguments(t, x, u, p))

    def delay_lines(self, inputs: Shapes) -> tuple[DelayLine, ...]:
        return self.block.delay_lines(self._shapes(inputs))

    def delay_times(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return self.block.delay_times(*self._arguments(t, x, u, p))

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return self.block.output_shapes(self._shapes(inputs))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        outputs = self.block.outputs(*self._arguments(t, x, u, p))
        # What is worked out at a tick while the control is off is not taken over: see trace.
        return self._while_on(u, outputs) if self.clocked else outputs

    def records(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return self.block.records(*self._arguments(t, x, u, p))

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return self._while_on(u, self.block.derivatives(*self._arguments(t, x, u, p)))

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        # A guard that is zero keeps its side, so that nothing fires while the block is off.
        found = self._while_on(u, self.block.guard_values(*self._arguments(t, x, u, p)))
        if _WORKS not in x:
            return found
        settled = {name: if_else(x[_WORKS] != 0.0, value, 0.0) for name, value in found.items()}
        return {**settled, _TURNED: u[ON] - 0.5}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        found = self._while_on(u, self.block.mode_values(*self._arguments(t, x, u, p)), x)
        return {**found, _WORKS: u[ON] != 0.0} if _WORKS in x else found

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        # The modes of a block that is off stand still; when it is switched on, `resets` gives all of them.
        found = self._while_on(u, self.block.contradictions(*self._arguments(t, x, u, p)))
        return {**found, _WORKS: (u[ON] != 0.0) != x[_WORKS]} if _WORKS in x else found

    def captures(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        captured = self.block.captures(*self._arguments(t, x, u, p))
        return self._while_on(u, captured, x)

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        if not self.clocked:
            return {}
        arguments = self._arguments(t, x, u, p)
        updated = self._while_on(u, self.block.updates(*arguments), arguments[1])
        return {**updated, _DONE: u[RESTART]} if self._notes_restarts else updated

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        arguments = self._arguments(t, x, u, p)
        after = dict(self._while_on(u, self.block.resets(*arguments, e), x))
        if FIRE in self.hidden and self.block.sampled:
            fired = {
                name: if_else(u[FIRE] != 0.0, value, after.get(name, x[name]))
                for name, value in self.block.updates(*arguments).items()
            }
            after |= fired
        if self._restarted:
            again = u[RESTART] != 0.0
            if self._notes_restarts:
                after[_DONE] = if_else(again, 0.0, x[_DONE])
                again = logic_and(again, x[_DONE] == 0.0)
            starts = self._starts(x, p)
            for name, value in {**starts, **self._first_modes(t, {**x, **starts}, u, p)}.items():
                after[name] = if_else(again, value, after.get(name, x[name]))
        if _BEGUN in x:
            after[_BEGUN] = if_else(u[RESTART] != 0.0, 1.0, x[_BEGUN])
        if _WORKS in x:
            begins = logic_and(u[ON] != 0.0, x[_WORKS] == 0.0)
            now = {**x, **after}
            earlier = {name: now[name_before(name)] for name in now if name_before(name) in now}
            for name, value in self.mode_values(t, {**now, **earlier}, u, p).items():
                after[name] = if_else(begins, value, after.get(name, x[name]))
            after[_WORKS] = u[ON] != 0.0
        return after

    def _while_on(self, u: Signals, values: Signals, otherwise: Signals | None = None) -> Signals:
        """Values while the control is on; else those of ``otherwise`` by name, or 0."""
        if ON not in self.hidden:
            return values
        return {
            name: if_else(u[ON] != 0.0, value, 0.0 if otherwise is None else otherwise[name])
            for name, value in values.items()
        }
