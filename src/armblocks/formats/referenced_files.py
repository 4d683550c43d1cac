"""Files that a robot file refers to: relative paths, ``package://``, ``model://`` and ``file://``.

No file outside the root of the context is read, and nothing is fetched from a network.
"""

from __future__ import annotations

import re
from pathlib import Path

from armblocks.errors import ArmblocksError
from armblocks.files import read_bounded
from armblocks.formats.file_findings import FileContext

MAX_LEVELS = 12
"""Number of folders above the file that are searched for a package."""
_MANIFEST_BYTES = 100_000


def package_folder(name: str, context: FileContext, start: Path | None = None) -> Path | None:
    """The folder of a ROS package: given by the context, or found above ``start`` (the file's folder).

    The folder has the name of the package, or contains a ``package.xml`` with this name.
    """
    if name in context.packages:
        return Path(context.packages[name])
    start = start or context.folder
    if start is None or not re.fullmatch(r"[\w.-]+", name) or name in (".", ".."):
        return None
    for folder in [start, *start.parents][:MAX_LEVELS]:
        if folder.name == name or _manifest_names(folder / "package.xml", name):
            return folder
        if (folder / name).is_dir():
            return folder / name
        if folder == context.root:
            return None
    return None


def _manifest_names(manifest: Path, name: str) -> bool:
    if not manifest.is_file():
        return False
    try:
        text = read_bounded(manifest, _MANIFEST_BYTES).decode("utf-8", "replace")
    except ArmblocksError:
        return False
    return re.search(rf"<name>\s*{re.escape(name)}\s*</name>", text) is not None


def resolved(reference: str, context: FileContext, start: Path | None = None) -> Path | str:
    """The file of a reference, or the reason why there is none.

    A backslash, which files from Windows contain, is read as a slash if there is no file with its name.
    """
    path = _resolved(reference, context, start)
    if isinstance(path, str) and "\\" in reference:
        other = _resolved(reference.replace("\\", "/"), context, start)
        return other if isinstance(other, Path) else path
    return path


def _resolved(reference: str, context: FileContext, start: Path | None) -> Path | str:
    scheme, separator, rest = reference.partition("://")
    start = start or context.folder
    if separator and scheme in ("package", "model"):
        package, _, inside = rest.partition("/")
        folder = package_folder(package, context, start)
        if folder is None:
            return f"the package '{package[:40]}' is not found"
        path = folder / inside
    elif separator and scheme != "file":
        return f"files with '{scheme[:20]}://' are not read"
    elif start is None:
        return "the folder of the robot file is unknown"
    else:
        path = start / (rest if separator else reference)
    return _checked(path, context)


def _checked(path: Path, context: FileContext) -> Path | str:
    try:
        real = path.resolve()
        if context.root is not None and not real.is_relative_to(context.root.resolve()):
            return "the file is outside of the project folder"
        return real if real.is_file() else "there is no such file"
    except (OSError, ValueError, RuntimeError):  # NUL characters, too long names, loops of links
        return "the path is not valid"
