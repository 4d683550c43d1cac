"""A drawing that is open in the studio: a diagram with its past, its future and the pages that edit it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armblocks.diagram import Diagram
from armblocks.studio.documents.aspects import Aspect, changed_aspects
from armblocks.studio.documents.edited import Edited, Outcome
from armblocks.studio.protocol.messages import documents as say
from armblocks.studio.protocol.messages.sheet_edits import DiagramEdit, ModelEdit
from armblocks.studio.sheet.clipping import ReadDiagram
from armblocks.studio.sheet.edits import EDITS, applied
from armblocks.studio.sheet.nesting import check_own, inside, with_inside
from armblocks.studio.sheet.parameter_values import ResolveRobot
from armblocks.studio.sheet.placing import arranged


class Document(Edited[Diagram]):
    """One open diagram; see :class:`~armblocks.studio.documents.edited.Edited`."""

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
        self._resolve_robot = resolve_robot
        self._read_diagram = read_diagram

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
        self.perform(say.Change(document="", inside=list(path), edit=edit))

    def written(self, value: Diagram, name: str) -> None:
        """The file of this name holds ``value``, which this drawing is or was: it is the saved one.

        Where the diagrams had another name they get this one, past and future ones too.
        """
        self.saved = value
        if value.name != name:
            self.rewrite(lambda given: replace(given, name=name))

    def outcome(self, request: say.Change | say.ArrangeBlocks) -> Outcome[Diagram]:
        """What the step is called, and the diagram after it."""
        if isinstance(request, say.Change) and isinstance(request.edit, ModelEdit):
            return Outcome(EDITS.title(request.edit), self._applied(request.edit, self.diagram))
        check_own(self.diagram, request.inside)
        sheet = inside(self.diagram, request.inside)
        if isinstance(request, say.Change):
            title = EDITS.title(request.edit)
            after = self._applied(request.edit, sheet)
        else:
            title, after = "arrange", arranged(sheet)
        return Outcome(title, with_inside(self.diagram, request.inside, after))

    def _applied(self, edit: DiagramEdit, sheet: Diagram) -> Diagram:
        return applied(edit, sheet, self._resolve_robot, self._read_diagram)

    def aspects(self, before: Diagram, after: Diagram) -> set[Aspect]:
        """All that is different between two diagrams."""
        return changed_aspects(before, after)
