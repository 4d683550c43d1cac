"""The fields of links: the values and shapes that a script may assign, and the values that it reads."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from armblocks.errors import ArmblocksError, counted
from armblocks.formats.matlab.records import LinkRecord
from armblocks.formats.matlab.values import Value
from armblocks.matlab.arrays import Array, array_of, empty, kind_of, number_of, scalar
from armblocks.matlab.source import Location
from armblocks.robot import inertia_matrix
from armblocks.spatial import Vector3

ASSIGNABLE = "alpha, a (A), theta, d (D), sigma, offset, mdh, m, r, I, Jm, G, B, Tc, qlim"

VECTORS = frozenset(("r", "I", "Tc", "qlim"))
"""Fields that take a row of numbers."""


def set_link_field(location: Location, link: LinkRecord, name: str, value: Value) -> None:
    """``link.name = value``. Raises ``FormatError`` for an unknown field or an invalid value."""
    setter = _SETTERS.get(name)
    if setter is None:
        raise location.error(f"a link has no field '{name}'", allowed=ASSIGNABLE)
    setter(location, link, value)


def link_field(location: Location, link: LinkRecord, name: str) -> Value:
    """The value of ``link.name``; ``[]`` where the script has not set it."""
    getter = _GETTERS.get(name)
    if getter is None:
        raise location.error(f"a link has no field or method '{name}' here", allowed=ASSIGNABLE)
    return getter(link)


def finite_number(location: Location, value: Value, what: str) -> float:
    """A value that must be one finite number."""
    number = number_of(location, value, what)
    if not math.isfinite(number):
        raise location.error(f"{what} is {number}", allowed="a finite number")
    return number


def numbers(location: Location, value: Value, what: str, count: int) -> list[float]:
    """A value that must be a row or column of ``count`` finite numbers."""
    array = array_of(location, value, what)
    if array.size != count or 1 not in array.shape:
        raise location.error(f"{what} is {kind_of(array)}", allowed=counted(count, "number"))
    if not np.isfinite(array).all():
        raise location.error(f"{what} holds numbers that are not finite", allowed="finite numbers")
    return [float(number) for number in array.ravel()]


def inertia_from(location: Location, value: Value) -> tuple[Vector3, Vector3, Vector3]:
    """``I`` in the forms of the toolbox: 3x3, or Ixx Iyy Izz, or Ixx Iyy Izz Ixy Iyz Ixz."""
    array = array_of(location, value, "I")
    allowed = "a symmetric 3x3 matrix, [Ixx Iyy Izz], or [Ixx Iyy Izz Ixy Iyz Ixz]"
    if array.shape != (3, 3) and (1 not in array.shape or array.size not in (3, 6)):
        raise location.error(f"I is {kind_of(array)}", allowed=allowed)
    if not np.isfinite(array).all():
        raise location.error("I holds numbers that are not finite", allowed=allowed)
    try:
        return inertia_matrix(array if array.shape == (3, 3) else array.ravel())
    except ArmblocksError as error:
        raise location.error(f"I is invalid: {error.what}", allowed=allowed) from None


def coulomb_from(location: Location, value: Value) -> tuple[float, float]:
    """``Tc``: one number t means [t -t]."""
    array = array_of(location, value, "Tc")
    if array.size == 1:
        t = finite_number(location, array, "Tc")
        return t, -t
    if array.size != 2:
        raise location.error(f"Tc is {kind_of(array)}", allowed="a number, or [Tc+ Tc-]")
    plus, minus = numbers(location, array, "Tc", 2)
    if plus < minus:
        raise location.error(
            f"Tc has {plus:g} before {minus:g}",
            allowed="[Tc+ Tc-] with Tc+ above Tc-",
            fix="exchange the two",
        )
    return plus, minus


def _set_number(
    attribute: str, what: str, *, minimum: float = -math.inf
) -> Callable[[Location, LinkRecord, Value], None]:
    def assign(location: Location, link: LinkRecord, value: Value) -> None:
        number = finite_number(location, value, what)
        if number < minimum:
            raise location.error(f"{what} is {number:g}", allowed=f"{minimum:g} or more")
        setattr(link, attribute, number)

    return assign


def _set_sigma(location: Location, link: LinkRecord, value: Value) -> None:
    if value in ("R", "P") if isinstance(value, str) else False:
        link.sigma = int(value == "P")
    elif isinstance(value, str):
        raise location.error(
            f"sigma is '{value}'", allowed="0 or 'R' (revolute), any other number or 'P' (prismatic)"
        )
    else:
        link.sigma = int(finite_number(location, value, "sigma") != 0)


def _set_modified(location: Location, link: LinkRecord, value: Value) -> None:
    link.modified = finite_number(location, value, "mdh") != 0


def _set_centre(location: Location, link: LinkRecord, value: Value) -> None:
    x, y, z = numbers(location, value, "r", 3)
    link.centre_of_mass = (x, y, z)


def _set_inertia(location: Location, link: LinkRecord, value: Value) -> None:
    link.inertia = inertia_from(location, value)


def _set_gear(location: Location, link: LinkRecord, value: Value) -> None:
    ratio = finite_number(location, value, "G")
    if ratio == 0:
        raise location.error("G is 0, so the motor cannot move the joint", allowed="any other number")
    link.gear_ratio = ratio


def _set_coulomb(location: Location, link: LinkRecord, value: Value) -> None:
    link.coulomb_friction = coulomb_from(location, value)


def _set_limits(location: Location, link: LinkRecord, value: Value) -> None:
    array = array_of(location, value, "qlim")
    if array.size == 0 or (array.size == 2 and array.ravel().tolist() == [-math.inf, math.inf]):
        link.qlim = None
        return
    low, high = numbers(location, array, "qlim", 2)
    if low > high:
        raise location.error(f"qlim goes from {low:g} to {high:g}", allowed="the lower limit first")
    link.qlim = (low, high)


_SETTERS: dict[str, Callable[[Location, LinkRecord, Value], None]] = {
    "alpha": _set_number("alpha", "alpha"),
    "a": _set_number("a", "a"),
    "A": _set_number("a", "A"),
    "theta": _set_number("theta", "theta"),
    "d": _set_number("d", "d"),
    "D": _set_number("d", "D"),
    "sigma": _set_sigma,
    "offset": _set_number("offset", "offset"),
    "mdh": _set_modified,
    "m": _set_number("mass", "m", minimum=0.0),
    "r": _set_centre,
    "I": _set_inertia,
    "Jm": _set_number("motor_inertia", "Jm", minimum=0.0),
    "G": _set_gear,
    "B": _set_number("viscous_friction", "B"),
    "Tc": _set_coulomb,
    "qlim": _set_limits,
}


def _row(values: tuple[float, ...] | None) -> Array:
    return empty() if values is None else np.array([values])


def _optional(value: float | None) -> Array:
    return empty() if value is None else scalar(value)


_GETTERS: dict[str, Callable[[LinkRecord], Value]] = {
    "alpha": lambda link: scalar(link.alpha),
    "a": lambda link: scalar(link.a),
    "A": lambda link: scalar(link.a),
    "theta": lambda link: scalar(link.theta),
    "d": lambda link: scalar(link.d),
    "D": lambda link: scalar(link.d),
    "sigma": lambda link: scalar(float(link.sigma)),
    "offset": lambda link: scalar(link.offset),
    "mdh": lambda link: scalar(float(link.modified)),
    "m": lambda link: _optional(link.mass),
    "r": lambda link: _row(link.centre_of_mass),
    "I": lambda link: empty() if link.inertia is None else np.array(link.inertia),
    "Jm": lambda link: _optional(link.motor_inertia),
    "G": lambda link: _optional(link.gear_ratio),
    "B": lambda link: _optional(link.viscous_friction),
    "Tc": lambda link: _row(link.coulomb_friction),
    "qlim": lambda link: _row(link.qlim),
}
