"""Atomic writing of files, and reading of files up to a size limit."""

from __future__ import annotations

import contextlib
import os
import secrets
from pathlib import Path
from typing import BinaryIO

from armblocks.errors import FormatError


def write_atomically(path: str | Path, data: bytes, *, mode: int = 0o666) -> os.stat_result:
    """Replace the file at ``path`` by ``data``, atomically: readers find either the old or the new file.

    Returns the ``stat`` of the new file: a later change of size, time or inode means that another program has
    written the file. ``mode``: the permissions of a new file, less the user's umask.

    The bytes are written to a temporary file in the same folder and flushed (``fsync``). A rename then
    replaces the old file, and the folder entry is flushed too. A symbolic link stays a link: its target is
    replaced. The permissions of an existing file do not change.

    Source: Pillai et al., "All File Systems Are Not Created Equal", OSDI 2014: a rename without both
    ``fsync`` calls is not safe.

    Raises ``FormatError`` where the folder is missing, is not a folder or cannot be written, where ``path``
    is a folder, and where writing fails. The old file is then unchanged.
    """
    target = _writable_target(path)
    folder = target.parent
    temporary = folder / f".{target.name[:64]}.{secrets.token_hex(6)}.tmp"
    try:
        status = _write_and_flush(temporary, data, mode)
        if target.exists():
            temporary.chmod(target.stat().st_mode & 0o7777)
        temporary.replace(target)
        sync_folder(folder)
        return status
    except OSError as error:
        raise _write_error(str(path), error) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


class GrowingFile:
    """A file that is written in parts under a temporary name and renamed when it is complete.

    Before the renaming, an existing file of that name is unchanged. ``stream`` receives the parts; another
    program may write them to ``temporary`` instead. Raises ``FormatError`` as :func:`write_atomically` does.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = str(path)
        self._target = _writable_target(path)
        name = f".{self._target.name[:64]}.{secrets.token_hex(6)}.part"
        self.temporary = self._target.parent / name
        try:
            self.stream: BinaryIO = self.temporary.open("xb")
        except OSError as error:
            raise _write_error(self.path, error) from error

    def finish(self) -> None:
        """Rename the complete file to its final name."""
        try:
            self.stream.flush()
            os.fsync(self.stream.fileno())
            self.stream.close()
            if self._target.exists():
                self.temporary.chmod(self._target.stat().st_mode & 0o7777)
            self.temporary.replace(self._target)
            sync_folder(self._target.parent)
        except OSError as error:
            self.abandon()
            raise _write_error(self.path, error) from error

    def abandon(self) -> None:
        """Delete the temporary file."""
        with contextlib.suppress(OSError):
            self.stream.close()
        with contextlib.suppress(OSError):
            self.temporary.unlink(missing_ok=True)


def read_bounded(path: str | Path, limit: int) -> bytes:
    """The bytes of the file at ``path``, at most ``limit`` of them.

    Raises ``FormatError`` where the file is missing, is a folder, cannot be read or is larger.
    """
    try:
        # Read and count: the size in the folder entry is wrong for devices and growing files.
        with Path(path).open("rb") as stream:
            data = stream.read(limit + 1)
    except FileNotFoundError as error:
        raise FormatError("there is no such file", where=str(path), fix="check the path") from error
    except IsADirectoryError as error:
        raise FormatError("this is a folder", where=str(path), fix="give the path of a file in it") from error
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise FormatError(
            f"the file cannot be read ({reason})", where=str(path), fix="check its permissions"
        ) from error
    if len(data) > limit:
        raise FormatError(
            "the file is too large",
            where=str(path),
            allowed=f"at most {limit} bytes",
            fix="split or shorten it",
        )
    return data


def _write_and_flush(path: Path, data: bytes, mode: int) -> os.stat_result:
    """Create ``path`` with ``mode`` less the user's umask, write the data and flush it to the disk."""
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), mode)
    with os.fdopen(descriptor, "wb") as stream:
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())
        return os.fstat(stream.fileno())


def sync_folder(folder: Path) -> None:
    """Flush a folder's entries to the disk. Windows has no such call and needs none."""
    if os.name == "nt":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _writable_target(path: str | Path) -> Path:
    """The path to write: the target, if ``path`` is a symbolic link."""
    if "\0" in str(path):
        raise FormatError(
            "the path contains a NUL character", where=repr(str(path)), fix="choose another name"
        )
    target = Path(os.path.realpath(path))
    folder = target.parent
    if not folder.is_dir():
        raise FormatError(
            f"the folder '{folder}' does not exist",
            where=str(path),
            fix="create the folder, or choose another",
        )
    if target.is_dir():
        raise FormatError("the path is an existing folder", where=str(path), fix="choose another name")
    return target


def _write_error(path: str, error: OSError) -> FormatError:
    return FormatError(
        f"the file cannot be written ({error.strerror or error})",
        where=path,
        fix="check the folder's permissions and free space; an existing file is unchanged",
    )
