"""Evaluation of a system at a point: delayed values, unknowns of implicit equations, derivative, Jacobian."""

from __future__ import annotations

from armblocks.integration import system_functions
from armblocks.integration.delay_history import DelayHistory
from armblocks.integration.frame import Frame
from armblocks.integration.implicit_equations import define_solve
from armblocks.integration.linear_equations import LinearEquationsLayout
from armblocks.routines.memory import Reals


class Evaluation:
    """Emits evaluations of the system. The time of an evaluation is an array of one element."""

    def __init__(self, frame: Frame, history: DelayHistory | None) -> None:
        self.frame = frame
        self.history = history
        sizes, workspace = frame.sizes, frame.workspace
        self.implicit = define_solve(frame.r.program, workspace, sizes.algebraic) if sizes.algebraic else None
        null_array = frame.r.null_array
        self.z = frame.vector(workspace.z) if sizes.hybrid else null_array
        self.unknowns = frame.vector(workspace.trial_w) if sizes.hybrid else null_array

    def solve(self, t: Reals, x: Reals) -> None:
        """Write the delayed values at a point into ``z``, and the implicit unknowns into ``trial_w``."""
        f = self.frame
        if self.history:
            f.r.call(self.history.read, t, x, f.reals, f.counts, f.p)
        if self.implicit:
            f.r.call(self.implicit, t, x, f.reals, f.p)

    def flow(self, t: Reals, x: Reals, xd: Reals) -> None:
        """The derivative at a point."""
        self.solve(t, x)
        f = self.frame
        f.r.call(system_functions.derivative, t, x, self.z, self.unknowns, f.p, xd)

    def jacobian(self, t: Reals, x: Reals, layout: LinearEquationsLayout) -> None:
        """Write the Jacobians of the flow and of the implicit equations at a point into the scratch
        memory."""
        self.solve(t, x)
        f, scratch = self.frame, self.frame.arrays.scratch
        J, T = scratch.after(layout.J), scratch.after(layout.T)
        f.r.call(system_functions.flow_jacobian, t, x, self.z, self.unknowns, f.p, J, T)

    def accept_unknowns(self) -> None:
        """Set ``w`` to the latest solution of the implicit equations."""
        workspace = self.frame.workspace
        self.frame.copy(workspace.trial_w, workspace.w, self.frame.sizes.algebraic)
