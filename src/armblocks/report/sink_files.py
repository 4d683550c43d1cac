"""The files of To File blocks: written after a run, into a folder that the caller gives."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from armblocks.diagram import Diagram, FileSettings, ViewKind, diagram_views
from armblocks.errors import DiagramError, FormatError
from armblocks.simulation.export import check_format
from armblocks.simulation.result import SimulationResult

DATA_FORMATS = ("csv", "parquet", "npz", "mat")
REPORT_DATA = tuple(f"data.{kind}" for kind in DATA_FORMATS)
"""File names of a report's data, which To File blocks must not use."""


@dataclass(frozen=True, kw_only=True)
class SinkFile:
    """A file of a To File block: its path in the folder, the signal and its name in the file."""

    block: str
    signal: str
    variable: str
    settings: FileSettings


def sink_files(diagram: Diagram, reserved: Sequence[str] = ()) -> tuple[SinkFile, ...]:
    """All files of the diagram's To File blocks; nothing is written.

    Raises ``DiagramError`` if two blocks have the same file, or if a file name is in ``reserved``, and
    ``MissingLibraryError`` if the library of a format is not installed.
    """
    owners = {name.lower(): "the report" for name in reserved}
    files: list[SinkFile] = []
    for block, view in diagram_views(diagram):
        if view.kind is not ViewKind.FILE:
            continue
        settings = view.subject
        assert isinstance(settings, FileSettings)
        other = owners.setdefault(settings.file.lower(), f"'{block}'")  # many file systems ignore case
        if other != f"'{block}'":
            raise DiagramError(
                f"{other} and '{block}' write the same file '{settings.file}'",
                where=f"diagram '{diagram.name}'",
                allowed="a separate file for each To File block",
                fix=f"give '{block}' another file",
            )
        check_format(Path(settings.file))
        files.append(
            SinkFile(block=block, signal=view.signals[0], variable=view.labels[0], settings=settings)
        )
    return tuple(files)


def write_files(
    folder: str | os.PathLike[str], diagram: Diagram, result: SimulationResult, *, taken: Sequence[str] = ()
) -> tuple[Path, ...]:
    """Write the files of the To File blocks of a diagram into ``folder``, each atomically.

    Subfolders are created. Files are written only inside the folder; symbolic links that lead out of it are
    errors. ``taken``: names in the folder that must not be replaced. Returns the paths. Raises
    ``DiagramError`` if two blocks write the same file, and ``FormatError`` if a file cannot be written or its
    path leaves the folder.
    """
    target = Path(folder)
    written_paths: list[Path] = []
    for sink in sink_files(diagram, taken):
        path = target / sink.settings.file
        if not path.resolve().is_relative_to(target.resolve()):
            raise FormatError(
                f"the file '{sink.settings.file}' of '{sink.block}' leads out of the folder through a link",
                where=str(target),
                allowed="files inside of the folder",
                fix="remove the link or choose another folder",
            )
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FormatError(
                f"the folder of '{sink.settings.file}' cannot be created ({error.strerror or error})",
                where=str(target),
                fix="choose another folder or change its permissions",
            ) from error
        count = len(range(0, result.time.size, sink.settings.decimation))
        first = max(0, count - sink.settings.limit) * sink.settings.decimation
        rows = slice(first, None, sink.settings.decimation)
        result.select({sink.variable: f"{sink.block}/{sink.signal}"}, rows).save(
            path, jumps=sink.settings.decimation == 1
        )
        written_paths.append(path)
    return tuple(written_paths)
