"""Libraries of subsystems: files of named, masked diagrams that blocks of other files are linked to.

A library file contains diagrams by name, in the form of inner diagrams of blocks::

    {"format": 1, "library": {"JointServo": {"mask": […], "blocks": {…}, "connections": […]}, …}}

A block of a diagram or of a library refers to an entry and has its parameters::

    "hip": {"type": "Subsystem", "library": "servos.json#JointServo", "parameters": {"kp": 40}}

The file is a path relative to the folder of the file that names it, or a shipped library by its name. It is
loaded when the diagram is read, so that changes of a library affect all files that use it. A loaded entry has
``Diagram.link`` and must not be changed, unless the link is broken (``link=""``).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Protocol

from armblocks.diagram import Diagram
from armblocks.errors import ArmblocksError, FormatError, UnknownNameError
from armblocks.files import read_bounded
from armblocks.formats.json_document import Node, read_document
from armblocks.formats.robot_references import relative_to_folder
from armblocks.formats.shipped import SUFFIX, list_libraries, shipped_folder

MAX_BYTES = 16 * 2**20
MAX_DEPTH = 320
"""Maximum nesting of objects and arrays, as in diagrams."""
MAX_LIBRARY_DEPTH = 40
"""Maximum nesting of library blocks."""

ReadFile = Callable[[Path], bytes]
"""A function that returns the bytes of a library file from its resolved path. It raises ``FormatError`` for a
forbidden path."""


class ReadEntry(Protocol):
    """Builds the diagram of one entry of a library document."""

    def __call__(self, root: Node, entry: Node, name: str, folder: Path, libraries: Libraries) -> Diagram:
        """``folder`` is the folder of the library; ``libraries`` loads the entries that the entry is linked
        to."""
        ...


def read_library_file(path: Path) -> bytes:
    """The bytes of a library file in any folder."""
    return read_bounded(path, MAX_BYTES)


def library_path(reference: str, folder: Path | None) -> Path:
    """The file of a reference without its ``#name``: a shipped library, or a path relative to a folder.

    Raises ``UnknownNameError`` for a name that is not shipped, ``FormatError`` for a file that is not JSON.
    """
    if not is_path(reference):
        library_names = list_libraries()
        if reference not in library_names:
            raise UnknownNameError("shipped library", reference, library_names)
        return shipped_folder("libraries").resolve() / f"{reference}{SUFFIX}"
    if "\0" in reference or not reference.lower().endswith(SUFFIX):
        raise FormatError(
            f"{reference[:80]!r} is not the path of a library",
            allowed=f"the path of a {SUFFIX} file, or one of {', '.join(list_libraries())}",
            where="library",
            fix=f"name a file that ends in {SUFFIX}",
        )
    return (Path(reference) if folder is None else folder / reference).resolve()


def is_path(reference: str) -> bool:
    """Whether a text is a path and not the name of a shipped library."""
    return "/" in reference or "\\" in reference or reference.lower().endswith(SUFFIX)


def shortest_link(link: str, folder: Path | None) -> str:
    """A link in the form for a file in ``folder``: a shipped name, or a path, relative if it is below the
    folder."""
    file, _, entry = link.partition("#")
    return f"{relative_to_folder(file, folder) if is_path(file) else file}#{entry}"


def _link_file(path: Path) -> str:
    """The name of a shipped library, which is the same in every installation, or the path of another
    library."""
    return path.stem if path.parent == shipped_folder("libraries").resolve() else str(path)


class Libraries:
    """Loads entries of libraries for one document, each only once. Errors have file and line."""

    def __init__(
        self,
        folder: Path | None,
        read_entry: ReadEntry,
        read_file: ReadFile = read_library_file,
        *,
        parent: Libraries | None = None,
    ) -> None:
        self._folder = folder
        self._read_entry = read_entry
        self._read_file = read_file
        self._roots: dict[Path, Node] = {} if parent is None else parent._roots
        self._diagrams: dict[tuple[Path, str], Diagram] = {} if parent is None else parent._diagrams
        self._chain: list[tuple[Path, str]] = [] if parent is None else parent._chain

    def linked(self, node: Node) -> Diagram:
        """The diagram of a reference ``"file#name"``."""
        file, separator, name = node.text().partition("#")
        if not (file and separator and name):
            raise node.error(
                f"'{node.text()[:80]}' is not an entry of a library",
                allowed='"file.json#Name", or "shipped#Name"',
                fix="name the file and the entry",
            )
        try:
            path = library_path(file, self._folder)
            return self._entry(path, name)
        except UnknownNameError as error:
            where = f"{node.where}: {error.where}" if error.where else node.where
            raise UnknownNameError(error.kind, error.name, error.known, where=where) from error
        except ArmblocksError as error:
            where = f"{node.where}: {error.where}" if error.where else node.where
            raise FormatError(error.what, where=where, allowed=error.allowed, fix=error.fix) from error

    def entries(self, path: Path) -> Mapping[str, Diagram]:
        """All diagrams of a library."""
        return {name: self._entry(path, name) for name in self._root(path).members()["library"].members()}

    def _entry(self, path: Path, name: str) -> Diagram:
        key = (path, name)
        if key in self._diagrams:
            return self._diagrams[key]
        chain_text = [f"{file.name}#{entry}" for file, entry in (*self._chain, key)]
        if key in self._chain:
            first = self._chain.index(key)
            raise FormatError(
                f"library blocks contain each other in a cycle: {' -> '.join(chain_text[first:])}",
                where=str(path),
                allowed="library blocks that do not contain themselves",
                fix="remove one of these blocks from the other",
            )
        if len(self._chain) >= MAX_LIBRARY_DEPTH:
            raise FormatError(
                f"library blocks are nested more than {MAX_LIBRARY_DEPTH} levels deep: "
                f"{' -> '.join(chain_text[:3])} -> …",
                where=str(path),
                allowed=f"at most {MAX_LIBRARY_DEPTH}",
                fix="reduce the nesting",
            )
        root = self._root(path)
        stored_libraries = root.members()["library"].members()
        if name not in stored_libraries:
            raise UnknownNameError("library block", name, stored_libraries, where=str(path))
        inner = Libraries(path.parent, self._read_entry, self._read_file, parent=self)
        self._chain.append(key)
        try:
            diagram = self._read_entry(root, stored_libraries[name], name, path.parent, inner)
        finally:
            self._chain.pop()
        diagram = replace(diagram, link=f"{_link_file(path)}#{name}")
        self._diagrams[key] = diagram
        return diagram

    def _root(self, path: Path) -> Node:
        """The document of a library file."""
        if path not in self._roots:
            root = read_document(self._read_file(path), str(path), MAX_BYTES, MAX_DEPTH)
            if "library" not in root.members():
                raise root.error(
                    "the key 'library' is missing",
                    allowed="a library of subsystems",
                    fix="give the path of a library, not of a diagram",
                )
            self._roots[path] = root
        return self._roots[path]
