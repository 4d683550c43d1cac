"""Named configurations of a robot: coordinates q with a name, such as ``ready``."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import FrozenInstanceError
from typing import NamedTuple, TypeVar, cast, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import RobotError, UnknownNameError, counted
from armblocks.robot.coordinate_map import CoordinateMap
from armblocks.robot.fields import numbers
from armblocks.robot.joints import Joint

Array = NDArray[np.float64]
Other = TypeVar("Other")
MAX_CONFIGURATIONS = 1000
"""Maximum number of named configurations of a robot."""
MAX_NAME = 200
"""Maximum number of characters of the name of a configuration."""


Layout = tuple[tuple[str, tuple[str, ...]], ...]
"""The joints of q in their order: names, and the units of their coordinates."""


class Configuration(NamedTuple):
    """A named configuration: the coordinates ``q`` (nq,) of a robot, rad or m, and the entries of a ball."""

    name: str
    q: tuple[float, ...]


class Configurations(Mapping[str, Array], metaclass=ArgumentErrors):
    """The named configurations of a robot in their order: ``robot.configurations["ready"]`` is q (nq,).

    Each access returns a new array, rad or m. The mapping is immutable. Two mappings are equal, with the
    same hash, if names, numbers and order are the same. ``entries``: names and coordinates as tuples.
    ``layout``: the joints of the robot that the coordinates belong to, with their units; None: not known.

    Created from a mapping of names to coordinates, or from pairs of name and coordinates. Raises RobotError
    for names that are empty, too long, used twice or begin or end with a space, and for coordinates that are
    not finite numbers. Raises UnknownNameError for the access to an unknown name.
    """

    __slots__ = ("entries", "layout", "where")
    entries: tuple[Configuration, ...]
    layout: Layout | None
    where: str

    def __init__(
        self,
        entries: Mapping[str, ArrayLike] | Iterable[tuple[str, ArrayLike]] = (),
        *,
        where: str = "configurations",
        layout: Layout | None = None,
    ) -> None:
        object.__setattr__(self, "where", where)
        object.__setattr__(self, "layout", layout)
        pairs = _pairs(entries, where)
        if len(pairs) > MAX_CONFIGURATIONS:
            raise RobotError(
                f"there are {len(pairs)} named configurations",
                where=where,
                allowed=f"at most {MAX_CONFIGURATIONS}",
                fix="remove some of them",
            )
        found: dict[str, Configuration] = {}
        for name, q in pairs:
            check_name(name, found, where)
            found[name] = Configuration(name, _finite(q, f"{where}, configuration '{name}'"))
        object.__setattr__(self, "entries", tuple(found.values()))

    def __setattr__(self, name: str, value: object) -> None:
        raise FrozenInstanceError(f"cannot assign to field '{name}'")

    def __delattr__(self, name: str) -> None:
        raise FrozenInstanceError(f"cannot delete field '{name}'")

    def __getitem__(self, name: str) -> Array:
        for entry in self.entries:
            if entry.name == name:
                return np.array(entry.q)
        raise UnknownNameError("configuration", str(name), list(self), where=self.where)

    def __contains__(self, name: object) -> bool:
        return any(entry.name == name for entry in self.entries)

    @overload
    def get(self, name: str, default: None = None, /) -> Array | None: ...
    @overload
    def get(self, name: str, default: Array, /) -> Array: ...
    @overload
    def get(self, name: str, default: Other, /) -> Array | Other: ...
    def get(self, name: str, default: object = None, /) -> object:
        """The coordinates (nq,) of a configuration, or ``default``."""
        return next((np.array(entry.q) for entry in self.entries if entry.name == name), default)

    def __iter__(self) -> Iterator[str]:
        return (entry.name for entry in self.entries)

    def __len__(self) -> int:
        return len(self.entries)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Configurations) and self.entries == other.entries

    def __hash__(self) -> int:
        return hash(self.entries)

    def __reduce__(self) -> tuple[object, ...]:
        return _restored, (self.entries, self.where, self.layout)

    def __repr__(self) -> str:
        inside = ", ".join(f"{entry.name!r}: {list(entry.q)}" for entry in self.entries)
        return f"Configurations({{{inside}}})"

    def with_entry(self, name: str, q: ArrayLike) -> Configurations:
        """These configurations and another one, which replaces one of the same name."""
        known = name in self
        pairs: list[tuple[str, ArrayLike]] = [(e.name, q if e.name == name else e.q) for e in self.entries]
        return Configurations(pairs if known else [*pairs, (name, q)], where=self.where)


def configurations_of(value: object, joints: Mapping[str, Joint], where: str) -> Configurations:
    """The configurations of a robot with these ``joints``, by name in the order of q.

    ``value``: a mapping or pairs, or the configurations of a robot. ``dataclasses.replace``
    passes the configurations of a robot with other joints. Then each joint keeps its coordinates by name, or
    by its place if it was renamed. A new joint and a joint of another type get neutral coordinates. Errors
    name the robot, ``where``. Raises RobotError for another number of coordinates.
    """
    if isinstance(value, Configurations) and not value.entries:
        return value
    layout = tuple((name, tuple(entry.unit for entry in joint.positions)) for name, joint in joints.items())
    entries = value
    if isinstance(value, Configurations):
        if (value.layout, value.where) == (layout, where):
            return value
        entries = value.entries
        if value.layout is not None and value.layout != layout:
            neutral = [joint.neutral for joint in joints.values()]
            entries = [(name, _fitted(q, value.layout, layout, neutral)) for name, q in value.entries]
    made = Configurations(cast("Mapping[str, ArrayLike]", entries), where=where, layout=layout)
    _check_lengths(made, list(joints.values()))
    return made


def _fitted(
    q: Sequence[float], before: Layout, after: Layout, neutral: Sequence[Sequence[float]]
) -> list[float]:
    """The coordinates of the joints ``after`` an edit, from those of the joints ``before``."""
    old: dict[str, tuple[tuple[str, ...], Sequence[float]]] = {}
    first = 0
    for name, units in before:
        old[name] = units, q[first : first + len(units)]
        first += len(units)
    names = {name for name, _ in after}
    may_be_renamed = len(before) == len(after)
    result: list[float] = []
    for place, (name, units) in enumerate(after):
        known = old.get(name)
        if known is None and may_be_renamed and before[place][0] not in names:
            known = old[before[place][0]]
        result += known[1] if known is not None and known[0] == units else neutral[place]
    return result


def _restored(entries: tuple[Configuration, ...], where: str, layout: Layout | None) -> Configurations:
    return Configurations(entries, where=where, layout=layout)


def _pairs(
    entries: Mapping[str, ArrayLike] | Iterable[tuple[str, ArrayLike]], where: str
) -> list[tuple[str, ArrayLike]]:
    if isinstance(entries, Mapping):
        return list(cast("Mapping[str, ArrayLike]", entries).items())
    try:
        return [(name, q) for name, q in entries]
    except (TypeError, ValueError):
        raise RobotError(
            f"{entries!r:.60} is not a mapping of names to coordinates",
            where=where,
            allowed="a mapping such as {'ready': (0.0, 1.5)}",
            fix="give names with their coordinates",
        ) from None


def check_name(name: object, used: Iterable[str], where: str) -> None:
    """Raise RobotError for the name of a configuration that is empty, too long or in use."""
    if not isinstance(name, str) or not name.strip() or name != name.strip() or len(name) > MAX_NAME:
        raise RobotError(
            f"{str(name)[:40]!r} is not a name of a configuration",
            where=where,
            allowed=f"a text of at most {MAX_NAME} characters that does not begin or end with a space",
            fix="choose another name",
        )
    if name in used:
        raise RobotError(
            f"two configurations are named '{name}'",
            where=where,
            allowed="a different name for each configuration",
            fix="choose another name",
        )


def _finite(q: ArrayLike, where: str) -> tuple[float, ...]:
    values = numbers(q, where=where)
    if values.ndim != 1:
        raise RobotError(
            f"the coordinates have the shape {values.shape}",
            where=where,
            allowed="one number for each coordinate of the robot, (nq,)",
            fix="give a list of numbers",
        )
    for k, value in enumerate(values.tolist()):
        if not math.isfinite(value):
            raise RobotError(
                f"coordinate {k + 1} is {value}",
                where=where,
                allowed="finite numbers",
                fix="correct the coordinate",
            )
    return tuple(values.tolist())


def _check_lengths(configurations: Configurations, joints: Sequence[Joint]) -> None:
    """Raise RobotError for configurations that do not belong to these joints, the joints with entries in q.

    Quaternions must not be zero; they are used as given, and only their direction has an effect.
    """
    count = sum(joint.nq for joint in joints)
    for name, q in configurations.entries:
        place = f"{configurations.where}, configuration '{name}'"
        if len(q) != count:
            raise RobotError(
                f"the configuration has {counted(len(q), 'coordinate')}",
                where=place,
                allowed=f"{count}, one for each coordinate of the robot",
                fix="record the configuration again, or remove it from configurations",
            )
        first = 0
        for joint in joints:
            for motion in joint.motions:
                part = q[first : first + len(motion.positions)]
                first += len(part)
                if len(motion.positions) != len(motion.speeds) and not any(part):
                    raise RobotError(
                        "all entries of a quaternion are 0",
                        where=place,
                        allowed="w x y z with at least one that is not 0",
                        fix="use 1 0 0 0 for no rotation",
                    )


def of_tree(configurations: Configurations, mapped: CoordinateMap) -> Configurations:
    """The configurations with the coordinates of all joints of the tree, as of ``Robot.uncoupled``.

    The constants of couplings are in the offsets of the joints, so that they are not added here.
    """
    rows = [(name, mapped.positions @ np.array(q)) for name, q in configurations.entries]
    return Configurations(rows, where=configurations.where)
