"""Linear systems whose equations are partly algebraic: E x' = A x + B u with a singular E."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
from casadi import SX, mtimes
from numpy.typing import ArrayLike, NDArray

from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    WorkedExample,
    driver,
    parameter,
    shape_of,
)
from armblocks.errors import InputError, counted

Matrix = NDArray[np.float64]
RELATIVE_TOLERANCE = 1e-12
"""Singular values and matrix entries below this fraction of the largest value count as 0."""


@dataclass(frozen=True, kw_only=True)
class DescriptorStateSpace(Block):
    """A linear system with algebraic equations: E x' = A x + B u, y = C x + D u, where E may be singular.

    - The equations must be of index 1: the algebraic equations determine the part of x in the null space of
      E. Equations of higher index are an error.
    - The block has rank(E) states z, the coordinates of x in the row space of E along its right singular
      vectors. If E is regular, z is x itself.
    - ``initial`` is x(0). Only its part in the row space of E is used; the algebraic equations determine the
      rest from z and u.
    - The matrices are not tunable, so that the feedthrough is known exactly.

    P. Kunkel, V. Mehrmann, Differential-Algebraic Equations, 2006, section 2.1.
    """

    title: ClassVar[str] = "Descriptor State-Space"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A capacitor of 1 F behind 1 ohm; the current is an algebraic unknown: 0 = u - v - i.",
        parameters={
            "E": ((1.0, 0.0), (0.0, 0.0)),
            "A": ((0.0, 1.0), (-1.0, -1.0)),
            "B": ((0.0,), (1.0,)),
            "C": ((1.0, 0.0), (0.0, 1.0)),
            "D": ((0.0,), (0.0,)),
        },
        inputs={"u": driver("SineWave")},
    )

    E: ArrayLike = parameter(((1.0,),), dimensions=(2,), doc="the matrix of x' (n, n)", tunable=False)
    A: ArrayLike = parameter(((-1.0,),), dimensions=(2,), doc="the system matrix (n, n)", tunable=False)
    B: ArrayLike = parameter(((1.0,),), dimensions=(2,), doc="the input matrix (n, m)", tunable=False)
    C: ArrayLike = parameter(((1.0,),), dimensions=(2,), doc="the output matrix (k, n)", tunable=False)
    D: ArrayLike = parameter(((0.0,),), dimensions=(2,), doc="the feedthrough (k, m)", tunable=False)
    initial: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, dimensions=(0, 1), doc="x (n,) at t = 0, or one number for all"
    )

    def check(self) -> None:
        E, A, B, C, D = (shape_of(self.parameter_value(name)) for name in "EABCD")
        if A[0] != A[1] or E != A or B[0] != A[0] or C[1] != A[0] or (C[0], B[1]) != D:
            raise InputError(
                f"E is {E}, A is {A}, B is {B}, C is {C}, D is {D}",
                where="DescriptorStateSpace",
                allowed="E and A (n, n), B (n, m), C (k, n), D (k, m)",
                fix="correct the shapes of the five matrices",
            )
        if shape_of(self.initial) not in ((), A[:1]):
            raise InputError(
                f"initial has shape {shape_of(self.initial)}",
                where="DescriptorStateSpace.initial",
                allowed=f"() or {A[:1]}",
                fix="give one number for each row of A, or one for all",
            )
        _ = self._explicit

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input", shape=shape_of(self.B)[1:]),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the output", shape=shape_of(self.C)[:1]),)

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        rank = len(self._explicit.A)
        return (State("z", (rank,), "coordinates of x in the row space of E"),) if rank else ()

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        system = self._explicit
        feedthrough = mtimes(_sparse(system.D), u["u"])
        return {"y": feedthrough + mtimes(_sparse(system.C), x["z"]) if len(system.A) else feedthrough}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        system = self._explicit
        if not len(system.A):
            return {}
        return {"z": mtimes(_sparse(system.A), x["z"]) + mtimes(_sparse(system.B), u["u"])}

    def initial_states(self, p: Signals) -> Signals:
        if not len(self._explicit.A):
            return {}
        start = p["initial"] * SX.ones(shape_of(self.A)[0])
        return {"z": mtimes(SX(self._explicit.differentiated), start)}

    @property
    def _explicit(self) -> _Explicit:
        return _explicit(*(self.parameter_value(name) for name in "EABCD"))


@dataclass(frozen=True)
class _Explicit:
    """z' = A z + B u, y = C z + D u, and the rows that compute z from x."""

    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    differentiated: Matrix


@lru_cache(maxsize=64)
def _explicit(*matrices: Any) -> _Explicit:
    """Eliminate the algebraic equations.

    Raises ``InputError`` if they do not determine their unknowns.
    """
    E, A, B, C, D = (np.asarray(value) for value in matrices)
    U, singular_values, Vt = np.linalg.svd(E)
    rank = int(np.sum(singular_values > RELATIVE_TOLERANCE * max(1.0, float(singular_values[0]))))
    if rank == len(E):
        return _Explicit(np.linalg.solve(E, A), np.linalg.solve(E, B), C, D, np.eye(rank))
    U1, U2, V1, V2 = U[:, :rank], U[:, rank:], Vt[:rank].T, Vt[rank:].T
    # 0 = U2' (A (V1 z + V2 w) + B u) must determine w.
    algebraic = U2.T @ A @ V2
    scale = float(np.linalg.norm(A)) or 1.0
    if float(np.linalg.svd(algebraic, compute_uv=False)[-1]) <= RELATIVE_TOLERANCE * scale:
        raise InputError(
            f"E has rank {rank} of {len(E)}; "
            f"{counted(len(E) - rank, 'algebraic equation does', 'algebraic equations do')} not determine "
            "the part of x in the null space of E",
            where="DescriptorStateSpace",
            allowed="equations of index 1: A restricted to the left and right null spaces of E is regular",
            fix="differentiate the algebraic equations by hand, or omit one that repeats another",
        )
    w_of_z = -np.linalg.solve(algebraic, U2.T @ A @ V1)
    w_of_u = -np.linalg.solve(algebraic, U2.T @ B)
    x_of_z = V1 + V2 @ w_of_z  # x = x_of_z z + V2 w_of_u u
    scaled = (U1 / singular_values[:rank]).T
    return _Explicit(
        A=_cleaned(scaled @ A @ x_of_z),
        B=_cleaned(scaled @ (B + A @ V2 @ w_of_u)),
        C=_cleaned(C @ x_of_z),
        D=_cleaned(D + C @ V2 @ w_of_u),
        differentiated=_cleaned(V1.T),
    )


def _cleaned(matrix: Matrix) -> Matrix:
    """The matrix with entries of rounding size set to 0, so that they do not count as feedthrough."""
    largest = float(np.max(np.abs(matrix), initial=0.0))
    return np.where(np.abs(matrix) <= RELATIVE_TOLERANCE * largest, 0.0, matrix)


def _sparse(matrix: Matrix) -> SX:
    """The matrix as symbols; its zero entries are structural zeros."""
    rows, columns = matrix.shape
    sparse = SX(rows, columns)
    for i, j in zip(*np.nonzero(matrix)):
        sparse[int(i), int(j)] = float(matrix[i, j])
    return sparse
