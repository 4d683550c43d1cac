"""Recovery of robot edits after a crash, with the same journal as for diagrams."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import pytest
from crashed_disk import Disk, carry_out, run_async

from armblocks.errors import ArmblocksError, FormatError, InputError
from armblocks.formats import load_robot, write_robot
from armblocks.studio.documents import open_files
from armblocks.studio.documents.older_journals import converted
from armblocks.studio.protocol.messages import documents as document_messages
from armblocks.studio.protocol.messages.robot_edits import AddJoint, RenameLink, SetCell
from armblocks.studio.protocol.messages.sheet_edits import ArrangeBlocks, Rename
from armblocks.studio.robots.open_robots import OpenRobot


def content(open_file: OpenRobot) -> bytes:
    return write_robot(open_file.robot)


def cell(
    key: str, link: str, column: str, text: str, gesture: str = "", **more: Any
) -> document_messages.Change:
    edit = SetCell(link=link, column=column, text=text, angles="deg")
    return document_messages.Change(document="", key=key, gesture=gesture, edit=edit, **more)


OLD_JOURNAL: list[tuple[dict[str, Any], document_messages.Alteration]] = [
    (
        {"kind": "robot_change", "gesture": "g", "edit": {"kind": "rename", "link": "a", "name": "b"}},
        document_messages.Change(document="", gesture="g", edit=RenameLink(link="a", name="b")),
    ),
    (
        {"kind": "robot_change", "gesture": "", "edit": {"kind": "add", "after": ""}},
        document_messages.Change(document="", edit=AddJoint(after="")),
    ),
    ({"kind": "robot_undo"}, document_messages.Undo(document="")),
    (
        {"kind": "arrange", "inside": ["a"]},
        document_messages.Change(document="", inside=["a"], edit=ArrangeBlocks()),
    ),
    (
        {"kind": "change", "inside": [], "edit": {"kind": "rename", "block": "a", "name": "b"}},
        document_messages.Change(document="", edit=Rename(block="a", name="b")),
    ),
]


@pytest.mark.parametrize(("written", "expected"), OLD_JOURNAL)
def test_journaled_requests_of_version_0_2_0_are_converted(
    written: dict[str, Any], expected: document_messages.Alteration
) -> None:
    assert type(expected).model_validate({**converted(written), "document": ""}) == expected


def requests(seed: int, count: int) -> list[Any]:
    """Requests that type texts into cells, several per cell, with undo and redo between them."""
    random_ = random.Random(seed)
    result: list[Any] = []
    while len(result) < count:
        gesture = f"{seed} {len(result)}" if random_.random() < 0.7 else ""
        link, column = f"link{random_.randrange(1, 8)}", random_.choice(["a", "d", "mass", "alpha", "Ixx"])
        for _ in range(random_.randrange(1, 5)):
            result.append(cell(f"{seed} {len(result)}", link, column, f"{random_.random():.3f}", gesture))
        for kind in (document_messages.Undo, document_messages.Redo):
            for _ in range(random_.randrange(3)):
                result.append(kind(document="", key=f"{seed} {len(result)}"))
    return result


@pytest.mark.parametrize("seed", range(8))
def test_recovered_robot_edits_have_their_undo_and_redo_history(
    disk: Disk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    monkeypatch.setattr(open_files, "SNAPSHOT_EVERY", 25)  # some snapshots fall between the texts of one cell

    async def scenario() -> None:
        robots = disk.robots()
        open_file = robots.open_shipped("puma560")
        carry_out(robots, open_file, requests(seed, 60))
        if open_file.snapshot is not None:
            await open_file.snapshot
        if seed % 3 == 0:
            await robots.save(open_file, "arms/mine.json", overwrite=False)
        carry_out(robots, open_file, requests(seed + 1000, 40))
        recovered = disk.as_after_a_crash(tmp_path / "second").robots().attach(open_file.key)
        assert content(recovered) == content(open_file)
        assert recovered.document.version == open_file.document.version
        assert recovered.document.dirty == open_file.document.dirty
        assert (recovered.path, recovered.origin) == (open_file.path, open_file.origin)
        while recovered.document.undo_title:  # up to the start of the journal
            assert recovered.document.undo_title == open_file.document.undo_title
            recovered.document.undo()
            open_file.document.undo()
            assert content(recovered) == content(open_file)
        while open_file.document.redo_title:
            recovered.document.redo()
            open_file.document.redo()
        assert content(recovered) == content(open_file)

    run_async(scenario)


def test_a_snapshot_within_a_gesture_does_not_split_its_undo_step(
    disk: Disk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(open_files, "SNAPSHOT_EVERY", 2)

    async def scenario() -> None:
        robots = disk.robots()
        open_file = robots.open_shipped("puma560")
        for number, text in enumerate(("1", "1.2", "1.25")):
            robots.perform(open_file, cell(str(number), "link2", "a", text, "one cell"))
            if open_file.snapshot is not None:
                await open_file.snapshot
        recovered = disk.as_after_a_crash(tmp_path / "second").robots().attach(open_file.key)
        assert recovered.robot.links[1].dh is not None
        assert recovered.robot.links[1].dh.a == 1.25
        recovered.document.undo()
        assert recovered.robot == load_robot("puma560")

    run_async(scenario)


def test_unsaved_robots_are_offered_and_do_not_overwrite_a_newer_file(disk: Disk, tmp_path: Path) -> None:
    async def scenario() -> None:
        robots = disk.robots()
        open_file = robots.open_shipped("puma560")
        await robots.save(open_file, "arm.json", overwrite=False)
        robots.perform(open_file, cell("1", "link1", "mass", "7"))
        documents = disk.documents()
        documents.perform(
            documents.new(), document_messages.Change(document="", key="1", edit=ArrangeBlocks())
        )
        second = disk.as_after_a_crash(tmp_path / "second")
        newer_content = write_robot(load_robot("kr180"))
        second.project.path("arm.json").write_bytes(newer_content)
        restarted = second.robots()
        (offer,) = restarted.recoverable.descriptions()
        assert (offer.kind, offer.path, offer.disk, offer.edits, offer.parts) == (
            "robot",
            "arm.json",
            "changed",
            1,
            6,
        )
        assert [offer.kind for offer in second.documents().recoverable.descriptions()] == ["diagram"]
        recovered = await restarted.recover(
            document_messages.Recover(document=open_file.key, action="keep_both")
        )
        assert recovered is not None
        assert recovered.path is not None
        assert recovered.path.startswith("arm recovered 20")
        assert recovered.robot.links[0].mass == 7
        assert second.project.read("arm.json") == newer_content
        with pytest.raises(ArmblocksError, match="there is no robot to recover named"):
            await restarted.recover(document_messages.Recover(document=open_file.key, action="open"))

    run_async(scenario)


def test_a_robot_edit_repeated_after_a_crash_is_applied_once(disk: Disk, tmp_path: Path) -> None:
    async def scenario() -> None:
        robots = disk.robots()
        open_file = robots.new()
        robots.perform(open_file, cell("one", "link1", "a", "2"))
        robots.perform(open_file, document_messages.Undo(document="", key="two"))
        restarted = disk.as_after_a_crash(tmp_path / "second").robots()
        recovered = restarted.attach(open_file.key)
        assert not restarted.perform(recovered, cell("one", "link1", "a", "2"))
        assert not restarted.perform(recovered, document_messages.Undo(document="", key="two"))
        assert restarted.perform(recovered, document_messages.Redo(document="", key="three"))
        assert recovered.robot.links[0].dh is not None
        assert recovered.robot.links[0].dh.a == 2

    run_async(scenario)


def test_a_page_finds_its_robot_after_a_server_restart(disk: Disk) -> None:
    async def scenario() -> None:
        first = disk.robots()
        opened = first.new()
        await first.save(opened, "arm.json", overwrite=False)
        first.close_all()
        robots = disk.robots()
        open_file = robots.attach("0123456789abcdef", "arm.json")
        assert (open_file.key, open_file.robot) == ("0123456789abcdef", opened.robot)
        assert robots.attach("f" * 16, "arm.json") is open_file
        assert robots["f" * 16] is open_file
        assert robots.attach("e" * 16, origin="kr180").robot == load_robot("kr180")
        assert robots.attach("d" * 16).robot == opened.robot

    run_async(scenario)


def test_a_dropped_robot_is_journaled_before_its_first_edit(disk: Disk, tmp_path: Path) -> None:
    async def scenario() -> None:
        robots = disk.robots()
        open_file = robots.open_value(load_robot("kr180"))
        assert open_file.document.dirty
        with pytest.raises(InputError, match="has unsaved edits"):
            robots.close(open_file, discard=False)
        recovered = disk.as_after_a_crash(tmp_path / "second").robots().attach(open_file.key)
        assert recovered.robot == load_robot("kr180")

    run_async(scenario)


def test_reloading_a_changed_robot_file_is_one_undo_step(disk: Disk, tmp_path: Path) -> None:
    async def scenario() -> None:
        robots = disk.robots()
        open_file = robots.new()
        with pytest.raises(FormatError, match="the robot has no file yet"):
            robots.reload(open_file)
        await robots.save(open_file, "arm.json", overwrite=False)
        robots.perform(open_file, cell("1", "link1", "a", "2"))
        before = open_file.robot
        disk.project.write("arm.json", write_robot(load_robot("kr180")))
        with pytest.raises(FormatError, match="the file has changed on the disk since it was opened"):
            await robots.save(open_file, "", overwrite=False)
        assert open_file.state().disk == "changed"
        for _ in range(2):  # a repeated request is applied once
            robots.reload(open_file, "reload")
        assert open_file.robot == load_robot("kr180")
        assert not open_file.document.dirty
        recovered = disk.as_after_a_crash(tmp_path / "second").robots().attach(open_file.key)
        recovered.document.undo()
        assert recovered.robot == before

    run_async(scenario)


def test_a_page_does_not_overwrite_a_cell_changed_by_another_page(disk: Disk) -> None:
    async def scenario() -> None:
        robots = disk.robots()
        open_file = robots.open_shipped("puma560")
        robots.perform(open_file, cell("1", "link1", "a", "2", author="other", base=0))
        robots.perform(open_file, cell("2", "link1", "d", "3", author="me", base=0))  # another cell
        for conflicting in (
            cell("3", "link1", "a", "4", author="me", base=0),
            document_messages.Undo(document="", key="4", author="me", base=0),
        ):
            with pytest.raises(InputError, match=r"another page.*repeat the edit"):
                robots.perform(open_file, conflicting)
        assert open_file.robot.links[0].dh is not None
        assert (open_file.robot.links[0].dh.a, open_file.robot.links[0].dh.d) == (2, 3)
        robots.perform(
            open_file, cell("5", "link1", "a", "4", author="me", base=2)
        )  # after seeing the change

    run_async(scenario)
