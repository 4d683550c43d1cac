"""Guards that are exactly 0 after an instant: a state that is reset to a limit, for example.

If such a guard depends on a parameter, a change of the parameter moves the zero into the run for one sign of
the change only. If signals jump there, the derivative does not exist.
"""

from __future__ import annotations

from collections.abc import Sequence

from casadi import SX, Function, densify, fabs, fmax, if_else, logic_and, logic_or, vertcat, vertsplit

from armblocks.equations.sensitivity_delays import DelayedSensitivities
from armblocks.equations.sensitivity_layout import Columns, any_marked
from armblocks.equations.side_differences import KINK, ROUNDING, STEP

AT_ZERO = 1e-12
"""The largest value of a guard that counts as 0."""
MOVES = 1e-6
"""The smallest derivative of a guard with respect to a parameter that counts, relative to 1 plus its time
derivative."""
JUMPS = 1e-4
"""The smallest change of a signal or of a state that is a jump, relative to 1 plus its value."""
LATER = 1e-4
"""The time after which a change of a rate has moved a guard, s."""


class Ties:
    """The search for guards that are 0 after a call of ``reset``."""

    def __init__(self, columns: Columns, delays: DelayedSensitivities, g: SX, g_rate: SX) -> None:
        """``g``, ``g_rate`` (ng,): the guards and their time derivatives."""
        self.columns = c = columns
        self.rate_along = delays.rate_along
        """The time derivatives of the discrete variables (nz,)."""
        self.rates = vertcat(c.V, delays.curvature)
        """The time derivatives of the unknowns and of delayed time derivatives."""
        symbols = [c.t, c.x, c.z, c.w, c.p]
        moved = [SX.sym("along", symbol.numel()) for symbol in symbols]
        along = [c.derivative_along(column, **dict(zip("txzwp", moved))) for column in (g, g_rate)]
        self.rate = Function("g_rate", [*symbols, self.rates], [g_rate])
        self.along = Function("g_along", [*symbols, self.rates, *moved], along)
        self.no_event = SX.zeros(g.numel())
        self.guards, self.flow, self.signals, self.reset = (
            Function("f", list(traced.arguments), [densify(vertcat(*traced.results, SX(0, 1)))])
            for traced in (c.system.guards, c.system.derivative, c.system.signals, c.system.reset)
        )

    def first(
        self,
        x: Sequence[SX],
        z: Sequence[SX],
        instants: Sequence[SX],
        opened: SX,
        *,
        t: SX | None = None,
        stays: bool = False,
    ) -> SX:
        """The number, from 1, of a guard that is 0, that a parameter moves, and whose sides differ; or 0.

        ``x``, ``z``: the states (nx,) and discrete variables (nz,) after the call, each followed by its
        derivatives with respect to the parameters. ``instants``: the derivatives of the time of the instant.
        ``opened``: whether the derivatives after the call are those along the instant. ``t``: another time
        than the present. ``stays``: only guards whose time derivative is 0 as well.
        """
        c = self.columns
        at = [c.t if t is None else t, x[0], z[0], c.w, c.p]
        (g,) = self.guards.call(at, True, False)
        (rate,) = self.rate.call([*at, self.rates], True, False)
        (flow,) = self.flow.call(at, True, False)
        rests = fabs(rate) <= AT_ZERO
        tied = SX.zeros(g.numel())
        change = [SX(0.0), *(SX.zeros(column.numel()) for column in (c.x, c.z, c.p))]
        for k, instant in enumerate(instants):
            within, beside = opened * instant, (1.0 - opened) * instant
            Z = z[k + 1] + self.rate_along * within
            moved = self.along.call([*at, self.rates, within, x[k + 1], Z, c.W[k], c.seeds[k]], True, False)
            moves = fabs(moved[0] + rate * beside) > MOVES * (1.0 + fabs(rate))
            # A double zero that splits.
            splits = logic_and(logic_and(rests, beside == 0.0), fabs(moved[1]) > MOVES)
            moves = logic_or(moves, splits)
            at_zero = logic_and(fabs(g) <= AT_ZERO, moves)
            if stays:
                at_zero = logic_and(at_zero, rests)
            tied = logic_or(tied, at_zero)
            # Parameters that move no zero are not changed. With different weights no changes cancel.
            weight = (1.0 + 0.37 * k) * any_marked(at_zero)
            along = [instant, x[k + 1] + flow * beside, z[k + 1] + self.rate_along * instant, c.seeds[k]]
            change = [total + weight * part for total, part in zip(change, along)]
        directions = SX(c.system.guard_directions)
        tied = logic_and(tied, logic_or(rests, logic_or(directions == 0.0, directions * rate > 0.0)))
        # A changed rate moves a double zero shortly afterwards.
        later = LATER * any_marked(logic_and(tied, rests))
        present = self._signals([c.t, x[0] + later * flow, *at[2:]])
        differences: list[SX] = []
        for step in (-STEP, STEP):
            t, moved_x, moved_z, p = (value + step * along for value, along in zip([*at[:3], c.p], change))
            (moved_flow,) = self.flow.call([t, moved_x, moved_z, c.w, p], True, False)
            moved_x = moved_x + later * moved_flow
            (after,) = self.reset.call([t, moved_x, moved_z, c.w, p, self.no_event], True, False)
            other_x, other_z = vertsplit(after, [0, c.x.numel(), after.numel()])
            differences.append(self._signals([t, other_x, other_z, c.w, p]) - present)
        before, after = differences
        differs = fmax(fabs(before), fabs(after)) > JUMPS * (1.0 + fabs(present))
        if stays:
            kink = STEP * (KINK + ROUNDING * fabs(present))
            differs = logic_or(differs, fabs(before + after) > kink)
        number = SX(0.0)
        for k in range(g.numel()):
            number = if_else(tied[k], float(k + 1), number)
        return if_else(any_marked(differs), number, 0.0)

    def _signals(self, at: Sequence[SX]) -> SX:
        """The states and signals at ``t, x, z, w, p``."""
        (signals,) = self.signals.call(list(at), True, False)
        return vertcat(at[1], signals)
