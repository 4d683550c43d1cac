"""Writes all figures of a linear system to a folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from os import PathLike
from pathlib import Path

from armblocks.analysis.linear_system import LinearSystem
from armblocks.files import write_atomically
from armblocks.pictures.picture import Picture
from armblocks.pictures.png import picture_png
from armblocks.pictures.svg import svg_file
from armblocks.report.charts.frequency_charts import bode_picture, nyquist_picture
from armblocks.report.charts.response_charts import impulse_picture, step_picture
from armblocks.report.charts.root_charts import pole_zero_picture, root_locus_picture
from armblocks.report.writing import check_figure_formats, make_folder, usable_figure_formats


def linear_figures(
    system: LinearSystem, *, loop: bool = False, hertz: bool = False
) -> dict[str, Callable[[], Picture]]:
    """The figures of a system, by file name.

    ``loop``: the system is the open loop of ``1 + L``, for which margins, Nyquist diagram and root locus are
    defined.
    """
    if not system.inputs or not system.outputs:
        return {"poles-and-zeros": lambda: pole_zero_picture(system)} if system.order else {}
    figures: dict[str, Callable[[], Picture]] = {
        "bode": lambda: bode_picture(system, margins=loop and system.is_siso, hertz=hertz),
        "step": lambda: step_picture(system),
        "impulse": lambda: impulse_picture(system),
    }
    if system.order:
        figures["poles-and-zeros"] = lambda: pole_zero_picture(system)
    if loop and system.is_siso:
        figures["nyquist"] = lambda: nyquist_picture(system)
        if system.order:
            figures["root-locus"] = lambda: root_locus_picture(system)
    return figures


def write_linear_report(
    folder: str | PathLike[str],
    system: LinearSystem,
    *,
    loop: bool = False,
    hertz: bool = False,
    formats: Sequence[str] | None = None,
) -> tuple[Path, ...]:
    """Write each figure, and ``linear-system.json``, into a folder, created if absent; returns the paths.

    The default format is svg, also png if matplotlib is installed. Raises ``UnknownNameError`` for a format
    that is not svg or png, ``MissingLibraryError`` for png without matplotlib, ``FormatError`` if the folder
    cannot be written.
    """
    formats = usable_figure_formats() if formats is None else formats
    check_figure_formats(formats, where="write_linear_report")
    target = Path(folder)
    make_folder(target)
    written_paths: list[Path] = []
    for name, draw in linear_figures(system, loop=loop, hertz=hertz).items():
        picture = draw()
        for kind in formats:
            path = target / f"{name}.{kind}"
            data = svg_file(picture).encode() if kind == "svg" else picture_png(picture)
            write_atomically(path, data)
            written_paths.append(path)
    system.save(target / "linear-system.json")
    return (*written_paths, target / "linear-system.json")
