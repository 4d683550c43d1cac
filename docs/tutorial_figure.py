"""The figure of the tutorial "Control a joint": the angles of its three runs in one chart."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path
from typing import Any

from block_pages import FIGURE_WIDTH, figure_html

import armblocks as ab
from armblocks.blocks import FromTable, Scope, Step
from armblocks.report.figures import view_figures

TUTORIAL = Path(__file__).parent / "tutorial-controller.md"
RUNS = {
    "proportional": "proportional_run",
    "with integral": "integral_run",
    "with anti-windup": "anti_windup_run",
}
"""The label of each trace, and the variable of its run in the tutorial."""


def controller_figure() -> str:
    """HTML of the chart. Executes the programs of the tutorial up to the section on margins."""
    page, heading, _ = TUTORIAL.read_text(encoding="utf-8").partition(
        "## Stability margins"
    )
    if not heading:
        raise ValueError(f"{TUTORIAL.name} has no section on margins")
    variables: dict[str, Any] = {}
    with contextlib.redirect_stdout(io.StringIO()):
        for code in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
            exec(compile(code, str(TUTORIAL), "exec"), variables)  # noqa: S102
    builder = ab.DiagramBuilder("three runs")
    sources = {"reference": builder.add("source 0", Step(time=0.2, final=0.5))}
    for number, (label, run) in enumerate(RUNS.items(), start=1):
        result: ab.SimulationResult = variables[run]
        table = FromTable(times=result.time, values=result["joint/q"].ravel())
        sources[label] = builder.add(f"source {number}", table)
    for label, source in sources.items():
        builder.name_signal(source, label)
    builder.add("angles", Scope(inputs=len(sources)), *sources.values())
    chart = ab.simulate(builder.build(), stop_time=3.0)
    return "".join(
        figure_html(figure)
        for figure in view_figures(builder.build(), chart, FIGURE_WIDTH)
    )
