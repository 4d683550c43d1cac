"""Every error and warning that armblocks shows to a person.

::

    ArmblocksError(ValueError)
    ├── InputError            a call was given a wrong shape, dtype, value or option
    ├── UnknownNameError      an unknown name; suggests the nearest known names
    ├── RobotError            a robot description that contradicts itself
    │   └── AssemblyError     no configuration satisfies the constraints
    ├── DiagramError          a diagram that cannot be built
    │   └── AlgebraicLoopError
    ├── FormatError           a file that cannot be read or written (file:line)
    ├── MissingLibraryError   a library of an optional extra is not installed
    ├── CompileError          equations that the compiler cannot translate
    └── SimulationError       a run that failed (it keeps the results up to that time)

    ArmblocksWarning(UserWarning)
    ├── InertiaWarning        an inertia that no body can have
    └── LimitWarning          a joint beyond its range, speed or torque
"""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any


def compose_message(what: str, where: str = "", allowed: str = "", fix: str = "") -> str:
    """Join the four parts of a message into the text that a person reads."""
    head = f"{where}: {what}" if where else what
    parts = [head]
    if allowed:
        parts.append(f"Allowed: {allowed}")
    if fix:
        parts.append(f"Fix: {fix}")
    return " ".join(part if part.endswith(("?", "!")) else part.rstrip(".") + "." for part in parts)


