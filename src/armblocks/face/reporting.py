"""Reports from Python: the same folder as ``armblocks run`` writes."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import TYPE_CHECKING

from armblocks.diagram import Diagram
from armblocks.simulation import SimulationResult

if TYPE_CHECKING:
    from armblocks.report import ReportFiles


def write_report(
    folder: str | PathLike[str],
    diagram: Diagram,
    result: SimulationResult,
    *,
    formats: Sequence[str] = ("svg", "png"),
    data: Sequence[str] = ("csv", "parquet"),
) -> ReportFiles:
    """Write ``report.html``, the diagram, figures and data of a run into a folder, made if absent.

    ``formats`` of the figures: svg, png. ``data``: csv, parquet, npz, mat. Returns the paths. Raises
    UnknownNameError for another format, FormatError where the folder cannot be written.
    """
    from armblocks import report

    return report.write_report(folder, diagram, result, formats=formats, data=data)
