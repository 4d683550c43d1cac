"""The root locus: the poles of a closed loop as functions of its gain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import InputError, counted
from armblocks.extras import from_extra

if TYPE_CHECKING:
    from armblocks.analysis.linear_system import LinearSystem

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

MAX_GAINS = 3000
"""Maximum number of gains that are chosen automatically."""
MIN_GAIN_SPACING = 1e-7
"""Minimum relative distance of neighbouring gains."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RootLocus:
    """``roots`` (N, nx) of ``1 + gain L`` at ``gains`` (N,), each column one branch from a pole of L."""

    system: LinearSystem
    gains: Array
    roots: Complex
    zeros: Complex


def root_locus(system: LinearSystem, gains: Array | None = None) -> RootLocus:
    """The branches of a loop with negative feedback; by default the gains are chosen automatically.

    Automatic gains range from 0 to a gain at which the roots are near their limits. They are denser where the
    roots move fast, so that branches can be distinguished where they meet. Raises ``InputError`` for more
    than one input or output, and for a system without states.
    """
    if not system.is_siso or not system.order:
        raise InputError(
            f"a root locus of {counted(system.D.shape[1], 'input')}, {counted(system.D.shape[0], 'output')} "
            "and "
            f"{counted(system.order, 'state')} is requested",
            where=system.name,
            allowed="one input, one output, and one state or more",
            fix="choose with system.select(output, input)",
        )
    loop = system.minimal()
    zeros = loop.zeros()
    if gains is not None:
        given_gains = np.asarray(gains, dtype=np.float64)
        rows = [_roots(loop, float(gain)) for gain in given_gains]
    else:
        given_gains, rows = _adaptive_gains(loop, zeros)
    return RootLocus(system=loop, gains=given_gains, roots=_tracked(rows), zeros=zeros)


def extent(loop: LinearSystem, zeros: Complex) -> float:
    """The radius of the figure of a root locus."""
    if loop.is_discrete:
        return 1.5
    return 3.0 * max(float(np.abs(np.concatenate([loop.poles(), zeros])).max(initial=0.0)), 1e-9)


def _roots(loop: LinearSystem, gain: float) -> Complex:
    with from_extra("analysis", "root loci"):
        from scipy.linalg import eigvals

    direct = 1.0 + gain * float(loop.D[0, 0])
    if direct == 0.0:  # only at this gain a root is infinite
        return _roots(loop, gain * (1.0 + MIN_GAIN_SPACING))
    return eigvals(loop.A - (gain / direct) * (loop.B @ loop.C))


def _adaptive_gains(loop: LinearSystem, zeros: Complex) -> tuple[Array, list[Complex]]:
    """Gains up to the gain at which every root is next to a zero or outside the figure."""
    radius = extent(loop, zeros)
    last = 1e-6 / max(float(np.abs(loop.B).max() * np.abs(loop.C).max()), 1e-12)
    for _ in range(120):
        roots = _roots(loop, last)
        is_near_zero = np.abs(roots[:, None] - zeros[None, :]).min(axis=1, initial=np.inf) < 0.01 * radius
        if bool((is_near_zero | (np.abs(roots) > 1.3 * radius)).all()):
            break
        last *= 2.0
    gains = [0.0, *np.geomspace(last * 1e-6, last, 80).tolist()]
    rows = [_roots(loop, gain) for gain in gains]
    k = 0
    while k + 1 < len(gains) and len(gains) < MAX_GAINS:
        can_be_divided = gains[k + 1] - gains[k] > MIN_GAIN_SPACING * gains[k + 1]
        if can_be_divided and _largest_movement(rows[k], rows[k + 1], radius) > 0.02 * radius:
            middle = (gains[k] + gains[k + 1]) / 2.0
            gains.insert(k + 1, middle)
            rows.insert(k + 1, _roots(loop, middle))
        else:
            k += 1
    return np.array(gains), rows


def _partners(before: Complex, after: Complex) -> NDArray[np.intp]:
    """For each root in ``before``, the index of the root in ``after`` on the same branch."""
    with from_extra("analysis", "root loci"):
        from scipy.optimize import linear_sum_assignment

    return linear_sum_assignment(np.abs(before[:, None] - after[None, :]))[1]


def _largest_movement(before: Complex, after: Complex, radius: float) -> float:
    """The largest movement of a root that is inside the figure."""
    partners = after[_partners(before, after)]
    visible = (np.abs(before) < 1.3 * radius) | (np.abs(partners) < 1.3 * radius)
    return float((np.abs(partners - before) * visible).max(initial=0.0))


def _tracked(rows: list[Complex]) -> Complex:
    """Assign the roots to columns such that the sum of the distances to the previous roots is minimal."""
    tracked = [rows[0]]
    for row in rows[1:]:
        tracked.append(row[_partners(tracked[-1], row)])
    return np.array(tracked)
