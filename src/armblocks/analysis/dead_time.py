"""Dead time in a linear system: an all-pass of finite order, or exact in the frequency response.

In the linearised system, the outputs of the delays are additional inputs ``v``, and their inputs are
additional outputs ``d``::

    dx' = A dx + B du + E dv    dy = C dx + D du + F dv    dd = G dx + H du + K dv    dv(t) = dd(t - T)

The delay is replaced by the Padé approximation of order n/n, ``Q(-s T) / Q(s T)`` with the coefficients ``(2n
- k)! n! / ((2n)! k! (n - k)!)`` (Golub, Van Loan, Matrix Computations, 4th ed., 9.3.1). The gain of this
approximation is 1, and its phase is accurate up to about n / T rad/s. A variable delay has its value at the
operating point.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from armblocks.equations.evaluation import EvaluatedSystem, Jacobians, Point

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Realisation = tuple[Array, Array, Array, float]

MAX_ORDER = 10
"""Maximum order of an approximation. At higher orders, rounding errors of the coefficients dominate."""


def pade(order: int, delay: float) -> Realisation:
    """The matrices ``A (n, n), B (n, 1), C (1, n), D`` of the approximation of a delay (s)."""
    n = order
    weights = [
        math.factorial(2 * n - k) * math.factorial(n) / (math.factorial(k) * math.factorial(n - k))
        for k in range(n + 1)
    ]
    # The companion matrix is well scaled in the unit of time in which the product of all poles is 1.
    unit = (weights[0] / weights[n]) ** (1.0 / n)
    denominator = np.array([weights[k] * unit**k for k in range(n + 1)]) / weights[0]
    numerator = denominator * (-1.0) ** np.arange(n + 1)
    direct = float(numerator[n] / denominator[n])
    A = np.diag(np.ones(n - 1), 1)
    A[-1] = -denominator[:n] / denominator[n]
    B = np.zeros((n, 1))
    B[-1, 0] = 1.0
    C = ((numerator[:n] - direct * denominator[:n]) / denominator[n])[None]
    return A * (unit / delay), B * (unit / delay), C, direct


@dataclass(frozen=True, kw_only=True, eq=False)
class DeadTime:
    """The delays of a system at a point: indices of ``v`` in ``z``, delays, derivatives of ``d``.

    ``names`` are the names of ``v``. Only delays that an equation reads are included.
    """

    indices: Indices
    names: tuple[str, ...]
    delays: Array
    inputs: Jacobians

    @property
    def count(self) -> int:
        """Number of delayed scalars."""
        return self.indices.size

    @cached_property
    def feedthrough(self) -> Array:
        """``K``: the direct feedthrough from the outputs of the delays to their inputs."""
        return self.inputs.z[:, self.indices]


def dead_time(
    evaluated: EvaluatedSystem, point: Point, inputs: Jacobians, readers: list[Jacobians]
) -> DeadTime:
    """The delays that the equations ``readers`` depend on, directly or through other delays.

    ``inputs`` are the derivatives of the inputs of all delays, ``readers`` the derivatives of the equations.
    """
    system = evaluated.system
    assert system.delays is not None
    indices = np.array([*system.delays.values, *system.delays.derivatives], dtype=np.intp)
    names = [name for slot in system.discrete for name in slot.elements]
    delays = np.tile(evaluated.delay_times(point), 2)
    read = np.any([reader.z[:, indices].any(axis=0) for reader in readers], axis=0)
    for _ in range(indices.size):
        read = read | inputs.z[np.ix_(np.flatnonzero(read), indices)].any(axis=0)
    needed: Indices = np.flatnonzero(read)
    jacobians = Jacobians(
        t=inputs.t[needed], x=inputs.x[needed], z=inputs.z[needed], w=inputs.w[needed], p=inputs.p[needed]
    )
    needed_indices = indices[needed]
    return DeadTime(
        indices=needed_indices,
        names=tuple(names[int(k)] for k in needed_indices),
        delays=delays[needed],
        inputs=jacobians,
    )


class PadeApproximation:
    """Replaces delays by approximations: derivatives with respect to ``[x; q]`` in place of ``x``.

    The states ``q`` of the approximations obey ``q' = P q + R d`` and ``v = S q + W d``.
    """

    def __init__(self, dead: DeadTime, order: int) -> None:
        self.dead = dead
        size = dead.count * order
        P, R, S = np.zeros((size, size)), np.zeros((size, dead.count)), np.zeros((dead.count, size))
        W = np.zeros((dead.count, dead.count))
        for k, delay in enumerate(dead.delays.tolist()):
            block = slice(k * order, (k + 1) * order)
            P[block, block], R[block, k : k + 1], S[k : k + 1, block], W[k, k] = pade(order, delay)
        inputs = dead.inputs
        # v = S q + W (G x + H u + K v); d follows from v.
        closed_loop = np.linalg.inv(np.eye(dead.count) - W @ dead.feedthrough)
        self.by_x = closed_loop @ np.hstack([W @ inputs.x, S])
        self.by_z = closed_loop @ (W @ self._others(inputs.z))
        self.by_p = closed_loop @ (W @ inputs.p)
        self.names = tuple(f"{name} pade[{k}]" for name in dead.names for k in range(order))
        input_derivatives = self(inputs)
        rate = np.hstack([np.zeros((size, inputs.x.shape[1])), P]) + R @ input_derivatives.x
        self.rates = Jacobians(
            t=np.zeros((size, 1)),
            x=rate,
            z=R @ input_derivatives.z,
            w=np.zeros((size, 0)),
            p=R @ input_derivatives.p,
        )

    def _others(self, by_z: Array) -> Array:
        """The derivatives with respect to all of ``z`` except delayed values."""
        others = by_z.copy()
        others[:, self.dead.indices] = 0.0
        return others

    def __call__(self, j: Jacobians) -> Jacobians:
        """The derivatives with the approximations in place of delayed values."""
        by_delayed = j.z[:, self.dead.indices]
        padded = np.hstack([j.x, np.zeros((j.x.shape[0], self.by_x.shape[1] - j.x.shape[1]))])
        return Jacobians(
            t=j.t,
            x=padded + by_delayed @ self.by_x,
            z=self._others(j.z) + by_delayed @ self.by_z,
            w=j.w,
            p=j.p + by_delayed @ self.by_p,
        )

    def flow(self, j: Jacobians) -> Jacobians:
        """The derivatives of ``[x'; q']``."""
        block, rates = self(j), self.rates
        return Jacobians(
            t=np.vstack([block.t, rates.t]),
            x=np.vstack([block.x, rates.x]),
            z=np.vstack([block.z, rates.z]),
            w=block.w,
            p=np.vstack([block.p, rates.p]),
        )
