"""Least squares whose inertial parameters belong to possible rigid bodies.

A body's ten parameters are possible if and only if its pseudo-inertia

    P = [[S, h], [h', m]],  S = tr(I) / 2 - I  (second moments about the origin), h: first moments

is positive definite: the body then has a density of mass that is nowhere negative. Source: Wensing, Kim,
Slotine, *Linear matrix inequalities for physically consistent inertial parameter identification*, IEEE
Robotics and Automation Letters 2018; Traversaro et al., *Identification of fully physical consistent inertial
parameters using optimization on manifolds*, IROS 2016.

The problem is convex. It is solved by Newton's method with logarithmic barriers (Boyd, Vandenberghe, *Convex
Optimization*, 11.3), which needs no solver for semidefinite programs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

PULL = 1e-2
"""Weight of the distance from the start: a standard deviation of 100 scales. It determines the directions
that the data leave open."""
_INTERIOR = 1e-3
"""Smallest eigenvalue, in scales, of the pseudo-inertias of the start."""
_FIRST_BARRIER = 10.0
_LAST_BARRIER = 1e-8
_REDUCTION = 0.15
_NEWTON_STEPS = 60
_LARGEST = 1e5
"""Largest length of a column of the weighted matrix in scaled units."""


def _basis() -> Array:
    """The derivatives (10, 4, 4) of P with respect to m, mx, my, mz, Ixx, Iyy, Izz, Ixy, Iyz, Ixz."""
    E = np.zeros((10, 4, 4))
    E[0, 3, 3] = 1.0
    for k in range(3):
        E[1 + k, k, 3] = E[1 + k, 3, k] = 1.0
        E[4 + k, :3, :3] = 0.5 * np.eye(3)
        E[4 + k, k, k] -= 1.0
    for k, (i, j) in enumerate(((0, 1), (1, 2), (0, 2))):
        E[7 + k, i, j] = E[7 + k, j, i] = -1.0
    return E


BASIS = _basis()


def pseudo_inertia(parameters: Array) -> Array:
    """P (…, 4, 4) of ten parameters (…, 10).

    Mass, first moments, second moments xx yy zz xy yz xz about the origin.
    """
    P: Array = np.tensordot(parameters, BASIS, axes=1)
    return P


def interior_parameters(parameters: Array, scale: Array) -> Array:
    """The parameters (10,), changed so that the eigenvalues of the scaled P are at least a small number.

    ``scale`` (10,): units of the parameters, ``m, m l, m l2`` for a mass m and a length l.
    """
    values, vectors = np.linalg.eigh(pseudo_inertia(parameters / scale))
    P = (vectors * np.maximum(values, _INTERIOR)) @ vectors.T
    S = P[:3, :3]
    I = np.trace(S) * np.eye(3) - S  # noqa: E741 - the field's letter
    entries = [P[3, 3], *P[:3, 3], I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[1, 2], I[0, 2]]
    return np.array(entries) * scale


@dataclass(frozen=True, kw_only=True, eq=False)
class Constraints:
    """Conditions on parameters x (p,).

    ``bodies`` (k, 10): the indices of the parameters of each body; ``positive``, ``negative``: parameters
    above and below 0. ``scale`` (p,): the unit of each parameter.
    """

    bodies: Indices
    positive: Indices
    negative: Indices
    scale: Array

    def interior(self, x: Array) -> Array:
        """A point near ``x`` that satisfies all conditions."""
        point = x.copy()
        for body in self.bodies:
            point[body] = interior_parameters(x[body], self.scale[body])
        least = _INTERIOR * self.scale
        point[self.positive] = np.maximum(x[self.positive], least[self.positive])
        point[self.negative] = np.minimum(x[self.negative], -least[self.negative])
        return point


def consistent_fit(A: Array, y: Array, prior: Array, constraints: Constraints) -> Array:
    """The parameters x (p,) that minimise ``|A x - y|2`` and satisfy the constraints.

    ``A`` (m, p) and ``y`` (m,): rows divided by their standard deviations. Directions of x without effect
    stay as near to ``prior`` as the constraints allow, in the units of ``constraints.scale``.
    """
    scale = constraints.scale
    start = constraints.interior(prior)
    matrix = A * scale
    # Exact data have weights without bound; the weight of the start would be lost in rounding errors.
    weight = min(1.0, _LARGEST / max(float(np.linalg.norm(matrix, axis=0).max(initial=0.0)), 1e-300))
    matrix, y = weight * matrix, weight * (y - A @ start)
    H = matrix.T @ matrix + PULL**2 * np.eye(len(prior))
    g = matrix.T @ y
    origin = start / scale
    z = np.zeros_like(prior)
    # A start far from the minimum needs a strong barrier, or the damped steps do not reach the centre.
    gap = 0.5 * float(g @ np.linalg.solve(H, g))
    barrier = max(_FIRST_BARRIER, gap / len(prior))
    while barrier > _LAST_BARRIER:
        z = _centred(z, H, g, barrier, origin, constraints)
        barrier *= _REDUCTION
    return (origin + z) * scale


def _centred(z: Array, H: Array, g: Array, barrier: float, origin: Array, c: Constraints) -> Array:
    """The minimum of the objective with a barrier, by damped Newton steps."""
    for _ in range(_NEWTON_STEPS):
        try:
            gradient, hessian = _barrier_derivatives(origin + z, barrier, c)
            total = H @ z - g + gradient
            step = -np.linalg.solve(H + hessian, total)
        except np.linalg.LinAlgError:
            break  # a body at the border of the possible bodies: singular within rounding errors
        decrease = float(-total @ step)
        value, length = _objective(z, H, g, barrier, origin, c), 1.0
        if decrease <= max(1e-2 * barrier, 1e-12 * abs(value)):
            break
        while length > 1e-12:
            trial = _objective(z + length * step, H, g, barrier, origin, c)
            if trial <= value - 0.1 * length * decrease:
                break
            length *= 0.5
        else:
            break  # the decrease is below the resolution of the objective
        z = z + length * step
    return z


def _objective(z: Array, H: Array, g: Array, barrier: float, origin: Array, c: Constraints) -> float:
    """Half the weighted squares plus the barrier; infinite outside."""
    x = origin + z
    signed = np.concatenate([x[c.positive], -x[c.negative]])
    if not (signed > 0.0).all():
        return np.inf
    logarithms = float(np.log(signed).sum())
    try:
        factors = np.linalg.cholesky(pseudo_inertia(x[c.bodies]))
    except np.linalg.LinAlgError:
        return np.inf
    logarithms += 2.0 * float(np.log(np.diagonal(factors, axis1=1, axis2=2)).sum())
    return float(0.5 * z @ H @ z - g @ z) - barrier * logarithms


def _barrier_derivatives(x: Array, barrier: float, c: Constraints) -> tuple[Array, Array]:
    """Gradient (p,) and second derivatives (p, p) of ``-barrier (log det P + log x)`` in scaled units."""
    gradient, hessian = np.zeros_like(x), np.zeros((len(x), len(x)))
    for body, inverse in zip(c.bodies, np.linalg.inv(pseudo_inertia(x[c.bodies]))):
        products = inverse @ BASIS
        gradient[body] -= barrier * np.trace(products, axis1=1, axis2=2)
        hessian[np.ix_(body, body)] += barrier * np.einsum("aij,bji->ab", products, products)
    for indices in (c.positive, c.negative):
        gradient[indices] -= barrier / x[indices]
        hessian[indices, indices] += barrier / x[indices] ** 2
    return gradient, hessian
