"""Tables of thousands of points: values of NumPy, events at every point, size of the traced functions."""

from typing import Any

import numpy as np
import pytest
from block_evaluation import evaluate
from scipy.interpolate import CubicSpline, RegularGridInterpolator

import armblocks as ab
from armblocks.blocks import (
    Clock,
    DirectLookup,
    FromTable,
    Integrator,
    InterpolationUsingPrelookup,
    LookupTable1D,
    LookupTable2D,
    LookupTableND,
    Prelookup,
)
from armblocks.blocks.long_tables import MAX_SHORT_POINTS
from armblocks.blocks.splines import spline_derivatives
from armblocks.diagram import trace_diagram
from armblocks.errors import DiagramError, InputError

RANDOM = np.random.default_rng(8)
COUNT = 3 * MAX_SHORT_POINTS
X = np.cumsum(RANDOM.uniform(0.02, 0.1, COUNT))
Y = RANDOM.normal(size=COUNT)
U = np.concatenate([RANDOM.uniform(X[0] - 1, X[-1] + 1, 16), X[[0, 1, -2, -1]], X[5::17]])
RUNS: list[dict[str, Any]] = [{"solver": "rk4", "step": 0.001}, {"rtol": 1e-9, "atol": 1e-12}]


def reference(u: np.ndarray, method: str, beyond: str) -> np.ndarray:
    if method == "flat":
        return Y[np.clip(np.searchsorted(X, u, side="right") - 1, 0, COUNT - 1)]
    if beyond == "clip":
        return np.interp(u, X, Y)
    k = np.clip(np.searchsorted(X, u, side="right") - 1, 0, COUNT - 2)
    return Y[k] + (Y[k + 1] - Y[k]) * (u - X[k]) / (X[k + 1] - X[k])


@pytest.mark.parametrize("method", ["linear", "flat"])
@pytest.mark.parametrize("beyond", ["clip", "linear"])
@pytest.mark.parametrize("zero_crossing", [True, False])
def test_a_long_curve_agrees_with_numpy(method: str, beyond: str, zero_crossing: bool) -> None:
    table = LookupTable1D(
        positions=X, table=Y, method=method, extrapolation=beyond, zero_crossing=zero_crossing
    )
    np.testing.assert_allclose(evaluate(table, U)["y"], reference(U, method, beyond), rtol=1e-12, atol=1e-13)


def test_a_long_curve_takes_the_nearest_point() -> None:
    middle = (X[1:] + X[:-1]) / 2
    u = np.concatenate([U[:20], np.nextafter(middle[::17], -np.inf), middle[::17]])
    expected = Y[np.searchsorted(middle, u, side="right")]
    for zero_crossing in (True, False):
        table = LookupTable1D(positions=X, table=Y, method="nearest", zero_crossing=zero_crossing)
        np.testing.assert_array_equal(evaluate(table, u)["y"], expected)


