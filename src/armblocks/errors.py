"""Every error and warning that armblocks shows to a person.

::

    ArmblocksError(ValueError)
    ├── InputError            a call was given a wrong shape, dtype, value or option
    ├── UnknownNameError      a name that is not in a list of known names (the nearest is said)
    ├── RobotError            a robot description that contradicts itself
    ├── DiagramError          a diagram that cannot be built
    │   └── AlgebraicLoopError
    ├── FormatError           a file that cannot be read or written (file:line)
    ├── MissingLibraryError   a library that an extra of the package brings is not installed
    ├── CompileError          equations that the compiler cannot translate
    └── SimulationError       a run that could not go on (partial results are kept)

    ArmblocksWarning(UserWarning)
    ├── InertiaWarning        an inertia that no body can have
    └── LimitWarning          a joint beyond its range or speed

A message has four parts: *what* was found, *where*, what was *allowed*, and what to do (*fix*).
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
    """Base of all errors that name what, where, what is allowed and what to do.

    ``what`` one sentence with the user's own names and the value found; ``where`` a file:line, block
    path, robot/link or parameter; ``allowed`` the rule or the valid names; ``fix`` one action.
    """

    def __init__(self, what: str, *, where: str = "", allowed: str = "", fix: str = "") -> None:
        self.what = what
        self.where = where
        self.allowed = allowed
        self.fix = fix
        super().__init__(compose_message(what, where, allowed, fix))

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle the parts: a process pool sends an error back so."""
        return _unpickled, (type(self), self.args), self.__dict__


def _unpickled(kind: type[ArmblocksError], args: tuple[object, ...]) -> ArmblocksError:
    """An error with its text as it was; ``__init__``, which composes the text, takes other arguments."""
    return kind.__new__(kind, *args)


class InputError(ArmblocksError):
    """A call was given a wrong shape, dtype, value or option."""


LONGEST_NAME = 60
"""Characters of a name in a message that is none."""
LONGEST_LIST = 200
"""Characters of a list of names in a message; of a longer one, the names nearest to the one in question."""


class UnknownNameError(ArmblocksError):
    """A name that is not among the ``known`` ones; says the nearest and lists them, as far as is legible."""

    def __init__(self, kind: str, name: str, known: Iterable[str], *, where: str = "") -> None:
        self.kind = kind
        self.name = name
        self.known: Sequence[str] = sorted(known)
        folded = {entry.casefold(): entry for entry in self.known}
        near = difflib.get_close_matches(name.casefold(), list(folded), n=1, cutoff=0.5)
        shown = name if len(name) <= LONGEST_NAME else f"{name[:LONGEST_NAME]}..."
        super().__init__(
            f"there is no {kind} named '{shown}'",
            where=where,
            allowed=_legible(self.known, name),
            fix=f"did you mean '{folded[near[0]]}'?" if near else "use one of the names above",
        )


def _legible(names: Sequence[str], wanted: str) -> str:
    """All names if they are few, else those most like the wanted one and how many more there are."""
    if not names:
        return "none exist"
    if len(whole := ", ".join(names)) <= LONGEST_LIST:
        return whole
    matcher = difflib.SequenceMatcher(b=wanted.casefold())

    def likeness(name: str) -> float:
        matcher.set_seq1(name.casefold())
        return matcher.quick_ratio()

    chosen: list[str] = []
    for name in sorted(names, key=lambda name: -likeness(name)):
        if sum(map(len, chosen)) + 2 * len(chosen) + len(name) > LONGEST_LIST - 30:
            break
        chosen.append(name)
    return f"{', '.join(sorted(chosen) or [names[0][:LONGEST_LIST]])}, and {len(names) - len(chosen)} more"


def check_arguments(kind: type, values: Sequence[object], named: Mapping[str, object]) -> None:
    """Raise for arguments that the constructor of a dataclass does not have.

    Its ``__new__`` calls this, so that the error names the nearest field, before ``__init__`` raises Python's
    own. ``InputError`` where values are given without a name, ``UnknownNameError`` for another name.
    """
    known: Mapping[str, dataclasses.Field[Any]] = getattr(kind, "__dataclass_fields__", {})
    if not values and named.keys() <= known.keys():
        return
    fields = [entry.name for entry in dataclasses.fields(kind) if entry.init and entry.repr]
    for name in named:
        if name not in known:
            raise UnknownNameError("argument", name, fields, where=kind.__name__)
    raise InputError(
        f"{len(values)} arguments are given without their names",
        where=kind.__name__,
        allowed=f"arguments by name: {', '.join(fields) or 'none'}",
        fix=f"write {kind.__name__}({fields[0]}=…)" if fields else f"write {kind.__name__}()",
    )


class RobotError(ArmblocksError):
    """A robot description that contradicts itself, or lacks what the request needs."""


class DiagramError(ArmblocksError):
    """A diagram that cannot be built: the block path is in ``where``."""


class AlgebraicLoopError(DiagramError):
    """Signals that depend on each other at the same instant in a way that cannot be solved.

    ``loop`` lists them in the direction in which they flow; ``why`` says what stands in the way.
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
    """A file that cannot be read or written; ``where`` is file:line."""


class MissingLibraryError(ArmblocksError):
    """A library that an extra of the package brings is not installed."""

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
    """Equations that the compiler cannot translate."""


class SimulationError(ArmblocksError):
    """A run that could not go on. ``partial`` holds the result up to the last good time, if any."""

    def __init__(
        self, what: str, *, where: str = "", allowed: str = "", fix: str = "", partial: object = None
    ) -> None:
        self.partial = partial
        super().__init__(what, where=where, allowed=allowed, fix=fix)


class ArmblocksWarning(UserWarning):
    """Base of all warnings: the result is usable, but something deserves a look."""


class InertiaWarning(ArmblocksWarning):
    """An inertia that no rigid body can have (negative, or against the triangle inequality)."""


class LimitWarning(ArmblocksWarning):
    """A joint beyond its range or speed: joint, time and value are in the text."""
