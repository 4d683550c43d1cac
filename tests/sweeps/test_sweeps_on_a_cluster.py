"""Sweeps on a real Dask cluster, whose workers are threads of this process."""

from __future__ import annotations

import errno
import warnings
from collections.abc import Generator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import armblocks as ab
from armblocks.cli.main import app
from armblocks.errors import InputError
from armblocks.sweeps import cluster, files, scheduling
from armblocks.sweeps.cluster import compute_parts

VARY = {"PID.P": ab.uniform(1, 5), "x1.initial": ab.uniform(-1, 1)}
SETTINGS: dict[str, Any] = {"stop_time": 1.0, "sample_time": 0.1, "measures": {"peak": "peak(x1/y)"}}


@pytest.fixture(scope="module")
def client() -> Generator[Any]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # those of other packages
        from distributed import Client, LocalCluster

        cluster_type: Any = LocalCluster
        client_type: Any = Client
        with (
            cluster_type(
                n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None
            ) as workers,
            client_type(workers) as made,
        ):
            yield made


def assert_same(first: ab.SweepResult, second: ab.SweepResult) -> None:
    for name in (*first.names, *first.kept):
        equal_nan = first[name].dtype.kind == "f"
        assert np.array_equal(first[name], second[name], equal_nan=equal_nan), name


def test_a_cluster_computes_the_same_table(client: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scheduling, "FIRST_RUNS", 3)
    monkeypatch.setattr(scheduling, "MAX_RUNS", 7)
    local = ab.sweep("van_der_pol_pid", VARY, runs=40, keep="u/y", **SETTINGS)
    remote = ab.sweep("van_der_pol_pid", VARY, runs=40, keep="u/y", scheduler=client, **SETTINGS)
    assert_same(local, remote)
    # Several models in one task, Python measures, lanes; the scheduler by its address.
    more: dict[str, Any] = {**SETTINGS, "measures": {"end": lambda result: float(result["x1/y"][-1])}}
    vary = {"x1.initial": [0.0, 1.0, 2.0], "PID.P": [1.0, 2.0]}
    address = client.scheduler_info()["address"]
    assert_same(
        ab.sweep("van_der_pol_pid", vary, **more),
        ab.sweep("van_der_pol_pid", vary, scheduler=address, lanes=True, **more),
    )


def test_the_command_computes_on_the_scheduler_of_an_address(
    client: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    used: list[Any] = []

    class Observed(cluster.ClusterScheduler):
        def __init__(self, groups: Any, client: Any, maker: Any) -> None:
            used.append(client)
            super().__init__(groups, client, maker)

    monkeypatch.setattr("armblocks.face.sweep.ClusterScheduler", Observed)
    address = client.scheduler_info()["address"]
    arguments = ["sweep", "van_der_pol_pid", "--vary", "PID.P=1:3:3", "--measure", "peak(x1/y)"]
    arguments += ["--stop-time", "1", "--sample-time", "0.1", "--out"]
    tables: list[bytes] = []
    for name, options in (("here.csv", []), ("there.csv", ["--scheduler", address])):
        found = CliRunner().invoke(app, [*arguments, str(tmp_path / name), *options])
        assert found.exit_code == 0, found.output
        assert "3 runs" in found.output
        tables.append((tmp_path / name).read_bytes())
    assert tables[0] == tables[1] and len(used) == 1


def test_tasks_of_a_lost_worker_are_repeated(client: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each run is counted once, although a worker is retired in the middle of the sweep."""
    monkeypatch.setattr(scheduling, "MAX_RUNS", 4)
    lost: list[str] = []

    def lose_one(*_: object) -> None:
        if not lost:
            lost.append(sorted(client.scheduler_info()["workers"])[0])
            client.retire_workers(workers=lost, close_workers=True)

    monkeypatch.setattr("armblocks.face.sweep.PROGRESS_SECONDS", 0.0)
    remote = ab.sweep("van_der_pol_pid", VARY, runs=60, scheduler=client, progress=lose_one, **SETTINGS)
    assert lost and remote.complete
    assert remote["run"].tolist() == list(range(60))
    assert_same(ab.sweep("van_der_pol_pid", VARY, runs=60, **SETTINGS), remote)


def test_an_interrupted_sweep_on_a_cluster_is_continued(
    client: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scheduling, "MAX_RUNS", 4)
    monkeypatch.setattr("armblocks.face.sweep.PROGRESS_SECONDS", 0.0)
    seen: list[int] = []

    def interrupt(done: int, *_: object) -> None:
        seen.append(done)
        if done >= 8 and len(seen) < 20:
            seen.extend([0] * 20)
            raise KeyboardInterrupt

    arguments: dict[str, Any] = {
        "runs": 40,
        "out": tmp_path / "runs.parquet",
        "scheduler": client,
        **SETTINGS,
    }
    first = ab.sweep("van_der_pol_pid", VARY, progress=interrupt, **arguments)
    assert not first.complete and 0 < len(first) < 40
    second = ab.sweep("van_der_pol_pid", VARY, progress=interrupt, **arguments)
    assert second.complete
    assert_same(ab.sweep("van_der_pol_pid", VARY, runs=40, **SETTINGS), second)


def test_a_sweep_continues_after_a_full_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("armblocks.face.sweep.PART_RUNS", 5)
    monkeypatch.setattr(scheduling, "FIRST_RUNS", 3)
    monkeypatch.setattr(scheduling, "MAX_RUNS", 5)
    whole = ab.sweep("van_der_pol_pid", VARY, runs=30, **SETTINGS)
    write = files.write_atomically

    def full(path: Path, data: bytes) -> None:
        if len(list(path.parent.glob("runs-*"))) == 2:
            raise OSError(errno.ENOSPC, "no space left on device")
        write(path, data)

    target = tmp_path / "runs.parquet"
    monkeypatch.setattr(files, "write_atomically", full)
    with pytest.raises(OSError, match="no space left"):
        ab.sweep("van_der_pol_pid", VARY, runs=30, out=target, **SETTINGS)
    monkeypatch.setattr(files, "write_atomically", write)
    assert len(list(tmp_path.glob("*.parts/runs-*"))) == 2 and not target.exists()
    assert_same(whole, ab.sweep("van_der_pol_pid", VARY, runs=30, out=target, **SETTINGS))


def test_messages_of_clusters(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 0.2)
    with pytest.raises(InputError, match=r"no Dask scheduler answers at 'tcp://127\.0\.0\.1:1'"):
        ab.sweep("van_der_pol_pid", VARY, runs=2, scheduler="tcp://127.0.0.1:1")
    with pytest.raises(InputError, match="the scheduler is 8786"):
        ab.sweep("van_der_pol_pid", VARY, runs=2, scheduler=8786)
    with pytest.raises(InputError, match="a worker of the cluster has armblocks"):
        compute_parts([], [], 0, "0.0.1")