class ArmblocksError(ValueError):
    """Base class of all errors. A message has the parts what, where, allowed and fix.

    ``what`` is one sentence with the user's own names and the value found. ``where`` is a file and line, a
    block path, robot/link or a parameter. ``allowed`` is the rule or the valid names, and ``fix`` one action.
    """

    def __init__(self, what: str, *, where: str = "", allowed: str = "", fix: str = "") -> None:
        self.what = what
        self.where = where
        self.allowed = allowed
        self.fix = fix
        super().__init__(compose_message(what, where, allowed, fix))

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle the parts, so that a process pool can return the error."""
        return _restored_error, (type(self), self.args), self.__dict__


def _restored_error(kind: type[ArmblocksError], args: tuple[object, ...]) -> ArmblocksError:
    """Restore an error from its pickled text without ``__init__``, which expects the parts of the text."""
    return kind.__new__(kind, *args)


class InputError(ArmblocksError):
    """A call was given a wrong shape, dtype, value or option."""


MAX_NAME_LENGTH = 60
"""Maximum number of characters of an unknown name in a message."""
MAX_LIST_LENGTH = 200
"""Maximum number of characters of a list of names in a message. A longer list is cut to the nearest names."""


class UnknownNameError(ArmblocksError):
    """A name is not in ``known``. The message suggests the nearest name and lists the known names."""

    def __init__(self, kind: str, name: str, known: Iterable[str], *, where: str = "") -> None:
        self.kind = kind
        self.name = name
        self.known: Sequence[str] = sorted(known)
        folded = {entry.casefold(): entry for entry in self.known}
        nearest = difflib.get_close_matches(name.casefold(), list(folded), n=1, cutoff=0.5)
        shortened_name = name if len(name) <= MAX_NAME_LENGTH else f"{name[:MAX_NAME_LENGTH]}..."
        super().__init__(
            f"there is no {kind} named '{shortened_name}'",
            where=where,
            allowed=_shortened_list(self.known, name),
            fix=f"did you mean '{folded[nearest[0]]}'?" if nearest else "use one of the names above",
        )


def _shortened_list(names: Sequence[str], unknown: str) -> str:
    """All names if they are few, else the names most similar to the unknown one and the number of others."""
    if not names:
        return "none exist"
    if len(full_list := ", ".join(names)) <= MAX_LIST_LENGTH:
        return full_list
    matcher = difflib.SequenceMatcher(b=unknown.casefold())

    def similarity(name: str) -> float:
        matcher.set_seq1(name.casefold())
        return matcher.quick_ratio()

    nearest_names: list[str] = []
    for name in sorted(names, key=lambda name: -similarity(name)):
        if sum(map(len, nearest_names)) + 2 * len(nearest_names) + len(name) > MAX_LIST_LENGTH - 30:
            break
        nearest_names.append(name)
    shown_names = sorted(nearest_names) or [names[0][:MAX_LIST_LENGTH]]
    return f"{', '.join(shown_names)}, and {len(names) - len(nearest_names)} more"


def check_arguments(kind: type, values: Sequence[object], named: Mapping[str, object]) -> None:
    """Raise an error for arguments that the constructor of a dataclass does not accept.

    Its ``__new__`` calls this, so that the error names the nearest field, before ``__init__`` raises Python's
    own. Raises ``InputError`` for positional arguments and ``UnknownNameError`` for unknown keywords.
    """
    known: Mapping[str, dataclasses.Field[Any]] = getattr(kind, "__dataclass_fields__", {})
    if not values and named.keys() <= known.keys():
        return
    fields = [entry.name for entry in dataclasses.fields(kind) if entry.init and entry.repr]
    for name in named:
        if name not in known:
            raise UnknownNameError("argument", name, fields, where=kind.__name__)
    raise InputError(
        f"{len(values)} arguments are given without names",
        where=kind.__name__,
        allowed=f"arguments by name: {', '.join(fields) or 'none'}",
        fix=f"write {kind.__name__}({fields[0]}=…)" if fields else f"write {kind.__name__}()",
    )


def check_type(
    value: object,
    kinds: type | tuple[type, ...],
    allowed: str,
    *,
    where: str,
    error: type[ArmblocksError] = InputError,
) -> None:
    """Raise an error unless a value is of one of these types; ``allowed`` describes them."""
    if not isinstance(value, kinds):
        raise error(
            f"a value of type {type(value).__name__} was given",
            where=where,
            allowed=allowed,
            fix="pass a value of an allowed type",
        )


class RobotError(ArmblocksError):
    """A robot description that is inconsistent, or lacks data that the call needs."""


class AssemblyError(RobotError):
    """No configuration near a guess satisfies the constraints of a robot, as far as the search found.

    ``q`` are the coordinates of the best configuration; ``gaps`` has the remaining gap of each constraint in
    words.
    """

    def __init__(
        self,
        what: str,
        *,
        where: str = "",
        allowed: str = "",
        fix: str = "",
        q: Sequence[float] = (),
        gaps: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(what, where=where, allowed=allowed, fix=fix)
        self.q = tuple(q)
        self.gaps = dict(gaps or {})


class DiagramError(ArmblocksError):
    """A diagram that cannot be built: the block path is in ``where``."""


class AlgebraicLoopError(DiagramError):
    """An algebraic loop that cannot be solved: signals that depend on each other at the same time.

    ``loop`` lists the signals in signal-flow order; ``why`` is the reason why the loop cannot be solved.
    """

    def __init__(
        self,
        loop: Sequence[str],
        *,
        where: str = "",
        why: str = "",
        allowed: str = "every loop passes through a block with a state, such as Integrator",
        fix: str = "break the loop with an Integrator or remove one of these connections",
    ) -> None:
        self.loop = tuple(loop)
        self.why = why
        chain = " -> ".join((*self.loop, *self.loop[:1]))
        super().__init__(
            f"algebraic loop{' ' * bool(why)}{why}: {chain}", where=where, allowed=allowed, fix=fix
        )


class FormatError(ArmblocksError):
    """A file that cannot be read or written; ``where`` is ``file:line``."""


class MissingLibraryError(ArmblocksError):
    """A library of an optional extra is not installed."""

    def __init__(self, library: str, extra: str, use: str, *, where: str = "") -> None:
        self.library = library
        self.extra = extra
        super().__init__(
            f"the library '{library}' is not installed; it is needed for {use}",
            where=where,
            allowed="everything else works without it",
            fix=f'pip install "armblocks[{extra}]"',
        )


class CompileError(ArmblocksError):
    """Equations that the compiler does not support."""


class SimulationError(ArmblocksError):
    """A run that failed. ``partial`` holds the result up to the last valid time, or ``None``."""

    def __init__(
        self, what: str, *, where: str = "", allowed: str = "", fix: str = "", partial: object = None
    ) -> None:
        self.partial = partial
        super().__init__(what, where=where, allowed=allowed, fix=fix)


class ArmblocksWarning(UserWarning):
    """Base class of all warnings: the result is usable but should be checked."""


class InertiaWarning(ArmblocksWarning):
    """An inertia that no rigid body can have: negative, or violating the triangle inequality."""


class LimitWarning(ArmblocksWarning):
    """A joint exceeded its position, speed or torque limit. The message contains joint, time and value."""
