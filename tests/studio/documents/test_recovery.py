"""Recovery of diagrams after a crash, without replacing files that were changed by other programs."""

from __future__ import annotations

import asyncio
import os
import random
from pathlib import Path
from typing import Any

import pytest
from crashed_disk import Disk, carry_out, run_async

from armblocks.errors import ArmblocksError, FormatError, InputError
from armblocks.formats import diagram_to_bytes, load_robot
from armblocks.studio.documents import open_files
from armblocks.studio.protocol.messages import documents as document_messages
from armblocks.studio.protocol.messages.sheet_edits import (
    AddBlocks,
    DiagramEdit,
    MoveBlocks,
    NewBlock,
    Place,
    SetParameters,
)
from armblocks.studio.sheet.document import Document
from armblocks.studio.sheet.open_documents import OpenDocument, OpenDocuments


def change(key: str, edit: DiagramEdit, **more: Any) -> document_messages.Change:
    return document_messages.Change(document="", key=key, edit=edit, **more)


def add(name: str, kind: str = "Gain") -> AddBlocks:
    return AddBlocks(blocks=[NewBlock(name=name, type=kind, place=Place(x=0, y=0))])


def content(open_file: OpenDocument) -> bytes:
    return diagram_to_bytes(open_file.document.diagram, load_robot)


def random_requests(seed: int, count: int) -> list[Any]:
    """Edits of all kinds with undo and redo between them; invalid ones are refused."""
    random_ = random.Random(seed)
    requests: list[Any] = []
    for k in range(count):
        some = f"b{random_.randrange(8)}"
        edits: list[DiagramEdit] = [
            add(f"b{random_.randrange(8)}", random_.choice(["Gain", "Integrator", "Sum"])),
            SetParameters(block=some, values={"gain": random_.random()}),
            MoveBlocks(places={some: Place(x=float(k), y=1.5)}),
        ]
        requests.append(
            random_.choice(
                [
                    change(f"{seed} {k}", random_.choice(edits)),
                    change(f"{seed} {k}", random_.choice(edits)),
                    document_messages.Undo(document="", key=f"{seed} {k}"),
                    document_messages.Redo(document="", key=f"{seed} {k}"),
                ]
            )
        )
    return requests


@pytest.mark.parametrize("seed", range(12))
def test_recovered_edits_have_their_undo_and_redo_history(disk: Disk, tmp_path: Path, seed: int) -> None:
    async def scenario() -> None:
        documents = disk.documents()
        open_file = documents.new()
        carry_out(documents, open_file, random_requests(seed, 150))
        if seed % 3 == 0:
            await documents.save(open_file, "saved.json", overwrite=False)
        carry_out(documents, open_file, random_requests(seed + 1000, 150))
        after = disk.as_after_a_crash(tmp_path / "second").documents()
        recovered = after.attach(open_file.key)
        assert content(recovered) == content(open_file)
        assert recovered.document.version == open_file.document.version
        assert recovered.document.dirty == open_file.document.dirty
        assert recovered.path == open_file.path
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


def test_a_long_journal_is_replayed_from_its_last_snapshot(disk: Disk, tmp_path: Path) -> None:
    async def scenario() -> None:
        documents = disk.documents()
        open_file = documents.new()
        documents.perform(open_file, change("0", add("gain")))
        for k in range(1, 450):
            documents.perform(
                open_file, change(str(k), SetParameters(block="gain", values={"gain": float(k)}))
            )
            await asyncio.sleep(0.002 if k % 200 < 2 else 0)
        for _ in range(100):
            await asyncio.sleep(0.01)
            if open_file.snapshot is not None and open_file.snapshot.done():
                break
        for k in range(300):
            documents.perform(open_file, document_messages.Undo(document="", key=f"u{k}"))
        recovered = disk.as_after_a_crash(tmp_path / "second").documents().attach(open_file.key)
        assert content(recovered) == content(open_file)
        assert recovered.document.diagram.blocks["gain"].parameter_value("gain") == 149.0

    run_async(scenario)


