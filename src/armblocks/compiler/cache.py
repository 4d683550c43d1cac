"""Disk cache of compilation results.

There is one file for each result. Its name is the SHA-256 of everything that the result depends on, so the
content of a file never changes. A file has a checksum: damaged or truncated files count as absent. Files are
written under a temporary name and renamed, so concurrent processes see complete files only. If the folder
cannot be read or written, everything is compiled again without an error.

The folder is ``$ARMBLOCKS_CACHE_DIR`` (empty: no cache), else the system's cache folder.
"""

from __future__ import annotations

import contextlib
import os
import threading
import time
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

from armblocks.user_folders import cache_folder

_MAGIC = b"armblocks cache 1\n"
_SIZE_LIMIT = 256 * 1024 * 1024
_DAY = 86400.0
_PRUNE_EVERY = 600.0
"""Minimum time between two scans of all files, s. There may be tens of thousands of files."""
_SUFFIX = ".bin"


def folder() -> Path | None:
    """The cache folder; None if the cache is disabled or there is no folder for it."""
    folder_name = os.environ.get("ARMBLOCKS_CACHE_DIR")
    if folder_name is not None:
        return Path(folder_name) if folder_name else None
    return cache_folder()


def object_name(parts: Sequence[str]) -> str:
    """File name of machine code, from ``parts`` and the sources of the compiler."""
    return _digest(("object", compiler_fingerprint(), *parts))


def record_name(key: str) -> str:
    """File name of a result with a caller's key, from the key and the sources of the whole package."""
    return _digest(("record", package_fingerprint(), key))


def _digest(parts: Sequence[str]) -> str:
    return _sha256(b"".join(len(data).to_bytes(8, "little") + data for data in map(str.encode, parts))).hex()


def _sha256(data: bytes) -> bytes:
    import hashlib  # imported here because it loads OpenSSL, which is slow

    return hashlib.sha256(data).digest()


@cache
def compiler_fingerprint() -> str:
    """A digest of the source files that determine the machine code."""
    package = Path(__file__).parent.parent
    return _fingerprint(
        *(package / name for name in ("compiler", "routines", "integration", "inverse_kinematics"))
    )


@cache
def package_fingerprint() -> str:
    """A digest of all source files of the package."""
    return _fingerprint(Path(__file__).parent.parent)


def _fingerprint(*roots: Path) -> str:
    """Names, sizes and times of all Python files below the folders ``roots``."""
    entries: list[str] = []
    with contextlib.suppress(OSError):
        for root in roots:
            for entry in _python_files(root):
                status = entry.stat()
                entries.append(f"{entry.path} {status.st_size} {status.st_mtime_ns}")
    return _sha256("\n".join(sorted(entries)).encode()).hex()


def _python_files(root: Path | str) -> Iterator[os.DirEntry[str]]:
    with os.scandir(root) as entries:
        for entry in entries:
            if entry.is_dir(follow_symlinks=False):
                yield from _python_files(entry.path)
            elif entry.name.endswith(".py"):
                yield entry


def load(name: str) -> bytes | None:
    """The content stored under ``name``, None if it is absent or damaged."""
    root = folder()
    if root is None:
        return None
    path = _path(root, name)
    try:
        data = path.read_bytes()
    except OSError:
        return None
    start = len(_MAGIC) + 32
    content = data[start:]
    if not data.startswith(_MAGIC) or data[len(_MAGIC) : start] != _sha256(content):
        return None
    with contextlib.suppress(OSError):  # mark as used, so that it is pruned last
        if time.time() - path.stat().st_mtime > _DAY:
            os.utime(path)
    return content


def store(name: str, content: bytes) -> None:
    """Store ``content`` under ``name``. Write errors are ignored."""
    root = folder()
    if root is None:
        return
    path = _path(root, name)
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        writer = f"{os.getpid()}-{threading.get_ident()}-{time.monotonic_ns()}"
        temporary = path.with_name(f"{name[:16]}-{writer}.tmp")
        try:
            with temporary.open("xb") as file:
                file.write(_MAGIC + _sha256(content) + content)
            temporary.replace(path)
        except OSError:
            temporary.unlink(missing_ok=True)
            raise
        _prune_occasionally(root)


def _path(root: Path, name: str) -> Path:
    return root / name[:2] / f"{name}{_SUFFIX}"


def _prune_occasionally(root: Path) -> None:
    """Prune unless a process has done so recently; a file stores the time."""
    last = root / "pruned"
    with contextlib.suppress(OSError):
        if 0.0 <= time.time() - last.stat().st_mtime < _PRUNE_EVERY:
            return
    last.touch()
    prune(root)


def prune(root: Path, limit: int = _SIZE_LIMIT) -> None:
    """If the files exceed ``limit`` bytes, remove those used least recently until three quarters are left.

    Temporary files of killed writers are removed after a day.
    """
    cached_files: list[tuple[float, int, str]] = []
    for subfolder in root.glob("??"):
        with contextlib.suppress(OSError), os.scandir(subfolder) as files:
            for file in files:
                with contextlib.suppress(FileNotFoundError):  # another process prunes, too
                    status = file.stat()
                    if file.name.endswith(".tmp") and time.time() - status.st_mtime > _DAY:
                        Path(file).unlink()
                    elif file.name.endswith(_SUFFIX):
                        cached_files.append((status.st_mtime, status.st_size, file.path))
    total = sum(size for _, size, _ in cached_files)
    if total <= limit:
        return
    for _, size, path in sorted(cached_files):
        if total <= limit * 3 // 4:
            break
        with contextlib.suppress(OSError):
            Path(path).unlink()
            total -= size
