"""What a run came to, on one screen: how it went, displayed values, joints against their limits, files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.text import Text

from armblocks.cli.terminal import STRONG, WARNING, table
from armblocks.diagram import ViewKind

if TYPE_CHECKING:
    from armblocks import Diagram, SimulationResult


def print_run(result: SimulationResult, console: Console) -> None:
    """One line: what was simulated, how, and how fast."""
    run = result.run
    end = f"{result.time[-1]:g} s" if result.time.size else "nothing"
    how = "evaluated at" if run.solver == "none" else f"{run.solver}, {run.steps:,} steps, recorded at"
    text = Text.assemble(
        (f"{result.name}: ", STRONG),
        f"{end} in {run.wall_time:.3g} s, {run.real_time_factor:.3g} x real time; ",
        f"{how} {result.time.size:,} instants",
    )
    console.print(text)
    if not run.complete:
        console.print(Text.assemble(("incomplete: ", WARNING), run.message))
    elif run.message:
        console.print(Text.assemble(("note: ", WARNING), run.message))


def print_displays(diagram: Diagram, result: SimulationResult, console: Console) -> None:
    """The last value of everything that a Display block shows."""
    shown = table(("display", "left"), ("at the end", "right"), ("", "left"))
    for block, view in diagram.views():
        if view.kind is not ViewKind.VALUE or not result.time.size:
            continue
        labels = view.labels or ("",) * len(view.signals)
        for signal, label in zip(view.signals, labels):
            path = f"{block}/{signal}"
            value = result[path][-1]
            name = label or (block if len(view.signals) == 1 else path)
            shown.add_row(name, _value_text(value), result.units[result.resolve(path)])
    if shown.row_count:
        console.print()
        console.print(shown)


def _value_text(value: NDArray[np.float64] | np.float64) -> str:
    """Nine digits: what the Display block of the paper shows and more than a motion needs."""
    if np.ndim(value) == 2:
        return "\n".join(_value_text(row) for row in value)
    return "  ".join(f"{number:.9g}" for number in np.atleast_1d(value))


def print_files(folder: Path, console: Console) -> None:
    """Where the report is."""
    report = folder / "report.html"
    files = sum(1 for path in folder.rglob("*") if path.is_file())
    console.print()
    console.print(
        Text.assemble(("report: ", STRONG), str(report), f"  ({files} files in the folder)"), soft_wrap=True
    )
