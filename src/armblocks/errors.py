"""Every error and warning that armblocks shows to a person.

::

    ArmblocksError(ValueError)
    ├── InputError                  a call was given a wrong shape, dtype, value or option
    │   └── ArgumentError           a missing, repeated or unknown argument; also a TypeError
    ├── UnknownNameError            an unknown name; suggests the nearest known names
    │   └── UnknownArgumentError    an unknown keyword argument; also an ArgumentError
    ├── RobotError                  a robot description that contradicts itself
    │   ├── MissingFunctionError    a function that this robot does not have; also an AttributeError
    │   └── AssemblyError           no configuration satisfies the constraints
    ├── DiagramError                a diagram that cannot be built
    │   └── AlgebraicLoopError      an algebraic loop that cannot be solved
    ├── FormatError                 a file that cannot be read or written (file:line)
    ├── MissingLibraryError         a library of an optional extra is not installed
    ├── CompileError                equations that the compiler cannot translate
    └── SimulationError             a run that failed (with the results up to that time)

    ArmblocksWarning(UserWarning)
    ├── InertiaWarning              an inertia that no body can have
    └── LimitWarning                a joint beyond its range, speed or torque
"""

from __future__ import annotations

import difflib
import inspect
import warnings
from collections.abc import Iterable, Mapping, Sequence
from types import FrameType


def compose_message(what: str, where: str = "", allowed: str = "", fix: str = "") -> str:
    """Join the four parts of a message into the text that a person reads."""
    head = f"{where}: {what}" if where else what
    parts = [head]
    if allowed:
        parts.append(f"Allowed: {allowed}")
    if fix:
        parts.append(f"Fix: {fix}")
    return " ".join(part if part.endswith(("?", "!")) else part.rstrip(".") + "." for part in parts)


def counted(count: int, singular: str, plural: str = "") -> str:
    """A count with its noun: ``1 argument``, ``2 arguments``. The default plural has an ``s``."""
    return f"{count} {singular if count == 1 else plural or singular + 's'}"


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
            allowed=shortened_list(self.known, name),
            fix=f"did you mean '{folded[nearest[0]]}'?" if nearest else "use one of the names above",
        )


def shortened_list(names: Sequence[str], unknown: str = "") -> str:
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


class ArgumentError(InputError, TypeError):
    """A call lacks an argument, or has an argument that its signature does not accept.

    It is a ``TypeError``, too, like Python's own errors of this kind.
    """


class UnknownArgumentError(UnknownNameError, ArgumentError):
    """A call has a keyword argument that does not exist."""

    def __init__(self, name: str, known: Iterable[str], *, where: str = "") -> None:
        super().__init__("argument", name, known, where=where)


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


class MissingFunctionError(RobotError, AttributeError):
    """A function that does not exist for this robot.

    It is an ``AttributeError``, too, so that ``hasattr(arm, "hybrid_dynamics")`` is false.
    """


class AssemblyError(RobotError):
    """The search found no configuration near a guess that satisfies the constraints of a robot.

    ``q`` are the coordinates of the best configuration; ``gaps`` describes the remaining gap of each
    constraint.
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


def warn(text: str, category: type[ArmblocksWarning] = ArmblocksWarning) -> None:
    """Issue a warning whose location is the line of the user's code that called the package."""
    frame, depth = inspect.currentframe(), 1
    while frame is not None and frame.f_back is not None and _in_package(frame):
        frame, depth = frame.f_back, depth + 1
    warnings.warn(text, category, stacklevel=depth)


def _in_package(frame: FrameType) -> bool:
    """Whether a frame runs code of the package, including the generated methods of dataclasses and the
    decorators made by ``contextlib``."""
    package = __name__.partition(".")[0]
    return str(frame.f_globals.get("__name__", "")).partition(".")[0] in (package, "contextlib")
