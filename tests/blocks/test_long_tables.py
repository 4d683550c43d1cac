"""Tables of thousands of points: the same values as NumPy's, events at every point, compiled in a moment."""

from time import perf_counter
from typing import Any

import numpy as np
import pytest
from block_evaluation import evaluate

import armblocks as ab
from armblocks.blocks import Clock, FromTable, Integrator, LookupTable1D
from armblocks.blocks.long_tables import SHORT
from armblocks.errors import DiagramError, InputError

RANDOM = np.random.default_rng(8)
COUNT = 3 * SHORT
X = np.cumsum(RANDOM.uniform(0.02, 0.1, COUNT))
Y = RANDOM.normal(size=COUNT)
U = np.concatenate([RANDOM.uniform(X[0] - 1, X[-1] + 1, 60), X])
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
def test_a_long_curve_is_that_of_numpy(method: str, beyond: str, zero_crossing: bool) -> None:
    table = LookupTable1D(
        positions=X, table=Y, method=method, extrapolation=beyond, zero_crossing=zero_crossing
    )
    np.testing.assert_allclose(evaluate(table, U)["y"], reference(U, method, beyond), rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("method", ["linear", "flat"])
@pytest.mark.parametrize("settings", RUNS)
def test_a_run_meets_every_point_of_both_kinds_of_table(method: str, settings: dict[str, Any]) -> None:
    builder = ab.DiagramBuilder("long", settings=ab.SimulationOptions(stop_time=4.0, sample_time=0.05))
    course = builder.add("course", FromTable(times=X, values=np.column_stack([Y, 2 * Y]), method=method))
    curve = LookupTable1D(positions=X, table=Y, method=method)
    builder.add("sum", Integrator(initial=(0.0, 0.0)), course)
    builder.add("area", Integrator(), builder.add("curve", curve, builder.add("time", Clock())))
    result = ab.simulate(builder.build(), **settings)
    fine = np.unique(np.concatenate([X, result.time]))  # between these the course is straight or level
    values = reference(fine, method, "clip")
    left = values[:-1]
    right = values[:-1] if method == "flat" else values[1:]
    area = np.concatenate([[0.0], np.cumsum(np.diff(fine) * (left + right) / 2)])
    expected = np.interp(result.time, fine, area)
    np.testing.assert_allclose(result["area"], expected, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(result["sum"][:, 1], 2 * expected, rtol=1e-8, atol=1e-9)


def test_slopes_in_the_input_are_exact_and_those_in_the_table_are_refused() -> None:
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
    moved = ab.simulate(built, parameters={"course.times": X + 0.5})
    np.testing.assert_allclose(moved["course"], np.interp(moved.time, X + 0.5, Y), rtol=1e-12, atol=1e-13)
    with pytest.raises(DiagramError, match="each greater than"):
        ab.simulate(built, parameters={"course.times": -X})


def test_ten_thousand_points_compile_in_a_moment() -> None:
    """Naming every point took 22 s for a thousand; a search takes well under a second for ten thousand."""
    n = 10_000
    builder = ab.DiagramBuilder("large", settings=ab.SimulationOptions(stop_time=1.0))
    course = builder.add("course", FromTable(times=np.linspace(0, 1, n), values=np.arange(n) / n))
    curve = LookupTable1D(positions=np.arange(n) / n, table=np.sin(np.arange(n) / n), zero_crossing=False)
    builder.add("curve", curve, course)
    diagram = builder.build()
    begin = perf_counter()
    ab.compile_diagram(diagram).compiled  # noqa: B018 - compiles
    assert perf_counter() - begin < 5.0  # s, on a machine that is busy
