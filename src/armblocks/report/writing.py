"""The report folder: page, figures, data."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from pathlib import Path

from armblocks.diagram import Diagram
from armblocks.drawing.diagram_drawing import diagram_picture, sheets
from armblocks.errors import FormatError, MissingLibraryError, UnknownNameError
from armblocks.extras import installed
from armblocks.files import write_atomically
from armblocks.pictures.svg import svg_file
from armblocks.report.figures import Figure, file_name, motion_figures, view_figures
from armblocks.report.motion import Motion, motions
from armblocks.report.motion_summary import MotionSummary, summarise
from armblocks.report.page import ReportContents, Sheet, report_page
from armblocks.report.sink_files import DATA_FORMATS, REPORT_DATA, sink_files, write_files
from armblocks.simulation.export import check_format
from armblocks.simulation.result import SimulationResult

FIGURE_FORMATS = ("svg", "png")
MAX_SHEETS = 60
"""Maximum number of subsystems that the page draws; ``armblocks diagram --sheet`` draws any subsystem."""


@dataclass(frozen=True, kw_only=True)
class ReportFiles:
    """The paths of the files of a report."""

    folder: Path
    page: Path
    diagram: Path
    figures: tuple[Path, ...]
    data: tuple[Path, ...]


def write_report(
    folder: str | os.PathLike[str],
    diagram: Diagram,
    result: SimulationResult,
    *,
    formats: Sequence[str] | None = None,
    data: Sequence[str] | None = None,
) -> ReportFiles:
    """Write ``report.html``, ``diagram.svg``, ``figures/*``, ``data.*`` and the files of To File blocks.

    The folder is created if absent. Each file is written atomically, the page last.

    - ``formats``: of the figures, svg and png. The default is svg, also png if matplotlib is installed.
    - ``data``: csv, parquet, npz and mat. The default is csv, also parquet if pyarrow is installed.

    Raises UnknownNameError for an unsupported format, MissingLibraryError for a format whose library is not
    installed, DiagramError if two blocks write the same file, and FormatError if the folder cannot be
    written.
    """
    formats = usable_figure_formats() if formats is None else formats
    data = usable_data_formats() if data is None else data
    check_figure_formats(formats, where="write_report")
    for name in data:
        if name not in DATA_FORMATS:
            raise UnknownNameError("data format", name, DATA_FORMATS, where="write_report")
        check_format(Path(f"data.{name}"))
    sink_files(diagram, REPORT_DATA)  # raises errors before anything is written
    target = Path(folder)
    make_folder(target / "figures")
    arm_motions = motions(diagram, result) if result.time.size > 1 else ()
    summaries = tuple(_summary(motion) for motion in arm_motions)
    figures = _figures(diagram, result, arm_motions)
    drawing = diagram_picture(diagram, result)
    diagram_path = target / "diagram.svg"
    data_paths = tuple(target / f"data.{kind}" for kind in data)
    written_paths: list[Path] = []
    with _Writer() as writer:
        for figure in figures:
            for kind in formats:
                path = target / "figures" / f"{figure.name}.{kind}"
                writer.write(path, _encoding(figure, kind))
                written_paths.append(path)
        writer.write(diagram_path, svg_file(drawing).encode)
        for path in data_paths:
            result.save(path)
        data_paths += write_files(target, diagram, result, taken=REPORT_DATA)
    contents = ReportContents(
        diagram=diagram,
        result=result,
        motions=arm_motions,
        summaries=summaries,
        figures=tuple(figures),
        drawing=drawing,
        sheets=_sheets(diagram, result),
        files=tuple(
            path.relative_to(target).as_posix() for path in (diagram_path, *data_paths, *written_paths)
        ),
    )
    page = target / "report.html"
    write_atomically(page, report_page(contents).encode())
    return ReportFiles(
        folder=target, page=page, diagram=diagram_path, figures=tuple(written_paths), data=data_paths
    )


def usable_figure_formats() -> tuple[str, ...]:
    """SVG, and PNG if matplotlib is installed."""
    return FIGURE_FORMATS if installed("matplotlib") else ("svg",)


def usable_data_formats() -> tuple[str, ...]:
    """CSV, and Parquet if pyarrow is installed: the default data formats of a report."""
    return ("csv", "parquet") if installed("pyarrow") else ("csv",)


def check_figure_formats(formats: Sequence[str], *, where: str) -> None:
    """Raise ``UnknownNameError``, or ``MissingLibraryError`` for PNG without matplotlib."""
    for name in formats:
        if name not in FIGURE_FORMATS:
            raise UnknownNameError("figure format", name, FIGURE_FORMATS, where=where)
        if name == "png" and not installed("matplotlib"):
            raise MissingLibraryError("matplotlib", "figures", "PNG figures", where=where)


def _summary(motion: Motion) -> MotionSummary:
    return summarise(motion.robot, motion.time, motion.q, motion.qd, motion.qdd, motion.tau, motion.tool)


def _sheets(diagram: Diagram, result: SimulationResult) -> tuple[Sheet, ...]:
    return tuple(
        Sheet(path=path, same=same, picture=diagram_picture(diagram, result, sheet=path))
        for path, same in islice(sheets(diagram).items(), MAX_SHEETS)
    )


def _figures(diagram: Diagram, result: SimulationResult, arm_motions: Sequence[Motion]) -> list[Figure]:
    if result.time.size < 2:
        return []
    figures: list[Figure] = []
    for number, motion in enumerate(arm_motions):
        prefix = "" if len(arm_motions) == 1 else f"{file_name(motion.robot.name)}-{number + 1}-"
        figures += motion_figures(motion, prefix)
    figures += view_figures(diagram, result)
    counts: dict[str, int] = {}
    named_figures: list[Figure] = []
    for figure in figures:  # different block names may give the same file name
        count = counts[figure.name] = counts.get(figure.name, 0) + 1
        named_figures.append(figure if count == 1 else replace(figure, name=f"{figure.name}-{count}"))
    return named_figures


def _encoding(figure: Figure, kind: str) -> Callable[[], bytes]:
    """A function that returns the bytes of a figure's file. Slow encoders release the interpreter lock."""
    if kind == "svg":
        return svg_file(figure.picture, marks=figure.svg_marks).encode
    from armblocks.pictures.png import picture_pixels
    from armblocks.pictures.png_file import png_bytes

    return partial(png_bytes, picture_pixels(figure.picture))


class _Writer:
    """Encodes and writes files in a separate thread, because compression and file access release the
    interpreter lock.

    After the ``with`` block all files are written. The block raises the error of a file that cannot be
    written.
    """

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="report")
        self._files: list[Future[object]] = []

    def write(self, path: Path, encode: Callable[[], bytes]) -> None:
        """Queue a file for writing; ``encode`` returns its bytes."""
        self._files.append(self._thread.submit(lambda: write_atomically(path, encode())))

    def __enter__(self) -> _Writer:
        return self

    def __exit__(self, *failure: object) -> None:
        self._thread.shutdown(cancel_futures=failure[0] is not None)
        if failure[0] is None:
            for file in self._files:
                file.result()


def make_folder(folder: Path) -> None:
    """Create a folder if absent. Raises ``FormatError`` if this fails."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FormatError(
            f"the report cannot be written ({error.strerror or error})",
            where=str(folder),
            allowed="a folder that you may write to, on a disk with free space",
            fix="give another folder or change its permissions",
        ) from error
