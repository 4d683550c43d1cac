"""Sensitivity indices against closed forms, and the pictures of sweeps."""

from __future__ import annotations

import dataclasses
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armblocks as ab
from armblocks.errors import InputError, UnknownNameError
from armblocks.pictures.picture import Disc, Picture, Polyline, text_marks
from armblocks.report.charts.sweep_charts import cell_medians, grouped_percentiles, tornado_ranges
from armblocks.sweeps.sensitivity_designs import morris_values, sensitivity_points, sobol_values

VARY = {"PID.P": ab.loguniform(1, 20), "x1.initial": ab.uniform(-2, 2), "damping.gain": ab.normal(0.5, 0.1)}
SHORT: dict[str, Any] = {"stop_time": 1.0, "sample_time": 0.1}
MEASURES = {"peak": "peak(x1/y)"}


def test_sobol_indices_of_the_function_of_ishigami() -> None:
    a, b = 7.0, 0.1
    x = np.pi * (2.0 * sensitivity_points("saltelli", 5 * 4096, 3, seed=1) - 1.0)
    values = np.sin(x[:, 0]) + a * np.sin(x[:, 1]) ** 2 + b * x[:, 2] ** 4 * np.sin(x[:, 0])
    first = 0.5 * (1.0 + b * np.pi**4 / 5.0) ** 2
    second = a**2 / 8.0
    both = 8.0 * b**2 * np.pi**8 / 225.0
    total = first + second + both
    found = sobol_values(values, 3)
    assert found.groups == 4096
    assert np.abs(found.first - np.array([first, second, 0.0]) / total).max() < 0.02
    assert np.abs(found.total - np.array([first + both, second, both]) / total).max() < 0.02
    assert found.first_error.max() < 0.06 and found.total_error.max() < 0.06
    # A group with a failed run is omitted; units and offsets do not matter.
    values[7] = np.nan
    again = sobol_values(1e-12 * values + 5e-9, 3)
    assert again.groups == 4095
    assert np.abs(again.total - found.total).max() < 1e-2
    assert np.isnan(sobol_values(np.ones(50), 3).first).all()
    assert np.isnan(sobol_values(np.full(50, np.nan), 3).total).all()


def test_effects_of_morris_are_the_slopes_of_a_line() -> None:
    for dimensions in (1, 2, 5):
        points = sensitivity_points("morris", 20 * (dimensions + 1), dimensions, seed=3)
        assert points.min() > 0.0 and points.max() < 1.0
        changed = np.diff(points.reshape(20, dimensions + 1, dimensions), axis=1) != 0.0
        assert (changed.sum(axis=2) == 1).all() and (changed.sum(axis=1) == 1).all()
        slopes = np.arange(dimensions) - 1.5
        found = morris_values(points @ slopes + 4.0, points)
        assert np.allclose(found.mean, slopes) and np.allclose(found.mean_absolute, np.abs(slopes))
        assert np.allclose(found.deviation, 0.0, atol=1e-12)


def test_indices_of_sweeps(tmp_path: Path) -> None:
    shares = ab.sweep("van_der_pol_pid", VARY, design="saltelli", runs=5 * 8, measures=MEASURES, **SHORT)
    indices = shares.sobol("peak")
    assert indices.parameters == tuple(VARY) and indices.omitted == 0
    assert indices.parameters[int(indices.total.argmax())] == "x1.initial"
    assert repr(pickle.loads(pickle.dumps(indices))) == repr(indices)
    assert "8 groups" in repr(indices)
    effects = ab.sweep("van_der_pol_pid", VARY, design="morris", runs=4 * 6, measures=MEASURES, **SHORT)
    found = effects.morris("peak")
    assert found.groups == 6 and "mean absolute" in repr(pickle.loads(pickle.dumps(found)))
    with pytest.raises(InputError, match=r"the design is 'morris', and these indices need.*saltelli"):
        effects.sobol("peak")
    with pytest.raises(InputError, match="runs is 21 for the design 'saltelli' of 3 parameters"):
        ab.sweep("van_der_pol_pid", VARY, design="saltelli", runs=21)
    with pytest.raises(InputError, match=r"'PID\.I' has no distribution with quantiles"):
        ab.sweep("van_der_pol_pid", {**VARY, "PID.I": [1.0, 2.0]}, design="morris", runs=40)


