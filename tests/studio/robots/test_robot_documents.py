"""Robots as documents: open, drop, edit, save, read-outs, and the notifications of all clients."""

from __future__ import annotations

import asyncio
import base64
import json
import math
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import armblocks as ab
from armblocks.errors import ArmblocksWarning, FormatError
from armblocks.formats import DocumentKind, kind_of_data, load_robot, read_robots, write_robot
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.protocol.messages.documents import MAX_DROPPED_BYTES
from armblocks.studio.robots.readings import readings, singularity
from armblocks.studio.server.hub import Hub, StudioClient

PRINTED = Path(__file__).parents[2] / "formats" / "kr180_as_printed.m"


class Client:
    """A hub and a connected client."""

    def __init__(self, folder: Path) -> None:
        self.received: list[dict[str, Any]] = []
        self.hub = Hub(ProjectFolder(folder))
        self.connection = self.new_client(self.received)
        self._number = 0

    def new_client(self, received: list[dict[str, Any]]) -> StudioClient:
        async def receive(text: str) -> None:
            received.append(json.loads(text))

        async def receive_bytes(data: bytes) -> None:
            raise AssertionError("samples arrived without a run")

        return StudioClient(receive, receive_bytes)

    async def reply(self, kind: str, **values: Any) -> dict[str, Any]:
        self._number += 1
        number = self._number
        request = {"number": number, "request": {"kind": kind, **values}}
        await self.hub.answer(self.connection, json.dumps(request))
        return next(e for e in self.received if e["kind"] == "reply" and e["number"] == number)

    async def ask(self, kind: str, **values: Any) -> Any:
        reply = await self.reply(kind, **values)
        assert reply["fault"] is None, reply["fault"]
        return reply["value"]

    async def refused(self, kind: str, **values: Any) -> str:
        fault = (await self.reply(kind, **values))["fault"]
        assert fault is not None
        return f"{fault['where']}: {fault['what']}"

    def shown(self) -> dict[str, Any]:
        """The content and state that the client shows of a robot."""
        events = [event for event in self.received if event.get("state", {}).get("kind") == "robot"]
        contents = [event.get("content") or (event.get("change") or {}).get("content") for event in events]
        return {**next(content for content in reversed(contents) if content), **events[-1]["state"]}


def run_scenario(folder: Path, scenario: Callable[[Client], Awaitable[None]]) -> None:
    async def main() -> None:
        client = Client(folder)
        await client.hub.welcome(client.connection)
        await scenario(client)
        client.hub.close()

    asyncio.run(main())


def packed(data: bytes) -> str:
    return base64.b64encode(data).decode()


def cell(link: str, column: str, text: str) -> dict[str, str]:
    return {"kind": "cell", "link": link, "column": column, "text": text, "angles": "deg"}


def test_a_urdf_file_is_dropped_with_its_findings(tmp_path: Path) -> None:
    link = '<visual><geometry><mesh filename="arm.dae"/></geometry></visual>'
    text = f"""<robot name="turntable"><link name="base"/><link name="arm">{link}</link>
    <joint name="j" type="continuous"><parent link="base"/><child link="arm"/></joint></robot>"""

    async def scenario(client: Client) -> None:
        await client.ask("drop", name="arm.urdf", content=packed(text.encode()))
        opened = next(event for event in client.received if event["kind"] == "opened")
        assert opened["content"]["name"] == "turntable"
        assert any("the mesh 'arm.dae' is not shown" in note for note in opened["notes"])
        shown = client.shown()
        assert [link["name"] for link in shown["links"]] == ["base", "arm"]
        assert [link["moves"] for link in shown["links"]] == [False, True]

    run_scenario(tmp_path, scenario)


