"""Diagrams as canonical JSON: small differences in a diagram are small differences in its file.

Blocks are keyed by name and sorted. Connections are sorted strings (``"jtraj/q -> fkine/q"``). The layout is
separate from the content. No derived values, ids or times are written. A changed parameter is one line, a
moved block is one line of the layout, and additions of different blocks do not conflict in version control.
The layout also has user-drawn routes, under the text of the connection, and notes, under names that begin
with ``/``, which block names cannot::

    {
      "blocks": {"sine": {"parameters": {"frequency": 2, …}, "type": "SineWave"}, …},
      "connections": ["sine/y -> scope/u1"],
      "format": 1,
      "layout": {"/1": {"text": "…", "x": 40, "y": 0}, "sine": {"x": 40, "y": 40},
                 "sine/y -> scope/u1": {"bends": [120]}, …},
      "name": "model",
      "settings": {"stop_time": 10, …}
    }

``frame_lines`` has the lines between frame ports, sorted strings without direction: ``"hinge/F -- rod/R"``.

A diagram may declare parameters, its ``mask``; a block's ``formulas`` of them are beside its parameters, and
their values are not written. The values of mask parameters are among the parameters of the subsystem block,
for the outermost diagram under ``parameters`` of the document.

``parameter_sets`` has named values of parameters by path, ``{"stiff": {"pid.kp": 40, "kp": 2}}``, see
:mod:`armblocks.diagram.parameter_sets`. Each is checked by the rule of its parameter.

``bookmarks`` has parts of the sheet by name, ``{"motor": {"height": 90, "width": 160, "x": 0, "y": 40}}``.
``scope_trigger`` has the trigger of the scopes, see :class:`~armblocks.diagram.ScopeTrigger`.

A commented block has ``"commented": "out"`` or ``"through"``, see
:mod:`armblocks.diagram.comments`.

A block that is linked to an entry of a library has ``library`` instead of ``diagram``: see
:mod:`armblocks.formats.subsystem_libraries`.

A subsystem block has its inner diagram under ``diagram``, with the same keys, except ``format`` and
``robots``, which occur once, and without empty settings and layout.

Unknown keys (of another program, or a newer armblocks) are stored in ``Diagram.extras`` and written again. A
key similar to a known one, and an unknown parameter, are errors. Infinite parameters are the strings
``"inf"`` and ``"-inf"``; NaN is an error. References to robots: see
:mod:`armblocks.formats.robot_references`. The JSON Schema is ``formats/schema/diagram.schema.json``.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from armblocks.diagram import BlockLibrary, Diagram
from armblocks.formats.canonical_json import canonical_bytes
from armblocks.formats.data_files import DataFiles, UnrestrictedFiles
from armblocks.formats.diagram_reading import INNER_KEYS, DiagramReader
from armblocks.formats.diagram_writing import DiagramWriter
from armblocks.formats.json_document import KeyPath, Node, read_document, split_members
from armblocks.formats.robot_references import ResolveRobot, RobotReader, RobotWriter
from armblocks.formats.subsystem_libraries import Libraries, ReadEntry, ReadFile, read_library_file

FORMAT_VERSION = 1
MAX_BYTES = 16 * 2**20
MAX_DEPTH = 320
"""Maximum nesting of objects and arrays: a hundred subsystems, and the content of the innermost."""

_DOCUMENT_KEYS = ("format", *INNER_KEYS, "parameters", "robots")
_LIBRARY_KEYS = ("format", "library", "robots")


def diagram_from_bytes(
    data: bytes,
    name: str,
    library: BlockLibrary,
    resolve_robot: ResolveRobot,
    *,
    folder: Path | None = None,
    trust: bool = False,
    draft: bool = False,
    read_library: ReadFile = read_library_file,
    read_data: DataFiles | None = None,
) -> Diagram:
    """The checked diagram of a document; ``library`` holds the block types that it may use.

    ``name`` is the name of the file in messages. The path of a robot is relative to ``folder``, and
    ``resolve_robot`` returns the robot of a shipped name or a path. The diagram's Python functions are
    loaded, which runs their files, only with ``trust``. With ``draft`` the diagram need not be able to run:
    inputs may be unconnected and shapes may not fit. ``read_library`` opens the libraries that blocks are
    linked to. ``read_data`` reads the tables and Python functions; without ``read_data``, ``trust`` applies.

    Raises ``FormatError`` for violations of the format, ``UnknownNameError`` for unknown types, parameters,
    blocks, ports and robots, and ``DiagramError`` for a diagram that cannot be built. All name the file, and
    the line if known.
    """
    root = read_document(data, name, MAX_BYTES, MAX_DEPTH)
    members, _ = split_members(root, _DOCUMENT_KEYS)
    _check_version(root, members)
    files = read_data or UnrestrictedFiles(trust)
    robots = RobotReader(members.get("robots"), folder, resolve_robot, files)
    libraries = Libraries(folder, _entry_reader(library, resolve_robot, files), read_library)
    reader = DiagramReader(library, robots, libraries, draft=draft)
    return reader.diagram(root, _DOCUMENT_KEYS, Path(name).stem)


def diagram_to_bytes(
    diagram: Diagram,
    resolve_robot: ResolveRobot,
    *,
    folder: Path | None = None,
    project: Path | None = None,
) -> bytes:
    """The canonical document of a diagram. Reading it gives an equal diagram.

    A robot is written as the shortest reference that gives an equal robot; paths are relative to ``folder``.
    With ``project``, a table from a file is always a reference, also if the file has changed since it was
    read, and files of this folder have relative paths. Raises ``FormatError`` if JSON cannot represent a
    value.
    """
    writer = DiagramWriter(RobotWriter(folder, resolve_robot, project), folder)
    document = {"format": FORMAT_VERSION, **writer.diagram(diagram)}
    if diagram.mask:
        document["parameters"] = writer.values(diagram)
    if writer.robots.table:
        document["robots"] = writer.robots.table
    return canonical_bytes(document, one_line=_is_layout_entry, max_depth=MAX_DEPTH)


def read_library(
    path: Path,
    library: BlockLibrary,
    resolve_robot: ResolveRobot,
    *,
    trust: bool = False,
) -> Mapping[str, Diagram]:
    """All diagrams of a library file, each linked to it. Raises the errors of :func:`diagram_from_bytes`."""
    return Libraries(None, _entry_reader(library, resolve_robot, UnrestrictedFiles(trust))).entries(path)


def library_to_bytes(
    entries: Mapping[str, Diagram], resolve_robot: ResolveRobot, *, folder: Path | None = None
) -> bytes:
    """The canonical document of a library of diagrams by name."""
    writer = DiagramWriter(RobotWriter(folder, resolve_robot), folder)
    document: dict[str, object] = {
        "format": FORMAT_VERSION,
        "library": {name: writer.inner_diagram(diagram) for name, diagram in entries.items()},
    }
    if writer.robots.table:
        document["robots"] = writer.robots.table
    return canonical_bytes(document, one_line=_is_layout_entry, max_depth=MAX_DEPTH)


def _entry_reader(library: BlockLibrary, resolve_robot: ResolveRobot, files: DataFiles) -> ReadEntry:
    """The function that builds the diagram of a library entry."""

    def read(root: Node, entry: Node, name: str, folder: Path, libraries: Libraries) -> Diagram:
        members, _ = split_members(root, _LIBRARY_KEYS)
        _check_version(root, members)
        robots = RobotReader(members.get("robots"), folder, resolve_robot, files)
        return DiagramReader(library, robots, libraries, draft=False).diagram(entry, INNER_KEYS, name)

    return read


def _check_version(root: Node, members: Mapping[str, Node]) -> None:
    if "format" not in members:
        fix = f'add "format": {FORMAT_VERSION}'
        raise root.error(
            "the key 'format' is missing", allowed=f"the format version {FORMAT_VERSION}", fix=fix
        )
    version = members["format"].value
    if version != FORMAT_VERSION or isinstance(version, bool):
        raise members["format"].error(
            f"the format version is {version!r}",
            allowed=str(FORMAT_VERSION),
            fix="update armblocks, if the file is newer than it",
        )


def _is_layout_entry(path: KeyPath) -> bool:
    if len(path) > 2 and path[0] == "library":
        path = path[2:]
    while len(path) > 3 and path[0] == "blocks" and path[2] == "diagram":
        path = path[3:]
    return len(path) == 2 and path[0] in ("layout", "bookmarks")
