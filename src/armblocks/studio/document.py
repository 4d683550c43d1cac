"""A drawing that is open in the studio: a diagram with its past and its future."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armblocks.diagram import Diagram
from armblocks.studio.edits import Edit, applied, summary
from armblocks.studio.history import History
from armblocks.studio.nesting import inside, with_inside
from armblocks.studio.parameter_values import ResolveRobot


class Document(History[Diagram]):
    """One open diagram; see :class:`~armblocks.studio.history.History`."""

    def __init__(self, diagram: Diagram, resolve_robot: ResolveRobot) -> None:
        super().__init__(diagram)
        self._resolve_robot = resolve_robot

    @property
    def diagram(self) -> Diagram:
        """The diagram as it is now."""
        return self.value

    def edit(self, edit: Edit, path: Sequence[str] = ()) -> None:
        """Carry out an edit in the diagram inside the subsystem of this path.

        Raises what :func:`~armblocks.studio.edits.applied` and :func:`~armblocks.studio.nesting.inside`
        raise; nothing is then changed.
        """
        after = applied(edit, inside(self.diagram, path), self._resolve_robot)
        self.replace(summary(edit), with_inside(self.diagram, path, after))

    def rename(self, name: str) -> None:
        """Give the diagram the name of its file; past and future drawings are renamed too."""
        self.rewrite(lambda diagram: replace(diagram, name=name))