def test_the_script_of_the_paper_is_dropped_edited_undone_saved_and_reopened(tmp_path: Path) -> None:
    async def scenario(client: Client) -> None:
        (key,) = await client.ask("drop", name="kr180.m", content=packed(PRINTED.read_bytes()))
        opened = next(event for event in client.received if event["kind"] == "opened")
        assert opened["content"]["name"] == "KR180"
        assert any("split as on a printed page" in note for note in opened["notes"])
        shown = client.shown()
        assert (shown["path"], shown["dirty"], shown["convention"]) == (None, True, "standard")
        assert shown["links"][1]["cells"]["mass"] == 150
        assert {finding["link"] for finding in shown["findings"]} == {"link1", "link3"}
        for number, text in enumerate(("1", "1.", "1.5")):
            await client.ask(
                "change", document=key, key=str(number), gesture="g", edit=cell("link2", "d", text)
            )
        await client.ask("change", document=key, key="2", gesture="g", edit=cell("link2", "d", "9"))
        assert client.shown()["links"][1]["cells"]["d"] == 1.5  # a request with a repeated key is not applied
        assert "the cell is empty" in await client.refused(
            "change", document=key, key="x", edit=cell("link2", "d", "")
        )
        await client.ask("undo", document=key)
        assert client.shown()["links"][1]["cells"]["d"] == 1.25  # the typed letters are one step
        await client.ask("redo", document=key)
        assert "no file yet" in await client.refused("save", document=key)
        assert "studio does not open" in await client.refused("save", document=key, path="x.txt")
        await client.ask("save", document=key, path="arms/mine.json")
        assert not client.shown()["dirty"]
        again = await client.ask("open", path="arms/mine.json")
        assert again == [key]  # already open
        (tmp_path / "arms" / "mine.json").write_bytes(write_robot(load_robot("puma560")))
        assert "changed on the disk" in await client.refused("save", document=key)
        await client.ask("save", document=key, overwrite=True)
        (tmp_path / "other.json").write_text("{}")
        assert "the file already exists" in await client.refused("save", document=key, path="other.json")

    run_scenario(tmp_path, scenario)
    (saved,) = read_robots((tmp_path / "arms" / "mine.json").read_bytes(), "mine.json").values()
    with pytest.warns(ArmblocksWarning, match="printed page"):
        (printed,) = read_robots(PRINTED.read_bytes(), "kr180.m").values()
    assert saved.links[1].dh is not None
    assert saved.links[1].dh.d == 1.5
    assert saved.links[2:] == printed.links[2:]


def test_dropped_files_are_bounded_and_errors_name_the_file(tmp_path: Path) -> None:
    async def scenario(client: Client) -> None:
        for name in ("arm.exe", "noname", "run.py"):
            assert "is not a file type" in await client.refused("drop", name=name, content="")
        assert "the content is not base64" in await client.refused("drop", name="a.m", content="§")
        huge = packed(b" " * (MAX_DROPPED_BYTES + 1))
        assert f"{MAX_DROPPED_BYTES + 1} bytes" in await client.refused("drop", name="a.json", content=huge)
        code = b"L{1} = link([0 1 0 0 0]);\nsystem('rm -rf /')\n"
        assert "evil.m:2" in await client.refused("drop", name="evil.m", content=packed(code))
        assert "defines no robot" in await client.refused("drop", name="a.m", content=packed(b"x = 1;"))
        assert "a.json" in await client.refused("drop", name="a.json", content=packed(b"{"))
        model = (Path(ab.__file__).parents[2] / "examples" / "kr180model.json").read_bytes()
        (document,) = await client.ask("drop", name="model.json", content=packed(model))
        assert client.hub.documents[document].state().kind == "diagram"
        robot = packed(write_robot(load_robot("puma560")))
        await client.ask("drop", name="p.json", content=robot)
        assert client.shown()["title"] == load_robot("puma560").name
        two = b"L{1} = link([0 1 0 0 0]); a = robot(L, 'one'); L{2} = link([0 2 0 0 0]); b = robot(L, 'two');"
        keys = await client.ask("drop", name="two.m", content=packed(two))
        assert [client.hub.documents[key].state().title for key in keys] == ["one", "two"]
        assert client.shown()["title"] == "one"

    run_scenario(tmp_path, scenario)