def test_pictures_of_sweeps(tmp_path: Path) -> None:
    result = ab.sweep("van_der_pol_pid", VARY, runs=40, seed=2, measures=MEASURES, keep="x1/y", **SHORT)
    for kind in ("response", "tornado", "scatter", "parallel", "map", "bands"):
        path = tmp_path / f"{kind}.svg"
        picture = result.plot(kind, save=path)
        assert isinstance(picture, Picture) and path.stat().st_size > 1000
        texts = " ".join(mark.text for mark in text_marks(picture))
        shown = {"bands": ("x1/y", "time, s"), "map": ("x1.initial",)}
        for name in shown.get(kind, tuple(VARY)):
            assert name in texts, (kind, name)
        for mark in picture.marks:
            if isinstance(mark, Polyline):
                assert np.isfinite(np.asarray(mark.points, dtype=float)).all(), kind
            if isinstance(mark, Disc):
                assert 0.0 <= mark.x <= picture.width and 0.0 <= mark.y <= picture.height, kind
    with pytest.raises(UnknownNameError, match=r"PID\.X"):
        result.plot("tornado", parameters=["PID.X"])
    names = np.array(["one", "two"] * 20, dtype=object)
    named = dataclasses.replace(result, columns={**result.columns, "PID.P": names})
    assert named.plot("response").marks  # texts are omitted
    with pytest.raises(InputError, match=r"the parameter 'PID\.P' has no numbers"):
        named.plot("response", parameters=["PID.P"])
    with pytest.raises(InputError, match="a map has two parameters, and 1 varies"):
        result.plot("map", parameters=["PID.P"])
    with pytest.raises(UnknownNameError, match="pie"):
        result.plot("pie")
    with pytest.raises(InputError, match="no samples of u/y are kept"):
        result.plot("bands", "u/y")
    single = ab.sweep("van_der_pol_pid", {"PID.P": [2.0]}, **SHORT)
    with pytest.raises(InputError, match="the sweep has no measure"):
        single.plot()
    with pytest.raises(InputError, match="no parameter with numbers varies"):
        single.plot("tornado", "steps")


def test_percentiles_along_a_parameter() -> None:
    rng = np.random.default_rng(5)
    x = rng.uniform(0.0, 1.0, 5000)
    middles, percentiles = grouped_percentiles(x, 3.0 * x + rng.normal(0.0, 0.1, x.size), (5.0, 50.0, 95.0))
    assert np.abs(percentiles[:, 1] - 3.0 * middles).max() < 0.05
    assert (percentiles[:, 0] < percentiles[:, 1]).all() and (percentiles[:, 1] < percentiles[:, 2]).all()
    # Runs with equal values are one group; values that are not finite are omitted.
    middles, percentiles = grouped_percentiles(
        np.array([1.0, 1.0, 2.0, 2.0, np.nan]), np.array([1.0, 3.0, 5.0, np.inf, 7.0]), (50.0,)
    )
    assert middles.tolist() == [1.0, 2.0] and percentiles[:, 0].tolist() == [2.0, 5.0]
    ranges = tornado_ranges({"a": x, "b": -x, "constant": np.ones(5000)}, 2.0 * x)
    assert [entry[0] for entry in ranges] == ["a", "b"]
    assert ranges[0][1] < 0.2 < 1.8 < ranges[0][2] and ranges[1][1] > ranges[1][2]


def test_medians_of_cells_and_further_columns() -> None:
    x, y = np.array([0.5, 0.5, 1.5, 1.5, 0.5]), np.array([0.5, 0.5, 0.5, 1.5, np.nan])
    edges = np.array([0.0, 1.0, 2.0])
    medians = cell_medians(x, y, np.array([1.0, 3.0, 5.0, np.nan, 9.0]), edges, edges)
    assert np.array_equal(medians, [[2.0, np.nan], [5.0, np.nan]], equal_nan=True)
    result = ab.sweep("van_der_pol_pid", {"PID.P": [1.0, 2.0]}, measures=MEASURES, **SHORT)
    more = result.with_columns({"double": 2.0 * result["peak"]})
    assert more.measures == ("peak", "double") and more.largest("double")[0] == result.largest("peak")[0]
    assert more.to_dataframe()["double"].tolist() == (2.0 * result["peak"]).tolist()
    assert result.measures == ("peak",)
    with pytest.raises(InputError, match="the column 'peak' exists"):
        result.with_columns({"peak": [1.0, 2.0]})
    with pytest.raises(InputError, match=r"the column 'a' has the shape \(3,\)"):
        result.with_columns({"a": [1.0, 2.0, 3.0]})
