"""The project folder; the studio reads and writes no files outside it."""

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
MAX_BYTES = 16 * 2**20
MAX_FILES = 2000
"""Number of files in the list of a folder."""
STRAY_SECONDS = 60.0
"""Age after which a partly written file is considered abandoned by a killed process, s."""
_HIDDEN = ("node_modules", "__pycache__")
_STRAY = re.compile(r"\..*\.[0-9a-f]{12}\.(tmp|part)")
_FORBIDDEN = re.compile(r'[\x00-\x1f\x7f<>:"|?*\\]')
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)
MAX_NAME_LENGTH = 120

DiskState = Literal["same", "changed", "gone"]
"""State of a file on disk, compared with its known fingerprint."""


@dataclass(frozen=True)
class Fingerprint:
    """Identifies the content of a file.

    Modification time (ns), size (bytes) and inode are compared first, because they are cheap to read. If they
    differ, the SHA-256 of the content decides; a file that was rewritten with the same content is unchanged.
    """

    modified: int
    size: int
    number: int
    digest: str

    @classmethod
    def of(cls, status: os.stat_result, data: bytes) -> Fingerprint:
        """Return the fingerprint of a file with this status and content."""
        digest = hashlib.sha256(data).hexdigest()
        return cls(status.st_mtime_ns, status.st_size, status.st_ino, digest)

    def matches(self, status: os.stat_result) -> bool:
        """Whether modification time, size and inode are unchanged."""
        return (self.modified, self.size, self.number) == (status.st_mtime_ns, status.st_size, status.st_ino)

    def as_dict(self) -> dict[str, Any]:
        """The constructor arguments as a dictionary, for the journal."""
        return asdict(self)


