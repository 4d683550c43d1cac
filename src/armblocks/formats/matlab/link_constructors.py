"""``link`` of releases up to 8; ``Link``, ``Revolute``, ``Prismatic`` and their MDH variants of 9 and later.

In both, a row of more than six numbers is a legacy DYN row: five D-H parameters, then ``m rx ry rz Ixx Iyy
Izz Ixy Iyz Ixz [Jm [G [B [Tc+ Tc-]]]]`` with offset 0. The order of the D-H parameters is ``alpha A theta D
sigma`` for ``link`` and ``theta d a alpha sigma`` for ``Link``.

The default gear ratio is 1, as in the toolbox's manual. (In the code of releases 9 and 10 the default is 0,
which ignores motor inertia and motor friction.)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from armblocks.errors import counted
from armblocks.formats.matlab.link_fields import inertia_from, set_link_field
from armblocks.formats.matlab.records import LinkRecord, Release
from armblocks.formats.matlab.values import Value
from armblocks.matlab.arrays import Array, kind_of, text_of
from armblocks.matlab.source import Location

_COLUMNS = {
    Release.UP_TO_8: ("alpha", "a", "theta", "d", "sigma", "offset"),
    Release.FROM_9: ("theta", "d", "a", "alpha", "sigma", "offset"),
}
_MIN_DYN_LENGTH, _MAX_DYN_LENGTH = 15, 20


def link_from_row(
    location: Location, release: Release, row: Sequence[float], *, modified: bool = False
) -> LinkRecord:
    """A link from 4 to 6 D-H numbers, or from a DYN row of 15 to 20. Raises ``FormatError``."""
    columns = _COLUMNS[release]
    count = len(row)
    if not (4 <= count <= 6 or _MIN_DYN_LENGTH <= count <= _MAX_DYN_LENGTH) or count == _MAX_DYN_LENGTH - 1:
        order = " ".join(columns)
        raise location.error(
            f"a row of {counted(count, 'number')} is not a link",
            allowed=f"4 to 6 numbers {order}, or a legacy row with m r I Jm G B Tc after the first 5: "
            f"{_MIN_DYN_LENGTH} to 18 or {_MAX_DYN_LENGTH} numbers",
        )
    link = LinkRecord(location=location, release=release, modified=modified)
    dh_count = count if count <= 6 else 5
    for name, number in zip(columns, row[:dh_count]):
        set_link_field(location, link, name, np.array([[number]]))
    if count <= 6:
        return link
    link.mass = 0.0
    for name, part in (("m", row[5:6]), ("r", row[6:9])):
        set_link_field(location, link, name, np.array([part]))
    link.inertia = inertia_from(location, np.array([row[9:15]]))
    for name, part in (("Jm", row[15:16]), ("G", row[16:17]), ("B", row[17:18]), ("Tc", row[18:20])):
        if part:
            set_link_field(location, link, name, np.array([part]))
    return link


def rows_of(array: Array) -> list[list[float]]:
    """The rows of a D-H matrix as lists of floats."""
    return [[float(number) for number in row] for row in array]


def is_modified(location: Location, word: str) -> bool:
    """Whether the modified convention is named; as in the toolbox, three letters are compared."""
    if word[:3] not in ("sta", "mod"):
        raise location.error(f"'{word}' is not a D-H convention", allowed="'standard' or 'modified'")
    return word.startswith("mod")


def make_link(location: Location, arguments: list[Value]) -> LinkRecord:
    """``link([alpha A theta D sigma offset], convention)`` of releases up to 8."""
    if len(arguments) == 1 and isinstance(arguments[0], LinkRecord):
        return arguments[0].copy_on_assignment()
    if not 1 <= len(arguments) <= 2:
        raise location.error(
            f"link is called with {counted(len(arguments), 'argument')}",
            allowed="link(row), link(row, convention)",
        )
    row = arguments[0]
    if not isinstance(row, np.ndarray) or row.shape[0] != 1:
        raise location.error(f"link is called with {kind_of(row)}", allowed="a row [alpha A theta D sigma]")
    modified = len(arguments) == 2 and is_modified(
        location, text_of(location, arguments[1], "the convention")
    )
    return link_from_row(location, Release.UP_TO_8, rows_of(row)[0], modified=modified)


def _new_link(
    location: Location,
    arguments: list[Value],
    *,
    sigma: int | None = None,
    modified: bool = False,
    name: str = "Link",
) -> LinkRecord:
    """A link of releases 9 and later, from a row or from names and values.

    If the joint type is not given, a link with ``d`` is revolute and a link with ``theta`` is prismatic.
    """
    if sigma is None and arguments and isinstance(arguments[0], LinkRecord) and len(arguments) == 1:
        return replace(arguments[0], location=location)
    if sigma is None and arguments and isinstance(arguments[0], np.ndarray):
        if arguments[0].shape[0] != 1 or len(arguments) > 2:
            raise location.error(
                f"{name} is called with {kind_of(arguments[0])} and "
                f"{counted(len(arguments) - 1, 'more argument')}",
                allowed="Link([theta d a alpha sigma offset], convention)",
            )
        if len(arguments) == 2:
            modified = is_modified(location, text_of(location, arguments[1], "the convention"))
        return link_from_row(location, Release.FROM_9, rows_of(arguments[0])[0], modified=modified)
    link = LinkRecord(location=location, release=Release.FROM_9, modified=modified, sigma=sigma or 0)
    position, assigned = 0, set[str]()
    while position < len(arguments):
        key = text_of(location, arguments[position], f"argument {position + 1} of {name}")
        position += 1
        if key in ("revolute", "prismatic") and sigma is None:
            assigned.add(key)
            link.sigma = int(key == "prismatic")
        elif key in ("standard", "modified"):
            link.modified = key == "modified"
        elif key in _KEYS:
            if position == len(arguments):
                raise location.error(f"'{key}' of {name} has no value", allowed=f"{name}('{key}', value)")
            set_link_field(location, link, key, arguments[position])
            assigned.add(key)
            position += 1
        else:
            raise location.error(
                f"{name} has no parameter '{key}'",
                allowed=", ".join((*_KEYS, "revolute", "prismatic", "modified")),
            )
    _check_joint(location, link, assigned, fixed=sigma is not None, name=name)
    return link


_KEYS = ("theta", "d", "a", "alpha", "sigma", "offset", "qlim", "m", "r", "I", "Jm", "G", "B", "Tc")


def _check_joint(location: Location, link: LinkRecord, assigned: set[str], *, fixed: bool, name: str) -> None:
    """Set the joint type if it is not given, and check that the joint variable, d or theta, is not given."""
    is_type_open = not fixed and not assigned & {"sigma", "revolute", "prismatic"}
    if is_type_open and {"d", "theta"} <= assigned:
        raise location.error(
            f"{name} is given both 'd' and 'theta'",
            allowed="'d' of a revolute joint or 'theta' of a prismatic joint; the other is variable",
        )
    if is_type_open:
        link.sigma = int("theta" in assigned)
    variable = "d" if link.sigma else "theta"
    if variable in assigned and (fixed or not is_type_open):
        raise location.error(
            f"'{variable}' is the variable of this joint and cannot be given",
            allowed="'theta' of a prismatic, 'd' of a revolute joint",
            fix=f"remove '{variable}', or give it as 'offset'",
        )


CONSTRUCTORS: dict[str, Callable[[Location, list[Value]], LinkRecord]] = {
    "link": make_link,
    "Link": _new_link,
    "Revolute": lambda location, arguments: _new_link(location, arguments, sigma=0, name="Revolute"),
    "Prismatic": lambda location, arguments: _new_link(location, arguments, sigma=1, name="Prismatic"),
    "RevoluteMDH": lambda location, arguments: _new_link(
        location, arguments, sigma=0, modified=True, name="RevoluteMDH"
    ),
    "PrismaticMDH": lambda location, arguments: _new_link(
        location, arguments, sigma=1, modified=True, name="PrismaticMDH"
    ),
}
