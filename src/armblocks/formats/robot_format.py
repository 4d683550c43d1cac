"""The interface of a robot file format: name, suffixes, reader."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armblocks.formats.file_corrections import Correction
    from armblocks.formats.file_findings import FileContext, FileFinding
    from armblocks.robot import Robot

Read = Callable[[bytes, str], "Mapping[str, Robot]"]
Write = Callable[["Robot"], bytes]
ReadInContext = Callable[[bytes, str, "FileContext"], "Mapping[str, Robot]"]
Correct = Callable[[bytes, str, "Sequence[FileFinding]"], "Correction"]


def _no_reader(data: bytes, name: str) -> Mapping[str, Robot]:
    raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class RobotFormat:
    """One file format of robots.

    - ``suffixes``: in lower case with the dot.
    - ``max_bytes``: the maximum size of a file.
    - ``read``: a function of a file's bytes and its name for messages, which returns the robots by their
      names in the file and raises ``FormatError``.
    - ``read_in_context``: instead of ``read``, for a format whose files refer to other files, or that reports
      findings. The third argument is a :class:`FileContext`.
    - ``correct``: a function of a file's bytes, its name and its findings, which corrects findings with an
      unambiguous remedy.
    - ``recognises``: for a format that shares its suffix with another format, whether a file's bytes are of
      this format.
    """

    name: str
    suffixes: tuple[str, ...]
    max_bytes: int
    read: Read = _no_reader
    read_in_context: ReadInContext | None = None
    write: Write | None = None
    correct: Correct | None = None
    recognises: Callable[[bytes], bool] | None = None

    def robots(self, data: bytes, name: str, context: FileContext) -> Mapping[str, Robot]:
        """The robots of a file's bytes, by their names in the file; findings are added to the context."""
        if self.read_in_context is not None:
            return self.read_in_context(data, name, context)
        return self.read(data, name)
