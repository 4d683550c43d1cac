"""A nonlinear program: the functions that a solver calls, and its solution."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class NonlinearProgram:
    """Minimise ``f(z)`` with ``lower <= z <= upper (n,)`` and ``row_lower <= g(z) <= row_upper (m,)``.

    ``values(z)`` returns ``f`` and ``g (m,)``. ``derivatives(z)`` returns the gradient ``(n,)`` and the
    Jacobian ``(m, n)``. Both return ``None`` where the functions have no values.
    """

    lower: Array
    upper: Array
    row_lower: Array
    row_upper: Array
    values: Callable[[Array], tuple[float, Array] | None]
    derivatives: Callable[[Array], tuple[Array, Array] | None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Solution:
    """The end of a search: ``point (n,)``, the multipliers of the rows ``(m,)`` and of the bounds ``(n,)``.

    With the multipliers ``y`` and ``b`` the gradient of ``f + y g + b z`` is zero at a minimum: positive
    multipliers belong to upper limits. ``converged``: whether the conditions of a local minimum are met.
    """

    point: Array
    row_multipliers: Array
    bound_multipliers: Array
    iterations: int
    message: str
    converged: bool
