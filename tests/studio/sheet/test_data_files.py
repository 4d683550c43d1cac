"""Tables and Python functions of the project in the studio: choice, preview, trust, changes on disk."""

from __future__ import annotations

import asyncio
import base64
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from client_requests import Events, run_scenario

from armblocks.blocks import PythonFunction
from armblocks.errors import ArmblocksError
from armblocks.studio.server.hub import Hub
from armblocks.studio.sheet.parameter_values import parameter_json

TIMEOUT_SECONDS = 180
Ask = Callable[..., Awaitable[Any]]
ROWS = "time [ms],x,y [deg],word\n0,1,10,a\n5,2,20,b\n20,4,30,c\n"


def file_block(name: str, **choice: Any) -> dict[str, Any]:
    return {
        "kind": "add",
        "blocks": [
            {"name": name, "type": "FromFile", "parameters": {"data": choice}, "place": {"x": 0, "y": 0}},
            {"name": f"{name} scope", "type": "Scope", "place": {"x": 200, "y": 0}},
        ],
        "wires": [{"source": f"{name}/y", "target": f"{name} scope/u"}],
    }


def function_block(name: str, function: str, kind: str = "PythonFunction") -> dict[str, Any]:
    return {
        "kind": "add",
        "blocks": [
            {"name": name, "type": kind, "parameters": {"function": function}, "place": {"x": 200, "y": 0}},
            {"name": "one", "type": "Constant", "place": {"x": 0, "y": 0}},
            {"name": "end", "type": "Scope", "place": {"x": 400, "y": 0}},
        ],
        "wires": [
            {"source": "one/y", "target": f"{name}/u"},
            {"source": f"{name}/y", "target": "end/u"},
        ],
    }


async def findings(events: Events, since: int) -> list[dict[str, Any]]:
    """The findings of the next check after a number of messages."""
    async with asyncio.timeout(TIMEOUT_SECONDS):
        while True:
            for event in events[since:]:
                if event["kind"] == "checked":
                    return event["findings"]
            await asyncio.sleep(0.01)


async def end_of_run(events: Events, since: int) -> dict[str, Any]:
    async with asyncio.timeout(TIMEOUT_SECONDS):
        while True:
            for event in events[since:]:
                if event["kind"] == "run_progress" and event["state"] in ("done", "failed"):
                    return event
            await asyncio.sleep(0.01)


def test_a_file_is_previewed_and_its_columns_are_chosen(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "drive.csv").write_text(ROWS)
    (tmp_path / "other.txt").write_text(ROWS)

    async def scenario(_: Hub, ask: Ask, events: Events) -> None:
        assert [file["path"] for file in await ask("data_files", holds="table")] == ["data/drive.csv"]
        shown = await ask("preview_table", file="data/drive.csv")
        assert shown["time"] == "time [ms]"
        assert shown["chosen"] == ["x", "y [deg]"]
        assert [column["fault"] for column in shown["columns"]] == ["", "", "", "line 2 contains 'a'"]
        assert shown["times"] == [0.0, 0.005, 0.02]
        assert shown["curves"] == [[1.0, 2.0, 4.0], [10.0, 20.0, 30.0]]
        assert shown["rows"][1] == ["5", "2", "20"]
        assert shown["spacing"] == pytest.approx((0.005, 0.015))
        assert any("converted from ms to s" in note for note in shown["notes"])
        assert any("In degrees: y [deg]" in note for note in shown["notes"])
        text = await ask("preview_table", file="data/drive.csv", columns=["word"])
        assert text["fault"]["what"].startswith("the column 'word' has no numbers")
        unsorted = await ask("preview_table", file="data/drive.csv", time="word")
        assert unsorted["fault"] is not None
        for path in ("../secret.csv", "/etc/passwd", "drive.json", "no.csv"):
            with pytest.raises(ArmblocksError):
                await ask("preview_table", file=path)
        document = await ask("new", document_kind="diagram")
        since = len(events)
        await ask("change", document=document, key="0", edit=file_block("all", file="data/drive.csv"))
        (finding,) = await findings(
            events, since
        )  # as on the command line: all columns contain one with text
        assert "the column 'word' has no numbers: line 2 contains 'a'" in finding["what"]
        await ask("undo", document=document)
        edit = file_block("drive", file="data/drive.csv", time="time [ms]", columns=["x"])
        since = len(events)
        await ask("change", document=document, key="1", edit=edit)
        assert await findings(events, since) == []
        await ask("save", document=document, path="models/model.json")
        document = (await ask("open", path="models/model.json"))[0]
        since = len(events)
        await ask("run", document=document, speed=None, tuned={})
        assert (await end_of_run(events, since))["fault"] is None

    run_scenario(tmp_path, scenario, runs=True)
    block = json.loads((tmp_path / "models" / "model.json").read_text())["blocks"]["drive"]
    assert block["parameters"]["data"] == {
        "columns": ["x"],
        "file": "../data/drive.csv",
        "time": "time [ms]",
    }