class ProjectFolder:
    """Files below one folder, by relative path. Every path is resolved, symbolic links included, before use.

    Raises ``FormatError`` for a path outside the folder and for a suffix that the studio does not open.
    """

    def __init__(self, root: str | Path) -> None:
        self.root = Path(root).resolve()
        if not self.root.is_dir():
            raise FormatError("there is no such folder", where=str(root), fix="give a folder that exists")

    def path(self, relative: str, suffixes: tuple[str, ...] = READABLE, folder: Path | None = None) -> Path:
        """Return the resolved path of ``relative``, a path from the project or from ``folder`` in it."""
        allowed = f"a file of the project folder that ends in {' or '.join(suffixes)}"
        # A Windows share or drive is refused before the file system is accessed: the access alone would send
        # the user's credentials to the share (CVE-2024-35178).
        rooted = relative.startswith("/") and folder is None
        is_forbidden = "\0" in relative or "\\" in relative or ":" in relative or rooted
        if not relative or is_forbidden or len(relative) > 1000:
            raise FormatError(
                f"{relative[:80]!r} is not a path of the project",
                allowed=allowed,
                where="project folder",
                fix="choose a file of the project",
            )
        resolved = ((folder or self.root) / relative).resolve()
        if not resolved.is_relative_to(self.root) or resolved == self.root:
            raise FormatError(
                f"'{relative[:80]}' is outside of the project folder",
                allowed=allowed,
                where="project folder",
                fix="copy the file into the project",
            )
        if resolved.suffix.lower() not in suffixes:
            raise FormatError(
                f"the studio does not open '{relative[:80]}'",
                allowed=allowed,
                where="project folder",
                fix="choose a file of another kind",
            )
        return resolved

    def read(self, relative: str) -> bytes:
        """Return the content of a file."""
        return read_bounded(self.path(relative), MAX_BYTES)

    def read_known(self, relative: str) -> tuple[bytes, Fingerprint]:
        """Return the content of a file and its fingerprint."""
        path = self.path(relative)
        # The status is read before the content: a concurrent write is then reported twice rather than missed.
        status = path.stat() if path.is_file() else None
        data = read_bounded(path, MAX_BYTES)
        return data, Fingerprint.of(status or path.stat(), data)

    def read_library(self, path: Path) -> bytes:
        """Read a linked library by its resolved path: a shipped one, or a file of the project."""
        if path.parent != shipped_folder("libraries").resolve() and not path.is_relative_to(self.root):
            raise FormatError(
                f"the library '{path.name}' is outside of the project folder",
                allowed="shipped libraries, and files of the project folder",
                fix="copy the library into the project",
                where="project folder",
            )
        return read_bounded(path, MAX_BYTES)

    def write(self, relative: str, data: bytes) -> Fingerprint:
        """Replace a file atomically and return its fingerprint; missing folders are created."""
        path = self.path(relative, WRITABLE)
        check_file_name(relative)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FormatError(
                f"the folder '{path.parent}' cannot be created ({error.strerror})",
                where=relative,
                fix="choose another folder",
            ) from error
        return Fingerprint.of(write_atomically(path, data), data)

    def write_data(self, relative: str, data: bytes, suffixes: tuple[str, ...]) -> None:
        """Write a data file at the top of the folder, atomically."""
        path = self.path(relative, suffixes)
        check_file_name(relative)
        write_atomically(path, data)

    def exists(self, relative: str) -> bool:
        """Whether the file exists."""
        return self.path(relative).exists()

    def compared(self, relative: str, known: Fingerprint | None) -> tuple[DiskState, Fingerprint | None]:
        """Return the state of a file, and its present fingerprint if unchanged in content, else ``known``."""
        path = self.path(relative)
        try:
            status = path.stat()
            if known is not None and known.matches(status):
                return "same", known
            current = Fingerprint.of(status, read_bounded(path, MAX_BYTES))
        except FileNotFoundError:
            return "gone", known
        except (OSError, FormatError):
            return "changed", known
        return (
            ("same", current) if known is not None and known.digest == current.digest else ("changed", known)
        )

    def remove_stray_files(self, used: Iterable[str]) -> None:
        """Remove partly written temporary files beside these files, left by a studio killed during a save."""
        folders = {self.root, *((self.root / name).resolve().parent for name in used)}
        for folder in folders:
            if not (folder.is_relative_to(self.root) and folder.is_dir()):
                continue
            for path in folder.iterdir():
                with contextlib.suppress(OSError):
                    if _STRAY.fullmatch(path.name) and time() - path.stat().st_mtime > STRAY_SECONDS:
                        path.unlink()

    def files(self, suffixes: tuple[str, ...] = READABLE) -> list[str]:
        """Paths of the files with these suffixes, without hidden folders; at most :data:`MAX_FILES`."""
        return sorted(_first(self._walk(suffixes), MAX_FILES))

    def _walk(self, suffixes: tuple[str, ...]) -> Iterator[str]:
        for folder, folders, names in os.walk(self.root):
            folders[:] = sorted(f for f in folders if not f.startswith(".") and f not in _HIDDEN)
            for name in sorted(names):
                if name.startswith(".") or Path(name).suffix.lower() not in suffixes:
                    continue
                yield (Path(folder) / name).relative_to(self.root).as_posix()

    def robot_path(self, name: str, shipped: tuple[str, ...]) -> str:
        """Return the argument of ``load_robot`` for a robot named by a client; raise an error for other
        files."""
        if name in shipped:
            return name
        if Path(name).suffix.lower() not in READABLE:
            raise UnknownNameError("robot", name, shipped)
        return str(self.path(name))


def _first(names: Iterator[str], limit: int) -> list[str]:
    return [name for name, _ in zip(names, range(limit))]


def check_file_name(relative: str) -> None:
    """Raise ``FormatError`` for a path that some operating system cannot store or does not display."""
    for part in relative.split("/"):
        if not part or part != part.strip() or part.startswith(".") or part.endswith("."):
            reason = "is empty, or begins or ends with a dot or space"
        elif _FORBIDDEN.search(part):
            reason = "contains a character that some systems cannot store"
        elif _DEVICES.fullmatch(part):
            reason = "is a reserved device name"
        elif len(part) > MAX_NAME_LENGTH:
            reason = f"has {len(part)} characters"
        else:
            continue
        raise FormatError(
            f"'{part[:80]}' cannot be a file name: it {reason}",
            allowed=f"letters, digits, spaces, - and _, at most {MAX_NAME_LENGTH} characters",
            fix="choose another name",
            where="project folder",
        )
