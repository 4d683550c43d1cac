"""Three-vectors and 3x3 matrices of scalars that may be numbers or symbols.

The same algorithms therefore evaluate numbers and trace symbols. Terms with a known zero factor are omitted
during tracing (CasADi folds ``0 * x``, ``1 * x`` and ``0 + x``), so arms with many zeros in their tables have
short equations.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

from casadi import OP_ADD, OP_MUL, OP_SUB, SX

Scalar: TypeAlias = SX | float
Vector: TypeAlias = tuple[Scalar, Scalar, Scalar]
"""x, y, z."""
Matrix: TypeAlias = tuple[Vector, Vector, Vector]
"""Three rows."""

ZERO: Vector = (0.0, 0.0, 0.0)


class Symmetric(NamedTuple):
    """A symmetric 3x3 matrix by its six entries."""

    xx: Scalar
    yy: Scalar
    zz: Scalar
    xy: Scalar
    yz: Scalar
    xz: Scalar


def plus(a: Scalar, b: Scalar) -> Scalar:
    """The sum a + b.

    CasADi's operators try several types of numbers first, which takes seven times as long as ``SX.binary``.
    The expressions are the same.
    """
    return SX.binary(OP_ADD, a, b) if isinstance(a, SX) or isinstance(b, SX) else a + b


def minus(a: Scalar, b: Scalar) -> Scalar:
    """The difference a - b, computed as in :func:`plus`."""
    return SX.binary(OP_SUB, a, b) if isinstance(a, SX) or isinstance(b, SX) else a - b


def times(a: Scalar, b: Scalar) -> Scalar:
    """The product a b, computed as in :func:`plus`."""
    return SX.binary(OP_MUL, a, b) if isinstance(a, SX) or isinstance(b, SX) else a * b


def add(a: Vector, b: Vector) -> Vector:
    """The sum a + b."""
    return plus(a[0], b[0]), plus(a[1], b[1]), plus(a[2], b[2])


def subtract(a: Vector, b: Vector) -> Vector:
    """The difference a - b."""
    return minus(a[0], b[0]), minus(a[1], b[1]), minus(a[2], b[2])


def scale(k: Scalar, a: Vector) -> Vector:
    """The vector a times the scalar k."""
    return times(k, a[0]), times(k, a[1]), times(k, a[2])


def dot(a: Vector, b: Vector) -> Scalar:
    """The dot product a' b."""
    return plus(plus(times(a[0], b[0]), times(a[1], b[1])), times(a[2], b[2]))


def cross(a: Vector, b: Vector) -> Vector:
    """The cross product a x b."""
    return (
        minus(times(a[1], b[2]), times(a[2], b[1])),
        minus(times(a[2], b[0]), times(a[0], b[2])),
        minus(times(a[0], b[1]), times(a[1], b[0])),
    )


def rotate(R: Matrix, a: Vector) -> Vector:
    """The product R a."""
    return dot(R[0], a), dot(R[1], a), dot(R[2], a)


def rotate_back(R: Matrix, a: Vector) -> Vector:
    """The product R' a."""
    return rotate(transpose(R), a)


def transpose(R: Matrix) -> Matrix:
    """The transpose R'."""
    return (R[0][0], R[1][0], R[2][0]), (R[0][1], R[1][1], R[2][1]), (R[0][2], R[1][2], R[2][2])


def multiply(A: Matrix, B: Matrix) -> Matrix:
    """The product A B."""
    return transpose((rotate(A, _column(B, 0)), rotate(A, _column(B, 1)), rotate(A, _column(B, 2))))


def multiply_symmetric(S: Symmetric, a: Vector) -> Vector:
    """The product S a."""
    return rotate(((S.xx, S.xy, S.xz), (S.xy, S.yy, S.yz), (S.xz, S.yz, S.zz)), a)


def rotate_symmetric(R: Matrix, S: Symmetric) -> Symmetric:
    """The product R S R'."""
    SRt = tuple(multiply_symmetric(S, row) for row in R)
    return Symmetric(
        xx=dot(R[0], SRt[0]),
        yy=dot(R[1], SRt[1]),
        zz=dot(R[2], SRt[2]),
        xy=dot(R[0], SRt[1]),
        yz=dot(R[1], SRt[2]),
        xz=dot(R[0], SRt[2]),
    )


def add_symmetric(A: Symmetric, B: Symmetric) -> Symmetric:
    """The sum A + B."""
    return Symmetric(*(plus(a, b) for a, b in zip(A, B)))


class RotationZ(NamedTuple):
    """A rotation about z by its cosine and sine: four products for a vector instead of nine."""

    c: Scalar
    s: Scalar

    def matrix(self) -> Matrix:
        """The rotation matrix, as three rows."""
        return (self.c, -self.s, 0.0), (self.s, self.c, 0.0), (0.0, 0.0, 1.0)

    def rotate(self, a: Vector) -> Vector:
        """The product Rz a."""
        c, s = self
        x = minus(times(c, a[0]), times(s, a[1]))
        return x, plus(times(s, a[0]), times(c, a[1])), a[2]

    def rotate_back(self, a: Vector) -> Vector:
        """The product Rz' a."""
        c, s = self
        x = plus(times(c, a[0]), times(s, a[1]))
        return x, minus(times(c, a[1]), times(s, a[0])), a[2]

    def rotate_symmetric(self, S: Symmetric) -> Symmetric:
        """The product Rz S Rz', with six products for the 2x2 block, which rotates by twice the angle."""
        c, s = self
        difference = minus(S.yy, S.xx)
        doubled = plus(S.xy, S.xy)
        even = times(s, minus(times(s, difference), times(c, doubled)))
        odd = times(s, plus(times(c, difference), times(s, doubled)))
        return Symmetric(
            xx=plus(S.xx, even),
            yy=minus(S.yy, even),
            zz=S.zz,
            xy=minus(S.xy, odd),
            yz=plus(times(s, S.xz), times(c, S.yz)),
            xz=minus(times(c, S.xz), times(s, S.yz)),
        )


class Rotation(NamedTuple):
    """A rotation by its matrix."""

    R: Matrix

    def matrix(self) -> Matrix:
        """The rotation matrix, as three rows."""
        return self.R

    def rotate(self, a: Vector) -> Vector:
        """The product R a."""
        return rotate(self.R, a)

    def rotate_back(self, a: Vector) -> Vector:
        """The product R' a."""
        return rotate_back(self.R, a)

    def rotate_symmetric(self, S: Symmetric) -> Symmetric:
        """The product R S R'."""
        return rotate_symmetric(self.R, S)


def _column(A: Matrix, j: int) -> Vector:
    return A[0][j], A[1][j], A[2][j]