def test_a_journal_cut_anywhere_recovers_the_complete_edits_before_the_cut(
    disk: Disk, tmp_path: Path
) -> None:
    async def scenario() -> None:
        documents = disk.documents()
        open_file = documents.new()
        states = [content(open_file)]
        for k in range(6):
            documents.perform(open_file, change(str(k), add(f"b{k}")))
            states.append(content(open_file))
        journal = disk.state_folder.journals / f"{open_file.key}.diagram"
        whole = journal.read_bytes()
        ends = [0, *(k + 1 for k, byte in enumerate(whole) if byte == 10)]
        other = disk.as_after_a_crash(tmp_path / "second")
        copy = other.state_folder.journals / journal.name
        for record in range(2, len(ends)):  # recovery needs at least a head and a snapshot
            for cut in (ends[record] - 1, ends[record], ends[record] + 7):
                copy.unlink()  # also removes the lock of the previous recovery
                copy.write_bytes(whole[: min(cut, len(whole))])
                waiting = other.documents()
                applied = record - 2 if cut >= ends[record] else record - 3
                if applied < 0:
                    assert [entry.missing != "" for entry in waiting.recoverable.descriptions()] == [True]
                    continue
                assert [entry.edits for entry in waiting.recoverable.descriptions()] == [applied] * (
                    applied > 0
                )
                if applied > 0:
                    recovered = await waiting.recover(
                        document_messages.Recover(document=open_file.key, action="open")
                    )
                    assert recovered is not None
                    assert content(recovered) == states[applied]

    run_async(scenario)


def test_an_edit_repeated_after_a_crash_is_applied_once(disk: Disk, tmp_path: Path) -> None:
    async def scenario() -> None:
        documents = disk.documents()
        open_file = documents.new()
        documents.perform(open_file, change("one", add("gain")))
        after = disk.as_after_a_crash(tmp_path / "second").documents()
        recovered = after.attach(open_file.key)
        assert not after.perform(recovered, change("one", add("gain")))
        assert after.perform(recovered, change("two", add("gain 2")))
        assert sorted(recovered.document.diagram.blocks) == ["gain", "gain 2"]

    run_async(scenario)


def test_a_page_finds_its_document_after_a_server_restart(disk: Disk) -> None:
    async def scenario() -> None:
        first = disk.documents()
        new = first.new()
        await first.save(new, "a.json", overwrite=False)
        first.close_all()
        documents = disk.documents()
        key = "0123456789abcdef"
        open_file = documents.attach(key, path="a.json")
        assert open_file.key == key
        again = documents.attach("f" * 16, path="a.json")
        assert again is open_file
        assert documents["f" * 16] is open_file
        example = documents.attach("e" * 16, origin="van_der_pol_pid")
        assert example.document.diagram.name == "van_der_pol_pid"
        assert documents.attach("d" * 16).document.diagram.blocks == {}
        with pytest.raises(ArmblocksError, match="there is no such file"):
            documents.attach("c" * 16, path="gone.json")

    run_async(scenario)


def test_a_file_newer_than_the_journal_is_kept_beside_the_recovered_file(disk: Disk, tmp_path: Path) -> None:
    async def scenario() -> None:
        documents = disk.documents()
        open_file = documents.new()
        documents.perform(open_file, change("1", add("gain")))
        await documents.save(open_file, "a.json", overwrite=False)
        documents.perform(open_file, change("2", add("mine")))
        after_crash = disk.as_after_a_crash(tmp_path / "second")
        other_path = after_crash.project.path("a.json")
        other_path.write_bytes(other_path.read_bytes().replace(b'"gain"', b'"other"'))
        newer = other_path.read_bytes()
        after = after_crash.documents()
        (recovery,) = after.recoverable.descriptions()
        assert (recovery.path, recovery.disk, recovery.edits) == ("a.json", "changed", 1)
        recovered = await after.recover(document_messages.Recover(document=open_file.key, action="keep_both"))
        assert recovered is not None
        assert recovered.path is not None
        assert recovered.path.startswith("a recovered 20")
        assert other_path.read_bytes() == newer
        assert sorted(recovered.document.diagram.blocks) == ["gain", "mine"]
        assert not recovered.document.dirty
        assert after.recoverable.descriptions() == []

    run_async(scenario)


