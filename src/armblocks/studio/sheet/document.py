"""A drawing that is open in the studio: a diagram with its past, its future and the pages that edit it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armblocks.diagram import Diagram
from armblocks.studio.documents.aspects import Aspect, changed_aspects
from armblocks.studio.documents.edited import Edited, Outcome
from armblocks.studio.protocol.messages.documents import Change
from armblocks.studio.protocol.messages.sheet_edits import DiagramEdit, ModelEdit
from armblocks.studio.sheet.clipping import ReadDiagram, reader
from armblocks.studio.sheet.edits import EDITS, EditContext
from armblocks.studio.sheet.nesting import check_own, inside, with_inside
from armblocks.studio.sheet.parameter_values import ResolveRobot


class Document(Edited[Diagram]):
    """One open diagram; see :class:`~armblocks.studio.documents.edited.Edited`."""

    kind = "diagram"
    edits = DiagramEdit
    noun = "drawing"

    def __init__(
        self,
        diagram: Diagram,
        resolve_robot: ResolveRobot,
        *,
        version: int = 0,
        read_diagram: ReadDiagram | None = None,
    ) -> None:
        super().__init__(diagram, version=version)
        self._context = EditContext(resolve_robot, read_diagram or reader(resolve_robot))

    @property
    def diagram(self) -> Diagram:
        """The diagram as it is now."""
        return self.value

    def edit(self, edit: DiagramEdit, path: Sequence[str] = ()) -> None:
        """Carry out an edit in the diagram inside the subsystem of this path.

        Raises what :func:`~armblocks.studio.sheet.edits.applied` and
        :func:`~armblocks.studio.sheet.nesting.inside` raise, and ``DiagramError`` for a sheet of a library;
        nothing is then changed.
        """
        self.perform(Change(document="", inside=list(path), edit=edit))

    def written(self, value: Diagram, name: str) -> None:
        """The file of this name holds ``value``, which this drawing is or was: it is the saved one.

        Where the diagrams had another name they get this one, past and future ones too.
        """
        self.saved = value
        if value.name != name:
            self.rewrite(lambda given: replace(given, name=name))

    def outcome(self, request: Change) -> Outcome[Diagram]:
        """What the step is called, and the diagram after it."""
        edit, title = request.edit, EDITS.title(request.edit)
        if isinstance(edit, ModelEdit):
            return Outcome(title, EDITS.applied(edit, self.diagram, self._context), request.gesture)
        check_own(self.diagram, request.inside)
        after = EDITS.applied(edit, inside(self.diagram, request.inside), self._context)
        return Outcome(title, with_inside(self.diagram, request.inside, after), request.gesture)

    def aspects(self, before: Diagram, after: Diagram) -> set[Aspect]:
        """All that is different between two diagrams."""
        return changed_aspects(before, after)
