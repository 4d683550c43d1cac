"""A Rosenbrock method as data: linearly implicit steps with the exact Jacobian, for stiff systems."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from armblocks.errors import InputError
from armblocks.integration.butcher_tableau import CONSISTENCY, ButcherTableau, Row


@dataclass(frozen=True, kw_only=True)
class RosenbrockTableau:
    """A Rosenbrock method and its dense output, the polynomial for values within a step.

    One step of size ``h`` from ``(t, x)``, with ``J = df/dx`` and ``T = df/dt`` there and ``s`` stages::

        (I / gamma - h J) k[i] = f(t + nodes[i] h,  x + h * sum_j matrix[i][j] k[j])
                                 + sum_j couplings[i][j] k[j] + h time_weights[i] T         j < i
        x_new = x + h * sum_j weights[j] k[j]
        x(t + theta h) = x + h * sum_j (sum_m dense[j][m] theta^(m+1)) k[j]

    This form needs no product with ``J`` (Hairer, Wanner II, IV.7, equation (7.25), with ``u = h k``).
    :func:`from_textbook` computes it from ``alpha``, ``Gamma``, ``b``. The error estimate is ``h * sum_j
    error[j] k[j]``, of order ``error_order``. A method without ``error`` has a fixed step. An adaptive step
    also checks its dense output: the defect ``r = f - x'`` in the middle of the step gives the error ``(I /
    gamma - h J)^-1 h r`` of a stiff system, which must be below the tolerance as well. Without this check,
    steps would grow without bound where fast dynamics follow slow inputs. The result would then be accurate
    at the ends of the steps only.

    If the system has implicit equations ``0 = g(t, x, w)``, ``J`` and ``T`` are total derivatives along their
    solution ``w(t, x)``: the rows of ``g`` are appended to the matrix, which is eliminated as a whole.
    """

    name: str
    title: str
    source: str
    order: int
    dense_order: int
    gamma: float
    nodes: Row
    matrix: tuple[Row, ...]
    couplings: tuple[Row, ...]
    time_weights: Row
    weights: Row
    dense: tuple[Row, ...]
    aliases: tuple[str, ...] = ()
    error: Row | None = None
    error_order: int = 0

    def __post_init__(self) -> None:
        s = self.stages
        triangular = [list(range(s)), [len(row) for row in self.matrix], [len(row) for row in self.couplings]]
        rows = {
            "matrix": triangular[1] == triangular[0],
            "couplings": triangular[2] == triangular[0],
            "time_weights": len(self.time_weights) == s,
            "weights": len(self.weights) == s,
            "error": self.error is None or len(self.error) == s,
            "dense": len(self.dense) == s and len({len(row) for row in self.dense}) == 1,
        }
        for field, fits in rows.items():
            if not fits:
                raise InputError(
                    f"'{field}' does not fit the {s} stages",
                    where=f"integrator {self.name}",
                    allowed="row i of a matrix has i numbers; see RosenbrockTableau",
                    fix=f"correct '{field}'",
                )
        # In the textbook's form, the rows add up to the nodes, to the weights of T, to one and to zero.
        inverse = np.eye(s) / self.gamma - _square(self.couplings)
        sums = np.linalg.solve(inverse, np.ones(s))
        checks = {f"matrix row {i}": (float(_square(self.matrix)[i] @ sums), self.nodes[i]) for i in range(s)}
        checks |= {f"row {i} of Gamma": (float(sums[i]), self.time_weights[i]) for i in range(s)}
        checks["weights"] = (float(np.array(self.weights) @ sums), 1.0)
        ends = [sum(row) for row in self.dense]
        checks |= {f"dense row {j} at the step's end": (ends[j], w) for j, w in enumerate(self.weights)}
        if self.error is not None:
            checks["error"] = (float(np.array(self.error) @ sums), 0.0)
        for name, (actual, expected) in checks.items():
            # The coefficients are published with 15 or 16 digits and are multiplied by numbers of up to 300.
            if abs(actual - expected) > 100 * CONSISTENCY * max(1.0, abs(expected)):
                raise InputError(
                    f"{name} adds up to {actual!r}",
                    where=f"integrator {self.name}",
                    allowed=f"{expected!r}",
                    fix="check the coefficients against their source",
                )

    @property
    def adaptive(self) -> bool:
        """Whether the method has an error estimate and adapts its steps."""
        return self.error is not None

    @property
    def stages(self) -> int:
        """Number of systems of linear equations that one step solves."""
        return len(self.nodes)

    @property
    def rows(self) -> int:
        """Rows of ``K``: the derivative at the start of the step, the stages, the derivative at the end, and
        the state and the derivative in the middle."""
        return self.stages + 4

    @property
    def end_row(self) -> int:
        """The row of ``K`` with the derivative at the new point."""
        return self.stages + 1

    @property
    def error_row(self) -> Row | None:
        """``error`` over the rows of ``K``."""
        return None if self.error is None else (0.0, *self.error)

    @property
    def dense_rows(self) -> tuple[Row, ...]:
        """``dense`` over the rows of ``K``."""
        zeros = (0.0,) * len(self.dense[0])
        return (zeros, *self.dense, zeros)

    @property
    def needs_jacobian(self) -> bool:
        """Whether a step needs the Jacobian of the flow, as methods for stiff systems do."""
        return True

    @property
    def first_stage(self) -> int:
        """The row of ``K`` with the first stage: the derivative at the step's start is before it."""
        return 1

    @property
    def real_stability(self) -> float:
        """Length of the interval of absolute stability on the negative real axis: infinite."""
        return float("inf")

    @property
    def middle_row(self) -> int:
        """The row of ``K`` with the state in the middle of the step; the next one has its derivative."""
        return self.stages + 2

    def derivative_weights(self, theta: float) -> Row:
        """Weights of the rows of ``K`` in ``x'(t + theta h)``, the derivative of the dense output."""
        powers = [(m + 1) * theta**m for m in range(len(self.dense[0]))]
        return (0.0, *(sum(a * b for a, b in zip(row, powers)) for row in self.dense))

    @property
    def content(self) -> str:
        """All numbers of the method as text, exactly: the part of a cache key that identifies the method."""
        numbers = (
            self.gamma,
            self.nodes,
            self.matrix,
            self.couplings,
            self.time_weights,
            self.weights,
            self.dense,
            self.error,
            self.error_order,
        )
        return repr(("rosenbrock", numbers))


