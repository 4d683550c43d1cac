"""Documents, files and clients: saving, errors, notifications."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from client_requests import Events, run_scenario

from armblocks.blocks import BLOCKS
from armblocks.errors import ArmblocksError, FormatError, InputError
from armblocks.formats import load_diagram
from armblocks.studio.built_page import built_page
from armblocks.studio.protocol.clients import StudioClient
from armblocks.studio.runs import worker as run_worker
from armblocks.studio.server.hub import Hub
from armblocks.studio.server.launch import serve

TIMEOUT_SECONDS = 180


async def until(condition: Callable[[], bool]) -> None:
    """Let the hub run until a condition is true."""
    async with asyncio.timeout(TIMEOUT_SECONDS):
        while not condition():
            await asyncio.sleep(0.005)


GAIN = {"name": "gain", "type": "Gain", "place": {"x": 0, "y": 0}}


def test_a_diagram_is_opened_changed_checked_and_saved(tmp_path: Path) -> None:
    async def scenario(hub: Hub, ask: Callable[..., Awaitable[Any]], events: Events) -> None:
        key = await ask("open_shipped", document_kind="diagram", name="van_der_pol_pid")
        await ask("change", document=key, key="1", edit={"kind": "add", "blocks": [GAIN]})
        await ask(
            "change", document=key, key="1", edit={"kind": "add", "blocks": [GAIN]}
        )  # sent twice, applied once

        def last_check() -> list[Any] | None:
            return next((event["findings"] for event in reversed(events) if event["kind"] == "checked"), None)

        await until(lambda: bool(last_check()))
        await ask("undo", document=key)
        assert await ask("save", document=key, path="models/mine.json") == "models/mine.json"
        await until(lambda: last_check() == [])

    events = run_scenario(tmp_path, scenario)
    assert load_diagram(tmp_path / "models" / "mine.json", BLOCKS).name == "mine"
    checks = [event for event in events if event["kind"] == "checked"]
    first = next(event["findings"] for event in checks if event["findings"])
    assert [(f["block"], f["port"]) for f in first] == [("gain", "u")]
    assert checks[-1]["findings"] == []
    assert checks[-1]["wires"]["PID/y"]["shape"] == []
    last = [event for event in events if event["kind"] == "changed"][-1]
    assert last["state"]["path"] == "models/mine.json"
    assert not last["state"]["dirty"]


def test_a_file_changed_on_disk_is_not_overwritten_without_confirmation(tmp_path: Path) -> None:
    async def scenario(hub: Hub, ask: Callable[..., Awaitable[Any]], events: Events) -> None:
        key = await ask("new", document_kind="diagram")
        with pytest.raises(ArmblocksError, match="the drawing has no file yet"):
            await ask("save", document=key)
        await ask("save", document=key, path="a.json")
        (tmp_path / "a.json").write_text("{}")
        with pytest.raises(ArmblocksError, match="the file has changed on the disk since it was opened"):
            await ask("save", document=key)
        assert (tmp_path / "a.json").read_text() == "{}"
        (tmp_path / "b.json").write_text("{}")
        with pytest.raises(ArmblocksError, match="the file already exists"):
            await ask("save", document=key, path="b.json")
        await ask("save", document=key, path="b.json", overwrite=True)
        await ask("save", document=key)

    run_scenario(tmp_path, scenario)
    assert load_diagram(tmp_path / "b.json", BLOCKS).name == "b"


def test_an_incomplete_diagram_is_saved_and_reopened(tmp_path: Path) -> None:
    async def scenario(hub: Hub, ask: Callable[..., Awaitable[Any]], events: Events) -> None:
        key = await ask("new", document_kind="diagram")
        await ask("change", document=key, key="1", edit={"kind": "add", "blocks": [GAIN]})
        await ask("save", document=key, path="open.json")
        await ask("close", document=key)
        await ask("open", path="open.json")

    events = run_scenario(tmp_path, scenario)
    sheets = [event["content"]["sheet"]["blocks"] for event in events if event["kind"] == "opened"]
    assert list(sheets[-1]) == ["gain"]


def test_a_group_needs_blocks_and_a_free_name(tmp_path: Path) -> None:
    async def scenario(hub: Hub, ask: Callable[..., Awaitable[Any]], events: Events) -> None:
        key = await ask("open_shipped", document_kind="diagram", name="van_der_pol_pid")
        with pytest.raises(ArmblocksError, match="no blocks were chosen"):
            await ask("change", document=key, key="1", edit={"kind": "group", "blocks": [], "name": "s"})
        group = {"kind": "group", "blocks": ["error"], "name": "pid"}
        with pytest.raises(ArmblocksError, match="a block is already named 'PID'"):
            await ask("change", document=key, key="2", edit=group)
        await ask("change", document=key, key="3", edit={**group, "name": "part"})
        await ask("show_sheet", document=key, inside=["part"])
        inner = {"kind": "remove", "blocks": ["error"]}
        await ask("change", document=key, key="4", inside=["part"], edit=inner)
        with pytest.raises(ArmblocksError, match="there is no subsystem named 'error'"):
            await ask("show_sheet", document=key, inside=["error"])
        await ask("undo", document=key)
        await ask("undo", document=key)  # the subsystem is removed, so the client shows the top sheet

    events = run_scenario(tmp_path, scenario)
    opened = [event for event in events if event["kind"] == "opened"]
    assert opened[1]["content"]["inside"] == ["part"]
    assert opened[-1]["content"]["inside"] == []
    blocks, at_first = (event["content"]["sheet"]["blocks"] for event in (opened[-1], opened[0]))
    assert blocks.keys() == at_first.keys()


def test_the_server_sends_scenes_and_poses_of_robots(tmp_path: Path) -> None:
    async def scenario(hub: Hub, ask: Callable[..., Awaitable[Any]], events: Events) -> None:
        key = await ask("open_shipped", document_kind="diagram", name="kr180model")
        scene = await ask("scene", document=key, block="plot")
        assert scene["rows"] == 6
        assert len(scene["joints"]) == 4
        assert len(await ask("pose", document=key, block="plot", q=[0.0] * 4)) == 6
        with pytest.raises(ArmblocksError, match="5 joint coordinates were given"):
            await ask("pose", document=key, block="plot", q=[0.0] * 5)
        with pytest.raises(ArmblocksError, match="the block has no robot"):
            await ask("scene", document=key, block="speed")
        assert await ask("typed", type="Gain", parameter="gain", text="[1 2;3 4]") == [[1.0, 2.0], [3.0, 4.0]]

    run_scenario(tmp_path, scenario)


def test_a_failed_start_raises_an_error_with_the_reason(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="this installation has no studio page"):
        built_page(tmp_path)
    import socket

    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        with pytest.raises(InputError, match=r"port \d+ cannot be used"):
            serve(tmp_path, "", port=listener.getsockname()[1], open_browser=False, announce=print)


def test_a_run_without_memory_fails_with_an_error_message(monkeypatch: pytest.MonkeyPatch) -> None:
    message: list[bytes] = []

    class Pipe:
        def send_bytes(self, data: bytes) -> None:
            message.append(data)

    def exhausted(_: object) -> None:
        raise MemoryError

    job: dict[str, Any] = {"run": "r", "document": "d", "speed": None, "folder": "."}
    job |= {"diagram": "", "tuned": {}}
    run = run_worker._Run(Pipe(), job)  # pyright: ignore
    monkeypatch.setattr(run, "_simulate", lambda: exhausted(None))
    run.run()
    event = json.loads(message[-1][1:])
    assert event["state"] == "failed"
    assert event["fault"]["what"] == "the run exceeds its memory limit"


def test_a_document_is_closed_only_on_the_page_that_closes_it(tmp_path: Path) -> None:
    async def scenario(hub: Hub, ask: Callable[..., Awaitable[Any]], events: Events) -> None:
        key = await ask("new", document_kind="diagram")
        received: Events = []

        async def receive(text: str) -> None:
            received.append(json.loads(text))

        other = StudioClient(receive, receive)  # type: ignore[arg-type]
        await hub.welcome(other)
        attach = {"kind": "attach", "document": key, "document_kind": "diagram"}
        await hub.answer(other, json.dumps({"number": 1, "request": attach}))
        await ask("change", document=key, key="1", edit={"kind": "add", "blocks": [GAIN]})
        assert await ask("close", document=key, discard=True) is False
        assert [state["document"] for state in received[-1]["documents"]] == [key]
        close = {"kind": "close", "document": key}
        await hub.answer(other, json.dumps({"number": 2, "request": close}))
        assert "unsaved edits" in received[-1]["fault"]["what"]
        await hub.answer(other, json.dumps({"number": 3, "request": {**close, "discard": True}}))
        assert received[-1]["value"] is True
        assert key not in hub.documents

    run_scenario(tmp_path, scenario)


def test_pages_that_do_not_show_a_document_are_notified_of_unsaved_changes(tmp_path: Path) -> None:
    async def scenario(hub: Hub, ask: Callable[..., Awaitable[Any]], events: Events) -> None:
        received: Events = []

        async def receive(text: str) -> None:
            received.append(json.loads(text))

        await hub.welcome(StudioClient(receive, receive))  # type: ignore[arg-type]
        key = await ask("new", document_kind="diagram")
        await ask("change", document=key, key="1", edit={"kind": "add", "blocks": [GAIN]})
        assert [state["dirty"] for state in received[-1]["documents"]] == [True]
        await ask("undo", document=key)
        assert [state["dirty"] for state in received[-1]["documents"]] == [False]

    run_scenario(tmp_path, scenario)
