"""Every message over the websocket gets a reply with a value or an error; every kind of message is tested."""

from __future__ import annotations

import asyncio
import base64
import copy
import json
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest

from armblocks.diagram import Diagram
from armblocks.formats import diagram_to_bytes, load_robot, write_robot
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.protocol.clients import StudioClient
from armblocks.studio.protocol.message import Request, messages_of
from armblocks.studio.server.hub import Hub

NESTED = "…nested…"
"""Placeholder in a request for a deeply nested list."""
HOSTILE: tuple[Any, ...] = (
    None,
    True,
    -1,
    0,
    2**70,
    1e308,
    -1e308,
    5e-324,
    float("nan"),
    float("inf"),
    "",
    " ",
    "x" * 11_000,
    "../../secret.json",
    "..\\..\\secret.json",
    "/etc/passwd",
    "//host/share/a.json",
    "C:\\a.json",
    "a\0.json",
    "%2e%2e%2fsecret.json",
    "link.json",
    "\ud800",
    "__import__('os').system('true')",
    "9**9**9**9",
    "(" * 5000,
    "[" * 5000,
    [],
    [[]],
    ["x"] * 300,
    [1e308] * 1001,
    {},
    {"": {"": None}},
    {"a/b": 1, "__class__": "x"},
    {"gain": NESTED},
    NESTED,
)


PART = {"x": 1.0, "y": 1.0, "width": 100.0, "height": 50.0}
ROWS = b"time,x\n0,1\n1,2\n"
LAW = b"def law(u):\n    return u\n"


