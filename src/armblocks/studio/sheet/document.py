"""An open diagram with its undo history and the clients that edit it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armblocks.diagram import Diagram
from armblocks.formats.data_files import DataFiles
from armblocks.studio.documents.aspects import Aspect, changed_aspects
from armblocks.studio.documents.editable_document import EditableDocument, Outcome
from armblocks.studio.protocol.messages.documents import Change
from armblocks.studio.protocol.messages.sheet_edits import (
    DiagramEdit,
    ModelEdit,
    PasteBlocks,
    RemoveBlocks,
)
from armblocks.studio.sheet.clipping import ReadDiagram, reader
from armblocks.studio.sheet.edits import EDITS, EditContext
from armblocks.studio.sheet.nesting import check_editable, inside, with_inside
from armblocks.studio.sheet.parameter_sets import with_consistent_sets
from armblocks.studio.sheet.parameter_values import ResolveRobot
from armblocks.studio.sheet.renames import MovedBlocks
from armblocks.studio.sheet.scope_triggers import with_consistent_trigger


class Document(EditableDocument[Diagram]):
    """One open diagram; see :class:`~armblocks.studio.documents.editable_document.EditableDocument`."""

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
        data: DataFiles | None = None,
    ) -> None:
        super().__init__(diagram, version=version)
        self._moved = MovedBlocks()
        self._context = EditContext(resolve_robot, read_diagram or reader(resolve_robot), data)

    @property
    def diagram(self) -> Diagram:
        """The present diagram."""
        return self.value

    def edit(self, edit: DiagramEdit, path: Sequence[str] = ()) -> None:
        """Apply an edit to the diagram inside the subsystem at this path.

        Raises the errors of :func:`~armblocks.studio.sheet.edits.applied` and
        :func:`~armblocks.studio.sheet.nesting.inside`, and ``DiagramError`` for a sheet of a library. The
        diagram is then unchanged.
        """
        self.perform(Change(document="", inside=list(path), edit=edit))

    def mark_saved(self, value: Diagram, name: str) -> None:
        """Mark ``value``, which is the present or a former diagram, as the content of the file ``name``.

        A diagram with another name is renamed, together with the diagrams for undo and redo.
        """
        self.saved = value
        if value.name != name:
            self.rewrite(lambda diagram: replace(diagram, name=name))

    def outcome(self, request: Change) -> Outcome[Diagram]:
        """Return the title of the step and the diagram after it."""
        edit, title = request.edit, EDITS.title(request.edit)
        if isinstance(edit, ModelEdit):
            return Outcome(title, EDITS.applied(edit, self.diagram, self._context), request.gesture)
        check_editable(self.diagram, request.inside)
        sheet = EDITS.applied(edit, inside(self.diagram, request.inside), self._context)
        after = with_inside(self.diagram, request.inside, sheet)
        after = with_consistent_sets(self.diagram, after, edit, request.inside)
        prefix = "".join(f"{name}/" for name in request.inside)
        if isinstance(edit, RemoveBlocks):
            self._moved.remove(inside(self.diagram, request.inside), sheet, prefix)
        elif isinstance(edit, PasteBlocks):
            old_names = {new: old for old, new in edit.names.items()}
            added = sheet.blocks.keys() - inside(self.diagram, request.inside).blocks.keys()
            names = {old_names.get(name, name): name for name in sorted(added)}
            self._moved.paste(names, after, sheet, prefix)
        after = with_consistent_trigger(after, self._moved.renamed(self.diagram, after))
        return Outcome(title, after, request.gesture)

    def renamed(self, before: Diagram) -> dict[str, str]:
        """Return the paths of the blocks that the last step has renamed or moved: old path to new path."""
        return self._moved.renamed(before, self.diagram)

    def aspects(self, before: Diagram, after: Diagram) -> set[Aspect]:
        """Return the aspects in which two diagrams differ."""
        return changed_aspects(before, after)
