"""Modes whose choice depends only on rounding errors.

In an algebraic loop a signal depends on the modes that depend on it. At the boundary of a mode the signals of
both choices are equal up to rounding. Rounding can then make each choice inconsistent. An example is a dead
zone with the output ``y`` and the input ``u = K (r - y)`` at the end of the zone: with ``y = 0``, ``u`` may
be above the end; with the small positive ``y`` above the zone, ``u`` may be below the end.

If mode iteration finds no consistent modes, the inconsistent following modes are marked as *undecided* for
the rest of the run. From then on an undecided mode counts as inconsistent only if it is also inconsistent
after small relative changes of the time, the states, the parameters and the stored values. The accepted modes
thus solve a problem that differs from the given problem by rounding errors (a small backward error: Higham,
*Accuracy and Stability of Numerical Algorithms*, section 1.5). A loop without a solution stays inconsistent.
"""

from __future__ import annotations

from armblocks.integration.guard_functions import GuardFunctions
from armblocks.integration.workspace import LoopSizes, Workspace
from armblocks.routines.arithmetic import fma, select
from armblocks.routines.memory import Reals, RealVariable
from armblocks.routines.routine import Function, Program, Routine
from armblocks.routines.values import Boolean, Integer, Real

LARGEST_CHANGE = 2.0**-47
"""Maximum relative change of an argument: 32 units in the last place."""
CHANGES = 8
"""The number of changes that are tried: four, and their opposites."""
ROTATION = 0.6180339887498949
"""The weights of the arguments are multiples of the golden ratio without their integer parts, which are
distributed evenly."""

Solve = Function[[Reals, Reals, Reals, Reals], None]


class UndecidedModes:
    """The functions of a program for undecided modes. ``solve`` solves the implicit equations, if any."""

    def __init__(
        self,
        program: Program,
        workspace: Workspace,
        sizes: LoopSizes,
        guards: GuardFunctions,
        solve: Solve | None,
    ) -> None:
        self.workspace = workspace
        self.sizes = sizes
        self.guards = guards
        self.solve = solve
        self.mark = program.define(self._mark, "mark_undecided", inlined=False)
        self.accept = program.define(self._accept, "accept_undecided", inlined=False)

    def _mark(self, r: Routine, reals: Reals) -> Integer:
        """Mark the inconsistent following modes. Returns the number of modes that were not marked before."""
        contradictions, undecided = (
            reals.after(place) for place in (self.workspace.contradictions, self.workspace.undecided)
        )
        followers = r.integers("mode.follows", self.guards.followers)
        added = r.integer(0)
        for i in r.each(len(self.sizes.modes)):
            new = (followers[i] != 0) & (contradictions[i] != 0.0) & (undecided[i] == 0.0)
            undecided[i] = select(new, 1.0, undecided[i])
            added.value = added.value + new.count()
        return added.value

    def _accept(self, r: Routine, t: Reals, x: Reals, reals: Reals, p: Reals) -> Integer:
        """Clear ``contradictions`` of the undecided modes that are consistent after a small change of the
        arguments. Returns the number of them."""
        modes = len(self.sizes.modes)
        contradictions, undecided, remaining = (
            reals.after(place)
            for place in (
                self.workspace.contradictions,
                self.workspace.undecided,
                self.workspace.remaining_contradictions,
            )
        )
        concerned, accepted = r.integer(0), r.integer(0)
        for i in r.each(modes):
            inconsistent = (contradictions[i] != 0.0) & (undecided[i] != 0.0)
            concerned.value = concerned.value + inconsistent.count()
        with r.unless(concerned.value == 0):
            self._copy_values(r, reals, save=True)
            r.copy(contradictions, remaining, modes)
            for number in r.range(0, CHANGES):
                self._change(r, t, x, reals, p, number)
                self._evaluate_changed(r, reals)
                for i in r.each(modes):
                    consistent = (contradictions[i] == 0.0) & (undecided[i] != 0.0)
                    cleared = consistent & (remaining[i] != 0.0)
                    remaining[i] = select(cleared, 0.0, remaining[i])
                    accepted.value = accepted.value + cleared.count()
            r.copy(remaining, contradictions, modes)
            self._copy_values(r, reals, save=False)
        return accepted.value

    def _copy_values(self, r: Routine, reals: Reals, *, save: bool) -> None:
        """Save or restore the values that an evaluation with changed arguments overwrites."""
        workspace, sizes = self.workspace, self.sizes
        for place, saved, count in (
            (workspace.z, workspace.saved_z, sizes.discrete),
            (workspace.trial_w, workspace.saved_w, sizes.algebraic),
            (workspace.guards, workspace.saved_guards, len(sizes.directions)),
        ):
            source, target = (place, saved) if save else (saved, place)
            r.copy(reals.after(source), reals.after(target), count)

    def _change(self, r: Routine, t: Reals, x: Reals, reals: Reals, p: Reals, number: Integer) -> None:
        """Write the changed arguments. Modes and other integers in ``z`` do not change."""
        workspace, sizes = self.workspace, self.sizes
        largest = select(number & 1 == 0, LARGEST_CHANGE, -LARGEST_CHANGE)
        weight = r.real(0.25)
        for _ in r.range(0, number >> 1):
            _next(weight)
        z, saved_z = reals.after(workspace.z), reals.after(workspace.saved_z)
        for source, target, count in (
            (t, reals.after(workspace.changed_t), 1),
            (x, reals.after(workspace.changed_x), sizes.states),
            (p, reals.after(workspace.changed_p), sizes.parameters),
            (saved_z, z, sizes.discrete),
        ):
            for i in r.range(0, count):
                value = source[i]
                changed = fma(value, largest * fma(weight.value, 2.0, -1.0), value)
                if target is z:
                    changed = select(_is_integer(value), value, changed)
                target[i] = changed
                _next(weight)

    def _evaluate_changed(self, r: Routine, reals: Reals) -> None:
        """Evaluate the inconsistencies for the changed arguments; all are 1 if a loop has no solution."""
        workspace = self.workspace
        t, x, p = (
            reals.after(place) for place in (workspace.changed_t, workspace.changed_x, workspace.changed_p)
        )
        if self.solve:
            r.call(self.solve, t, x, reals, p)
        self.guards.evaluate(r, t, x, reals, p)
        if not self.solve:
            return
        unknowns, contradictions = reals.after(workspace.trial_w), reals.after(workspace.contradictions)
        ordered = r.boolean(True)
        for i in r.each(self.sizes.algebraic):
            ordered.value = ordered.value & unknowns[i].ordered
        for i in r.each(len(self.sizes.modes)):
            contradictions[i] = select(ordered.value, contradictions[i], 1.0)


def _next(weight: RealVariable) -> None:
    """Advance to the weight of the next argument."""
    following = weight.value + ROTATION
    weight.value = select(following >= 1.0, following - 1.0, following)


def _is_integer(value: Real) -> Boolean:
    """Whether a double is an integer."""
    shift = 1.5 * 2.0**52
    return (value + shift - shift == value) | (abs(value) >= 2.0**52)
