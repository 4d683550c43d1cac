"""Controllability and observability Gramians of a stable system."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.shown_values import is_stable
from armblocks.analysis.state_space import StateSpaceModel
from armblocks.errors import InputError
from armblocks.extras import from_extra

Array = NDArray[np.float64]


def gramians(system: StateSpaceModel) -> tuple[Array, Array]:
    """The controllability and the observability Gramian (nx, nx), by the Lyapunov equations.

    Raises ``InputError`` for a system that is not stable.
    """
    with from_extra("analysis", "Gramians"):
        from scipy.linalg import solve_continuous_lyapunov, solve_discrete_lyapunov

    if not is_stable(system):
        raise InputError(
            "the system is not stable and has no gramians",
            where=system.name,
            allowed="a stable system, because the integrals diverge for others",
            fix="use controllability() and observability()",
        )
    inputs, outputs = system.B @ system.B.T, system.C.T @ system.C
    if system.is_discrete:
        return solve_discrete_lyapunov(system.A, inputs), solve_discrete_lyapunov(system.A.T, outputs)
    return solve_continuous_lyapunov(system.A, -inputs), solve_continuous_lyapunov(system.A.T, -outputs)
