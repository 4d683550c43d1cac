"""Files that a diagram names: tables of measurements and Python functions.

A diagram file refers to a table by the path of its file, or by an object with the chosen columns::

    "data": "wind.csv"
    "data": {"file": "wind.csv", "time": "t [ms]", "columns": ["v", "direction"]}

Paths are relative to the diagram's folder. A Python function is ``file.py:name``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path

from armblocks.diagram import TimeTable, UserFunction
from armblocks.diagram.function_files import load_function
from armblocks.errors import FormatError
from armblocks.formats.table_files import load_table


@dataclass(frozen=True, kw_only=True)
class TableReference:
    """A file with a table, and the columns that a block uses.

    Without names, :func:`~armblocks.formats.load_table` chooses the columns.
    """

    file: str
    time: str = ""
    columns: tuple[str, ...] = ()


class DataFiles(ABC):
    """Reads the files that diagrams name."""

    @abstractmethod
    def table(self, reference: TableReference, folder: Path | None) -> TimeTable:
        """The table of a file; its path is relative to ``folder``. Raises ``ArmblocksError``."""

    @abstractmethod
    def function(self, reference: str, folder: Path | None) -> UserFunction:
        """The Python function ``file.py:name``. Raises ``ArmblocksError``."""


@dataclass(frozen=True)
class UnrestrictedFiles(DataFiles):
    """Reads tables from any folder. Runs the files of functions only with ``trust``."""

    trust: bool = False

    def table(self, reference: TableReference, folder: Path | None) -> TimeTable:
        """The table of a file."""
        path = Path(reference.file) if folder is None else folder / reference.file
        return load_table(path, time=reference.time, columns=reference.columns)

    def function(self, reference: str, folder: Path | None) -> UserFunction:
        """The function of a file, if code is trusted. **Runs the file.**"""
        if not self.trust:
            raise FormatError(
                f"'{reference}' is Python code, which is run only for a trusted diagram",
                allowed="a diagram without Python functions, or one that is trusted",
                where=f"function '{reference[:80]}'",
                fix="read the code, then use load_diagram(..., trust=True) or --trust",
            )
        return UserFunction(load_function(reference, folder))
