"""``result.plot``: signals of a run over time as one figure, for notebooks and files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from armblocks.errors import InputError, UnknownNameError
from armblocks.files import write_atomically
from armblocks.pictures.picture import Picture
from armblocks.pictures.style import Theme
from armblocks.pictures.svg import svg_file
from armblocks.report.charts.time_chart import Panel, Trace, time_chart
from armblocks.report.figures import in_display_unit
from armblocks.simulation.run_data import RunData

SUFFIXES = (".svg", ".png", ".pdf")
MAX_PANELS = 12
"""Maximum number of signals of a figure, one panel each."""
MAX_TRACES = 12
"""Maximum number of entries of a signal that are drawn."""


@dataclass(frozen=True, eq=False)
class SignalFigure:
    """Signals over time. A notebook shows it at the end of a cell; :meth:`save` writes a file."""

    picture: Picture

    def save(self, path: str | PathLike[str], *, theme: Theme | None = None) -> Path:
        """Write a ``.svg``, ``.png`` or ``.pdf`` file atomically; returns the path.

        ``theme``: by default the theme of the viewer for SVG, light for the other formats. Raises
        UnknownNameError for an unsupported suffix, MissingLibraryError without the extra ``figures``.
        """
        target = Path(path)
        match target.suffix.lower():
            case ".svg":
                data = self._svg(theme).encode()
            case ".png":
                from armblocks.pictures.png import picture_png

                data = picture_png(self.picture, theme=theme or "light")
            case ".pdf":
                from armblocks.pictures.pdf import picture_pdf

                data = picture_pdf(self.picture, theme=theme or "light")
            case _:
                raise UnknownNameError("format of figures", target.suffix, SUFFIXES, where=str(path))
        write_atomically(target, data)
        return target

    def _svg(self, theme: Theme | None) -> str:
        return svg_file(self.picture, theme=theme)

    def _repr_svg_(self) -> str:
        """The notebook view."""
        return self._svg(None)


def signal_figure(data: RunData, names: Sequence[str], theme: str | None) -> SignalFigure:
    """The figure of signals by name, or of all signals, see ``SimulationResult.plot``."""
    if theme not in ("light", "dark", None):
        raise UnknownNameError("theme", str(theme), ("light", "dark"), where=f"plot of '{data.name}'")
    paths = list(dict.fromkeys(data.resolve(name) for name in names or data.names))
    if not paths or not data.time.size or (names and len(paths) > MAX_PANELS):
        raise InputError(
            f"{len(paths)} signals with {data.time.size} samples cannot be drawn",
            where=f"plot of '{data.name}'",
            allowed=f"1 to {MAX_PANELS} signals and one sample or more",
            fix="name the signals: result.plot('block/port')",
        )
    rows = data.with_jumps()
    panels: list[Panel] = []
    for path in paths[:MAX_PANELS]:
        slot = rows.signals_layout[path]
        columns = np.asarray(rows[path], dtype=np.float64).reshape(len(rows.time), -1)[:, :MAX_TRACES]
        values, unit = in_display_unit(columns, slot.unit)
        labels = slot.entry_names if slot.shape else [path.rpartition("/")[2]]
        traces = (
            Trace(label=str(label), values=values[:, k], index=k)
            for k, label in zip(range(values.shape[1]), labels)
        )
        panels.append(Panel(quantity=slot.title or path, unit=unit, traces=tuple(traces)))
    drawn = ", ".join(panel.quantity for panel in panels)
    return SignalFigure(
        time_chart(rows.time, panels, title=data.name, description=f"Traces over time of {drawn}.")
    )
