"""Tables and Python functions in files of the project folder.

For an unreadable file, the result is a value that contains the error. The studio can then show the diagram,
and the user can correct it.
The server runs no Python code of the user; only worker processes do (``runs_code``).
"""

from __future__ import annotations

import dataclasses
from collections import OrderedDict
from collections.abc import Iterator
from pathlib import Path
from threading import Lock

from armblocks.diagram import Diagram, TimeTable, UserFunction
from armblocks.diagram.comments import active_levels
from armblocks.diagram.function_files import (
    FunctionOutline,
    UnloadedFunction,
    functions_of,
    run_source,
    split_reference,
)
from armblocks.diagram.levels import joined, levels_of
from armblocks.errors import ArmblocksError, FormatError, UnknownNameError, counted
from armblocks.files import read_bounded
from armblocks.formats.data_files import DataFiles, TableReference
from armblocks.formats.table_columns import ColumnFile, table_of
from armblocks.formats.table_files import TABLE_SUFFIXES, is_strict, load_columns
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.documents.trusted_files import TrustedFiles, digest_of

SOURCE_SUFFIXES = (".py",)
MAX_SOURCE_BYTES = 256 * 1024
"""Maximum size of a Python file, bytes."""
MAX_CACHED_FILES = 4
"""Number of files whose columns stay in memory."""


class ProjectData(DataFiles):
    """Reads the tables and functions that the diagrams of a project name."""

    def __init__(self, folder: ProjectFolder, trusted: TrustedFiles, *, runs_code: bool = False) -> None:
        self.folder = folder
        self.trusted = trusted
        self._runs_code = runs_code
        self._read: OrderedDict[tuple[Path, int, int, int], ColumnFile] = OrderedDict()
        self._reading = Lock()

    # -- tables ----------------------------------------------------------------------------------------------

    def columns(self, path: Path) -> ColumnFile:
        """The columns of a file; the latest files are cached until they change. Raises ``ArmblocksError``."""
        with self._reading:
            try:
                status = path.stat()
            except OSError:
                return load_columns(path)  # raises the error
            key = (path, status.st_mtime_ns, status.st_size, status.st_ino)
            if key not in self._read:
                self._read[key] = load_columns(path)
                while len(self._read) > MAX_CACHED_FILES:
                    self._read.popitem(last=False)
            self._read.move_to_end(key)
            return self._read[key]

    def table(self, reference: TableReference, folder: Path | None) -> TimeTable:
        """The table of a file of the project, with its fault if it cannot be read."""
        try:
            path = self.folder.path(reference.file, TABLE_SUFFIXES, folder)
        except ArmblocksError as error:
            return _unreadable(error, reference, reference.file, "")
        shown_path = self.shown(path)
        try:
            strict = is_strict(path)
            table = table_of(self.columns(path), shown_path, reference.time, reference.columns, strict=strict)
        except ArmblocksError as error:
            fault = FormatError(error.what, where=shown_path, allowed=error.allowed, fix=error.fix)
            return _unreadable(fault, reference, str(path), shown_path)
        return dataclasses.replace(table, source=str(path), shown=shown_path)

    # -- functions -------------------------------------------------------------------------------------------

    def source(self, path: Path) -> bytes:
        """The content of a Python file. Raises ``FormatError``."""
        return read_bounded(path, MAX_SOURCE_BYTES)

    def function(self, reference: str, folder: Path | None) -> UserFunction:
        """The function of a file of the project. Raises ``ArmblocksError`` if the file does not define it."""
        path, outline, source = self._outline(reference, folder)
        shown_path = self.shown(path)
        fault = FormatError(
            f"the code of {shown_path} has not been run",
            where=shown_path,
            allowed="functions of trusted files, in a run",
            fix="run the model",
        )
        if self._runs_code and (shown_path, digest_of(source)) not in self.trusted:
            fault = _untrusted(shown_path)
        elif self._runs_code:
            try:
                return UserFunction(run_source(source, path, shown_path, outline.name))
            except FormatError as error:
                fault = error
        name = outline.name
        return UserFunction(
            UnloadedFunction(f"{path}:{name}", f"{shown_path}:{name}", outline.arguments, fault)
        )

    def _outline(self, reference: str, folder: Path | None) -> tuple[Path, FunctionOutline, bytes]:
        file, name = split_reference(reference)
        path = self.folder.path(file, SOURCE_SUFFIXES, folder)
        source = self.source(path)
        functions = functions_of(source, self.shown(path))
        if name not in functions:
            raise UnknownNameError("function", name, functions, where=self.shown(path))
        return path, functions[name], source

    def shown(self, path: Path) -> str:
        """The path of a file from the project folder."""
        return path.relative_to(self.folder.root).as_posix()

    # -- diagrams --------------------------------------------------------------------------------------------

    def faults(self, diagram: Diagram) -> Iterator[tuple[str, ArmblocksError]]:
        """The paths of blocks whose files cannot be used now, and the reasons."""
        for path, value in files_of(diagram):
            fault = (
                self._fault_of_table(value)
                if isinstance(value, TimeTable)
                else self._fault_of_function(value)
            )
            if fault is not None:
                yield path, fault

    def _fault_of_table(self, table: TimeTable) -> ArmblocksError | None:
        if not table.shown:
            return table.fault
        current = self.table(TableReference(file=table.shown, time=table.time, columns=table.columns), None)
        if current.fault is None and current.shape[1] != table.shape[1]:
            return FormatError(
                f"{table.shown} has changed: it has {counted(current.shape[1] - 1, 'column')} of values "
                "instead of "
                f"{table.shape[1] - 1}",
                where=table.shown,
                fix="open the block and choose its columns again",
            )
        return current.fault

    def _fault_of_function(self, function: UserFunction) -> ArmblocksError | None:
        value = function.function
        if not isinstance(value, UnloadedFunction):
            return None
        try:
            path, outline, source = self._outline(value.shown, None)
        except ArmblocksError as error:
            return error
        shown_path = self.shown(path)
        if outline.arguments != value.arguments:
            return FormatError(
                f"{shown_path} has changed: the arguments of {outline.name} are different",
                where=shown_path,
                fix="open the block and load the function again",
            )
        return None if (shown_path, digest_of(source)) in self.trusted else _untrusted(shown_path)


