"""Undoing any sequence of edits restores the file byte by byte: edits of every kind, on every sheet."""

from __future__ import annotations

import random
from collections import Counter
from pathlib import Path

import pytest
from crashed_disk import Disk, run_async
from sheet_edits import MAKERS, random_edit

from armblocks.errors import ArmblocksError
from armblocks.formats import diagram_to_bytes, load_robot
from armblocks.studio.protocol.messages import documents as document_messages
from armblocks.studio.sheet.document import Document
from armblocks.studio.sheet.edits import EDITS

MODELS = ("puma560_servos", "van_der_pol_pid", "kr180model", "puma560_payload_drop")
SEEDS = 28
MIN_EDITS = 3
"""Minimum number of applied edits of each kind, so that the test covers all kinds."""


def content(document: Document) -> bytes:
    return diagram_to_bytes(document.diagram, load_robot)


def test_the_generators_cover_every_kind_of_edit() -> None:
    assert set(MAKERS) == set(EDITS.entries)


def test_random_edits_are_undone_redone_and_recovered_from_the_journal(tmp_path: Path) -> None:
    applied: Counter[type] = Counter()
    inner = 0

    async def scenario() -> None:
        nonlocal inner
        for seed in range(SEEDS):
            (tmp_path / str(seed) / "project").mkdir(parents=True)
            disk, rng = Disk(tmp_path / str(seed)), random.Random(seed)
            documents = disk.documents()
            open_file = documents.open_shipped(MODELS[seed % len(MODELS)])
            document = open_file.document
            original = content(document)
            diagrams = [document.diagram]
            for number in range(40):
                path, edit = random_edit(document, rng)
                request = document_messages.Change(
                    document="", key=f"{seed} {number}", inside=path, edit=edit
                )
                try:
                    documents.perform(open_file, request)
                except ArmblocksError:
                    assert document.diagram is diagrams[-1]
                    continue
                assert document.undo_title == EDITS.title(edit)
                applied[type(edit)] += 1
                inner += bool(path)
                diagrams.append(document.diagram)
            end = content(document)
            again = disk.as_after_a_crash(tmp_path / f"{seed} crashed").documents().attach(open_file.key)
            for one in (document, again.document):
                assert content(one) == end
                for expected in reversed(diagrams[:-1]):
                    one.undo()
                    assert one.diagram == expected
                assert one.undo_title == ""
                assert content(one) == original
                for expected in diagrams[1:]:
                    one.redo()
                    assert one.diagram == expected
                assert one.redo_title == ""
                assert content(one) == end

    run_async(scenario)
    for kind in MAKERS:
        assert applied[kind] >= MIN_EDITS, (kind, applied)
    assert inner > SEEDS


@pytest.mark.parametrize("seed", range(2))
def test_random_edits_are_reproducible_from_the_seed(seed: int, tmp_path: Path) -> None:
    (tmp_path / "project").mkdir()

    async def scenario() -> None:
        document = Disk(tmp_path).documents().open_shipped("puma560_servos").document
        assert random_edit(document, random.Random(seed)) == random_edit(document, random.Random(seed))

    run_async(scenario)
