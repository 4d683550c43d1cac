"""Signals that are exactly at a limit or at a jump when a tick samples them.

A change of a parameter moves such a signal to one side. The changes of the sampled value to both sides are
compared with its derivative. An event at the time of the tick also comes before the tick on one side. Then
the sampled value without this event is compared with the one after it. If the event causes other events, the
sampled values count as different.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi
from casadi import SX, Function, densify, fabs, fmax, if_else, logic_and, logic_or, sign, vertcat, vertsplit

from armblocks.equations.hybrid_system import HybridSystem
from armblocks.equations.jump_modes import JUMPS
from armblocks.equations.sensitivity_layout import any_marked
from armblocks.equations.side_differences import combined, without_derivative

SMALLEST_JUMP = 1e-4
"""The smallest relative change of a sampled value by an event."""
LATER = 2e-8
"""The time after which an event has occurred, relative to the time of the tick, s."""
_LIMITED = JUMPS | {casadi.OP_FABS, casadi.OP_FMIN, casadi.OP_FMAX}
"""Operations with a jump or a kink."""


def samples_limits(system: HybridSystem) -> bool:
    """Whether sampled values have jumps or kinks."""
    function = system.update.casadi_function()
    operations = {function.instruction_id(k) for k in range(function.n_instructions())}
    return bool(system.clocks) and not _LIMITED.isdisjoint(operations)


class Sampling:
    """The search for sampled values without a derivative."""

    def __init__(self, system: HybridSystem) -> None:
        self.update, self.reset, self.guards, self.flow = (
            Function("f", list(traced.arguments), [densify(vertcat(*traced.results, SX(0, 1)))])
            for traced in (system.update, system.reset, system.guards, system.derivative)
        )
        self.symbols = list(system.derivative.arguments)
        modes = frozenset(system.modes)
        self.rows = [k for k in range(system.discrete.size) if k not in modes]

    def first(self, updated: SX, Z: Sequence[SX], m: SX, along: Sequence[Sequence[SX]], events: SX) -> SX:
        """The number, from 1, of a discrete variable whose new value has no derivative; or 0.

        ``updated`` (nz,): the discrete variables after the ticks ``m``, and for each parameter ``Z``: their
        derivatives, ``along``: the derivatives of ``t, x, z, w, p`` before the ticks. ``events`` (ng,): the
        events at the time of the ticks that the parameters shift.
        """
        direction = [combined(parts) for parts in zip(*along)]
        present = updated - self.symbols[2]
        later = self._later()
        jumps = fabs(self._sampled(later, m, events) - present) > SMALLEST_JUMP * (1.0 + fabs(present))
        jumps = logic_or(jumps, self._causes_events(later, events))
        jumps = logic_and(jumps, any_marked(events))

        def change(step: float) -> SX:
            at = [value + step * part for value, part in zip(self.symbols, direction)]
            return self._sampled(at, m, SX.zeros(events.numel())) - present

        size = fabs(updated) + fabs(self.symbols[2])
        differs = logic_or(jumps, without_derivative(change, combined(Z) - direction[2], size))
        found = SX(0.0)
        for row in reversed(self.rows):
            found = if_else(differs[row], row + 1.0, found)
        return found

    def _sampled(self, at: Sequence[SX], m: SX, events: SX) -> SX:
        """The changes of the discrete variables by ticks after events at ``t, x, z, w, p``."""
        after = self._after(at, events)
        (sampled,) = self.update.call([*after, m], True, False)
        return sampled - after[2]

    def _later(self) -> list[SX]:
        """``t, x, z, w, p`` shortly after the events."""
        t, x, *others = self.symbols
        (flow,) = self.flow.call(self.symbols, True, False)
        shift = LATER * fmax(1.0, t)
        return [t + shift, x + shift * flow, *others]

    def _causes_events(self, at: Sequence[SX], events: SX) -> SX:
        """Whether guards without an event jump through zero."""
        before, after = (
            self.guards.call(list(point), True, False)[0] for point in (at, self._after(at, events))
        )
        jumps = fabs(after - before) > SMALLEST_JUMP * (1.0 + fabs(before))
        return any_marked(logic_and(logic_and(jumps, sign(before) != sign(after)), events == 0.0))

    def _after(self, at: Sequence[SX], events: SX) -> list[SX]:
        """``t, x, z, w, p`` after events."""
        t, x, _, w, p = at
        (after,) = self.reset.call([*at, events], True, False)
        new_x, new_z = vertsplit(after, [0, x.numel(), after.numel()])
        return [t, new_x, new_z, w, p]
