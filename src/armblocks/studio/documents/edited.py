"""An edited value with undo and redo history, and the author page of each version."""

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

MOST_VERSIONS = 1000
"""Versions that are remembered to find out what an edit of an older one runs into."""


@dataclass(frozen=True)
class Version(Generic[Value]):
    """A version that the value had, and which page made it."""

    number: int
    author: str
    value: Value


class Outcome(NamedTuple, Generic[Value]):
    """What a request would do: how the step is called, the value after it, and the gesture it belongs to."""

    title: str
    after: Value
    gesture: str = ""


class Edited(History[Value], ABC):
    """A value that several pages may edit; see :class:`~armblocks.studio.documents.history.History`."""

    kind: ClassVar[DocumentKind]
    edits: ClassVar[type[Edit]]
    """The class of its edits."""
    noun: ClassVar[str]
    """What people call it: "drawing", "robot"."""

    def __init__(self, value: Value, *, version: int = 0) -> None:
        super().__init__(value, version=version)
        self._author = ""
        self._versions = deque([Version(version, "", value)], maxlen=MOST_VERSIONS)

    def perform(self, request: Alteration) -> None:
        """Do what a page asks.

        Raises what the edit itself raises, and ``InputError`` where there is nothing to undo or to redo, and
        where another page has changed the same things since the version that this one saw; nothing is then
        changed.
        """
        others = self._changed_by_others(request)
        self._author = request.author
        try:
            if isinstance(request, Change):
                self._check_kind(request.edit)
                title, after, gesture = self.outcome(request)
                if others and clash(self.aspects(self.value, after), others):
                    raise self._overtaken("your change conflicts with a change from another page")
                self.replace(title, after, gesture)
            elif others:
                raise self._overtaken(f"the {self.noun} was changed in another page meanwhile")
            elif request.does == "undo":
                self.undo()
            else:
                self.redo()
        finally:
            self._author = ""

    @abstractmethod
    def outcome(self, request: Change) -> Outcome[Value]:
        """What a change would do to the value as it is now; raises ``ArmblocksError`` where it cannot be."""

    @abstractmethod
    def aspects(self, before: Value, after: Value) -> set[Aspect]:
        """All that is different between two of its forms."""

    @abstractmethod
    def written(self, value: Value, name: str) -> None:
        """The file of this name holds ``value``, which this is or was: it is the saved one."""

    def _check_kind(self, edit: Edit) -> None:
        if not isinstance(edit, self.edits):
            raise InputError(
                f"'{kind_of(type(edit))}' is no edit of a {self.noun}",
                where=f"the {self.noun}",
                allowed=", ".join(messages_of(self.edits)),
                fix="load the page again: it may be of another version",
            )

    def _changed_by_others(self, request: Alteration) -> set[Aspect]:
        """What pages other than the one that asks have changed since the version that it saw."""
        if request.base is None or request.base == self.version:
            return set()
        if not self._versions[0].number <= request.base <= self.version:
            raise self._overtaken(f"the page shows a version of the {self.noun} that is long past")
        known = [version for version in self._versions if version.number >= request.base]
        changed: set[Aspect] = set()
        for before, after in pairwise(known):
            if after.author != request.author:
                changed |= self.aspects(before.value, after.value)
        return changed

    def _become(self, value: Value) -> None:
        super()._become(value)
        self._versions.append(Version(self.version, self._author, value))

    def _overtaken(self, what: str) -> InputError:
        return InputError(
            what,
            where=f"the {self.noun}",
            allowed="an edit of what this page showed",
            fix="look at what is there now, and do it again if you still want to",
        )
