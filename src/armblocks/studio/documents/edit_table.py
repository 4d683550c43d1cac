"""The functions and titles of the edits of one kind of document."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar

from armblocks.studio.protocol.message import Edit

Value = TypeVar("Value")
EditT = TypeVar("EditT", bound=Edit)
More = ParamSpec("More")


@dataclass(frozen=True)
class EditEntry(Generic[Value, More]):
    """The title of an edit in the undo menu, and the pure function that applies the edit to a value."""

    title: Callable[[Any], str]
    carry_out: Callable[Concatenate[Any, Value, More], Value]


class EditTable(Generic[Value, More]):
    """One entry for each class of edits; a test checks that the table is complete."""

    def __init__(self) -> None:
        self._entries: dict[type[Edit], EditEntry[Value, More]] = {}

    def on(
        self, edit: type[EditT], title: Callable[[EditT], str]
    ) -> Callable[
        [Callable[Concatenate[EditT, Value, More], Value]], Callable[Concatenate[EditT, Value, More], Value]
    ]:
        """Register the decorated function as the implementation of a class of edits."""

        def register(
            carry_out: Callable[Concatenate[EditT, Value, More], Value],
        ) -> Callable[Concatenate[EditT, Value, More], Value]:
            self._entries[edit] = EditEntry(title, carry_out)
            return carry_out

        return register

    @property
    def entries(self) -> Mapping[type[Edit], EditEntry[Value, More]]:
        """The entry of each class of edits."""
        return self._entries

    def title(self, edit: Edit) -> str:
        """A short description of the edit, for the menu entry "Undo …"."""
        return self._entries[type(edit)].title(edit)

    def applied(self, edit: Edit, value: Value, *more: More.args, **named: More.kwargs) -> Value:
        """The value after an edit; raises ``ArmblocksError`` if the edit cannot be applied."""
        return self._entries[type(edit)].carry_out(edit, value, *more, **named)
