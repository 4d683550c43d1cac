"""Data types of closed-form solutions: branches of joint angles, with their distances from singularities."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
from casadi import SX

from armblocks.dynamics.closed_form.axes import Array, Chain


class Branch(NamedTuple):
    """One solution: the angle (or displacement) of each axis of the chain.

    ``measures``: for each choice between two solutions a number from 0 to 1, which is 0 where both coincide.
    """

    angles: list[SX]
    measures: list[SX]


class Solver(NamedTuple):
    """The closed solution of a geometry.

    ``geometry``: its name. ``branch_count``: the number of branches. ``choices``: the names of the choices
    between two solutions; a configuration where both coincide is singular. ``branches(T)``: all branches for
    the pose ``T`` (4, 4); in their order the last choice changes fastest.
    """

    geometry: str
    branch_count: int
    choices: tuple[str, ...]
    branches: Callable[[SX], Iterable[Branch]]


def placed(chain: Chain, T: SX, point: Array) -> SX:
    """The position of a tool-fixed point at the pose ``T``; ``point``: the position at zero joint angles."""
    in_tool = chain.tool[:3, :3].T @ (point - chain.tool[:3, 3])
    return SX(T[:3, :3] @ in_tool + T[:3, 3])


def perpendicular(h: Array) -> Array:
    """A unit vector perpendicular to ``h``."""
    unit = [0.0, 0.0, 0.0]
    unit[int(np.argmin(np.abs(h)))] = 1.0
    normal = np.asarray(np.cross(h, unit), dtype=np.float64)
    return normal / float(np.linalg.norm(normal))