@pytest.mark.parametrize("zero_crossing", [True, False])
@pytest.mark.parametrize("method", ["linear", "nearest"])
@pytest.mark.parametrize("sizes", [(30, 3), (9, 10), (5, 6, 7), (3, 3, 3, 20)])
def test_a_large_table_of_several_axes_agrees_with_scipy(
    sizes: tuple[int, ...], method: str, zero_crossing: bool
) -> None:
    axes = [np.cumsum(RANDOM.uniform(0.2, 1, n)) for n in sizes]
    table = RANDOM.normal(size=sizes)
    points = [np.concatenate([RANDOM.uniform(axis[0], axis[-1], 2), axis[[0, -1, 1]]]) for axis in axes]
    expected = RegularGridInterpolator(axes, table, method=method)(np.column_stack(points))
    kind: dict[str, Any] = {"table": table, "method": method, "zero_crossing": zero_crossing}
    block = LookupTableND(positions=np.concatenate(axes), **kind)
    np.testing.assert_allclose(evaluate(block, *points)["y"], expected, rtol=1e-11, atol=1e-13)
    if len(sizes) == 2:
        surface = LookupTable2D(positions1=axes[0], positions2=axes[1], **kind)
        np.testing.assert_allclose(evaluate(surface, *points)["y"], expected, rtol=1e-11, atol=1e-13)
    if method == "linear":
        lookups = [
            evaluate(Prelookup(positions=x, zero_crossing=zero_crossing), u) for x, u in zip(axes, points)
        ]
        pairs = [lookup[name] for lookup in lookups for name in ("k", "f")]
        actual = evaluate(InterpolationUsingPrelookup(table=table), *pairs)["y"]
        np.testing.assert_allclose(actual, expected, rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("extrapolation", ["clip", "linear"])
def test_a_long_prelookup_extrapolates_or_clips_outside_its_range(extrapolation: str) -> None:
    k = np.clip(np.searchsorted(X, U, side="right") - 1, 0, COUNT - 2)
    f = (U - X[k]) / (X[k + 1] - X[k])
    f = np.clip(f, 0, 1) if extrapolation == "clip" else f
    actual = evaluate(Prelookup(positions=X, extrapolation=extrapolation), U)
    np.testing.assert_array_equal(actual["k"], k)
    np.testing.assert_allclose(actual["f"], f, rtol=1e-12, atol=1e-13)


def test_direct_lookup_reads_entries_of_a_large_table() -> None:
    table = RANDOM.normal(size=(20, 30))
    rows, columns = [0.0, 19.9, -4.0, 7.5], [29.0, 3.2, 2.0, 99.0]
    actual = evaluate(DirectLookup(table=table), rows, columns)["y"]
    assert actual.tolist() == [table[0, 29], table[19, 3], table[0, 2], table[7, 29]]


@pytest.mark.parametrize("method", ["linear", "flat"])
@pytest.mark.parametrize("settings", RUNS)
def test_integrals_are_exact_across_every_point_of_sources_and_curves(
    method: str, settings: dict[str, Any]
) -> None:
    builder = ab.DiagramBuilder("long", settings=ab.SimulationOptions(stop_time=4.0, sample_time=0.05))
    table = builder.add("course", FromTable(times=X, values=np.column_stack([Y, 2 * Y]), method=method))
    curve = LookupTable1D(positions=X, table=Y, method=method)
    builder.add("sum", Integrator(initial=(0.0, 0.0)), table)
    builder.add("area", Integrator(), builder.add("curve", curve, builder.add("time", Clock())))
    result = ab.simulate(builder.build(), **settings)
    fine = np.unique(np.concatenate([X, result.time]))  # between these times the signal is linear or constant
    values = reference(fine, method, "clip")
    left = values[:-1]
    right = values[:-1] if method == "flat" else values[1:]
    area = np.concatenate([[0.0], np.cumsum(np.diff(fine) * (left + right) / 2)])
    expected = np.interp(result.time, fine, area)
    np.testing.assert_allclose(result["area"], expected, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(result["sum"][:, 1], 2 * expected, rtol=1e-8, atol=1e-9)


def test_derivatives_by_the_input_are_exact_and_those_by_the_table_are_refused() -> None:
    builder = ab.DiagramBuilder("slopes", settings=ab.SimulationOptions(stop_time=1.0))
    clock = builder.add("level", ab.blocks.Constant(value=0.5 * (X[20] + X[21])))
    builder.add("curve", LookupTable1D(positions=X, table=Y), clock)
    diagram = builder.build()
    slope = ab.linearize(diagram, inputs="level.value", outputs="curve").D
    np.testing.assert_allclose(slope, (Y[21] - Y[20]) / (X[21] - X[20]), rtol=1e-12)
    with pytest.raises(InputError, match=r"'curve\.table' is a table that is read by index"):
        ab.sensitivity(diagram, "curve.table", "curve")


def test_positions_of_a_long_table_are_checked_when_changed() -> None:
    diagram = ab.DiagramBuilder("tuned", settings=ab.SimulationOptions(stop_time=1.0))
    diagram.add("course", FromTable(times=X, values=Y))
    built = diagram.build()
    shifted = ab.simulate(built, parameters={"course.times": X + 0.5})
    np.testing.assert_allclose(shifted["course"], np.interp(shifted.time, X + 0.5, Y), rtol=1e-12, atol=1e-13)
    with pytest.raises(DiagramError, match="strictly ascending order"):
        ab.simulate(built, parameters={"course.times": -X})


def operations_of_large_tables(n: int) -> int:
    """Number of instructions of the signals of a diagram with two tables of n points and one of 100 x 100."""
    builder = ab.DiagramBuilder("large", settings=ab.SimulationOptions(stop_time=1.0))
    table = builder.add("course", FromTable(times=np.linspace(0, 1, n), values=np.arange(n) / n))
    curve = LookupTable1D(positions=np.arange(n) / n, table=np.sin(np.arange(n) / n), zero_crossing=False)
    builder.add("curve", curve, table)
    rows = np.linspace(0, 1, 100)
    surface = LookupTable2D(positions1=rows, positions2=rows, table=np.outer(rows, rows))
    builder.add("surface", surface, table, table)
    return trace_diagram(builder.build()).signals.casadi_function().n_instructions()


def test_the_traced_function_hardly_grows_with_the_length_of_a_table() -> None:
    short, long = operations_of_large_tables(1_000), operations_of_large_tables(10_000)
    assert long - short < 0.05 * (10_000 - 1_000)


@pytest.mark.parametrize("beyond", ["clip", "linear"])
@pytest.mark.parametrize("zero_crossing", [True, False])
def test_a_long_spline_agrees_with_scipy(beyond: str, zero_crossing: bool) -> None:
    kind: dict[str, Any] = {"method": "cubic", "extrapolation": beyond, "zero_crossing": zero_crossing}
    for count in (MAX_SHORT_POINTS + 1, 100):
        x = np.cumsum(RANDOM.uniform(0.02, 0.1, count))
        y = RANDOM.normal(size=count)
        at = [0, 1, *range(2, count - 2, 13), count - 2, count - 1]
        u = np.concatenate([RANDOM.uniform(x[0], x[-1], 8), [x[0] - 0.06, x[-1] + 0.07], x[at]])
        spline = CubicSpline(x, y)
        inside = np.clip(u, x[0], x[-1])
        expected = spline(inside)
        if beyond == "linear":
            expected = expected + np.where(u < x[0], spline(x[0], 1), spline(x[-1], 1)) * (u - inside)
        actual = evaluate(LookupTable1D(positions=x, table=y, **kind), u)["y"]
        np.testing.assert_allclose(actual, expected, rtol=1e-10, atol=1e-11)
        np.testing.assert_array_equal(actual[10:], y[at])


def test_a_large_spline_surface_agrees_with_scipy() -> None:
    axes = [np.cumsum(RANDOM.uniform(0.2, 1, n)) for n in (18, 4)]
    table = RANDOM.normal(size=(18, 4))
    points = [RANDOM.uniform(axis[0], axis[-1], 3) for axis in axes]
    expected = [
        float(CubicSpline(axes[1], CubicSpline(axes[0], table, axis=0)(a))(b)) for a, b in zip(*points)
    ]
    kind: dict[str, Any] = {"table": table, "method": "cubic"}
    surface = LookupTable2D(positions1=axes[0], positions2=axes[1], **kind)
    np.testing.assert_allclose(evaluate(surface, *points)["y"], expected, rtol=1e-10, atol=1e-11)
    block = LookupTableND(positions=np.concatenate(axes), **kind)
    np.testing.assert_allclose(evaluate(block, *points)["y"], expected, rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize("outside", ["hold", "linear", "zero"])
def test_a_long_spline_source_agrees_with_scipy(outside: str) -> None:
    values = np.column_stack([Y, 2 * Y])
    builder = ab.DiagramBuilder(
        "smooth", settings=ab.SimulationOptions(stop_time=X[-1] + 1, sample_time=0.01)
    )
    builder.add("course", FromTable(times=X, values=values, method="cubic", outside=outside))
    result = ab.simulate(builder.build())
    t, spline = result.time, CubicSpline(X, values)
    inside = np.clip(t, X[0], X[-1])
    expected = spline(inside)
    if outside == "linear":
        rates = np.where(t[:, None] < X[0], spline(X[0], 1), spline(X[-1], 1))
        expected = expected + rates * (t - inside)[:, None]
    if outside == "zero":
        expected[(t < X[0]) | (t > X[-1])] = 0.0
    np.testing.assert_allclose(result["course"], expected, rtol=1e-9, atol=1e-10)


@pytest.mark.parametrize("count", [2, 3, 4, 5, 40, 700])
@pytest.mark.parametrize("spacing", ["even", "random", "geometric"])
def test_derivatives_of_splines_agree_with_scipy(count: int, spacing: str) -> None:
    x = {
        "even": np.linspace(0, 10, count),
        "random": np.cumsum(np.random.default_rng(count).uniform(0.01, 1, count)),
        "geometric": np.geomspace(1, 1e6, count),
    }[spacing]
    y = np.random.default_rng(count + 1).normal(size=(count, 2))
    expected = np.tile(np.diff(y, axis=0) / np.diff(x), (2, 1)) if count == 2 else CubicSpline(x, y)(x, 1)
    scale = np.abs(expected).max(axis=0)
    np.testing.assert_allclose(
        spline_derivatives(x.tolist(), y) / scale, expected / scale, rtol=0, atol=1e-12
    )


def test_a_long_spline_is_tuned_during_a_run_without_compilation() -> None:
    builder = ab.DiagramBuilder("tuned", settings=ab.SimulationOptions(stop_time=4.0, sample_time=0.1))
    builder.add("curve", LookupTable1D(positions=X, table=Y, method="cubic"), builder.add("time", Clock()))
    run = ab.begin(builder.build())
    compiled = run.simulation.compiled
    run.advance(1.0)
    run.set("curve.table", -Y)
    run.advance(2.0)
    run.set("curve.positions", X + 0.5)
    run.advance()
    assert run.simulation.compiled is compiled
    run_result = run.result()
    for first, last, x, y in ((0.0, 1.0, X, Y), (1.0, 2.0, X, -Y), (2.0, 4.1, X + 0.5, -Y)):
        part = (run_result.time > first + 0.05) & (run_result.time < last - 0.05)
        expected = CubicSpline(x, y)(np.clip(run_result.time[part], x[0], x[-1]))
        np.testing.assert_allclose(run_result["curve"][part], expected, rtol=1e-9, atol=1e-12)


def test_a_long_spline_that_depends_on_a_mask_parameter_is_updated() -> None:
    builder = ab.DiagramBuilder("masked", settings=ab.SimulationOptions(stop_time=3.0, sample_time=0.1))
    builder.parameter("k", 1.0)
    values = f"k*[{', '.join(map(repr, Y.tolist()))}]"
    curve = LookupTable1D(positions=X, table=Y, method="cubic").with_parameters(table=ab.formula(values))
    builder.add("curve", curve, builder.add("time", Clock()))
    diagram = builder.build()
    for k in (1.0, -3.0):
        result = ab.simulate(diagram, parameters={"k": k})
        expected = CubicSpline(X, k * Y)(np.clip(result.time, X[0], X[-1]))
        np.testing.assert_allclose(result["curve"], expected, rtol=1e-9, atol=1e-11)
    run = ab.begin(diagram)
    run.set("k", 2.0)
    run.advance()
    np.testing.assert_allclose(run.result()["curve"], expected * -2 / 3, rtol=1e-9, atol=1e-11)
    with pytest.raises(InputError, match=r"'curve\.table', which is not tunable, depends on 'k'"):
        ab.sensitivity(diagram, "k", "curve")
