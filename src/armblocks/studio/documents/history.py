"""Undo and redo history of frozen values, which are edited by replacement."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar, Generic, TypeVar

from armblocks.errors import InputError

MAX_UNDO_STEPS = 10_000
"""Number of edits that can be undone; older ones are dropped."""

Value = TypeVar("Value")


@dataclass(frozen=True)
class Step(Generic[Value]):
    """One applied edit: its title, the value before it, and the gesture that it was a part of."""

    title: str
    before: Value
    gesture: str = ""


class History(Generic[Value]):
    """The present value of a frozen type, with stacks of former values for undo and redo.

    Values share their unchanged parts, so the history needs little memory.

    ``version`` increases with every change, undo and redo included, and is never reused: two pages that show
    the same version show the same value. ``saved`` is the value in the file, or ``None`` if no file
    contains one of these values. ``continued`` is true if the last replacement extended the previous step.
    """

    noun: ClassVar[str] = "document"
    """The word for the value in messages: "drawing", "robot"."""

    def __init__(self, value: Value, *, version: int = 0) -> None:
        self.value = value
        self.saved: Value | None = value
        self.version = version
        self.continued = False
        self._past: list[Step[Value]] = []
        self._future: list[Step[Value]] = []

    @property
    def dirty(self) -> bool:
        """Whether the file contains another value than the present one."""
        return self.value is not self.saved

    @property
    def undo_title(self) -> str:
        """Title of the step that ``undo`` would revert; ``""`` if there is none."""
        return self._past[-1].title if self._past else ""

    @property
    def redo_title(self) -> str:
        """Title of the step that ``redo`` would repeat; ``""`` if there is none."""
        return self._future[-1].title if self._future else ""

    def replace(self, title: str, value: Value, gesture: str = "") -> None:
        """Replace the present value, as one step that can be undone.

        Consecutive changes with the same ``gesture`` are one step, for example letters typed into a field.
        """
        self.continued = bool(gesture and self._past and self._past[-1].gesture == gesture)
        self.continued = self.continued and not self._future
        if not self.continued:
            self._past.append(Step(title, self.value, gesture))
            del self._past[:-MAX_UNDO_STEPS]
        self._future.clear()
        self._become(value)

    def rewrite(self, change: Callable[[Value], Value]) -> None:
        """Apply a change that cannot be undone to the present value and to all values for undo and redo."""
        changed: dict[int, Value] = {}  # equal objects stay equal objects, so that `saved` is still found

        def once(value: Value) -> Value:
            if id(value) not in changed:
                changed[id(value)] = change(value)
            return changed[id(value)]

        self._past = [replace(step, before=once(step.before)) for step in self._past]
        self._future = [replace(step, before=once(step.before)) for step in self._future]
        self.saved = None if self.saved is None else once(self.saved)
        self._become(once(self.value))

    def undo(self) -> None:
        """Revert the last edit; raises ``InputError`` if there is none."""
        step = self._pop(self._past, "undo")
        self._future.append(Step(step.title, self.value))
        self._become(step.before)

    def redo(self) -> None:
        """Repeat the edit that was undone last; raises ``InputError`` if there is none."""
        step = self._pop(self._future, "redo")
        self._past.append(Step(step.title, self.value))
        self._become(step.before)

    def _become(self, value: Value) -> None:
        self.value = value
        self.version += 1

    def _pop(self, steps: list[Step[Value]], verb: str) -> Step[Value]:
        if not steps:
            raise InputError(f"there is nothing to {verb}", where=f"the {self.noun}", fix="edit it first")
        return steps.pop()
