"""An interrupted save leaves the complete old or new file; no acknowledged save is lost."""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
from pathlib import Path
from time import sleep

import pytest

from armblocks.errors import FormatError
from armblocks.studio.documents.project_folder import ProjectFolder

TRIALS = int(os.environ.get("ARMBLOCKS_KILLED_SAVES", "12"))
"""Number of interrupted saves; 500 in the long version."""
SIZE = 4 * 2**20
SAVE_LOOP = """
import sys
from armblocks.studio.documents.project_folder import ProjectFolder
folder = ProjectFolder(sys.argv[1])
number = int(sys.argv[2])
while True:
    number += 1
    folder.write("a.json", b'{"number": %d, "text": "%s"}' % (number, b"x" * int(sys.argv[3])))
    print(number, flush=True)
"""


def test_a_killed_save_leaves_a_complete_file_no_older_than_acknowledged(tmp_path: Path) -> None:
    random_ = random.Random(1)
    path = tmp_path / "a.json"
    number = 0
    for _ in range(TRIALS):
        command = [sys.executable, "-c", SAVE_LOOP, str(tmp_path), str(number), str(SIZE)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            acknowledged = int(process.stdout.readline())
            sleep(random_.uniform(0, 0.15))
            process.kill()
            acknowledged = max([acknowledged, *map(int, process.stdout.read().split())])
        saved = json.loads(path.read_text())
        assert len(saved["text"]) == SIZE
        assert saved["number"] in (acknowledged, acknowledged + 1)
        number = saved["number"]
    for stray_file in tmp_path.glob(".*"):
        os.utime(stray_file, (0, 0))
    ProjectFolder(tmp_path).remove_stray_files(["a.json"])
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.json"]


@pytest.mark.parametrize("call", ["open", "write", "fsync", "replace", "fsync of the folder"])
def test_a_disk_error_in_any_step_of_a_save_leaves_a_complete_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str
) -> None:
    folder = ProjectFolder(tmp_path)
    folder.write("a.json", b"old")
    syncs: list[int] = []
    real_sync = os.fsync

    def refuse(*_: object, **__: object) -> int:
        raise OSError(28, "No space left on device")

    def refuse_second(descriptor: int) -> None:
        syncs.append(descriptor)
        if len(syncs) == 2:
            refuse()
        real_sync(descriptor)

    class Full:
        """A stream on a full disk."""

        def __init__(self, descriptor: int) -> None:
            self.descriptor = descriptor

        def __enter__(self) -> Full:
            return self

        def __exit__(self, *_: object) -> None:
            os.close(self.descriptor)

        write = refuse

    with monkeypatch.context() as patch:
        if call == "open":
            patch.setattr(os, "open", refuse)
        elif call == "write":
            patch.setattr(os, "fdopen", lambda descriptor, _: Full(descriptor))  # pyright: ignore
        elif call == "fsync":
            patch.setattr(os, "fsync", refuse)
        elif call == "replace":
            patch.setattr(Path, "replace", refuse)
        else:
            patch.setattr(os, "fsync", refuse_second)
        with pytest.raises(FormatError, match=r"cannot be written \(No space left on device\)") as refused:
            folder.write("a.json", b"new")
    assert "a.json" in refused.value.where
    assert "free space" in refused.value.fix
    # If only the sync of the folder fails, the name already refers to the new file.
    assert folder.read("a.json") == (b"new" if call == "fsync of the folder" else b"old")
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.json"]
    folder.write("a.json", b"newer")
    assert folder.read("a.json") == b"newer"
