"""The disk cache: atomic writes, damaged files, folders that cannot be written, and pruning."""

import multiprocessing
import os
import time
from pathlib import Path

import casadi
import numpy as np
import pytest
from small_functions import traced

from armblocks import user_folders
from armblocks.compiler import Kernel, cache, cached_kernel, compile_function
from armblocks.compiler.tape import Tape
from armblocks.equations import TracedFunction


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("ARMBLOCKS_CACHE_DIR", str(tmp_path / "cache"))
    return tmp_path / "cache"


def function() -> TracedFunction:
    return traced(lambda a: casadi.sin(a) * casadi.exp(a), 3, name="cached")


def files(folder: Path) -> list[Path]:
    return sorted(folder.glob("??/*"))


A = np.array([0.5, 1.0, -2.0])
EXPECTED = np.sin(A) * np.exp(A)


def counting(calls: list[str]) -> TracedFunction:
    calls.append("traced")
    return function()


def test_a_cached_function_is_not_traced_again(folder: Path) -> None:
    calls: list[str] = []
    for _ in range(3):
        kernel = cached_kernel("my key", lambda: counting(calls))
        np.testing.assert_allclose(kernel(A), EXPECTED, rtol=1e-15)
        np.testing.assert_allclose(kernel(np.tile(A, (9, 1)))[8], EXPECTED, rtol=1e-15)
        assert kernel.inputs == function().inputs
        assert kernel.outputs == function().outputs
        assert kernel.count.function_calls == 6
        assert kernel.name == "cached"
    assert calls == ["traced"]
    assert len(files(folder)) == 4  # record, tape, code for one sample, code for batches
    cached_kernel("another key", lambda: counting(calls))
    assert calls == ["traced", "traced"]


def test_cached_code_is_loaded_without_compilation(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = compile_function(function())(A)

    def refuse(*_: object, **__: object) -> bytes:
        raise AssertionError("compiled again")

    monkeypatch.setattr("armblocks.compiler.native.compile_object", refuse)
    assert np.array_equal(compile_function(function())(A), first)
    with pytest.raises(AssertionError, match="compiled again"):
        compile_function(traced(lambda a: a * 3, 3))(A)


def flip(data: bytes) -> bytes:
    return data[:-20] + bytes([data[-20] ^ 1]) + data[-19:]


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: b"",
        lambda data: data[:30],
        lambda data: data[:-1],
        flip,
        lambda data: data + b"x",
        os.urandom,
    ],
    ids=["empty", "head only", "cut short", "one bit", "longer", "other content"],
)
def test_damaged_files_are_written_again(folder: Path, damage: object) -> None:
    calls: list[str] = []
    before = cached_kernel("key", lambda: counting(calls))(A)
    whole = {path: path.read_bytes() for path in files(folder)}
    for path, data in whole.items():
        path.write_bytes(damage(len(data) if damage is os.urandom else data))  # type: ignore[operator]
    assert np.array_equal(cached_kernel("key", lambda: counting(calls))(A), before)
    assert calls == ["traced", "traced"]
    assert {path: path.read_bytes() for path in files(folder)} == whole


def test_a_missing_tape_is_traced_again_when_it_is_needed(folder: Path) -> None:
    calls: list[str] = []
    cached_kernel("key", lambda: counting(calls))(A)
    for path in files(folder):
        content = cache.load(path.stem)
        assert content is not None
        if content.startswith(b"armblocks tape"):
            path.unlink()
    kernel = cached_kernel("key", lambda: counting(calls))
    kernel(A)
    assert calls == ["traced"]
    assert isinstance(kernel.tape, Tape)
    assert calls == ["traced", "traced"]


def test_a_tape_or_record_of_another_version_is_written_again(folder: Path) -> None:
    calls: list[str] = []
    kernel = cached_kernel("key", lambda: counting(calls))
    kernel(A)
    for path in files(folder):
        content = cache.load(path.stem) or b""
        if content.startswith(b"{"):
            cache.store(path.stem, b'{"name": 3}')
        elif content.startswith(b"armblocks tape"):
            cache.store(path.stem, b"old tape")
    rewritten = cached_kernel("key", lambda: counting(calls))
    assert rewritten.tape == kernel.tape
    assert calls == ["traced", "traced"]


def test_a_folder_that_cannot_be_written_does_not_raise_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    monkeypatch.setenv("ARMBLOCKS_CACHE_DIR", str(blocked / "cache"))
    np.testing.assert_allclose(cached_kernel("key", function)(A), EXPECTED, rtol=1e-15)
    assert blocked.read_text() == "not a folder"


