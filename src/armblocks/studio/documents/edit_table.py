"""The functions and titles of the edits of one kind of document."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar

from armblocks.studio.protocol.message import Edit

Value = TypeVar("Value")
EditT = TypeVar("EditT", bound=Edit)
Context = ParamSpec("Context")


@dataclass(frozen=True)
class EditEntry(Generic[Value, Context]):
    """The title of an edit in the undo menu, and the pure function that applies the edit to a value."""

    title: Callable[[Any], str]
    apply: Callable[Concatenate[Any, Value, Context], Value]


class EditTable(Generic[Value, Context]):
    """One entry for each class of edits; a test checks that the table is complete."""

    def __init__(self) -> None:
        self._entries: dict[type[Edit], EditEntry[Value, Context]] = {}

    def on(
        self, edit: type[EditT], title: Callable[[EditT], str]
    ) -> Callable[
        [Callable[Concatenate[EditT, Value, Context], Value]],
        Callable[Concatenate[EditT, Value, Context], Value],
    ]:
        """Register the decorated function as the implementation of a class of edits."""

        def register(
            apply: Callable[Concatenate[EditT, Value, Context], Value],
        ) -> Callable[Concatenate[EditT, Value, Context], Value]:
            self._entries[edit] = EditEntry(title, apply)
            return apply

        return register

    @property
    def entries(self) -> Mapping[type[Edit], EditEntry[Value, Context]]:
        """The entry of each class of edits."""
        return self._entries

    def title(self, edit: Edit) -> str:
        """A short description of the edit, for the menu entry "Undo …"."""
        return self._entries[type(edit)].title(edit)

    def applied(self, edit: Edit, value: Value, *context: Context.args, **named: Context.kwargs) -> Value:
        """The value after an edit; raises ``ArmblocksError`` if the edit cannot be applied."""
        return self._entries[type(edit)].apply(edit, value, *context, **named)
