"""The arrays between the native search and Python, and the sizes of a search."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

TARGET = 16
"""Number of doubles of a target: a homogeneous matrix in row-major order."""
ROWS = 6
"""Rows of the error: three of the position, three of the rotation."""
POSE = 12
"""Number of doubles of a pose in the table of starts: the first three rows of the matrix."""


@dataclass(frozen=True, kw_only=True)
class SearchSizes:
    """The sizes of a search.

    ``positions``: the number of coordinates q; ``speeds``: the number of columns of the Jacobian.
    ``position_of_speed``: for each column the index in q of the coordinate that it moves; None for the
    columns of a ball joint, whose coordinates have no limits.
    """

    positions: int
    speeds: int
    position_of_speed: tuple[int | None, ...]


class Setting(IntEnum):
    """Indices of the settings, which are doubles."""

    POSITION_TOLERANCE = 0
    """Square of the largest position error of a solution, m²."""
    ROTATION_TOLERANCE = 1
    """Square of the largest rotation error of a solution, rad²."""
    DAMPING = 2
    """The damping divided by the weighted squared error."""
    FIRST_STEPS = 3
    """Maximum number of steps from a given start."""
    STEPS = 4
    """Maximum number of steps from a start of the table."""
    SLOW_STEPS = 5
    """Number of consecutive slow steps that end an attempt."""
    ATTEMPTS = 6
    """Maximum number of starts for each target."""
    HAS_STARTS = 7
    """1 if the first start of each target is given, else 0."""
    BLOCKS = 8
    """Number of blocks in the table of starts."""
    FLAT = 9
    """Squared gradient, relative to the squared error and Jacobian, below which an attempt ends."""
    ROOT_DAMPING = 10
    """The damping divided by the weighted error, for targets that cannot be reached."""
    WEIGHTS = 11
    """Six weights of the rows of the error; 0 for rows that do not count."""
    POSE_WEIGHTS = 17
    """Twelve weights of the squared differences between the entries of two poses."""
    COUNT = 29


class Limit(IntEnum):
    """Rows of the array of limits: each row has a number for each coordinate, or each column of J."""

    LOWEST = 0
    HIGHEST = 1
    PERIODIC = 2
    """1 for a coordinate whose pose repeats after 2 π."""
    STEP = 3
    """Reciprocal of the largest step, for each column of J."""
    COUNT = 4


class Number(IntEnum):
    """Indices of the results that are doubles."""

    POSITION_ERROR = 0
    ROTATION_ERROR = 1
    COST = 2
    """Weighted squared error."""
    COUNT = 3


class Count(IntEnum):
    """Indices of the results that are integers."""

    STATUS = 0
    STEPS = 1
    ATTEMPTS = 2
    COUNT = 3


class Status(IntEnum):
    """How the search of a target ended."""

    NOT_FOUND = 0
    CONVERGED = 1
    INVALID_TARGET = 2
    """The target is not a homogeneous matrix of a finite pose."""
