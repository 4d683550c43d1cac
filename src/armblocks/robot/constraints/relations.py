"""The elementary relations of closures of loops.

A closure is a sequence of relations of three types. The algorithms of :mod:`armblocks.dynamics` use only
these types, so the sequence describes a type of closure completely. ``a`` is the first frame of a closure and
``b`` the second frame; both have the axes x, y, z with the indices 0, 1, 2.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class NoDisplacement:
    """The origin of b has no displacement from the origin of a along an axis of a. Residual in m."""

    axis: int


@dataclass(frozen=True)
class Perpendicular:
    """An axis of a and an axis of b are perpendicular. The residual is the cosine of their angle."""

    first: int
    second: int


@dataclass(frozen=True)
class Distance:
    """The origins of a and b have a distance ``length`` (m).

    The residual is (d² - length²) / (2 length) in m, which is differentiable everywhere.
    """

    length: float


Relation = NoDisplacement | Perpendicular | Distance
"""An elementary relation: one equation."""

ORIGINS_COINCIDE = (NoDisplacement(0), NoDisplacement(1), NoDisplacement(2))
"""The three relations of two coincident origins."""
Z_AXES_PARALLEL = (Perpendicular(0, 2), Perpendicular(1, 2))
"""The two relations of parallel z axes."""
SAME_AXES = (*Z_AXES_PARALLEL, Perpendicular(0, 1))
"""The three relations of parallel axes."""