def files_of(diagram: Diagram) -> Iterator[tuple[str, TimeTable | UserFunction]]:
    """The tables and functions of files in a hierarchy, with the paths of their blocks.

    Commented blocks are omitted, because a run does not need them.
    """
    for level, sheet in active_levels(levels_of(diagram)).items():
        for name, block in sheet.blocks.items():
            if name in sheet.commented:
                continue
            for rule in block.own_parameters():
                value = block.parameter_value(rule.name)
                if not isinstance(value, TimeTable | UserFunction):
                    continue
                in_file = (
                    value.source or value.fault if isinstance(value, TimeTable) else unloaded_fault(value)
                )
                if in_file:
                    yield joined(level, name), value


def unloaded_fault(function: UserFunction) -> ArmblocksError | None:
    """Return the reason why the code of a function has not been run, or ``None``."""
    return function.function.fault if isinstance(function.function, UnloadedFunction) else None


def has_functions(diagram: Diagram) -> bool:
    """Whether a block names a function of a file."""
    return any(isinstance(value, UserFunction) for _, value in files_of(diagram))


def _unreadable(fault: ArmblocksError, reference: TableReference, source: str, shown_path: str) -> TimeTable:
    table = TimeTable.unread(fault, source, time=reference.time, columns=reference.columns)
    return dataclasses.replace(table, shown=shown_path)


def _untrusted(shown_path: str) -> FormatError:
    return FormatError(
        f"the code of {shown_path} is not trusted in its present form",
        where=shown_path,
        allowed="Python code that you have read and trusted",
        fix="open the block, read the code, and trust it",
    )
