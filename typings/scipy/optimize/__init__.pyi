"""The part of scipy.optimize that armblocks uses, typed."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

def linear_sum_assignment(
    cost_matrix: NDArray[np.float64], maximize: bool = ...
) -> tuple[NDArray[np.intp], NDArray[np.intp]]: ...

class OptimizeResult:
    x: NDArray[np.float64]
    status: int
    success: bool
    message: str

def least_squares(
    fun: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    x0: NDArray[np.float64],
    *,
    jac: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    bounds: tuple[NDArray[np.float64], NDArray[np.float64]],
    x_scale: str,
    ftol: float,
    xtol: float,
    gtol: float,
    max_nfev: int,
) -> OptimizeResult: ...

class NonlinearConstraint:
    def __init__(
        self,
        fun: Callable[[NDArray[np.float64]], NDArray[np.float64]],
        lb: NDArray[np.float64],
        ub: NDArray[np.float64],
    ) -> None: ...

def differential_evolution(
    func: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    bounds: Sequence[tuple[float, float]],
    **options: Any,
) -> OptimizeResult: ...
def minimize(
    fun: Callable[[NDArray[np.float64]], float], x0: NDArray[np.float64], **options: Any
) -> OptimizeResult: ...