def test_a_recovered_diagram_does_not_overwrite_a_newer_file(disk: Disk, tmp_path: Path) -> None:
    async def scenario() -> None:
        documents = disk.documents()
        open_file = documents.new()
        await documents.save(open_file, "a.json", overwrite=False)
        documents.perform(open_file, change("2", add("mine")))
        after_crash = disk.as_after_a_crash(tmp_path / "second")
        after_crash.project.path("a.json").write_bytes(b"{}")
        after = after_crash.documents()
        recovered = await after.recover(document_messages.Recover(document=open_file.key, action="open"))
        assert recovered is not None
        assert (recovered.disk, recovered.document.dirty) == ("changed", True)
        with pytest.raises(ArmblocksError, match="the file has changed on the disk"):
            await after.save(recovered, "", overwrite=False)

    run_async(scenario)


def test_a_recovery_is_discarded_only_on_request(disk: Disk, tmp_path: Path) -> None:
    async def scenario() -> None:
        documents = disk.documents()
        open_file = documents.new()
        documents.perform(open_file, change("1", add("gain")))
        second = disk.as_after_a_crash(tmp_path / "second")
        second.documents().close_all()
        after = second.documents()
        assert len(after.recoverable.descriptions()) == 1
        assert (
            await after.recover(document_messages.Recover(document=open_file.key, action="discard")) is None
        )
        with pytest.raises(ArmblocksError, match="there is no diagram to recover named"):
            await after.recover(document_messages.Recover(document=open_file.key, action="open"))
        assert second.documents().recoverable.descriptions() == []

    run_async(scenario)


def test_saved_diagrams_leave_no_journal(disk: Disk) -> None:
    async def scenario() -> None:
        documents = disk.documents()
        open_file = documents.new()
        documents.perform(open_file, change("1", add("gain")))
        assert len(list(disk.state_folder.journals.iterdir())) == 1
        with pytest.raises(InputError, match="'untitled' has unsaved edits"):
            documents.close(open_file, discard=False)
        await documents.save(open_file, "a.json", overwrite=False)
        documents.close_all()
        assert list(disk.state_folder.journals.iterdir()) == []

    run_async(scenario)


@pytest.mark.filterwarnings("ignore::armblocks.errors.InertiaWarning")
def test_a_missing_robot_file_is_reported_and_the_journal_remains(disk: Disk, tmp_path: Path) -> None:
    async def scenario() -> None:
        from armblocks.formats import write_robot

        (disk.project.root / "arm.json").write_bytes(write_robot(load_robot("kr180")))

        def resolve(name: str) -> Any:
            return load_robot(str(disk.project.root / "arm.json") if name == "arm.json" else name)

        documents = OpenDocuments(disk.project, disk.state_folder, resolve)
        open_file = documents.new()
        block = NewBlock(name="arm", type="Fkine", place=Place(x=0, y=0), parameters={"robot": "arm.json"})
        documents.perform(open_file, change("1", add("gain")))
        documents.perform(open_file, change("2", AddBlocks(blocks=[block])))
        second = disk.as_after_a_crash(tmp_path / "second")
        after = OpenDocuments(second.project, second.state_folder, lambda name: load_robot("no " + name))
        (recovery,) = after.recoverable.descriptions()
        assert recovery.missing.startswith("the last 1 edit could not be repeated")
        recovered = await after.recover(document_messages.Recover(document=open_file.key, action="open"))
        assert recovered is not None
        assert list(recovered.document.diagram.blocks) == ["gain"]
        assert recovered.document.dirty
        assert [path.suffix for path in second.state_folder.journals.iterdir()] == [".unread"]

    run_async(scenario)


