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

    ``version`` increases with every change, undo and redo included, and is never reused: two clients that
    show the same version show the same value. ``saved`` is the value in the file, or ``None`` if no file
    contains one of these values. ``continued`` is true if the last replacement extended the previous step.
    """

    noun: ClassVar[str] = "document"
    """The word for the value in messages: "drawing", "robot"."""

    def __init__(self, value: Value, *, version: int = 0) -> None:
        self.value = value
        self.saved: Value | None = value
        self.version = version
        self.continued = False
        self._undo_steps: list[Step[Value]] = []
        self._redo_steps: list[Step[Value]] = []

    @property
    def dirty(self) -> bool:
        """Whether the file differs from the present value."""
        return self.value is not self.saved

    @property
    def undo_title(self) -> str:
        """Title of the step that ``undo`` would revert; ``""`` if there is none."""
        return self._undo_steps[-1].title if self._undo_steps else ""

    @property
    def redo_title(self) -> str:
        """Title of the step that ``redo`` would repeat; ``""`` if there is none."""
        return self._redo_steps[-1].title if self._redo_steps else ""

    def replace(self, title: str, value: Value, gesture: str = "") -> None:
        """Replace the present value, as one step that can be undone.

        Consecutive changes with the same ``gesture`` are one step, for example letters typed into a field.
        """
        self.continued = bool(gesture and self._undo_steps and self._undo_steps[-1].gesture == gesture)
        self.continued = self.continued and not self._redo_steps
        if not self.continued:
            self._undo_steps.append(Step(title, self.value, gesture))
            del self._undo_steps[:-MAX_UNDO_STEPS]
        self._redo_steps.clear()
        self._set_value(value)

    def rewrite(self, change: Callable[[Value], Value]) -> None:
        """Apply a change that cannot be undone to the present value and to all values for undo and redo."""
        changed: dict[int, Value] = {}  # identical objects stay identical, so that `dirty` can compare them

        def change_once(value: Value) -> Value:
            if id(value) not in changed:
                changed[id(value)] = change(value)
            return changed[id(value)]

        self._undo_steps = [replace(step, before=change_once(step.before)) for step in self._undo_steps]
        self._redo_steps = [replace(step, before=change_once(step.before)) for step in self._redo_steps]
        self.saved = None if self.saved is None else change_once(self.saved)
        self._set_value(change_once(self.value))

    def undo(self) -> None:
        """Revert the last edit; raises ``InputError`` if there is none."""
        step = self._pop(self._undo_steps, "undo")
        self._redo_steps.append(Step(step.title, self.value))
        self._set_value(step.before)

    def redo(self) -> None:
        """Repeat the edit that was undone last; raises ``InputError`` if there is none."""
        step = self._pop(self._redo_steps, "redo")
        self._undo_steps.append(Step(step.title, self.value))
        self._set_value(step.before)

    def _set_value(self, value: Value) -> None:
        self.value = value
        self.version += 1

    def _pop(self, steps: list[Step[Value]], verb: str) -> Step[Value]:
        if not steps:
            raise InputError(f"there is nothing to {verb}", where=f"the {self.noun}", fix="edit it first")
        return steps.pop()
