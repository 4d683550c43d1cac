"""The exact derivative of a system's flow, and of its implicit equations, with respect to states, unknowns
and time."""

from __future__ import annotations

from dataclasses import dataclass

from casadi import SX, densify, jacobian, vertcat

from armblocks.equations.hybrid_system import HybridSystem
from armblocks.equations.signatures import signature
from armblocks.equations.traced_function import TracedFunction


@dataclass(frozen=True, eq=False)
class FlowJacobian:
    """Derivatives of ``F = (derivative, residual)`` with respect to ``v = (x, w)`` and time.

    ``function`` has the inputs of ``derivative``. Its outputs are ``J``, the structurally nonzero entries of
    ``dF/dv``, and ``T (nx + nw,)``, ``dF/dt``. Entry ``k`` is in row ``rows[k]`` and column ``columns[k]``.
    """

    rows: tuple[int, ...]
    columns: tuple[int, ...]
    function: TracedFunction


def trace_flow_jacobian(system: HybridSystem) -> FlowJacobian:
    """Differentiate the traced equations; structurally orthogonal columns are computed together."""
    flow = system.derivative
    t, x, z, w, p = flow.arguments
    (residual,) = system.residual.casadi_function().call([t, x, z, w, p], True, False)
    F, v = vertcat(flow.results[0], residual), vertcat(x, w)
    J = jacobian(F, v)
    entries = SX(0, 1) if J.nnz() == 0 else vertcat(*J.nonzeros())
    return FlowJacobian(
        rows=tuple(J.sparsity().row()),
        columns=tuple(J.sparsity().get_col()),
        function=TracedFunction(
            "flow_jacobian",
            flow.inputs,
            signature(("J", (J.nnz(),)), ("T", (F.numel(),))),
            flow.arguments,
            (entries, densify(jacobian(F, t))),
        ),
    )