def test_a_disk_error_in_the_journal_does_not_prevent_edits(
    disk: Disk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        documents = disk.documents()
        open_file = documents.new()
        documents.perform(open_file, change("1", add("one")))

        def refuse(*_: object) -> int:
            raise OSError(28, "No space left on device")

        with monkeypatch.context() as patch:
            patch.setattr(os, "write", refuse)
            documents.perform(open_file, change("2", add("two")))
            assert not open_file.state().journaled
        documents.perform(open_file, document_messages.Undo(document="", key="3"))
        documents.perform(open_file, document_messages.Undo(document="", key="4"))
        documents.perform(open_file, document_messages.Redo(document="", key="5"))
        assert open_file.state().journaled
        recovered = disk.as_after_a_crash(tmp_path / "second").documents().attach(open_file.key)
        assert content(recovered) == content(open_file)

    run_async(scenario)


def test_pages_are_notified_of_a_disk_error_in_the_journal(
    disk: Disk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(open_files, "SYNC_SECONDS", 0.0)

    async def scenario() -> None:
        documents = disk.documents()
        events: list[bool] = []
        notified = asyncio.Event()

        async def notify(open_file: OpenDocument) -> None:
            events.append(open_file.state().journaled)
            notified.set()

        watching = asyncio.create_task(documents.watch(notify))
        open_file = documents.new()
        await asyncio.sleep(0)

        def refuse(_: int) -> None:
            raise OSError(5, "Input/output error")

        with monkeypatch.context() as patch:
            patch.setattr(os, "fsync", refuse)
            documents.perform(open_file, change("1", add("one")))
            async with asyncio.timeout(30):
                await notified.wait()
        assert events == [False]
        watching.cancel()

    run_async(scenario)


def test_a_disk_error_in_a_save_leaves_the_diagram_and_the_journal(
    disk: Disk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        documents = disk.documents()
        open_file = documents.new()
        await documents.save(open_file, "a.json", overwrite=False)
        documents.perform(open_file, change("1", add("one")))
        old = disk.project.read("a.json")

        def refuse(*_: object) -> None:
            raise OSError(28, "No space left on device")

        with monkeypatch.context() as patch:
            patch.setattr(Path, "replace", refuse)
            with pytest.raises(FormatError, match=r"No space left on device.*free space"):
                await documents.save(open_file, "", overwrite=False)
        assert (open_file.document.dirty, open_file.disk) == (True, "same")
        assert disk.project.read("a.json") == old
        recovered = disk.as_after_a_crash(tmp_path / "second").documents().attach(open_file.key)
        assert content(recovered) == content(open_file)
        await documents.save(open_file, "", overwrite=False)
        assert not open_file.document.dirty

    run_async(scenario)


def test_an_unreadable_journal_is_not_overwritten(disk: Disk) -> None:
    async def scenario() -> None:
        key = "0123456789abcdef"
        disk.state_folder.journals.mkdir(parents=True)
        journal = disk.state_folder.journals / f"{key}.diagram"
        journal.write_bytes(b"nothing that is a journal")
        documents = disk.documents()
        with pytest.raises(FormatError, match="the journal contains no complete record"):
            documents.attach(key)
        assert journal.read_bytes() == b"nothing that is a journal"
        assert [offer.document for offer in documents.recoverable.descriptions()] == [key]

    run_async(scenario)


def test_a_defect_during_replay_keeps_the_edits_before_it(
    disk: Disk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        documents = disk.documents()
        open_file = documents.new()
        for k in range(4):
            documents.perform(open_file, change(str(k), add(f"b{k}")))
        second = disk.as_after_a_crash(tmp_path / "second")
        real = Document.outcome

        def defect(self: Document, request: document_messages.Change) -> Any:
            if request.key == "2":
                raise KeyError("something")
            return real(self, request)

        monkeypatch.setattr(Document, "outcome", defect)
        after = second.documents()
        (offer,) = after.recoverable.descriptions()
        assert offer.missing == "the last 2 edits could not be repeated: armblocks has a defect (KeyError)"
        assert sorted(after.attach(open_file.key).document.diagram.blocks) == ["b0", "b1"]

    run_async(scenario)


def test_a_deleted_or_renamed_file_is_reported_and_its_content_remains(
    disk: Disk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(open_files, "WATCH_SECONDS", 0.01)

    async def scenario() -> None:
        documents = disk.documents()
        events: asyncio.Queue[str] = asyncio.Queue()

        async def notify(open_file: OpenDocument) -> None:
            events.put_nowait(open_file.disk)

        watching = asyncio.create_task(documents.watch(notify))
        open_file = documents.new()
        documents.perform(open_file, change("1", add("one")))
        await documents.save(open_file, "a.json", overwrite=False)
        place = disk.project.path("a.json")
        async with asyncio.timeout(30):
            place.rename(place.with_name("b.json"))
            assert await events.get() == "gone"
            assert open_file.document.dirty
            crashed = disk.as_after_a_crash(tmp_path / "second").documents()
            assert [(offer.path, offer.disk) for offer in crashed.recoverable.descriptions()] == [
                ("a.json", "gone")
            ]
            place.with_name("b.json").rename(place)
            assert await events.get() == "same"
            place.unlink()
            assert await events.get() == "gone"
            await documents.save(open_file, "", overwrite=False)
        assert disk.project.exists("a.json")
        watching.cancel()

    run_async(scenario)
