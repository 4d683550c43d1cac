"""Undo and redo history of frozen values, which are edited by replacement."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

from armblocks.errors import InputError

MOST_UNDO = 10_000
"""Edits that can be undone; older ones are forgotten."""

Value = TypeVar("Value")


@dataclass(frozen=True)
class Step(Generic[Value]):
    """One edit that was carried out: its name, the value before it, and the gesture that it was a part of."""

    title: str
    before: Value
    gesture: str = ""


class History(Generic[Value]):
    """The present form of a frozen value, what it was before, and what was undone.

    Values share their parts, so the history needs little memory.

    ``version`` grows with every change, undo and redo included, and never returns: two pages that show the
    same version show the same value. ``saved`` is the form that the file holds, ``None`` where no file holds
    one of these. ``continued`` says whether the last replacement went on with the step before it.
    """

    def __init__(self, value: Value, *, version: int = 0) -> None:
        self.value = value
        self.saved: Value | None = value
        self.version = version
        self.continued = False
        self._past: list[Step[Value]] = []
        self._future: list[Step[Value]] = []

    @property
    def dirty(self) -> bool:
        """Whether the file holds another form than this one."""
        return self.value is not self.saved

    @property
    def undo_title(self) -> str:
        """What ``undo`` would take back; ``""`` if nothing."""
        return self._past[-1].title if self._past else ""

    @property
    def redo_title(self) -> str:
        """What ``redo`` would do again; ``""`` if nothing."""
        return self._future[-1].title if self._future else ""

    def replace(self, title: str, value: Value, gesture: str = "") -> None:
        """Put another form in the place of this one, as one step that can be undone.

        Changes in a row that name the same ``gesture`` are one step: the letters typed into one field.
        """
        self.continued = bool(gesture and self._past and self._past[-1].gesture == gesture)
        self.continued = self.continued and not self._future
        if not self.continued:
            self._past.append(Step(title, self.value, gesture))
            del self._past[:-MOST_UNDO]
        self._future.clear()
        self._become(value)

    def rewrite(self, change: Callable[[Value], Value]) -> None:
        """Change the value and all that it was and could become again: what no undo should take back."""
        changed: dict[int, Value] = {}  # the same form stays the same, so that the saved one is recognised

        def once(value: Value) -> Value:
            if id(value) not in changed:
                changed[id(value)] = change(value)
            return changed[id(value)]

        self._past = [replace(step, before=once(step.before)) for step in self._past]
        self._future = [replace(step, before=once(step.before)) for step in self._future]
        self.saved = None if self.saved is None else once(self.saved)
        self._become(once(self.value))

    def undo(self) -> None:
        """Take the last edit back; raises ``InputError`` if there is none."""
        step = self._pop(self._past, "undo")
        self._future.append(Step(step.title, self.value))
        self._become(step.before)

    def redo(self) -> None:
        """Do again what was undone last; raises ``InputError`` if there is nothing."""
        step = self._pop(self._future, "redo")
        self._past.append(Step(step.title, self.value))
        self._become(step.before)

    def _become(self, value: Value) -> None:
        self.value = value
        self.version += 1

    @staticmethod
    def _pop(steps: list[Step[Value]], verb: str) -> Step[Value]:
        if not steps:
            raise InputError(f"there is nothing to {verb}", where="the drawing", fix="edit it first")
        return steps.pop()
