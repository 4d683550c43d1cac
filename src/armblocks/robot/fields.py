"""Values of the fields of a robot description in their canonical form, or an error that names the field."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.errors import InputError, RobotError, check_type
from armblocks.spatial import Transform


def number(value: object, *, where: str) -> float:
    """A number as a float. Raises ``RobotError``."""
    try:
        return float(cast("float", value))
    except (TypeError, ValueError):
        raise RobotError(
            f"{value!r} is not a number", where=where, allowed="a number", fix="give one number"
        ) from None


def numbers(value: ArrayLike, *, where: str) -> NDArray[np.float64]:
    """An array of floats. Raises ``RobotError``."""
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise RobotError(
            f"{value!r} is not an array of numbers", where=where, allowed="numbers", fix="give numbers"
        ) from None


def pose(value: object, *, where: str) -> Transform:
    """A Transform, also from a homogeneous (4, 4) matrix. Raises ``RobotError``."""
    if isinstance(value, Transform):
        return value
    try:
        return Transform.from_matrix(cast("ArrayLike", value))
    except InputError as error:
        problem = f"the pose is neither a Transform nor a (4, 4) matrix: {error.what}"
        raise RobotError(problem, where=where, allowed=error.allowed, fix=error.fix) from None
    except (TypeError, ValueError):
        raise RobotError(
            f"the pose is a {type(value).__name__}",
            where=where,
            allowed="a Transform, or a homogeneous (4, 4) matrix",
            fix="give Transform(rotation=…, translation=…), or a matrix",
        ) from None


def check_kind(value: object, kind: type, *, where: str) -> None:
    """Raise ``RobotError`` unless a value is of a class of the description."""
    check_type(value, kind, f"a {kind.__name__}", where=where, error=RobotError)


class Named(Protocol):
    """A part of a description with a name."""

    @property
    def name(self) -> str: ...


def check_parts(parts: Sequence[Named], kind: type, noun: str, most: int, *, where: str, fix: str) -> None:
    """Raise ``RobotError`` unless these are at most ``most`` parts of this class with different names.

    ``noun``: the word for one part in messages. ``fix``: the remedy if there are too many.
    """
    if len(parts) > most:
        what = f"the robot has {len(parts)} {noun}s"
        raise RobotError(what, where=where, allowed=f"at most {most}", fix=fix)
    names: set[str] = set()
    for part in parts:
        check_kind(part, kind, where=f"{noun}s of {where}")
        if part.name in names:
            raise RobotError(
                f"two {noun}s are named '{part.name}'",
                where=where,
                allowed="unique names",
                fix=f"rename one of the {noun}s",
            )
        names.add(part.name)