def test_an_unsaved_copy_of_a_shipped_robot_has_the_names_of_its_published_poses(tmp_path: Path) -> None:
    async def scenario(client: Client) -> None:
        key = await client.ask("open_shipped", document_kind="robot", name="puma560")
        published = list(load_robot("puma560").configurations)
        record = {"kind": "record_pose", "q": [0.0] * 6}
        await client.ask("change", document=key, key="1", edit=record)
        shown = client.shown()
        assert [pose["name"] for pose in shown["poses"]] == [*published, "P1"]
        assert shown["published_poses"] == published
        await client.ask("save", document=key, path="mine.json")
        await client.ask("attach", document=key, document_kind="robot")
        assert client.shown()["published_poses"] == []  # the file has all poses
        dropped = packed((tmp_path / "mine.json").read_bytes())
        await client.ask("drop", name="dropped.json", content=dropped)
        shown = client.shown()
        assert (shown["path"], len(shown["poses"]), shown["published_poses"]) == (
            None,
            len(published) + 1,
            [],
        )

    run_scenario(tmp_path, scenario)


def test_saving_a_robot_file_updates_the_diagrams_that_use_it(tmp_path: Path) -> None:
    (tmp_path / "arms").mkdir()
    ab.save_robot(load_robot("puma560"), tmp_path / "arms" / "mine.json")

    async def scenario(client: Client) -> None:
        document = await client.ask("open_shipped", document_kind="diagram", name="kr180model")
        blocks = client.hub.documents[document].document.diagram.blocks
        name = next(name for name, block in blocks.items() if hasattr(block, "robot"))
        edit = {"kind": "parameters", "block": name, "values": {"robot": "arms/mine.json"}}
        await client.ask("change", document=document, key="1", edit=edit)
        key = await client.ask("robot_of_block", document=document, block=name)
        assert client.shown()["path"] == "arms/mine.json"
        link = client.shown()["links"][0]["name"]
        await client.ask("change", document=key, key="1", edit=cell(link, "mass", "7"))
        await client.ask("save", document=key)
        block = client.hub.documents[document].document.diagram.block(name)
        assert block.robot.links[0].mass == 7
        assert client.received[-3]["kind"] == "changed"
        assert client.received[-3]["state"]["document"] == document
        await client.ask("undo", document=document)
        block = client.hub.documents[document].document.diagram.block(name)
        assert block.robot.links[0].mass == 0
        other = next(name for name, block in blocks.items() if not hasattr(block, "robot"))
        assert "no robot" in await client.refused("robot_of_block", document=document, block=other)

    run_scenario(tmp_path, scenario)


def test_two_pages_show_each_other_s_edits(tmp_path: Path) -> None:
    async def scenario(client: Client) -> None:
        key = await client.ask("open_shipped", document_kind="robot", name="puma560")
        assert client.shown()["origin"] == "puma560"
        other_received: list[dict[str, Any]] = []
        other = client.new_client(other_received)
        await client.hub.welcome(other)
        request = {"number": 1, "request": {"kind": "attach", "document_kind": "robot", "document": key}}
        await client.hub.answer(other, json.dumps(request))
        tables = await client.ask("robot_tables")
        assert [column["title"] for column in tables["kinematics"]][:4] == ["joint", "α", "a", "d"]
        for number in range(8):
            await client.ask(
                "change", document=key, key=str(number), edit=cell("link2", "a", f"0.{number + 1}")
            )
            pose = await client.ask("pose", document=key, q=[0.0] * 6)
            await client.ask("scene", document=key)
        assert other_received[-1]["state"]["version"] == 8
        arm = ab.Arm(client.hub.documents[key].document.value)
        assert_allclose(pose, arm.link_poses([0.0] * 6), atol=1e-14)
        client.hub.remove_client(other)
        late: list[dict[str, Any]] = []
        await client.hub.welcome(client.new_client(late))
        assert [(state["document"], state["version"]) for state in late[0]["documents"]] == [(key, 8)]
        await client.ask("undo", document=key)
        assert other_received[-1]["state"]["version"] == 8
        assert "open document" in await client.refused("undo", document="nobody")
        rename = {"kind": "rename", "block": "a", "name": "b"}
        assert "'rename' is not an edit of a robot" in await client.refused(
            "change", document=key, edit=rename
        )
        await client.ask("redo", document=key)
        await client.ask("undo", document=key)
        assert "has unsaved edits" in await client.refused("close", document=key)
        await client.ask("close", document=key, discard=True)
        assert client.received[-2]["documents"] == []

    run_scenario(tmp_path, scenario)