def test_a_table_that_cannot_be_read_is_a_finding_at_its_block(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time,x\n0,1\n1,2\n")

    async def scenario(_: Hub, ask: Ask, events: Events) -> None:
        document = await ask("new", document_kind="diagram")
        await ask("change", document=document, key="1", edit=file_block("a", file="a.csv"))
        await ask("save", document=document, path="m.json")
        await ask("close", document=document)
        (tmp_path / "a.csv").write_text("time,x\n0,1\n0,2\n0,3\n")
        since = len(events)
        document = (await ask("open", path="m.json"))[0]
        (finding,) = await findings(events, since)
        assert (
            finding["block"],
            "row 3 of the table is 0, as in the two rows before" in finding["what"],
        ) == (
            "a",
            True,
        )
        # the file is corrected, and the check reads the new content
        (tmp_path / "a.csv").write_text("time,x\n0,1\n1,5\n")
        since = len(events)
        edit = {"kind": "parameters", "block": "a", "values": {"data": {"file": "a.csv"}}}
        await ask("change", document=document, key="2", edit=edit)
        assert await findings(events, since) == []
        (tmp_path / "a.csv").unlink()
        since = len(events)
        await ask("undo", document=document)
        assert "there is no such file" in (await findings(events, since))[0]["what"]

    run_scenario(tmp_path, scenario, runs=True)


def test_a_dropped_table_is_stored_and_replaced_only_on_request(tmp_path: Path) -> None:
    async def scenario(_: Hub, ask: Ask, events: Events) -> None:
        def content(text: str) -> str:
            return base64.b64encode(text.encode()).decode()

        assert await ask("store_file", name="a.csv", content=content(ROWS)) == {
            "path": "a.csv",
            "stored": True,
        }
        assert (await ask("store_file", name="a.csv", content=content(ROWS)))["stored"]  # the same content
        other = content("time,x\n0,1\n1,2\n")
        assert not (await ask("store_file", name="a.csv", content=other))["stored"]
        assert (tmp_path / "a.csv").read_text() == ROWS
        assert (await ask("store_file", name="a.csv", content=other, replace=True))["stored"]
        assert (tmp_path / "a.csv").read_text() == "time,x\n0,1\n1,2\n"
        refused = {
            "../b.csv": "b.csv",
            "b.parquet": "the file cannot be read",
            "b.json": "the studio does not open",
            ".b.csv": "cannot be a file name",
        }
        assert (await ask("store_file", name="../b.csv", content=other))["path"] == "b.csv"
        for name in list(refused)[1:]:
            with pytest.raises(ArmblocksError, match=refused[name]):
                await ask("store_file", name=name, content=other)
        matlab = base64.b64encode(b"MATLAB 7.3 MAT-file, Platform" + bytes(200)).decode()
        with pytest.raises(ArmblocksError, match=r"a MAT file of version 7\.3"):
            await ask("store_file", name="c.mat", content=matlab)
        assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "b.csv"]

    run_scenario(tmp_path, scenario, runs=True)


MARK = "from pathlib import Path\nPath(__file__).with_name('ran').write_text('')\n"
LAW = f"{MARK}\n\ndef law(u, t, gain=2.0):\n    return gain * u\n"


def test_the_default_function_is_in_no_file_of_the_project() -> None:
    assert parameter_json(PythonFunction().function) == {"function": "unchanged", "source": ""}


