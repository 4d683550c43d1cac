"""Reports and drawings from Python: the same files as from the command line."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from armblocks.diagram import Diagram
from armblocks.errors import check_type
from armblocks.face.model import CompiledDiagram, given_diagram
from armblocks.simulation import SimulationResult

if TYPE_CHECKING:
    from armblocks.report import ReportFiles


def write_report(
    folder: str | PathLike[str],
    diagram: Diagram | CompiledDiagram | str | PathLike[str],
    result: SimulationResult,
    *,
    formats: Sequence[str] | None = None,
    data: Sequence[str] | None = None,
) -> ReportFiles:
    """Write ``report.html``, the diagram, figures and data of a run into a folder, and return the paths.

    The folder is created if absent. The files of To File blocks are written to the same folder.

    - ``formats``: of the figures, svg and png. The default is svg, also png if matplotlib is installed.
    - ``data``: csv, parquet, npz and mat. The default is csv, also parquet if pyarrow is installed.

    Raises UnknownNameError for an unsupported format, MissingLibraryError for a format whose library is not
    installed, DiagramError if two blocks write the same file, FormatError if the folder cannot be written.
    """
    from armblocks import report

    diagram = given_diagram(diagram, "write_report")
    check_type(result, SimulationResult, "the result of simulate", where="write_report")
    return report.write_report(folder, diagram, result, formats=formats, data=data)


def write_files(
    folder: str | PathLike[str],
    diagram: Diagram | CompiledDiagram | str | PathLike[str],
    result: SimulationResult,
) -> tuple[Path, ...]:
    """Write the files of the To File blocks of a run into an existing folder.

    The paths of the blocks are relative to this folder, or to the folder of ``write_report``; paths outside
    of the folder are errors. ``simulate`` writes no files. Returns the paths. Raises DiagramError if two
    blocks write the same file, FormatError if a file cannot be written.
    """
    from armblocks.report.sink_files import write_files

    check_type(result, SimulationResult, "the result of simulate", where="write_files")
    return write_files(folder, given_diagram(diagram, "write_files"), result)


def draw_diagram(
    diagram: Diagram | CompiledDiagram | str | PathLike[str],
    path: str | PathLike[str],
    *,
    sheet: str = "",
    theme: Literal["light", "dark"] | None = None,
    result: SimulationResult | None = None,
    rates: bool = False,
) -> Path:
    """Draw a diagram into a ``.svg``, ``.png`` or ``.pdf`` file; returns the path.

    - ``sheet``: the path of a subsystem, such as ``"controller/filter"``; ``""`` is the top level.
    - ``theme``: ``"light"`` or ``"dark"``. By default SVG follows the viewer's preference, and other formats
      are light.
    - ``result``: a run whose data the scopes and displays show.
    - ``rates``: whether the clocks of sampled blocks are shown.

    Raises UnknownNameError for another suffix or sheet.
    """
    from armblocks import drawing

    diagram = given_diagram(diagram, "draw_diagram")
    return drawing.draw_diagram(path, diagram, result, sheet=sheet, theme=theme, rates=rates)