def test_a_full_disk_leaves_no_files(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(self: Path, target: Path) -> Path:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    np.testing.assert_allclose(cached_kernel("key", function)(A), EXPECTED, rtol=1e-15)
    assert files(folder) == []


def test_an_empty_variable_switches_the_cache_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ARMBLOCKS_CACHE_DIR", "")
    assert cache.folder() is None
    np.testing.assert_allclose(cached_kernel("key", function)(A), EXPECTED, rtol=1e-15)
    cache.store("0" * 64, b"nothing")
    assert cache.load("0" * 64) is None


def test_the_default_folder_is_the_cache_folder_of_the_user(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ARMBLOCKS_CACHE_DIR")
    assert cache.folder() == user_folders.cache_folder()


def test_without_a_home_there_is_no_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ARMBLOCKS_CACHE_DIR")
    monkeypatch.setattr(user_folders, "cache_folder", lambda: None)
    monkeypatch.setattr(cache, "cache_folder", user_folders.cache_folder)
    assert cache.folder() is None


def test_the_least_recently_used_files_are_pruned_first(folder: Path) -> None:
    names = [f"{k:064x}" for k in range(10)]
    for age, name in enumerate(reversed(names)):
        cache.store(name, bytes(1000))
        path = next(folder.glob(f"??/{name}.bin"))
        moment = time.time() - 3600 * age
        os.utime(path, (moment, moment))
    old = folder / "00" / "killed-writer.tmp"
    old.write_bytes(b"x")
    os.utime(old, (1, 1))
    cache.prune(folder, limit=100_000)
    assert len(files(folder)) == 10
    cache.prune(folder, limit=6000)
    remaining = {path.stem for path in files(folder)}
    assert remaining == set(names[-4:])  # four files of 1050 bytes fit into three quarters of 6000 bytes


def test_the_folder_is_pruned_at_most_every_ten_minutes(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pruned: list[Path] = []
    monkeypatch.setattr(cache, "prune", pruned.append)
    for moment, times in (
        (None, 1),
        (time.time() - 500.0, 1),
        (time.time() - 700.0, 2),
        (time.time() + 1e5, 3),
    ):
        if moment is not None:
            os.utime(folder / "pruned", (moment, moment))
        for k in range(3):
            cache.store(f"{k:064x}", b"content")
        assert pruned == [folder] * times


def test_loading_a_file_renews_its_modification_time(folder: Path) -> None:
    cache.store("ab" * 32, b"content")
    path = next(folder.glob("??/*"))
    os.utime(path, (1000, 1000))
    assert cache.load("ab" * 32) == b"content"
    assert time.time() - path.stat().st_mtime < 60


def test_edited_sources_change_the_names_of_records_and_code(monkeypatch: pytest.MonkeyPatch) -> None:
    record, code = cache.record_name("key"), cache.object_name(("a", "b"))
    assert code != cache.object_name(("ab", ""))
    monkeypatch.setattr(cache, "package_fingerprint", lambda: "edited")
    monkeypatch.setattr(cache, "compiler_fingerprint", lambda: "edited")
    assert cache.record_name("key") != record
    assert cache.object_name(("a", "b")) != code


def test_the_fingerprint_changes_with_edits_of_python_files(tmp_path: Path) -> None:
    source = tmp_path / "sub" / "module.py"
    source.parent.mkdir()
    source.write_text("a = 1")
    before = cache._fingerprint(tmp_path)
    assert cache._fingerprint(tmp_path) == before
    (tmp_path / "notes.txt").write_text("no source")
    assert cache._fingerprint(tmp_path) == before
    source.write_text("a = 12")
    assert cache._fingerprint(tmp_path) != before


@pytest.mark.parametrize("folder", ["compiler", "routines", "integration"])
def test_edits_of_each_package_that_generates_code_change_the_fingerprint(
    folder: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("compiler", "routines", "integration"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "module.py").write_text("a = 1")
    monkeypatch.setattr(cache, "__file__", str(tmp_path / "compiler" / "cache.py"))
    fingerprint = cache.compiler_fingerprint.__wrapped__
    before = fingerprint()
    (tmp_path / "other.py").write_text("a = 1")
    assert fingerprint() == before
    (tmp_path / folder / "module.py").write_text("a = 12")
    assert fingerprint() != before


def _work(folder: str, results: "multiprocessing.Queue[list[float]]") -> None:
    os.environ["ARMBLOCKS_CACHE_DIR"] = folder
    kernel: Kernel = cached_kernel("shared key", function)
    results.put(kernel(A).tolist())


def test_processes_that_write_at_the_same_time_read_complete_files(folder: Path) -> None:
    context = multiprocessing.get_context("spawn")
    results: multiprocessing.Queue[list[float]] = context.Queue()
    workers = [context.Process(target=_work, args=(str(folder), results)) for _ in range(3)]
    for worker in workers:
        worker.start()
    outcomes = [results.get(timeout=60) for _ in workers]
    for worker in workers:
        worker.join()
    assert outcomes[0] == outcomes[1] == outcomes[2]
    assert [path for path in files(folder) if path.suffix == ".tmp"] == []
    assert all(cache.load(path.stem) is not None for path in files(folder))
