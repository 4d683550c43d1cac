"""An edited value with undo and redo history, and the client that made each version."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar, Generic, NamedTuple

from armblocks.errors import InputError
from armblocks.studio.documents.aspects import Aspect, clash
from armblocks.studio.documents.history import History, Value
from armblocks.studio.protocol.message import Edit, kind_of, messages_of
from armblocks.studio.protocol.messages.documents import Alteration, Change, DocumentKind

MAX_VERSIONS = 1000
"""Number of stored versions, which are compared to detect conflicts of an edit made on an older version."""


@dataclass(frozen=True)
class Version(Generic[Value]):
    """A former value, its version number, and the client that made it."""

    number: int
    author: str
    value: Value


class Outcome(NamedTuple, Generic[Value]):
    """The effect of a request: title of the undo step, new value, and gesture that the step belongs to."""

    title: str
    after: Value
    gesture: str = ""


class EditableDocument(History[Value], ABC):
    """A value that several clients may edit; see :class:`~armblocks.studio.documents.history.History`."""

    kind: ClassVar[DocumentKind]
    edits: ClassVar[type[Edit]]
    """The base class of the edits of this kind of document."""

    def __init__(self, value: Value, *, version: int = 0) -> None:
        super().__init__(value, version=version)
        self._author = ""
        self._versions = deque([Version(version, "", value)], maxlen=MAX_VERSIONS)

    def perform(self, request: Alteration) -> None:
        """Apply the request of a client.

        Raises the errors of the edit itself. Raises ``InputError`` if there is nothing to undo or redo, or if
        another client has changed the same aspects since the version ``request.base``. The value is then
        unchanged.
        """
        others = self._changed_by_others(request)
        self._author = request.author
        try:
            if isinstance(request, Change):
                self._check_kind(request.edit)
                title, after, gesture = self.outcome(request)
                if others and clash(self.aspects(self.value, after), others):
                    raise self._conflict("your change conflicts with a change from another page")
                self.replace(title, after, gesture)
            elif others:
                raise self._conflict(f"the {self.noun} was changed in another page meanwhile")
            elif request.does == "undo":
                self.undo()
            else:
                self.redo()
        finally:
            self._author = ""

    @abstractmethod
    def outcome(self, request: Change) -> Outcome[Value]:
        """Return the effect of a change on the present value; raise ``ArmblocksError`` if it is invalid."""

    @abstractmethod
    def aspects(self, before: Value, after: Value) -> set[Aspect]:
        """Return the aspects in which two values differ."""

    @abstractmethod
    def mark_saved(self, value: Value, name: str) -> None:
        """Mark ``value``, which is the present or a former value, as the content of the file ``name``."""

    def _check_kind(self, edit: Edit) -> None:
        if not isinstance(edit, self.edits):
            raise InputError(
                f"'{kind_of(type(edit))}' is not an edit of a {self.noun}",
                where=f"the {self.noun}",
                allowed=", ".join(messages_of(self.edits)),
                fix="reload the page: it may come from another version of armblocks",
            )

    def _changed_by_others(self, request: Alteration) -> set[Aspect]:
        """The aspects that other clients have changed since the version on which the request is based."""
        if request.base is None or request.base == self.version:
            return set()
        if not self._versions[0].number <= request.base <= self.version:
            raise self._conflict(f"the page shows a version of the {self.noun} that is too old")
        versions = [version for version in self._versions if version.number >= request.base]
        changed: set[Aspect] = set()
        for before, after in pairwise(versions):
            if after.author != request.author:
                changed |= self.aspects(before.value, after.value)
        return changed

    def _set_value(self, value: Value) -> None:
        super()._set_value(value)
        self._versions.append(Version(self.version, self._author, value))

    def _conflict(self, what: str) -> InputError:
        return InputError(
            what,
            where=f"the {self.noun}",
            allowed="an edit of the version that this page showed",
            fix="look at the present version, and repeat the edit if you still want it",
        )
