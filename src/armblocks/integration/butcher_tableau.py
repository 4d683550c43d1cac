"""An explicit Runge-Kutta method as data. The native integrator is generated from it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from armblocks.errors import InputError

Row = tuple[float, ...]

CONSISTENCY = 1e-12
"""Maximum residual of a row sum. Rounding of published decimals stays below it; misprints exceed it."""


@dataclass(frozen=True, kw_only=True)
class ButcherTableau:
    """An explicit Runge-Kutta method and its dense output, the polynomial for values within a step.

    One step of size ``h`` from ``(t, x)`` to ``(t + h, x_new)``, with ``s = len(nodes)`` stages::

        K[i]   = f(t + nodes[i] h,  x + h * sum_j matrix[i][j] K[j])        i = 0 … s-1,  j < i
        x_new  = x + h * sum_j weights[j] K[j]
        K[s]   = f(t + h, x_new)                 the first stage of the next step (FSAL)
        K[s+1…] = the extra stages, of the same form, evaluated only where a sample time requires them
        x(t + theta h) = x + h * sum_j (sum_m dense[j][m] theta^(m+1)) K[j]

    An adaptive method also has ``error`` (s + 1 weights): the estimate ``h * sum_j error[j] K[j]`` is of
    order ``error_order``, so the step scales with ``norm^(-1 / (error_order + 1))``. Where
    ``second_error`` is given, both estimates are combined as in DOP853: ``e = h |e5|^2 / sqrt(|e5|^2 +
    0.01 |e3|^2)``.

    ``order`` is the global order of the steps, ``dense_order`` the order of the dense output.
    """

    name: str
    title: str
    source: str
    order: int
    dense_order: int
    nodes: Row
    matrix: tuple[Row, ...]
    weights: Row
    dense: tuple[Row, ...]
    aliases: tuple[str, ...] = ()
    error: Row | None = None
    error_order: int = 0
    second_error: Row | None = None
    extra_nodes: Row = ()
    extra_matrix: tuple[Row, ...] = ()

    def __post_init__(self) -> None:
        s = len(self.nodes)
        rows = {
            "matrix": [len(row) for row in self.matrix] == list(range(s)),
            "weights": len(self.weights) == s,
            "error": self.error is None or len(self.error) == s + 1,
            "second_error": self.second_error is None or len(self.second_error) == s + 1,
            "extra_matrix": [len(row) for row in self.extra_matrix]
            == [s + 1 + k for k in range(len(self.extra_nodes))],
            "dense": len(self.dense) == s + 1 + len(self.extra_nodes)
            and len({len(row) for row in self.dense}) == 1,
        }
        for field, fits in rows.items():
            if not fits:
                raise InputError(
                    f"'{field}' does not fit the {s} stages",
                    where=f"integrator {self.name}",
                    allowed="row i of the matrix has i numbers; see ButcherTableau",
                    fix=f"correct '{field}'",
                )
        sums = {f"matrix row {i}": (sum(row), self.nodes[i]) for i, row in enumerate(self.matrix)}
        sums |= {f"extra row {i}": (sum(row), self.extra_nodes[i]) for i, row in enumerate(self.extra_matrix)}
        sums["weights"] = (sum(self.weights), 1.0)
        end = [sum(row) for row in self.dense]
        sums |= {f"dense row {j} at the step's end": (end[j], w) for j, w in enumerate(self.weights)}
        if self.error is not None:
            sums["error"] = (sum(self.error), 0.0)
        for name, (actual, expected) in sums.items():
            if abs(actual - expected) > CONSISTENCY * max(1.0, abs(expected)):
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
        """Number of derivative evaluations of one step."""
        return len(self.nodes)

    @property
    def rows(self) -> int:
        """Rows of ``K``: stages, the derivative at the new point, and the extra stages."""
        return len(self.dense)

    @property
    def end_row(self) -> int:
        """The row of ``K`` with the derivative at the new point."""
        return self.stages

    @property
    def error_row(self) -> Row | None:
        """``error`` over the rows of ``K``."""
        return self.error

    @property
    def dense_rows(self) -> tuple[Row, ...]:
        """``dense`` over the rows of ``K``."""
        return self.dense

    @property
    def needs_jacobian(self) -> bool:
        """Whether a step needs the Jacobian of the flow, as methods for stiff systems do."""
        return False

    @property
    def first_stage(self) -> int:
        """The row of ``K`` with the first stage."""
        return 0

    @property
    def measures_stiffness(self) -> bool:
        """Whether the last two derivative evaluations are both at the end of a step. Their difference then
        estimates the fastest rate (Hairer, Wanner II, IV.2, equation (2.20))."""
        return self.adaptive and self.stages > 1 and self.nodes[-1] == 1.0

    @cached_property
    def real_stability(self) -> float:
        """Length of the interval of absolute stability on the negative real axis.

        A linear decay of rate ``lambda`` stays bounded while ``h lambda`` is below it. From the stability
        function ``R(z) = 1 + z b (I - z A)^-1 1`` (Hairer, Wanner II, IV.2, proposition 2.1), in hundredths.
        """
        for hundredths in range(1, 2000):
            z = hundredths / 100
            stages: list[float] = []
            for row in self.matrix:
                stages.append(1.0 - z * sum(a * y for a, y in zip(row, stages)))
            if abs(1.0 - z * sum(b * y for b, y in zip(self.weights, stages))) > 1.0 + 1e-9:
                return z
        return 20.0

    @property
    def content(self) -> str:
        """All numbers of the method as text, exactly: the part of a cache key that identifies the method."""
        return repr(
            (
                self.nodes,
                self.matrix,
                self.weights,
                self.dense,
                self.error,
                self.error_order,
                self.second_error,
                self.extra_nodes,
                self.extra_matrix,
            )
        )


def hermite_dense(weights: Row) -> tuple[Row, ...]:
    """Cubic Hermite polynomial through the values and derivatives at both ends of a step, as rows of
    ``dense``.

    The interpolation error is of order ``h^4``, so the dense output of a method up to order 4 has its order.
    Source: Hairer, Norsett, Wanner, *Solving Ordinary Differential Equations I*, II.6, equation (6.7).
    """
    s = len(weights)
    rows = [[0.0, 3.0 * w, -2.0 * w] for w in (*weights, 0.0)]
    for j, derivative in ((0, (1.0, -2.0, 1.0)), (s, (0.0, -1.0, 1.0))):
        rows[j] = [a + b for a, b in zip(rows[j], derivative)]
    return tuple(tuple(row) for row in rows)
