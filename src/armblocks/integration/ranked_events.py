"""Events of different ranks at one instant: see :mod:`armblocks.diagram.event_order`."""

from __future__ import annotations

from armblocks.integration.workspace import LoopSizes, Workspace
from armblocks.routines.arithmetic import select, sign
from armblocks.routines.memory import Reals
from armblocks.routines.routine import Program, Routine
from armblocks.routines.values import Integer


class RankedEvents:
    """The functions of a program for the ranks of guards and of the controls of conditional subsystems."""

    def __init__(self, program: Program, workspace: Workspace, sizes: LoopSizes) -> None:
        self.workspace = workspace
        self.ranks, self.controls = sizes.guard_ranks, sizes.controls
        self.select_lowest = program.define(self._select_lowest, "select_lowest_rank")
        self.hold_controls = program.define(self._hold_controls, "hold_controls") if self.controls else None
        self.store_signs = program.define(self._store_signs, "store_signs_up_to_rank")

    def _select_lowest(self, r: Routine, reals: Reals) -> Integer:
        """The lowest rank of the marked guards; clears the marks of the guards of higher ranks."""
        fired, ranks = reals.after(self.workspace.fired), r.integers("guard.ranks", self.ranks)
        lowest = r.integer(max(self.ranks))
        for i in r.each(len(self.ranks)):
            rank = ranks[i]
            lower = (fired[i] != 0.0) & (rank < lowest.value)
            lowest.value = select(lower, rank, lowest.value)
        for i in r.each(len(self.ranks)):
            fired[i] = select(ranks[i] > lowest.value, 0.0, fired[i])
        return lowest.value

    def _hold_controls(self, r: Routine, reals: Reals, rank: Integer) -> None:
        """Set the modes of controls of higher ranks to their old values.

        The reset for the events of this rank then does not act on the blocks that these controls control. For
        a negative rank nothing changes, because its events do not act on blocks. Before the start of the run
        there are no old values.
        """
        z = reals.after(self.workspace.z)
        modes, old_values, ranks = (
            r.integers(f"control.{role}", entries)
            for role, entries in zip(("modes", "old", "ranks"), zip(*self.controls))
        )
        for i in r.each(len(self.controls)):
            mode, old = z[modes[i]], z[old_values[i]]
            waits = (rank >= 0) & (ranks[i] > rank)
            z[modes[i]] = select(waits & (old >= 0.0), old, mode)

    def _store_signs(self, r: Routine, reals: Reals, rank: Integer) -> None:
        """Store the signs of all guards up to this rank; a guard that is zero keeps its stored sign."""
        workspace, ranks = self.workspace, r.integers("guard.ranks", self.ranks)
        values, signs = (reals.after(place) for place in (workspace.guards, workspace.signs))
        for i in r.each(len(self.ranks)):
            new_sign, old_sign = sign(values[i]), signs[i]
            stored = (new_sign != 0.0) & (ranks[i] <= rank)
            signs[i] = select(stored, new_sign, old_sign)
