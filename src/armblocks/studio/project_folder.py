"""The folder that a studio works in: the only files that it reads or writes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from armblocks.errors import FormatError, UnknownNameError
from armblocks.files import read_bounded, write_atomically

READABLE = (".json", ".m")
"""Suffixes of files that can be opened: diagrams, robots and scripts."""
WRITABLE = (".json",)
MOST_BYTES = 16 * 2**20
MOST_FILES = 2000
"""Files that the list of a folder shows."""
_HIDDEN = ("node_modules", "__pycache__")


@dataclass(frozen=True)
class FileState:
    """What tells one form of a file from another without reading it: time of change (ns) and size (bytes)."""

    modified: int
    size: int


class ProjectFolder:
    """Files below one folder, by paths relative to it. Every path is resolved, links included, before use.

    Raises ``FormatError`` for a path that leads out of the folder or has a suffix that the studio does not
    touch.
    """

    def __init__(self, root: str | Path) -> None:
        self.root = Path(root).resolve()
        if not self.root.is_dir():
            raise FormatError("there is no such folder", where=str(root), fix="give a folder that exists")

    def path(self, relative: str, suffixes: tuple[str, ...] = READABLE) -> Path:
        """The file that ``relative`` means."""
        allowed = f"a file of the project folder that ends in {' or '.join(suffixes)}"
        # A share or a drive of Windows is refused before the disk is touched: asking for it would already
        # send the user's credentials (CVE-2024-35178).
        strange = "\0" in relative or "\\" in relative or ":" in relative or relative.startswith("/")
        if not relative or strange or len(relative) > 1000:
            raise FormatError(f"{relative[:80]!r} is no path of the project", allowed=allowed)
        found = (self.root / relative).resolve()
        if not found.is_relative_to(self.root) or found == self.root:
            raise FormatError(f"'{relative[:80]}' lies outside of the project folder", allowed=allowed)
        if found.suffix.lower() not in suffixes:
            raise FormatError(f"the studio does not open '{relative[:80]}'", allowed=allowed)
        return found

    def read(self, relative: str) -> bytes:
        """The content of a file."""
        return read_bounded(self.path(relative), MOST_BYTES)

    def write(self, relative: str, data: bytes) -> None:
        """Replace a file, all or nothing; folders on the way are made."""
        path = self.path(relative, WRITABLE)
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, data)

    def state(self, relative: str) -> FileState | None:
        """How the file stands on the disk now; ``None`` if it is not there."""
        try:
            found = self.path(relative).stat()
        except FileNotFoundError:
            return None
        return FileState(found.st_mtime_ns, found.st_size)

    def files(self) -> list[str]:
        """The files that can be opened, by path, hidden folders left out; at most :data:`MOST_FILES`."""
        return sorted(_first(self._walk(), MOST_FILES))

    def _walk(self) -> Iterator[str]:
        for folder, folders, names in os.walk(self.root):
            folders[:] = sorted(f for f in folders if not f.startswith(".") and f not in _HIDDEN)
            for name in sorted(names):
                if name.startswith(".") or Path(name).suffix.lower() not in READABLE:
                    continue
                yield (Path(folder) / name).relative_to(self.root).as_posix()

    def robot_path(self, name: str, shipped: tuple[str, ...]) -> str:
        """What ``load_robot`` is to be given for a robot that a page names; raises for other files."""
        if name in shipped:
            return name
        if Path(name).suffix.lower() not in READABLE:
            raise UnknownNameError("robot", name, shipped)
        return str(self.path(name))


def _first(names: Iterator[str], most: int) -> list[str]:
    return [name for name, _ in zip(names, range(most))]
