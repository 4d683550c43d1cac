"""Lookup tables and sources from tables compared with SciPy and NumPy."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from block_evaluation import evaluate
from scipy.interpolate import CubicSpline, RegularGridInterpolator
from scipy.signal import chirp

from armblocks.blocks import (
    Chirp,
    DirectLookup,
    FromTable,
    Ground,
    InterpolationUsingPrelookup,
    LookupTable1D,
    LookupTable2D,
    LookupTableDynamic,
    LookupTableND,
    Prelookup,
    Pulse,
)
from armblocks.blocks.splines import spline_derivatives
from armblocks.errors import DiagramError, InputError

RANDOM = np.random.default_rng(22)
X = np.array([-1.0, 0.0, 0.5, 2.0, 3.5])
Y = RANDOM.normal(size=5)
INSIDE = np.concatenate([RANDOM.uniform(a, b, 3) for a, b in pairwise(X)])
OUTSIDE = np.array([-3.0, -1.5, 4.0, 7.0])


def test_linear_interpolation_agrees_with_numpy_between_points() -> None:
    table = LookupTable1D(positions=X, table=Y)
    u = np.concatenate([INSIDE, OUTSIDE])
    assert evaluate(table, u)["y"] == pytest.approx(np.interp(u, X, Y), rel=1e-14, abs=1e-15)
    assert np.array_equal(evaluate(table, X)["y"], Y)


def test_linear_extrapolation_continues_the_end_segments() -> None:
    result = evaluate(LookupTable1D(positions=X, table=Y, extrapolation="linear"), [-2.0, 4.5])["y"]
    first, last = (Y[1] - Y[0]) / (X[1] - X[0]), (Y[-1] - Y[-2]) / (X[-1] - X[-2])
    assert result == pytest.approx([Y[0] - first, Y[-1] + last], rel=1e-13)


@pytest.mark.parametrize("n", [2, 3, 4, 5, 9])
def test_cubic_interpolation_agrees_with_scipy(n: int) -> None:
    x, y = np.cumsum(RANDOM.uniform(0.2, 1, n)), RANDOM.normal(size=n)
    u = np.linspace(x[0], x[-1], 3 * n + 1)
    spline = CubicSpline(x, y) if n > 2 else lambda u: np.interp(u, x, y)
    table = LookupTable1D(positions=x, table=y, method="cubic", extrapolation="linear")
    assert evaluate(table, u)["y"] == pytest.approx(spline(u), rel=1e-11, abs=1e-12)
    beyond = evaluate(table, [x[0] - 1, x[-1] + 2])["y"]
    slopes = spline_derivatives(x.tolist(), y)
    assert beyond == pytest.approx([y[0] - slopes[0], y[-1] + 2 * slopes[-1]], rel=1e-11)
    held = evaluate(LookupTable1D(positions=x, table=y, method="cubic"), [x[0] - 1, x[-1] + 2])["y"]
    assert held.tolist() == [y[0], y[-1]]


def test_nearest_and_flat_interpolation_return_table_entries() -> None:
    u = np.array([-5.0, -0.6, -0.5, 0.0, 0.4, 1.25, 3.4, 3.5, 9.0])
    nearest = evaluate(LookupTable1D(positions=X, table=Y, method="nearest"), u)["y"]
    assert nearest.tolist() == Y[[0, 0, 1, 1, 2, 3, 4, 4, 4]].tolist()
    flat = evaluate(LookupTable1D(positions=X, table=Y, method="flat"), u)["y"]
    assert flat.tolist() == Y[[0, 0, 0, 1, 1, 2, 3, 4, 4]].tolist()


@pytest.mark.parametrize(("method", "scipy_method"), [("linear", "linear"), ("nearest", "nearest")])
def test_tables_of_one_to_three_dimensions_agree_with_scipy(method: str, scipy_method: str) -> None:
    axes = [np.cumsum(RANDOM.uniform(0.2, 1, n)) for n in (3, 4, 2)]
    points = np.stack([RANDOM.uniform(axis[0], axis[-1], 10) for axis in axes])
    for dimension in (1, 2, 3):
        table = RANDOM.normal(size=[len(axis) for axis in axes[:dimension]])
        expected = RegularGridInterpolator(axes[:dimension], table, method=scipy_method)(points[:dimension].T)
        block = LookupTableND(positions=np.concatenate(axes[:dimension]), table=table, method=method)
        assert evaluate(block, *points[:dimension])["y"] == pytest.approx(expected, rel=1e-12, abs=1e-13)
    table = RANDOM.normal(size=(3, 4))
    expected = RegularGridInterpolator(axes[:2], table, method=scipy_method)(points[:2].T)
    block = LookupTable2D(positions1=axes[0], positions2=axes[1], table=table, method=method)
    assert evaluate(block, *points[:2])["y"] == pytest.approx(expected, rel=1e-12, abs=1e-13)


def test_a_cubic_surface_is_a_spline_of_splines() -> None:
    x1, x2 = np.arange(4.0), np.array([0.0, 1.0, 3.0, 4.0, 6.0])
    table = RANDOM.normal(size=(4, 5))
    u1, u2 = 1.3, 2.2
    expected = CubicSpline(x1, [CubicSpline(x2, row)(u2) for row in table])(u1)
    block = LookupTable2D(positions1=x1, positions2=x2, table=table, method="cubic")
    assert evaluate(block, u1, u2)["y"] == pytest.approx(expected, rel=1e-11)


def test_direct_lookup_truncates_and_clips_its_indices() -> None:
    table = RANDOM.normal(size=(2, 3))
    result = evaluate(DirectLookup(table=table), [0.0, 1.9, -4.0], [2.0, 1.0, 99.0])["y"]
    assert result.tolist() == [table[0, 2], table[1, 1], table[0, 2]]


@pytest.mark.parametrize("extrapolation", ["clip", "linear"])
def test_prelookup_and_interpolation_make_a_lookup_table(extrapolation: str) -> None:
    u = np.concatenate([INSIDE, OUTSIDE, X])
    cell = evaluate(Prelookup(positions=X, extrapolation=extrapolation), u)
    assert set(np.unique(cell["k"])) == {0, 1, 2, 3}
    actual = evaluate(InterpolationUsingPrelookup(table=Y), cell["k"], cell["f"])["y"]
    expected = evaluate(LookupTable1D(positions=X, table=Y, extrapolation=extrapolation), u)["y"]
    assert actual == pytest.approx(expected, rel=1e-14, abs=1e-15)
    surface = RANDOM.normal(size=(3, 2))
    actual = evaluate(InterpolationUsingPrelookup(table=surface), 1.0, 0.25, 0.0, 0.5)["y"]
    assert actual == pytest.approx([0.75, 0.25] @ surface[1:] @ [0.5, 0.5], rel=1e-14)


def test_the_points_of_a_lookup_table_may_be_signals() -> None:
    u = np.concatenate([INSIDE, OUTSIDE])
    assert evaluate(LookupTableDynamic(), u, X, Y)["y"] == pytest.approx(
        np.interp(u, X, Y), rel=1e-13, abs=1e-15
    )


def test_ground_pulse_and_chirp_have_their_closed_forms() -> None:
    assert evaluate(Ground())["y"] == 0.0
    pulse = Pulse(amplitude=[2.0, 3.0], start=1.0, width=0.5)
    assert [float(evaluate(pulse, t=t)["y"][0]) for t in (0.99, 1.0, 1.49, 1.5)] == [0, 2, 2, 0]
    expected = chirp(3.7, f0=0.1, t1=10.0, f1=2.0, phi=-90)  # SciPy's chirp is a cosine
    block = Chirp(initial_frequency=0.1, final_frequency=2.0, target_time=10.0)
    assert evaluate(block, t=3.7)["y"] == pytest.approx(expected, rel=1e-12)


def test_a_source_from_a_table_agrees_with_numpy_and_scipy() -> None:
    values = RANDOM.normal(size=(5, 2))
    for t in (-0.3, 0.2, 2.0, 3.1):
        expected = [np.interp(t, X, column) for column in values.T]
        assert evaluate(FromTable(times=X, values=values), t=t)["y"] == pytest.approx(expected, rel=1e-14)
    assert evaluate(FromTable(times=X, values=Y, method="flat"), t=0.49)["y"] == Y[1]
    assert evaluate(FromTable(times=X, values=Y, method="cubic"), t=0.3)["y"] == pytest.approx(
        CubicSpline(X, Y)(0.3)
    )
    assert evaluate(FromTable(times=X, values=Y), t=9.0)["y"] == Y[-1]
    assert evaluate(FromTable(times=X, values=Y, outside="zero"), t=9.0)["y"] == 0.0
    assert evaluate(FromTable(times=[0, 1], values=[1, 3], outside="linear"), t=2.0)["y"] == 5.0


def test_inconsistent_break_points_and_tables_are_refused() -> None:
    with pytest.raises(
        InputError, match=r"LookupTable1D: positions is \[0.0, 0.0\].*strictly ascending order"
    ):
        LookupTable1D(positions=[0, 0])
    with pytest.raises(InputError, match=r"positions1 has 3 positions for 2 entries of the table"):
        LookupTable2D(positions1=[0, 1, 2])
    with pytest.raises(InputError, match=r"3 positions are given for a table of shape \(2, 2\)"):
        LookupTableND(positions=[0, 1, 0])
    with pytest.raises(InputError, match=r"InterpolationUsingPrelookup: the table has shape \(1,\)"):
        InterpolationUsingPrelookup(table=[1.0])
    with pytest.raises(DiagramError, match=r"the positions have shape \(2,\) and the values \(3,\)"):
        evaluate(LookupTableDynamic(), 0.5, [0.0, 1.0], [1.0, 2.0, 3.0])