def requests(document: str, robot: str) -> list[dict[str, Any]]:
    """At least one valid request of every kind."""
    place = {"x": 0.0, "y": 0.0, "width": None, "height": None, "flipped": False, "rotation": 0}
    block = {"name": "new", "type": "Gain", "parameters": {"gain": "2*pi"}, "place": place}
    encoded = base64.b64encode(ROWS).decode()
    choice = {"file": "a.csv", "time": "time", "columns": ["x"]}
    played = {"name": "played", "type": "FromFile", "parameters": {"data": choice}, "place": place}
    called = {"name": "f", "type": "PythonFunction", "parameters": {"function": "law.py:law"}, "place": place}
    wire = {"source": "PID/y", "target": "new/u", "bends": [1.0]}
    note = {"x": 1.0, "y": 1.0, "text": "note"}
    edits: list[dict[str, Any]] = [
        {"kind": "add", "blocks": [block], "wires": [wire]},
        {"kind": "add", "blocks": [played]},
        {"kind": "add", "blocks": [called]},
        {"kind": "notes", "notes": {"/1": note}},
        {"kind": "parameters", "block": "PID", "values": {"P": "1"}},
        {"kind": "move", "places": {"PID": place}, "notes": {}},
        {"kind": "appearance", "blocks": ["PID"], "name_side": "above", "colour": "red"},
        {"kind": "rename", "block": "PID", "name": "PID"},
        {
            "kind": "mask",
            "block": "",
            "name": "",
            "parameters": [{"name": "k", "default": 1.0, "minimum": 0.0}],
        },
        {"kind": "paste", "text": diagram_to_bytes(Diagram(name="d", blocks={}), load_robot).decode()},
        {"kind": "settings", "values": {"stop_time": 1.0}},
        {"kind": "save_parameter_set", "name": "stiff", "values": {"PID.P": "2*pi"}, "all_parameters": True},
        {"kind": "rename_parameter_set", "name": "soft", "to": "stiff"},
        {"kind": "apply_parameter_set", "name": "soft"},
        {"kind": "remove_set_parameter", "path": "PID.P"},
        {"kind": "remove_parameter_set", "name": "soft"},
        {"kind": "add_bookmark", "name": "left", "part": PART, "replace": True},
        {"kind": "rename_bookmark", "name": "left", "to": "right"},
        {"kind": "remove_bookmark", "name": "left"},
        {"kind": "arrange"},
    ]
    common = {"document": document, "base": None, "author": "me"}
    of_robot = {**common, "document": robot, "gesture": "", "inside": []}
    to_block = {"document": document, "inside": [], "block": "PID"}
    q = {"q": [0.0] * 6, "qd": [0.0] * 6, "qdd": [0.0] * 6}
    content = base64.b64encode(write_robot(load_robot("kr180"))).decode()
    motion = {"document": robot, "poses": ["P1", "P2"], "course": "joint", "duration": 1.0}
    cell = {"kind": "cell", "link": "link1", "column": "a", "text": "1", "angles": "deg"}
    return [
        {"kind": "open", "path": "arm.json"},
        {"kind": "open_shipped", "document_kind": "diagram", "name": "van_der_pol_pid"},
        {"kind": "open_shipped", "document_kind": "robot", "name": "puma560"},
        {"kind": "drop", "name": "arm.json", "content": content},
        {"kind": "new", "document_kind": "diagram"},
        {
            "kind": "attach",
            "document": document,
            "document_kind": "diagram",
            "inside": [],
            "path": None,
            "origin": "",
            "in_front": True,
        },
        {"kind": "show_sheet", "document": document, "inside": []},
        {
            "kind": "route",
            "document": document,
            "inside": [],
            "places": {"PID": {"x": 200.0, "y": 100.0}},
            "wires": [{"source": "PID/y", "target": "u/u1", "bends": [375.0]}],
            "passed": "u",
        },
        *({"kind": "change", **common, "inside": [], "edit": edit} for edit in edits),
        {"kind": "change", **of_robot, "edit": cell},
        {"kind": "change", **of_robot, "edit": {"kind": "record_pose", "q": [0.0] * 6, "name": "P1"}},
        {"kind": "change", **of_robot, "edit": {"kind": "record_pose", "q": [0.5] * 6, "after": "P1"}},
        {"kind": "change", **of_robot, "edit": {"kind": "update_pose", "name": "P1", "q": [0.1] * 6}},
        {"kind": "change", **of_robot, "edit": {"kind": "rename_pose", "name": "P1", "to": "P1"}},
        {"kind": "change", **of_robot, "edit": {"kind": "move_pose", "name": "P1", "by": 0}},
        {"kind": "reach", "document": robot, "q": [0.0] * 6, "target": [0.0] * 16},
        {"kind": "motion", **motion},
        {"kind": "motion_rows", **motion},
        {"kind": "save_motion", **motion, "path": "motion.csv", "overwrite": True},
        {"kind": "workspace", "document": robot},
        {"kind": "change", **of_robot, "edit": {"kind": "remove_pose", "name": "P1"}},
        {"kind": "undo", **common},
        {"kind": "redo", **common},
        {"kind": "save", "document": document, "path": "saved.json", "overwrite": True},
        {"kind": "reload", **common},
        {"kind": "ignore_file_change", "document": document},
        {"kind": "ping"},
        {"kind": "files"},
        {"kind": "outline", "document": document},
        {"kind": "parameter_sets", "document": document},
        {"kind": "bookmarks", "document": document},
        {"kind": "find", "document": document, "text": "PID"},
        {"kind": "copy", "document": document, "inside": [], "blocks": ["PID"], "notes": []},
        {"kind": "ask_mask", "document": document, "inside": [], "block": ""},
        {"kind": "close", "document": "0123456789abcdef", "discard": False},
        {"kind": "recover", "document": "0123456789abcdef", "action": "open"},
        {"kind": "run", "document": "0123456789abcdef", "speed": 1.0, "tuned": {"PID.P": 1.0}},
        {"kind": "control", "run": "0123456789abcdef", "action": "stop"},
        {"kind": "rewind", "run": "0123456789abcdef", "time": 0.0},
        {"kind": "speed", "run": "0123456789abcdef", "speed": None},
        {"kind": "tune", "run": "0123456789abcdef", "values": {"PID.P": 1.0}},
        {
            "kind": "typed",
            "document": document,
            "inside": [],
            "block": "PID",
            "type": "PID",
            "parameter": "P",
            "text": "1",
        },
        {"kind": "typed_settings", "document": document, "values": {"stop_time": 1.0}},
        {"kind": "scene", **to_block},
        {"kind": "pose", **to_block, "q": [0.0]},
        {"kind": "pose", "document": robot, "q": [0.0] * 6},
        {"kind": "picture", "document": robot, "q": [0.0], "theme": "light"},  # drawing takes long
        {"kind": "readings", "document": robot, **q},
        {"kind": "robot_of_block", **to_block},
        {"kind": "robot_tables"},
        {"kind": "data_files", "holds": "table"},
        {"kind": "preview_table", **choice},
        {
            "kind": "store_file",
            "name": "kept.csv",
            "content": encoded,
            "replace": True,
        },
        {"kind": "read_source", "file": "law.py"},
        {"kind": "trust_source", "file": "law.py", "digest": sha256(LAW).hexdigest(), "trusted": False},
    ]