Tableau = ButcherTableau | RosenbrockTableau
"""An explicit or a Rosenbrock method as data."""


def from_textbook(
    *,
    alpha: Sequence[Sequence[float]],
    gamma: Sequence[Sequence[float]],
    b: Sequence[float],
    dense: Sequence[Sequence[float]],
    error: Sequence[float] | None = None,
) -> dict[str, object]:
    """The fields of a :class:`RosenbrockTableau` from the usual form of a method.

    ``(I - h gamma[i][i] J) k[i] = f(t + alpha_i h, x + h sum_j alpha[i][j] k[j]) + h J sum_j gamma[i][j] k[j]
    + h gamma_i T`` with ``alpha_i``, ``gamma_i`` the sums of the rows, ``x_new = x + h sum_j b[j] k[j]``
    (Hairer, Wanner II, IV.7, equation (7.4)). Row i of ``alpha`` has i numbers, row i of ``gamma`` i + 1;
    ``dense`` and ``error`` are weights of these ``k``. The fields are computed as fractions and rounded once,
    because the last digits of a library's matrix inversion depend on the processor.
    """
    inverse = _inverse(gamma)
    return {
        "gamma": gamma[0][0],
        "nodes": tuple(float(sum(map(Fraction, row))) for row in alpha),
        "matrix": tuple(_times_inverse(row, inverse)[:i] for i, row in enumerate(alpha)),
        "couplings": tuple(tuple(float(-entry) for entry in row[:-1]) for row in inverse),
        "time_weights": tuple(float(sum(map(Fraction, row))) for row in gamma),
        "weights": _times_inverse(b, inverse),
        "dense": tuple(zip(*(_times_inverse(column, inverse) for column in zip(*dense)))),
        "error": None if error is None else _times_inverse(error, inverse),
    }


def _inverse(gamma: Sequence[Sequence[float]]) -> list[list[Fraction]]:
    """The rows of the inverse of a lower triangular matrix, by forward substitution."""
    rows: list[list[Fraction]] = []
    for i, row in enumerate(gamma):
        exact = [Fraction(entry) for entry in row]
        entries = [
            -sum((exact[k] * rows[k][j] for k in range(j, i)), Fraction(0)) / exact[i] for j in range(i)
        ]
        rows.append([*entries, 1 / exact[i]])
    return rows


def _times_inverse(weights: Sequence[float], inverse: Sequence[Sequence[Fraction]]) -> Row:
    """A row of weights times the triangular matrix ``inverse``; a shorter row is padded with zeros."""
    exact = [Fraction(weight) for weight in weights]
    return tuple(
        float(sum((exact[k] * inverse[k][j] for k in range(j, len(exact))), Fraction(0)))
        for j in range(len(inverse))
    )


def stiffly_accurate_dense(weights: Row, inner: Sequence[Row]) -> tuple[Row, ...]:
    """``dense`` of the Rodas family from the published ``H``, ``(m, s)``.

    ``x(theta) = (1 - theta) x + theta (x_new + (1 - theta) (y_1 + theta (y_2 + theta y_3)))`` with
    ``y_i = h sum_j H[i][j] k[j]`` (Hairer, Wanner II, VI.4).
    """
    rows: list[Row] = []
    for j, weight in enumerate(weights):
        powers = [weight] + [0.0] * len(inner)
        for m, row in enumerate(inner):  # theta (1 - theta) theta^m
            powers[m] += row[j]
            powers[m + 1] -= row[j]
        rows.append(tuple(powers))
    return tuple(rows)


def _square(rows: Sequence[Sequence[float]]) -> np.ndarray:
    """A lower triangular matrix as a square array."""
    matrix = np.zeros((len(rows), len(rows)))
    for i, row in enumerate(rows):
        matrix[i, : len(row)] = row
    return matrix