def test_code_runs_only_after_its_content_was_trusted(tmp_path: Path) -> None:
    (tmp_path / "law.py").write_text(LAW)

    async def scenario(_: Hub, ask: Ask, events: Events) -> None:
        assert [file["path"] for file in await ask("data_files", holds="function")] == ["law.py"]
        source = await ask("read_source", file="law.py")
        assert source["text"] == LAW
        assert source["functions"][0] == {
            "name": "law",
            "arguments": ["u", "t", "gain=…"],
            "line": 5,
            "doc": "",
        }
        assert not source["trusted"]
        document = await ask("new", document_kind="diagram")
        since = len(events)
        await ask("change", document=document, key="1", edit=function_block("f", "law.py:law"))
        (finding,) = await findings(events, since)
        assert (finding["block"], "the code of law.py is not trusted" in finding["what"]) == ("f", True)
        since = len(events)
        await ask("run", document=document, speed=None, tuned={})
        assert "not trusted" in (await end_of_run(events, since))["fault"]["what"]
        assert not (tmp_path / "ran").exists()
        with pytest.raises(ArmblocksError, match="the file has changed since it was shown"):
            await ask("trust_source", file="law.py", digest="0" * 64, trusted=True)
        since = len(events)
        await ask("trust_source", file="law.py", digest=source["digest"], trusted=True)
        assert await findings(events, since) == []
        assert (tmp_path / "ran").exists()
        since = len(events)
        await ask("run", document=document, speed=None, tuned={})
        assert (await end_of_run(events, since))["fault"] is None
        # every change of the file requires trust again
        (tmp_path / "ran").unlink()
        (tmp_path / "law.py").write_text(LAW.replace("gain * u", "gain / 0 * u"))
        source = await ask("read_source", file="law.py")
        assert not source["trusted"]
        since = len(events)
        await ask("run", document=document, speed=None, tuned={})
        assert "not trusted" in (await end_of_run(events, since))["fault"]["what"]
        assert not (tmp_path / "ran").exists()
        since = len(events)
        await ask("trust_source", file="law.py", digest=source["digest"], trusted=True)
        (finding,) = await findings(events, since)
        assert finding["block"] == "f"
        assert "law.py, line 6: ZeroDivisionError" in finding["what"]

    run_scenario(tmp_path, scenario, runs=True)


def test_ports_follow_the_arguments_after_a_reload(tmp_path: Path) -> None:
    (tmp_path / "law.py").write_text("def law(u):\n    return u\n")

    async def scenario(_: Hub, ask: Ask, events: Events) -> None:
        document = await ask("new", document_kind="diagram")
        await ask(
            "change",
            document=document,
            key="1",
            edit=function_block("f", "law.py:law", "CalledPythonFunction"),
        )
        (tmp_path / "law.py").write_text("def law(u, v):\n    return u\n")
        since = len(events)
        edit = {"kind": "parameters", "block": "one", "values": {"value": 3.0}}
        await ask("change", document=document, key="2", edit=edit)
        assert "the arguments of law are different" in (await findings(events, since))[0]["what"]
        edit = {"kind": "parameters", "block": "f", "values": {"function": "law.py:law"}}
        since = len(events)
        await ask("change", document=document, key="3", edit=edit)
        changed = next(event for event in events[since:] if event["kind"] == "changed")
        ports = changed["change"]["sheet"]["blocks"]["f"]["inputs"]
        assert [port["name"] for port in ports] == ["u", "v"]
        (tmp_path / "law.py").write_text("def law(u, v):\n    return u +\n")
        source = await ask("read_source", file="law.py")
        assert "line 2" in source["fault"]["what"]
        with pytest.raises(ArmblocksError, match="the file is not Python: line 2"):
            await ask("change", document=document, key="4", edit=edit)

    run_scenario(tmp_path, scenario, runs=True)


def test_hidden_characters_of_a_source_are_shown(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("def law(u):\n    return u  # \u202e } \u200b\n")
    (tmp_path / "b.py").write_bytes(b"# -*- coding: utf-7 -*-\n#+AAo-def law(u): return u\n")

    async def scenario(_: Hub, ask: Ask, events: Events) -> None:
        source = await ask("read_source", file="a.py")
        assert source["hidden"] == 2
        assert "\\u202e" in source["text"]
        # the text that Python would run, in the encoding that the file declares
        assert "\ndef law(u)" in (await ask("read_source", file="b.py"))["text"]

    run_scenario(tmp_path, scenario, runs=True)
