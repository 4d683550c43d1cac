"""The project folder: the only files that a studio reads or writes."""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from time import time
from typing import Any, Literal

from armblocks.errors import FormatError, UnknownNameError
from armblocks.files import read_bounded, write_atomically
from armblocks.formats.robot_formats import ROBOT_SUFFIXES
from armblocks.formats.shipped import shipped_folder

READABLE = ROBOT_SUFFIXES
"""Suffixes of files that can be opened: diagrams, robots and scripts."""
WRITABLE = (".json",)
MOST_BYTES = 16 * 2**20
MOST_FILES = 2000
"""Files that the list of a folder shows."""
STRAY_SECONDS = 60.0
"""A file half written that is older than this was left by a program that was killed."""
_HIDDEN = ("node_modules", "__pycache__")
_STRAY = re.compile(r"\..*\.[0-9a-f]{12}\.(tmp|part)")
_STRANGE = re.compile(r'[\x00-\x1f\x7f<>:"|?*\\]')
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)
LONGEST_NAME = 120

Disk = Literal["same", "changed", "gone"]
"""How a file stands, compared with what is known of it."""


@dataclass(frozen=True)
class Fingerprint:
    """What tells one form of a file from another.

    Time of change (ns), size (bytes) and number are asked of the disk often; the content's SHA-256 decides
    where they differ, so that a file that was only touched or written again as it was is the same.
    """

    modified: int
    size: int
    number: int
    digest: str

    @classmethod
    def of(cls, status: os.stat_result, data: bytes) -> Fingerprint:
        """The fingerprint of a file with this content."""
        digest = hashlib.sha256(data).hexdigest()
        return cls(status.st_mtime_ns, status.st_size, status.st_ino, digest)

    def matches(self, status: os.stat_result) -> bool:
        """Whether the disk says nothing that is other than it was."""
        return (self.modified, self.size, self.number) == (status.st_mtime_ns, status.st_size, status.st_ino)

    def said(self) -> dict[str, Any]:
        """As the arguments that make it again."""
        return asdict(self)


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
            raise FormatError(
                f"{relative[:80]!r} is no path of the project",
                allowed=allowed,
                where="project folder",
                fix="choose a file of the project",
            )
        found = (self.root / relative).resolve()
        if not found.is_relative_to(self.root) or found == self.root:
            raise FormatError(
                f"'{relative[:80]}' lies outside of the project folder",
                allowed=allowed,
                where="project folder",
                fix="copy the file into the project",
            )
        if found.suffix.lower() not in suffixes:
            raise FormatError(
                f"the studio does not open '{relative[:80]}'",
                allowed=allowed,
                where="project folder",
                fix="choose a file of another kind",
            )
        return found

    def read(self, relative: str) -> bytes:
        """The content of a file."""
        return read_bounded(self.path(relative), MOST_BYTES)

    def read_known(self, relative: str) -> tuple[bytes, Fingerprint]:
        """The content of a file, and by what it is told from what may stand there later."""
        path = self.path(relative)
        # Asked before the reading: who writes in between is noticed once too often rather than never.
        status = path.stat() if path.is_file() else None
        data = read_bounded(path, MOST_BYTES)
        return data, Fingerprint.of(status or path.stat(), data)

    def read_library(self, path: Path) -> bytes:
        """The library that a diagram is linked to, by its resolved path: a shipped one, or of the project."""
        if path.parent != shipped_folder("libraries").resolve() and not path.is_relative_to(self.root):
            raise FormatError(
                f"the library '{path.name}' lies outside of the project folder",
                allowed="shipped libraries, and files of the project folder",
                fix="copy the library into the project",
                where="project folder",
            )
        return read_bounded(path, MOST_BYTES)

    def write(self, relative: str, data: bytes) -> Fingerprint:
        """Replace a file, all or nothing; folders on the way are made."""
        path = self.path(relative, WRITABLE)
        check_file_name(relative)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FormatError(
                f"the folder '{path.parent}' cannot be made ({error.strerror})",
                where=relative,
                fix="choose another folder",
            ) from error
        return Fingerprint.of(write_atomically(path, data), data)

    def exists(self, relative: str) -> bool:
        """Whether there is such a file."""
        return self.path(relative).exists()

    def compared(self, relative: str, known: Fingerprint | None) -> tuple[Disk, Fingerprint | None]:
        """How a file stands now, and its fingerprint where it is the known one or has the same content."""
        path = self.path(relative)
        try:
            status = path.stat()
            if known is not None and known.matches(status):
                return "same", known
            now = Fingerprint.of(status, read_bounded(path, MOST_BYTES))
        except FileNotFoundError:
            return "gone", known
        except (OSError, FormatError):
            return "changed", known
        return ("same", now) if known is not None and known.digest == now.digest else ("changed", known)

    def sweep(self, used: Iterable[str]) -> None:
        """Remove what a studio that was killed during a save left half written beside these files."""
        folders = {self.root, *((self.root / name).resolve().parent for name in used)}
        for folder in folders:
            if not (folder.is_relative_to(self.root) and folder.is_dir()):
                continue
            for path in folder.iterdir():
                with contextlib.suppress(OSError):
                    if _STRAY.fullmatch(path.name) and time() - path.stat().st_mtime > STRAY_SECONDS:
                        path.unlink()

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


def check_file_name(relative: str) -> None:
    """Raise ``FormatError`` for a path that some system could not store or would not show."""
    for part in relative.split("/"):
        if not part or part != part.strip() or part.startswith(".") or part.endswith("."):
            reason = "is empty, or begins with a dot or space, or ends with one"
        elif _STRANGE.search(part):
            reason = "holds a character that not every system stores"
        elif _DEVICES.fullmatch(part):
            reason = "is the name of a device"
        elif len(part) > LONGEST_NAME:
            reason = f"has {len(part)} characters"
        else:
            continue
        raise FormatError(
            f"'{part[:80]}' cannot be a file's name: it {reason}",
            allowed=f"letters, digits, spaces, - and _, at most {LONGEST_NAME} characters",
            fix="choose another name",
            where="project folder",
        )
