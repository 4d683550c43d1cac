"""A drawing that is open in the studio: its present form, its past and its future."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armblocks.diagram import Diagram
from armblocks.errors import InputError
from armblocks.studio.edits import Edit, applied, summary
from armblocks.studio.nesting import inside, with_inside
from armblocks.studio.parameter_values import ResolveRobot

MOST_UNDO = 10_000
"""Edits that can be undone; older ones are forgotten."""


@dataclass(frozen=True)
class Step:
    """One edit that was carried out: what it is called, and the diagram before it."""

    title: str
    before: Diagram


class Document:
    """One open diagram. Diagrams are frozen and share their blocks, so the past costs next to nothing.

    ``version`` grows with every change, undo and redo included, and never returns: two pages that show the
    same version show the same drawing. ``saved`` is the diagram that the file holds.
    """

    def __init__(self, diagram: Diagram, resolve_robot: ResolveRobot) -> None:
        self.diagram = diagram
        self.saved = diagram
        self.version = 0
        self._resolve_robot = resolve_robot
        self._past: list[Step] = []
        self._future: list[Step] = []

    @property
    def dirty(self) -> bool:
        """Whether the file holds another drawing than this one."""
        return self.diagram is not self.saved

    @property
    def undo_title(self) -> str:
        """What ``undo`` would take back; ``""`` if nothing."""
        return self._past[-1].title if self._past else ""

    @property
    def redo_title(self) -> str:
        """What ``redo`` would do again; ``""`` if nothing."""
        return self._future[-1].title if self._future else ""

    def edit(self, edit: Edit, path: Sequence[str] = ()) -> None:
        """Carry out an edit in the diagram inside the subsystem of this path.

        Raises what :func:`~armblocks.studio.edits.applied` and :func:`~armblocks.studio.nesting.inside`
        raise; nothing is then changed.
        """
        after = applied(edit, inside(self.diagram, path), self._resolve_robot)
        self.replace(summary(edit), with_inside(self.diagram, path, after))

    def replace(self, title: str, diagram: Diagram) -> None:
        """Put another diagram in the place of this one, as one step that can be undone."""
        self._past.append(Step(title, self.diagram))
        del self._past[:-MOST_UNDO]
        self._future.clear()
        self._become(diagram)

    def rename(self, name: str) -> None:
        """Give the diagram the name of its file; past and future drawings are renamed too."""
        self.diagram = replace(self.diagram, name=name)
        self._past = [Step(step.title, replace(step.before, name=name)) for step in self._past]
        self._future = [Step(step.title, replace(step.before, name=name)) for step in self._future]
        self.version += 1

    def undo(self) -> None:
        """Take the last edit back; raises ``InputError`` if there is none."""
        step = self._pop(self._past, "undo")
        self._future.append(Step(step.title, self.diagram))
        self._become(step.before)

    def redo(self) -> None:
        """Do again what was undone last; raises ``InputError`` if there is nothing."""
        step = self._pop(self._future, "redo")
        self._past.append(Step(step.title, self.diagram))
        self._become(step.before)

    def _become(self, diagram: Diagram) -> None:
        self.diagram = diagram
        self.version += 1

    @staticmethod
    def _pop(steps: list[Step], verb: str) -> Step:
        if not steps:
            raise InputError(f"there is nothing to {verb}", where="the drawing", fix="edit it first")
        return steps.pop()
