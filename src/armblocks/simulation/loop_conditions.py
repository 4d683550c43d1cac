"""The loss of accuracy in linear loops, from their condition numbers at several times of the run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import counted
from armblocks.integration.system import CompiledSystem
from armblocks.simulation.run_part import Rows

Array = NDArray[np.float64]

CHECKED_SAMPLES = 32
"""Number of samples of each part of a run at which condition numbers are computed, including the first
and the last."""
MAX_CONDITION = 1e8
"""Condition number above which fewer than half of a double's 16 digits are correct."""
ITERATIONS = 12
"""Iterations of the power method. Its bound is then near the spectral radius of most matrices."""
MAX_NAMES = 3
"""Maximum number of signals that a warning names."""


def warnings_of_loops(system: CompiledSystem, parts: Sequence[Rows]) -> list[str]:
    """A warning for each linear loop with a condition number above ``MAX_CONDITION``, with the worst time."""
    worst = [(0.0, 0.0)] * len(system.loops)
    for rows in parts if system.loops else ():
        sample_indices = np.unique(np.linspace(0, rows.time.size - 1, CHECKED_SAMPLES).astype(np.intp))
        t, x, z, w = (
            part[sample_indices] for part in (rows.time, rows.states, rows.discrete, rows.algebraic)
        )
        for loop, matrices in enumerate(system.loop_matrices(t, x, z, w, rows.p)):
            conditions = loop_conditions(matrices)
            place = int(np.argmax(conditions))
            worst[loop] = max(
                worst[loop], (float(conditions[place]), float(rows.time[sample_indices][place]))
            )
    return [
        f"the loop of {_listed(names)} has the condition number {condition:.2g} at {time:.9g} s, so that its "
        f"signals have about {max(0.0, 16.0 - np.log10(condition)):.0f} correct digits"
        for names, (condition, time) in zip(system.loops, worst)
        if condition > MAX_CONDITION
    ]


def loop_conditions(matrices: Array) -> Array:
    """Upper bounds (k,) of condition numbers of loops ``x = M x + c``; 0 where singular.

    ``matrices`` (k, n, n) are ``M - 1``. The condition number is the spectral radius of ``|(1 - M)^-1| (1 +
    |M|)``. It bounds the error of a signal, as a multiple of the rounding errors of all terms, for the best
    choice of the signals' units (Bauer, *Numer. Math.* 5 (1963) 73-87).
    """
    n = matrices.shape[-1]
    numbers = np.zeros(len(matrices))
    for k in range(len(matrices)):
        matrix: Array = matrices[k]
        try:
            inverse = np.abs(np.linalg.inv(matrix))
        except np.linalg.LinAlgError:
            continue
        growth = inverse @ (np.eye(n) + np.abs(matrix + np.eye(n)))
        vector = np.ones(n)
        for _ in range(ITERATIONS):
            product = growth @ vector
            vector = np.sqrt(vector / vector.max() * product / product.max())
        bound = float(np.max(growth @ vector / vector))
        numbers[k] = bound if np.isfinite(bound) else 0.0
    return numbers


def _listed(names: Sequence[str]) -> str:
    name_list = ", ".join(f"'{name}'" for name in names[:MAX_NAMES])
    return (
        name_list
        if len(names) <= MAX_NAMES
        else f"{name_list} and {counted(len(names) - MAX_NAMES, 'more signal')}"
    )
