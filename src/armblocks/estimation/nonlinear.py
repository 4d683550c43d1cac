"""Nonlinear least squares with bounds, several sensors of unknown noise, and covariances."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks import interrupts
from armblocks.extras import from_extra

Array = NDArray[np.float64]
Evaluation = Callable[[Array], tuple[list[Array], list[Array]] | None]
"""For parameters (k,) the residuals (N,) of each sensor and their derivatives (N, k); ``None`` where the
model has no result."""

RANK_TOLERANCE = 1e-7
"""Singular values of the derivatives with columns of length 1 below this fraction of the largest are 0."""
_ROUNDS = 6
_CONVERGED = 1e-3
"""The noise estimates have converged when they change by at most this fraction in one round."""


@dataclass(frozen=True, kw_only=True, eq=False)
class NonlinearFit:
    """The estimate of k parameters.

    ``covariance`` (k, k) has NaN for parameters that are not determined (``unknown``), and is infinite where
    no residual is left to estimate the noise. ``deviations`` (n,): the standard deviation of each sensor.
    ``condition``: of the weighted derivatives with columns of length
    1. ``stopped``: whether an interrupt or the number of evaluations ended the search.
    """

    values: Array
    covariance: Array
    unknown: NDArray[np.bool_]
    deviations: Array
    condition: float
    degrees_of_freedom: int
    evaluations: int
    message: str
    stopped: bool


class _Search:
    """Evaluates the model, and stores the best parameters and the last evaluation."""

    def __init__(self, evaluate: Evaluation, observe: Callable[[int, float], None] | None) -> None:
        self._evaluate = evaluate
        self._observe = observe
        self._last: tuple[bytes, tuple[list[Array], list[Array]]] | None = None
        self.best: tuple[float, Array, tuple[list[Array], list[Array]]] | None = None
        self.count = 0
        self.sigma = np.empty(0)

    def at(self, x: Array) -> tuple[list[Array], list[Array]]:
        """Residuals and derivatives. Where the model fails, the residuals are a thousand times the best."""
        key = x.tobytes()
        if self._last is not None and self._last[0] == key:
            return self._last[1]
        found = self._evaluate(x)
        self.count += 1
        if found is None:
            assert self.best is not None  # the first evaluation raises the error of the model
            residuals, derivatives = self.best[2]
            found = [1e3 * r + 1e3 * s for r, s in zip(residuals, self.sigma.tolist())], derivatives
        elif self.sigma.size:
            self._keep(x, found)
        self._last = key, found
        return found

    def _keep(self, x: Array, found: tuple[list[Array], list[Array]]) -> None:
        cost = self.cost(found[0])
        if self.best is None or cost < self.best[0]:
            self.best = cost, x.copy(), found
        if self._observe is not None:
            self._observe(self.count, cost)

    def cost(self, residuals: Sequence[Array]) -> float:
        """The sum of the squared residuals in standard deviations."""
        return sum(float(r @ r) / s**2 for r, s in zip(residuals, self.sigma.tolist()))

    def reweighted(self, sigma: Array) -> None:
        """Continue with other standard deviations."""
        self.sigma = sigma
        if self.best is not None:
            self.best = self.cost(self.best[2][0]), *self.best[1:]


def nonlinear_fit(
    evaluate: Evaluation,
    start: Array,
    bounds: tuple[Array, Array],
    *,
    deviations: Array | None,
    scales: Array,
    evaluations: int,
    observe: Callable[[int, float], None] | None = None,
) -> NonlinearFit:
    """Minimise the squared residuals in standard deviations (trust-region reflective method of SciPy).

    ``deviations`` (n,): known standard deviations of the sensors; ``None``: they are estimated from the
    residuals, and the estimate is repeated with them. ``scales`` (n,): sizes of the measured signals, the
    first weights. ``evaluations``: the largest number of evaluations. Ctrl-C ends the search with the best
    parameters.
    """
    search = _Search(evaluate, observe)
    search.sigma = scales if deviations is None else deviations
    message, stopped = "", False
    x = np.clip(start, *bounds)
    for _ in range(1 if deviations is not None else _ROUNDS):
        try:
            message, stopped = _minimise(search, x, bounds, evaluations)
        except KeyboardInterrupt:
            if search.best is None:
                raise
            interrupts.answered()
            message, stopped = "stopped by Ctrl-C", True
        assert search.best is not None
        x = search.best[1]
        if deviations is not None:
            break
        new = _deviations(search.best[2], search.sigma, scales)
        converged = bool(np.all(np.abs(new - search.sigma) <= _CONVERGED * search.sigma))
        one_sensor = len(scales) == 1  # the weight of a single sensor has no effect on the minimum
        search.reweighted(new)
        if converged or stopped or one_sensor:
            break
    return _summary(search, message, stopped=stopped, known_noise=deviations is not None)


def _minimise(
    search: _Search, start: Array, bounds: tuple[Array, Array], evaluations: int
) -> tuple[str, bool]:
    with from_extra("analysis", "parameter estimation"):
        from scipy.optimize import least_squares

    def residuals(x: Array) -> Array:
        return np.concatenate([r / s for r, s in zip(search.at(x)[0], search.sigma.tolist())])

    def derivatives(x: Array) -> Array:
        return np.vstack([J / s for J, s in zip(search.at(x)[1], search.sigma.tolist())])

    left = evaluations - search.count
    if left < 1:
        return "the number of evaluations is reached", True
    solution = least_squares(
        residuals,
        start,
        jac=derivatives,
        bounds=bounds,
        x_scale="jac",
        ftol=1e-10,
        xtol=1e-9,
        gtol=1e-10,
        max_nfev=left,
    )
    if solution.status == 0:
        return "the number of evaluations is reached", True
    return "converged", False


def _deviations(found: tuple[list[Array], list[Array]], sigma: Array, scales: Array) -> Array:
    """The standard deviation of each sensor, with the remaining degrees of freedom of its residuals."""
    residuals, derivatives = found
    J = np.vstack([part / s for part, s in zip(derivatives, sigma.tolist())])
    inverse = np.linalg.pinv(J.T @ J)
    new: list[float] = []
    for r, part, s, scale in zip(residuals, derivatives, sigma.tolist(), scales.tolist()):
        used = float(np.einsum("ij,jk,ik->", part, inverse, part)) / s**2
        freedom = max(len(r) - min(used, len(r) - 1.0), 1.0)
        new.append(max(float(r @ r) / freedom, (1e-9 * scale) ** 2) ** 0.5)
    return np.array(new)


def _summary(search: _Search, message: str, *, stopped: bool, known_noise: bool) -> NonlinearFit:
    assert search.best is not None
    _, values, (residuals, derivatives) = search.best
    J = np.vstack([part / s for part, s in zip(derivatives, search.sigma.tolist())])
    lengths = np.linalg.norm(J, axis=0)
    scale = np.where(lengths > 0.0, lengths, 1.0)
    _, s, Vt = np.linalg.svd(J / scale, full_matrices=False)
    rank = int(np.sum(s > RANK_TOLERANCE * s.max(initial=0.0)))
    half = Vt[:rank].T / s[:rank] / scale[:, None]
    freedom = sum(map(len, residuals)) - rank
    if freedom < 1 and not known_noise:
        half = np.full_like(half, np.inf)  # the residuals are 0 for any noise
    known = np.sqrt(np.sum(Vt[:rank] ** 2, axis=0)) > 1.0 - 1e-6
    covariance = np.where(known & known[:, None], half @ half.T, np.nan)
    return NonlinearFit(
        values=values,
        covariance=covariance,
        unknown=~known,
        deviations=search.sigma,
        condition=float(s[0] / s[rank - 1]) if rank else float("inf"),
        degrees_of_freedom=freedom,
        evaluations=search.count,
        message=message,
        stopped=stopped,
    )
