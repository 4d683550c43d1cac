"""The report of a sweep: the page, the table, and the diagrams of single runs."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armblocks as ab
from armblocks.errors import FormatError, InputError, UnknownNameError

VARY = {"PID.P": ab.loguniform(1, 20), "x1.initial": ab.uniform(-2, 2)}
SHORT: dict[str, Any] = {"stop_time": 1.0, "sample_time": 0.1}
MEASURES = {"peak": "peak(x1/y)", "<iae>": "iae({reference/y} - {x1/y})"}


def test_a_report_shows_measures_pictures_and_worst_cases(tmp_path: Path) -> None:
    result = ab.sweep("van_der_pol_pid", VARY, runs=40, measures=MEASURES, keep="x1/y", **SHORT)
    files = result.write_report(
        tmp_path / "new" / "report", worst=2, smallest=["<iae>"], limits={"peak": (0.0, 1.0)}
    )
    page = files.page.read_text()
    headings = re.findall(r'<h2 id="[^"]*">([^<]*)</h2>', page)
    assert headings == [
        "Measures", "Measure peak", "Measure &lt;iae&gt;", "Signals", "Worst cases", "Design", "Files",
    ]  # fmt: skip
    assert "<iae>" not in page and "<script" not in page
    assert "://" not in page.replace("http://www.w3.org/2000/svg", "")
    identifiers = re.findall(r'\bid="([^"]*)"', page)
    assert len(identifiers) == len(set(identifiers))
    # Two parameters: response, tornado, parallel coordinates and map of each measure; bands of the signal.
    assert page.count("<figure") == 2 * 4 + 1
    share, low, high = result.probability("peak", high=1.0)
    assert f"{100 * share:g}" in page and f"{100 * low:.4g} … {100 * high:.4g}" in page
    assert "iae({reference/y} - {x1/y})" in page  # the definition of the measure
    worst = [*result.largest("peak", 2).tolist(), *result.smallest("<iae>", 2).tolist()]
    assert set(files.runs) == set(worst)
    for run in worst:
        assert f'<a href="runs/run-{run}.json">{run}</a>' in page
    assert len(files.table.read_text().splitlines()) == 41


def test_the_file_of_a_run_gives_the_same_bits(tmp_path: Path) -> None:
    vary = {
        "gripped.final[0]": ab.uniform(0, 180),
        "path.durations": [[2.0, 0.8, 2.0, 1.6, 1.6, 2.0, 0.8, 2.0]],
    }
    settings: dict[str, Any] = {"stop_time": 0.3, "sample_time": 0.01, "rtol": 1e-8, "record_jumps": False}
    measures = {"peak": "peak(rne/tau[1])"}
    result = ab.sweep("kr180_pick_and_place", vary, runs=3, measures=measures, **settings)
    files = result.write_report(tmp_path, worst=1)
    ((number, path),) = files.runs.items()
    assert number == result.largest("peak")[0]
    run, again = result.run(number), ab.simulate(path)
    assert again.names == run.names
    for name in run.names:
        assert np.array_equal(run[name], again[name], equal_nan=True), name
    assert np.abs(again["rne/tau"][:, 1]).max() == result["peak"][number]


def test_runs_that_did_not_complete_are_listed_by_reason(tmp_path: Path) -> None:
    result = ab.sweep("van_der_pol_pid", VARY, runs=12, measures={"peak": "peak(x1/y)"}, max_steps=5, **SHORT)
    assert result.failed.size == 12
    files = result.write_report(tmp_path, worst=1)
    page = files.page.read_text()
    assert "12 runs did not complete and have no measures" in page
    # One row, although the messages differ in the time at which the run ended.
    assert len(set(result["message"].tolist())) > 1
    assert page.count('<th scope="row">step limit</th>') == 1 and result["message"][0] in page
    assert list(files.runs) == [0] and "Measure peak" not in page
    assert ab.simulate(files.runs[0]).run.complete


def test_sensitivity_indices_are_in_the_report(tmp_path: Path) -> None:
    measures = {"peak": "peak(x1/y)"}
    for design, runs, title in (("saltelli", 4 * 4, "Sobol indices"), ("morris", 3 * 4, "Effects of Morris")):
        result = ab.sweep("van_der_pol_pid", VARY, design=design, runs=runs, measures=measures, **SHORT)
        page = result.write_report(tmp_path / design).page.read_text()
        assert title in page and "4 groups" in page


def test_a_sweep_with_a_file_keeps_its_table(tmp_path: Path) -> None:
    out = tmp_path / "runs.parquet"
    result = ab.sweep("van_der_pol_pid", {"PID.P": [1.0, 2.0]}, measures=MEASURES, out=out, **SHORT)
    files = result.write_report(tmp_path / "report")
    assert files.table == out and "runs.parquet" in files.page.read_text()
    assert not (tmp_path / "report" / "table.csv").exists()


def test_messages_of_reports_of_sweeps(tmp_path: Path) -> None:
    result = ab.sweep("van_der_pol_pid", {"PID.P": [1.0]}, measures=MEASURES, **SHORT)
    assert "Design" in result.write_report(tmp_path).page.read_text()  # nothing varies: no pictures
    with pytest.raises(UnknownNameError, match="measure named 'top'"):
        result.write_report(tmp_path, limits={"top": (0.0, 1.0)})
    with pytest.raises(InputError, match="worst is -1"):
        result.write_report(tmp_path, worst=-1)
    (tmp_path / "file").write_text("")
    with pytest.raises(FormatError, match="the report cannot be written"):
        result.write_report(tmp_path / "file")
    none = dataclasses.replace(result, columns={name: result[name][:0] for name in result.names})
    with pytest.raises(InputError, match="no run has been computed"):
        none.write_report(tmp_path)
