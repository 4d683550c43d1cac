"""The result of a run: its data, with methods for tables, files and display."""

from __future__ import annotations

import importlib
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol, final

from armblocks.errors import counted
from armblocks.simulation.export import save, to_dataframe
from armblocks.simulation.notebook_view import result_html
from armblocks.simulation.run_data import RunData

if TYPE_CHECKING:
    import pandas as pd


class SignalFigure(Protocol):
    """A figure of signals, which notebooks show."""

    def save(self, path: str | PathLike[str], *, theme: Literal["light", "dark"] | None = None) -> Path:
        """Write a ``.svg``, ``.png`` or ``.pdf`` file atomically; returns the path."""
        ...


@final
class SimulationResult(RunData):
    """Signals of one run. ``result["block/port"]`` is ``(N, *shape)``, a view.

    - ``time`` (N,) s.
    - ``signals`` (ny, N): ``signals_layout`` has the names, shapes and units of its rows.
    - ``states`` (N, nx): ``states_layout`` has the names of its columns.
    - ``parameters``: the values at the end of the run, after ``parameter_changes``.
    - ``final_state``: the state from which another run continues; ``None`` for a failed run.
    - ``jumps``: both sides of each jump between the samples.
    - ``log``: the log file, if any. The result then has a selection of the file's rows with all extremes of
      the logged signals.
    """

    def to_dataframe(self, *, jumps: bool = False) -> pd.DataFrame:
        """A pandas table: index ``time`` in s, one column for each scalar, named as in :meth:`columns`.

        With ``jumps``, the rows are the same as in :meth:`with_jumps`, and the index is not unique.
        """
        return to_dataframe(self, jumps=jumps)

    def save(self, path: str | PathLike[str], *, jumps: bool = True) -> None:
        """Write a file atomically; its suffix is ``.csv``, ``.parquet``, ``.npz`` or ``.mat``.

        The rows are the same as in :meth:`with_jumps`, two rows with the same time for each jump. Without
        ``jumps`` the file has the samples only.

        Raises ``UnknownNameError`` for an unsupported suffix and ``FormatError`` if the file cannot be
        written.
        """
        save(self, path, jumps=jumps)

    def plot(
        self,
        *names: str,
        save: str | PathLike[str] | None = None,
        theme: Literal["light", "dark"] | None = None,
    ) -> SignalFigure:
        """Draw signals over time, one panel each: ``result.plot("arm/q", "rne/tau", save="run.svg")``.

        Without names, the first 12 signals. A notebook shows the figure at the end of a cell. ``save``: also
        write a ``.svg``, ``.png`` or ``.pdf`` file. Angles are in degrees. Raises UnknownNameError for a
        signal or a suffix that does not exist.
        """
        # The figures belong to a higher layer.
        figures: Any = importlib.import_module("armblocks.report.signal_figure")
        figure: SignalFigure = figures.signal_figure(self, names, theme)
        if save is not None:
            figure.save(save, theme=theme)
        return figure

    def __repr__(self) -> str:
        report = self.run
        end = f"{self.time[-1]:g} s" if self.time.size else "nothing"
        solver = (
            "no solver needed"
            if report.solver == "none"
            else f"{report.solver}, {counted(report.steps, 'step')}"
        )
        head = (
            f"{self.name}: {counted(self.time.size, 'sample')} to {end}, "
            f"{counted(len(self.names), 'signal')}, {solver}, "
            f"{report.wall_time:.3g} s ({report.real_time_factor:.3g} x real time)"
        )
        if self.log is not None:
            head += f", all {self.log.rows} rows in {self.log.path}"
        lines = [f"<SimulationResult {head}{'' if report.complete else ', INCOMPLETE'}>"]
        if report.message:
            lines.append(f"  {report.message}")
        width = max((len(name) for name in self.names), default=0)
        for slot in self.signals_layout:
            shape = "x".join(map(str, slot.shape)) or "scalar"
            entries = f"{slot.unit:<8} {', '.join(slot.entries)}" if slot.entries else slot.unit
            lines.append(f"  {slot.name:<{width}}  {shape:<6} {entries}".rstrip())
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return result_html(self)