def test_read_outs_equal_the_values_of_the_arm(tmp_path: Path) -> None:
    arm = ab.load_robot("puma560")
    q, qd, qdd = [0.1, 0.4, -0.3, 0.5, 0.7, 0.2], [0.5] * 6, [1.0] * 6

    async def scenario(client: Client) -> None:
        key = await client.ask("open_shipped", document_kind="robot", name="puma560")
        shown_values = await client.ask("readings", document=key, q=q, qd=qd, qdd=qdd)
        assert shown_values["pose"] == arm.fkine(q).tolist()
        assert shown_values["jacobian"] == arm.jacob0(q).tolist()
        assert shown_values["torque"] == arm.rne(q, qd, qdd).tolist()
        assert shown_values["gravload"] == arm.gravload(q).tolist()
        assert shown_values["manipulability"] == float(arm.manipulability(q))
        roll, pitch, yaw = shown_values["rpy"]
        assert_allclose(math.cos(pitch) * math.cos(yaw), shown_values["pose"][0][0], atol=1e-12)
        assert_allclose(math.cos(pitch) * math.sin(roll), shown_values["pose"][2][1], atol=1e-12)
        assert "5 numbers were given for q" in await client.refused(
            "readings", document=key, q=q[:5], qd=qd, qdd=qdd
        )
        assert "joint coordinate was given" in await client.refused("pose", document=key, q=[0.0])
        picture = await client.ask("picture", document=key, q=q, theme="light")
        assert "<svg" in picture

    run_scenario(tmp_path, scenario)


def test_singularities_are_described_in_words() -> None:
    puma = ab.load_robot("puma560")
    names = puma.robot.joint_names
    wrist = readings(puma, [0.1, 0.4, -0.3, 0.5, 0.0, 0.2], [0.0] * 6, [0.0] * 6)
    assert wrist.singular.startswith(f"Singular: {names[3]} and {names[5]} can move together")
    assert readings(puma, [0.1, 0.4, -0.3, 0.5, 0.7, 0.2], [0.0] * 6, [0.0] * 6).singular == ""
    assert singularity(np.zeros((6, 2)), ["a", "b"], 1.0) == "Singular: no joint moves the tool."
    values = np.zeros((6, 2))
    values[0, 0] = 1.0
    assert singularity(values, ["a", "b"], 1.0) == "Singular: b moves without motion of the tool."
    square = np.diag([1.0, 1.0, 1.0, 1.0, 1.0, 0.01])
    assert singularity(square, list("abcdef"), 1.0).startswith("Close to singular: f moves")
    fast = readings(puma, [9.0] * 6, [100.0] * 6, [0.0] * 6)
    assert f"{names[0]} is outside its range" in fast.limits
    kuka = ab.load_robot("kr180")
    assert "link1 exceeds its speed limit" in readings(kuka, [0.0] * 4, [9.0] * 4, [0.0] * 4).limits


def test_file_kinds_are_recognised_and_file_sizes_are_bounded() -> None:
    assert kind_of_data(write_robot(load_robot("kr180")), "arm.json") is DocumentKind.ROBOT
    assert kind_of_data(b"% a script", "arm.m") is DocumentKind.ROBOT
    assert kind_of_data(b'{"blocks": {}, "links": []}', "model.json") is DocumentKind.DIAGRAM
    assert kind_of_data(b'{"library": "joints", "blocks": {}}', "parts.JSON") is DocumentKind.LIBRARY
    for wrong in (b"[1, 2]", b"{"):
        with pytest.raises(FormatError, match=r"model\.json"):
            kind_of_data(wrong, "model.json")
    with pytest.raises(FormatError, match="is not a suffix of a robot file"):
        read_robots(b"", "arm.step")
    with pytest.raises(FormatError, match="the file has 1048577 bytes"):
        read_robots(b" " * (2**20 + 1), "arm.m")
