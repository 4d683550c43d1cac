"""The result of a workspace: :class:`WorkspaceCells` with its pictures and files as methods."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from armblocks.face.workspace.cells import Statistic, WorkspaceCells
from armblocks.pictures.picture import Picture
from armblocks.pictures.style import Theme


@dataclass(frozen=True, eq=False, kw_only=True)
class Workspace(WorkspaceCells):
    """The reachable region of a frame of an arm. ``print`` shows a summary.

    - ``samples``: number of configurations. ``accepted``: number of configurations within the limits of
      joints that couplings determine.
    - ``cell`` (m): side of the cubic cells. ``corner`` (3,) m: the centre of the first cell, in the world.
      ``counts`` (nx, ny, nz): samples in each cell.
    - ``maps``: the measures by name. ``axes``: the rows of the Jacobian of the measures.
    - ``low``, ``high`` (3,) m: the exact bounds of the sampled positions. ``reach`` (m): their largest
      distance from the origin of the ``base`` (3,).
    - ``points`` (P, 3) m, ``q`` (P, nq) and ``values`` (P,) of each measure: the first P samples.
    - ``notes``: assumed ranges and missing limits.

    A cell without samples may still be reachable in a thin part of the region: use more samples, or larger
    cells.
    """

    def picture(
        self,
        measure: str | None = None,
        statistic: Statistic = "most",
        *,
        normal: str | None = None,
        at: float | None = None,
        width: float = 960.0,
    ) -> Picture:
        """Slices with a measure in colours, by default the first measure; ``"count"`` shows the samples.

        - ``normal``, ``at``: one slice, as :meth:`slice`. By default the slices through the base normal to y
          and the slice with the most cells normal to z are side by side.
        - ``width``: px.
        """
        from armblocks.face.workspace.pictures import workspace_picture

        return workspace_picture(self, measure, statistic, normal, at, width)

    def save(self, path: str | PathLike[str], *, content: str = "cells", theme: Theme | None = None) -> Path:
        """Write a file by its suffix: reached cells as ``.csv``, ``.parquet`` or ``.npz``, or a picture.

        ``content="points"``: the stored samples instead of the cells. Pictures: ``.svg``, ``.png``, ``.pdf``.
        Parquet files need the extra ``data``, PNG and PDF files the extra ``figures``. Raises
        UnknownNameError for other suffixes.
        """
        from armblocks.face.workspace.files import save_workspace

        return save_workspace(self, path, content, theme)

    def write(self, folder: str | PathLike[str]) -> tuple[Path, ...]:
        """Write ``workspace.html``, ``workspace.csv``, ``points.csv`` and a figure of each measure."""
        from armblocks.face.workspace.files import write_workspace

        return write_workspace(self, folder)

    __repr__ = WorkspaceCells.__repr__
    __str__ = WorkspaceCells.__str__