def with_hostile_values(request: dict[str, Any], tried: set[tuple[Any, ...]]) -> Iterator[dict[str, Any]]:
    """Yield variants of the request: one value, at any depth, is replaced by a hostile one.

    ``tried`` has the fields of earlier requests. Fields beside ``edit`` are read before the edit and are the
    same for all edits of diagrams, and for all edits of robots: they are replaced once for each of the two.
    """

    def value_paths(value: Any, path: tuple[Any, ...]) -> Iterator[tuple[Any, ...]]:
        if path:
            yield path
        members: Any = ()
        if isinstance(value, dict):
            members = value.items()  # pyright: ignore[reportUnknownVariableType, reportUnknownMemberType]
        elif isinstance(value, list):
            members = list(enumerate(value))[:1]  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
        for name, inner in members:
            yield from value_paths(inner, (*path, name))

    for path in value_paths(request, ()):
        field = (*sorted(request), *path)
        if path == ("kind",) or (path[0] != "edit" and "edit" in request and field in tried):
            continue
        tried.add(field)
        for hostile in HOSTILE:
            variant = copy.deepcopy(request)
            holder: Any = variant
            for name in path[:-1]:
                holder = holder[name]
            holder[path[-1]] = hostile
            yield variant


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    project = tmp_path / "project"
    project.mkdir()
    (tmp_path / "secret.json").write_text("SECRET")
    (project / "link.json").symlink_to(tmp_path / "secret.json")
    (project / "a.csv").write_bytes(ROWS)
    (project / "law.py").write_bytes(LAW)
    (project / "arm.json").write_bytes(write_robot(load_robot("puma560")))
    return project


def test_every_kind_of_message_answers_hostile_values_with_an_error(folder: Path) -> None:
    events: list[dict[str, Any]] = []
    defects: list[str] = []

    async def receive(text: str) -> None:
        event = json.loads(text)
        if event["kind"] == "reply":
            events.append(event)
        assert "SECRET" not in text

    async def receive_bytes(data: bytes) -> None:
        raise AssertionError("samples arrived without a run")

    async def main() -> None:
        hub = Hub(ProjectFolder(folder))
        client = StudioClient(receive, receive_bytes)
        await hub.welcome(client)
        number = 0

        async def send(request: dict[str, Any]) -> dict[str, Any]:
            nonlocal number
            number += 1
            text = json.dumps({"number": number, "request": request})
            text = text.replace(json.dumps(NESTED), "[" * 2000 + "]" * 2000)
            await hub.answer(client, text)
            assert events[-1]["number"] == number
            return events[-1]

        robot = (await send({"kind": "open", "path": "arm.json"}))["value"][0]
        tried: set[tuple[Any, ...]] = set()
        assert {request["kind"] for request in requests("", "")} == set(messages_of(Request))
        opening = {"kind": "open_shipped", "document_kind": "diagram", "name": "van_der_pol_pid"}
        for index in range(len(requests("", ""))):
            document = (await send(opening))["value"]
            request = requests(document, robot)[index]
            values = {"kind": "save_parameter_set", "name": "soft", "values": {"PID.P": 1.0}}
            await send({"kind": "change", "document": document, "edit": values})
            marked = {"kind": "add_bookmark", "name": "left", "part": PART}
            await send({"kind": "change", "document": document, "edit": marked})
            await send({"kind": "save", "document": document, "path": f"{index}.json"})
            fault = (await send(request))["fault"]
            nothing_to = ("scene", "pose", "robot_of_block", "undo", "redo")
            if document in request.values() and request["kind"] not in nothing_to:
                assert fault is None, fault
            for bad in with_hostile_values(request, tried):
                fault = (await send(bad))["fault"]
                if fault is not None:
                    assert fault["what"], bad
                    assert fault["fix"], bad
                    if "defect" in fault["what"]:
                        defects.append(f"{fault['what']}: {str(bad)[:300]}")
            await send({"kind": "close", "document": document, "discard": True})
        assert (await send({"kind": "ping"}))["fault"] is None
        hub.close()

    asyncio.run(main())
    assert defects == []
    assert sorted(path.name for path in folder.parent.iterdir()) == ["project", "secret.json"]
    assert (folder.parent / "secret.json").read_text() == "SECRET"
