"""A drawing that is open in the studio: a diagram with its past, its future and the pages that edit it."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from armblocks.diagram import Diagram
from armblocks.errors import InputError
from armblocks.studio import messages as say
from armblocks.studio.aspects import Aspect, changed_aspects, clash
from armblocks.studio.edits import Edit, applied, summary
from armblocks.studio.history import History
from armblocks.studio.nesting import check_own, inside, with_inside
from armblocks.studio.parameter_values import ResolveRobot
from armblocks.studio.placing import arranged

MOST_VERSIONS = 1000
"""Versions that are remembered to find out what an edit of an older one runs into."""


@dataclass(frozen=True)
class Version:
    """A version that the drawing had, and which page made it."""

    number: int
    author: str
    diagram: Diagram


class Document(History[Diagram]):
    """One open diagram; see :class:`~armblocks.studio.history.History`."""

    def __init__(self, diagram: Diagram, resolve_robot: ResolveRobot, *, version: int = 0) -> None:
        super().__init__(diagram, version=version)
        self._resolve_robot = resolve_robot
        self._author = ""
        self._versions = deque([Version(version, "", diagram)], maxlen=MOST_VERSIONS)

    @property
    def diagram(self) -> Diagram:
        """The diagram as it is now."""
        return self.value

    def perform(self, request: say.Change | say.Undo | say.Redo | say.ArrangeBlocks) -> None:
        """Do what a page asks.

        Raises what :meth:`edit`, :meth:`undo` and :meth:`redo` raise, and ``InputError`` where another page
        has changed the same things since the version that this one saw; nothing is then changed.
        """
        others = self._changed_by_others(request)
        self._author = request.author
        try:
            match request:
                case say.Change() | say.ArrangeBlocks():
                    title, after = self._outcome(request)
                    if others and clash(changed_aspects(self.diagram, after), others):
                        raise _overtaken("what you changed was changed in another page meanwhile")
                    self.replace(title, after)
                case say.Undo() | say.Redo():
                    if others:
                        raise _overtaken("the drawing was changed in another page meanwhile")
                    self.undo() if isinstance(request, say.Undo) else self.redo()
        finally:
            self._author = ""

    def edit(self, edit: Edit, path: Sequence[str] = ()) -> None:
        """Carry out an edit in the diagram inside the subsystem of this path.

        Raises what :func:`~armblocks.studio.edits.applied` and :func:`~armblocks.studio.nesting.inside`
        raise, and ``DiagramError`` for a sheet of a library; nothing is then changed.
        """
        self.perform(say.Change(document="", inside=list(path), edit=edit))

    def written(self, diagram: Diagram, name: str) -> None:
        """The file of this name holds ``diagram``, which this drawing is or was: it is the saved one.

        Where the diagrams had another name they get this one, past and future ones too.
        """
        self.saved = diagram
        if diagram.name != name:
            self.rewrite(lambda given: replace(given, name=name))

    def _outcome(self, request: say.Change | say.ArrangeBlocks) -> tuple[str, Diagram]:
        """What the step is called, and the diagram after it."""
        check_own(self.diagram, request.inside)
        sheet = inside(self.diagram, request.inside)
        if isinstance(request, say.Change):
            title, after = summary(request.edit), applied(request.edit, sheet, self._resolve_robot)
        else:
            title, after = "arrange", arranged(sheet)
        return title, with_inside(self.diagram, request.inside, after)

    def _changed_by_others(self, request: say.Alteration) -> set[Aspect]:
        """What pages other than the one that asks have changed since the version that it saw."""
        if request.base is None or request.base == self.version:
            return set()
        if not self._versions[0].number <= request.base <= self.version:
            raise _overtaken("the page shows a version of the drawing that is long past")
        known = [version for version in self._versions if version.number >= request.base]
        changed: set[Aspect] = set()
        for before, after in pairwise(known):
            if after.author != request.author:
                changed |= changed_aspects(before.diagram, after.diagram)
        return changed

    def _become(self, value: Diagram) -> None:
        super()._become(value)
        self._versions.append(Version(self.version, self._author, value))


def _overtaken(what: str) -> InputError:
    return InputError(
        what,
        where="the drawing",
        allowed="an edit of what this page showed",
        fix="look at what is there now, and do it again if you still want to",
    )
