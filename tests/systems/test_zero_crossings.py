"""Switching blocks: the zero crossings are located exactly with fixed and adaptive steps."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from itertools import pairwise

import numpy as np
import pytest
from reference_simulator import run_reference
from scipy.interpolate import RegularGridInterpolator

from armblocks.blocks import (
    Abs,
    AngleDifference,
    Clock,
    CompareToConstant,
    CompareToZero,
    Constant,
    DeadZone,
    Derivative,
    Extremum,
    Gain,
    HitCrossing,
    Integrator,
    IntervalTest,
    JointStops,
    LookupTable1D,
    LookupTable2D,
    LookupTableDynamic,
    MinMax,
    Modulo,
    MotorDrive,
    MultiportSwitch,
    Mux,
    Prelookup,
    Product,
    Ramp,
    RelationalOperator,
    Relay,
    Rounding,
    Sign,
    SineWave,
    Sqrt,
    Step,
    Sum,
    Switch,
    UnitDelay,
    ZeroOrderHold,
)
from armblocks.diagram import Block, Diagram, DiagramBuilder, trace_diagram
from armblocks.equations import SimulationOptions
from armblocks.errors import SimulationError
from armblocks.integration.system import compile_system
from armblocks.simulation import SimulationResult, simulate
from compiled_diagrams import compiled

Run = Callable[[Diagram, float], dict[str, np.ndarray]]
SAMPLES = 100


def result_of(
    diagram: Diagram, stop: float, solver: str = "rk45", step: float | None = None
) -> SimulationResult:
    return simulate(compiled(diagram), options(stop, solver, step))


def options(stop: float, solver: str, step: float | None) -> SimulationOptions:
    return SimulationOptions(
        stop_time=stop, sample_time=stop / SAMPLES, solver=solver, step=step, rtol=1e-10, atol=1e-12
    )


def native(solver: str, step: float | None = None) -> Run:
    def run(diagram: Diagram, stop: float) -> dict[str, np.ndarray]:
        result = result_of(diagram, stop, solver, step)
        return {name: result[name] for name in result.names} | {"t": result.time}

    return run


def by_reference(diagram: Diagram, stop: float) -> dict[str, np.ndarray]:
    times = np.arange(SAMPLES + 1) * (stop / SAMPLES)
    return run_reference(diagram, times.tolist(), step=stop / SAMPLES / 3) | {"t": times}


RUNS: dict[str, Run] = {"adaptive": native("rk45"), "fixed": native("rk4", 0.01), "reference": by_reference}


NATIVE = pytest.mark.parametrize("run", [RUNS["adaptive"], RUNS["fixed"]], ids=["adaptive", "fixed"])
"""The reference does not support indexed tables, which CasADi has no operation for."""


@pytest.fixture(params=RUNS.values(), ids=list(RUNS))
def run(request: pytest.FixtureRequest) -> Run:
    return request.param


def with_integral(block: Block, *sources: Block) -> Diagram:
    """Sources, a block, and the integral of its first output, which depends on the switching times."""
    return with_integrals({"": block}, *sources)


def with_integrals(blocks: Mapping[str, Block], *sources: Block) -> Diagram:
    """Blocks in parallel with the same sources; the integral of the block ``k`` is ``integral k``."""
    builder = DiagramBuilder("d")
    fed = [builder.add(f"source{k}", source) for k, source in enumerate(sources)]
    for key, block in blocks.items():
        out = builder.add(f"block {key}".strip(), block, *fed)[block.output_ports()[0].name]
        builder.add(f"integral {key}".strip(), Integrator(), out)
    return builder.build()


def close(actual: np.ndarray, expected: np.ndarray, tolerance: float = 5e-9) -> None:
    # rtol 1e-10 over a few hundred steps; RK4 with h = 0.01 s on sines: h^4/120 = 1e-10
    assert actual == pytest.approx(expected, abs=tolerance)


def time_above(level: float, t: np.ndarray) -> np.ndarray:
    """Return how long the sine was above ``level`` until the time t."""
    first, last = math.asin(level), math.pi - math.asin(level)
    rounds = np.floor(t / (2 * math.pi))
    rest = t - 2 * math.pi * rounds
    start = -(2 * math.pi - last) if level < 0 else first
    begins, ends = (first, last) if level >= 0 else (start, last)
    within = np.clip(rest, max(begins, 0.0), ends) - max(begins, 0.0)
    if level < 0:
        within = within + np.clip(rest - (2 * math.pi + first), 0.0, None)
    return rounds * (last - first) + within


def test_the_integral_of_the_absolute_value_of_a_sine_is_exact(run: Run) -> None:
    result = run(with_integral(Abs(), SineWave(amplitude=2.0)), 10.0)
    whole = np.floor(result["t"] / math.pi)
    close(result["integral/y"], 4.0 * whole + 2.0 * (1.0 - np.cos(result["t"] - math.pi * whole)), 2e-8)


def test_the_derivative_of_an_absolute_value_jumps_only_at_events(run: Run) -> None:
    builder = DiagramBuilder("d")
    absolute = builder.add("abs", Abs(), builder.add("sine", SineWave()))
    builder.add("integral", Integrator(), builder.add("rate", Derivative(), absolute))
    result = run(builder.build(), 10.0)
    close(result["integral/y"], np.abs(np.sin(result["t"])))


def test_the_durations_of_comparisons_are_exact(run: Run) -> None:
    parts = {">": 1.0, ">=": 1.0, "<": 0.0, "<=": 0.0, "==": None, "~=": 2.0}
    cases = {
        f"{relation} {level:+g}".replace(".", ","): (relation, level)
        for relation in parts
        for level in (0.3, -0.6)
    }
    blocks = {key: CompareToConstant(relation=relation, constant=c) for key, (relation, c) in cases.items()}
    result = run(with_integrals(blocks, SineWave()), 10.0)
    for key, (relation, level) in cases.items():
        above, t = time_above(level, result["t"]), result["t"]
        expected = {1.0: above, 0.0: t - above, None: 0.0 * t, 2.0: t}[parts[relation]]
        close(result[f"integral {key}/y"], expected, 1e-9)


def test_the_maximum_of_equal_signals_is_correct_until_one_changes(run: Run) -> None:
    """max(t, 1) equals 1 up to t = 1."""
    builder = DiagramBuilder("d")
    one = builder.add("one", Constant(value=1.0))
    most = builder.add("most", MinMax(function="max"), builder.add("clock", Clock()), one)
    builder.add("integral", Integrator(), builder.add("equal", RelationalOperator(relation="=="), most, one))
    result = run(builder.build(), 2.0)
    close(result["integral/y"], np.minimum(result["t"], 1.0), 1e-12)


def test_the_integrals_of_a_sign_and_an_interval_test_are_exact(run: Run) -> None:
    result = run(with_integrals({"1": Sign(), "2": IntervalTest(lower=-0.6, upper=0.3)}, SineWave()), 10.0)
    triangle = math.pi / 2 - np.abs(np.mod(result["t"], 2 * math.pi) - math.pi) + math.pi / 2
    close(result["integral 1/y"], triangle, 1e-9)
    close(result["integral 2/y"], time_above(-0.6, result["t"]) - time_above(0.3, result["t"]), 1e-9)


def test_the_integral_of_the_greater_of_sine_and_cosine_is_exact(run: Run) -> None:
    cosine = SineWave(phase=math.pi / 2)
    result = run(with_integral(MinMax(function="max"), SineWave(), cosine), 10.0)

    def integral(t: float) -> float:
        edges = [0.0, *[e for e in (math.pi / 4, 5 * math.pi / 4, 9 * math.pi / 4) if e < t], t]
        total = 0.0
        for k, (a, b) in enumerate(pairwise(edges)):
            total += math.sin(b) - math.sin(a) if k % 2 == 0 else math.cos(a) - math.cos(b)
        return total

    close(result["integral/y"], np.array([integral(t) for t in result["t"]]))


def test_the_index_of_the_greatest_element_changes_at_the_exact_times(run: Run) -> None:
    builder = DiagramBuilder("d")
    parts = [builder.add(f"s{k}", SineWave(phase=-k * 2 * math.pi / 3)) for k in range(3)]
    three = builder.add("three", Mux(inputs=3), *parts)
    greatest = builder.add("greatest", Extremum(function="max"), three)
    builder.add("integral", Integrator(), greatest["index"])
    result = run(builder.build(), 2 * math.pi)
    # element 1 is greatest around pi/2, 2 around 7 pi/6, 3 around 11 pi/6, each for a third of the period
    t, third = result["t"], 2 * math.pi / 3
    first = math.pi / 6
    expected = (
        3 * np.minimum(t, first) + np.clip(t - first, 0, third) + 2 * np.clip(t - first - third, 0, third)
    )
    close(result["integral/y"], expected + 3 * np.clip(t - first - 2 * third, 0, None), 1e-9)


def test_a_growing_index_selects_the_inputs_of_a_multiport_switch(run: Run) -> None:
    values = [Constant(value=float(value)) for value in (5.0, -1.0, 2.0)]
    result = run(with_integral(MultiportSwitch(), Clock(), *values), 5.0)
    t = result["t"]
    close(
        result["integral/y"], 5 * np.minimum(t, 2) - np.clip(t - 2, 0, 1) + 2 * np.clip(t - 3, 0, None), 1e-11
    )


def test_the_integrals_of_rounded_sines_are_exact(run: Run) -> None:
    """A rounded sine is a sum of comparisons, whose integrals are known."""
    functions = ("floor", "ceil", "round", "fix")
    blocks = {function: Rounding(function=function) for function in functions}
    result = run(with_integrals(blocks, SineWave(amplitude=2.5)), 10.0)
    t = result["t"]

    def above(level: float) -> np.ndarray:
        return time_above(level / 2.5, t)

    def below(level: float) -> np.ndarray:
        return t - above(level)

    expected = {
        "floor": above(1) + above(2) - below(0) - below(-1) - below(-2),
        "ceil": above(0) + above(1) + above(2) - below(-1) - below(-2),
        "round": above(0.5) + above(1.5) - below(-0.5) - below(-1.5),
        "fix": above(1) + above(2) - below(-1) - below(-2),
    }
    for function in functions:
        close(result[f"integral {function}/y"], expected[function], 2e-9)


def test_the_integrals_of_remainders_of_a_sine_are_exact(run: Run) -> None:
    """The remainder is u - n v; the quotient n is a sum of comparisons, whose integrals are known."""
    for function, divisors in (("mod", (1.0, -0.7)), ("rem", (0.7, -1.0))):
        result = run(
            with_integral(Modulo(function=function), SineWave(amplitude=2.5), Constant(value=divisors)), 10.0
        )
        for k, divisor in enumerate(divisors):
            integral = remainder_integral(function, divisor, result["t"])
            close(result["integral/y"][:, k], integral, 1.5e-8)  # an amplitude of 2.5


def test_remainders_agree_with_numpy_for_quotients_of_every_size() -> None:
    """The divisors jump at 0.5 s, also to 0 and to numbers that are too small for events."""
    random, n = np.random.default_rng(11), 60
    before, factor = (
        random.choice([-1, 1], n) * 10 ** random.uniform(-2, 2, n),
        random.choice([1.5, -0.7, 1e-18, 0.0], n),
    )
    start = random.choice([-1, 1], n) * 10 ** random.uniform(0, 22, n) * np.abs(before)
    initial = np.where(random.random(n) < 0.2, 0.0, before)
    for function in ("mod", "rem"):
        last = before * np.where((factor == 0.0) & (function == "rem"), 1e-20, factor)
        first = before if function == "rem" else initial
        for zero_crossing in (True, False):
            builder = DiagramBuilder("quotients")
            u = builder.add("u", Ramp(slope=random.uniform(-3, 3, n) * np.abs(before), initial=start))
            v = builder.add("v", Step(time=0.5, initial=first, final=last))
            builder.add("y", Modulo(function=function, zero_crossing=zero_crossing), u, v)
            result = simulate(compiled(builder.build()), SimulationOptions(stop_time=1.0, sample_time=0.05))
            u_run, v_run = result["u/y"], result["v/y"]
            divisor = np.where(v_run == 0.0, np.inf, v_run)
            remainder = np.mod if function == "mod" else np.fmod
            expected = np.where(v_run == 0.0, u_run, remainder(u_run, divisor))
            assert np.array_equal(result["y/y"], expected)


def test_a_remainder_by_zero_is_nan_from_a_jump_of_the_divisor_on() -> None:
    builder = DiagramBuilder("zero")
    divisor = builder.add("v", Step(time=0.5, initial=0.4, final=0.0))
    builder.add("y", Modulo(function="rem"), builder.add("u", Ramp(initial=1.3)), divisor)
    with pytest.raises(SimulationError, match=r"'y/y' is nan at 0\.5 s"):
        simulate(compiled(builder.build()), SimulationOptions(stop_time=1.0, sample_time=0.1))


def remainder_integral(function: str, divisor: float, t: np.ndarray) -> np.ndarray:
    """The integral of the remainder of 2.5 sin t."""

    def above(level: float) -> np.ndarray:
        return time_above(level / 2.5, t)

    step = abs(divisor)
    levels = step * np.arange(1, int(2.5 / step) + 1)
    turns = sum(above(level) for level in levels) + sum(above(-level) - t for level in levels)
    if function == "mod":
        turns = turns + (above(0.0) - t if divisor > 0 else above(0.0))
    return 2.5 * (1 - np.cos(t)) - step * turns


def test_the_difference_of_rotating_angles_jumps_when_they_are_opposite(run: Run) -> None:
    """3 t - 1, wrapped to a sawtooth between -pi and pi; its integral consists of parabolas."""
    result = run(with_integral(AngleDifference(), Ramp(slope=3.0), Constant(value=1.0)), 10.0)
    angle = 3 * result["t"] - 1
    wrapped = np.mod(angle + math.pi, 2 * math.pi) - math.pi
    close(result["integral/y"], (wrapped**2 - 1) / 6, 1e-9)


METHODS = ("linear", "nearest", "flat")


@pytest.mark.parametrize("count", [3, 20])
@NATIVE
def test_steps_end_at_every_cell_boundary_of_a_surface(count: int, run: Run) -> None:
    """The integral along a straight path agrees with Gauss's rule for each cell, exact for quadratics."""
    random = np.random.default_rng(count)
    axes = [np.cumsum(random.uniform(0.5, 1.5, n)) * 3 / count for n in (count, count - 1)]
    table = random.normal(size=(count, count - 1))
    starts, slopes = (0.2, axes[1][-1] + 0.3), (0.9, -1.1)
    surface = LookupTable2D(positions1=axes[0], positions2=axes[1], table=table)
    blocks = {method: surface.with_parameters(method=method) for method in METHODS}
    ramps = (Ramp(initial=a, slope=b) for a, b in zip(starts, slopes))
    result = run(with_integrals(blocks, *ramps), 4.0)
    t = result["t"]

    def value(method: str, times: np.ndarray) -> np.ndarray:
        u = [np.clip(a + b * times, x[0], x[-1]) for a, b, x in zip(starts, slopes, axes)]
        if method == "flat":
            k = [np.searchsorted(x, v, side="right") - 1 for x, v in zip(axes, u)]
            return table[tuple(k)]
        return RegularGridInterpolator(axes, table, method=method)(np.column_stack(u))

    edges = [np.r_[x, (x[1:] + x[:-1]) / 2] for x in axes]
    times = [(edge - a) / b for a, b, edge in zip(starts, slopes, edges)]
    fine = np.unique(np.concatenate([t, *(entry[(entry > 0) & (entry < 4)] for entry in times)]))
    nodes, weights = np.polynomial.legendre.leggauss(2)
    h, middle = np.diff(fine) / 2, (fine[1:] + fine[:-1]) / 2
    for method in METHODS:
        pieces = np.zeros_like(h)
        for node, weight in zip(nodes, weights):
            pieces += weight * h * value(method, middle + node * h)
        area = np.concatenate([[0.0], np.cumsum(pieces)])
        close(result[f"integral {method}/y"], np.interp(t, fine, area), 1e-9)


@pytest.mark.parametrize("count", [4, 40])
@NATIVE
def test_the_index_of_a_prelookup_changes_at_events(count: int, run: Run) -> None:
    """For a ramp the index is a staircase and the fraction a sawtooth."""
    x = np.cumsum(np.random.default_rng(count).uniform(0.5, 1.5, count)) * 4 / count
    builder = DiagramBuilder("d")
    u = builder.add("u", Ramp(slope=1.0))
    for extrapolation in ("clip", "linear"):
        place = builder.add(extrapolation, Prelookup(positions=x, extrapolation=extrapolation), u)
        builder.add(f"k {extrapolation}", Integrator(), place["k"])
        builder.add(f"f {extrapolation}", Integrator(), place["f"])
    result = run(builder.build(), 6.0)
    t = result["t"]
    fine = np.unique(np.r_[t, x[x < 6.0]])
    middle, width = (fine[1:] + fine[:-1]) / 2, np.diff(fine)
    k = np.clip(np.searchsorted(x, middle) - 1, 0, count - 2)
    linear = (middle - x[k]) / (x[k + 1] - x[k])
    for extrapolation, f in (("clip", np.clip(linear, 0, 1)), ("linear", linear)):
        close(result[f"k {extrapolation}/y"], np.maximum(t[:, None] - x[1:-1], 0).sum(axis=1), 1e-9)
        area = np.concatenate([[0.0], np.cumsum(f * width)])
        close(result[f"f {extrapolation}/y"], np.interp(t, fine, area), 1e-9)


def test_steps_end_at_the_kinks_of_a_curve_with_variable_points(run: Run) -> None:
    """Points at 1 and 2 + t/2, values 0 and 1, at t: 0, then (t - 1) / (1 + t/2), then 1 after t = 4."""
    builder = DiagramBuilder("d")
    positions = builder.add("x", Ramp(initial=[1.0, 2.0], slope=[0.0, 0.5]))
    curve = builder.add(
        "y",
        LookupTableDynamic(),
        builder.add("t", Clock()),
        positions,
        builder.add("v", Constant(value=[0.0, 1.0])),
    )
    builder.add("integral", Integrator(), curve)
    result = run(builder.build(), 6.0)
    t = result["t"]

    def rising(s: np.ndarray) -> np.ndarray:  # integral of (s - 1) / (1 + s / 2) = 2 - 6 / (s + 2)
        return 2 * (s - 1) - 6 * np.log((s + 2) / 3)

    expected = np.select([t < 1, t < 4], [0 * t, rising(np.maximum(t, 1))], rising(np.array(4.0)) + t - 4)
    close(result["integral/y"], expected, 2e-9)


def test_steps_end_at_the_kinks_and_jumps_of_a_table(run: Run) -> None:
    """A ramp from -1 through the table -> its antiderivative, piece by piece."""
    points, values = [0.0, 1.0, 1.5, 3.0], [1.0, -1.0, 2.0, 2.5]
    table = LookupTable1D(positions=points, table=values)
    cases = [(method, extrapolation) for method in METHODS for extrapolation in ("clip", "linear")]
    builder = DiagramBuilder("d")
    shifted = builder.add(
        "u", Sum(signs="+-"), builder.add("t", Clock()), builder.add("one", Constant(value=1.0))
    )
    for method, extrapolation in cases:
        block = table.with_parameters(method=method, extrapolation=extrapolation)
        read = builder.add(f"{method} {extrapolation}", block, shifted)
        builder.add(f"integral {method} {extrapolation}", Integrator(), read)
    result = run(builder.build(), 5.0)

    def curve(u: float, method: str, extrapolation: str) -> float:
        if method == "flat":
            return values[max(int(np.searchsorted(points, u, side="right")) - 1, 0)]
        if method == "nearest":
            return values[int(np.searchsorted([0.5, 1.25, 2.25], u, side="right"))]
        if extrapolation == "linear" and u < 0.0:
            return 1.0 - 2.0 * u
        if extrapolation == "linear" and u > 3.0:
            return 2.5 + (u - 3.0) / 3.0
        return float(np.interp(u, points, values))

    breakpoints = [-1.0, 0.0, 0.5, 1.0, 1.25, 1.5, 2.25, 3.0, 4.0]

    def integral(end: float, method: str, extrapolation: str) -> float:
        total, nodes = 0.0, [b for b in breakpoints if b < end] + [end]
        for a, b in pairwise(nodes):
            m = (a + b) / 2  # each piece is linear
            total += (b - a) * curve(m, method, extrapolation)
        return total

    for case in cases:
        expected = np.array([integral(t - 1.0, *case) for t in result["t"]])
        close(result[f"integral {' '.join(case)}/y"], expected, 1e-10)


def test_steps_end_where_the_limits_of_a_drive_become_active(run: Run) -> None:
    """Input 15, peak 10, limit 20 (1 - w/100), w = 20 t: 10 until t = 2.5, then falling, -10 after 7.5."""
    builder = DiagramBuilder("d")
    speed = builder.add("w", Gain(gain=20.0), builder.add("t", Clock()))
    drive = builder.add("drive", MotorDrive(), builder.add("reference", Constant(value=15.0)), speed)
    builder.add("integral", Integrator(), drive)
    result = run(builder.build(), 9.0)
    t = result["t"]
    falling = np.clip(t, 2.5, 7.5) - 2.5
    close(
        result["integral/y"],
        10 * np.minimum(t, 2.5) + 10 * falling - 2 * falling**2 - 10 * np.clip(t - 7.5, 0, None),
        1e-10,
    )


def test_a_mass_between_elastic_stops_reverses_its_speed(run: Run) -> None:
    """An elastic stop without damping: contact for half a spring period, then the reversed speed."""
    builder = DiagramBuilder("d")
    stops = JointStops(lower=-1.0, upper=1.0, stiffness=100.0, damping=0.0)
    q = builder.add("q", Integrator(initial=0.0))
    qd = builder.add("qd", Integrator(initial=1.0))
    builder.connect(qd, q["u"])
    builder.connect(builder.add("stops", stops, q, qd), qd["u"])
    result = run(builder.build(), 3.6)
    t, half = result["t"], math.pi / 10
    inside = 1.0 + np.sin(10 * (t - 1.0)) / 10
    back = 1.0 - (t - 1.0 - half)
    final = -1.0 - np.sin(10 * (t - 3.0 - half)) / 10
    expected = np.select([t < 1, t < 1 + half, t < 3 + half], [t, inside, back], final)
    # RK4 with h = 0.01 s on a spring of 10 rad/s: (0.1)^4 / 120 of the amplitude 0.1 per radian
    close(result["q/y"], expected, 2e-6)


def test_modes_of_a_chain_of_blocks_become_consistent(run: Run) -> None:
    """Each mode depends on the one before: |-2| = 2, 2 > 1, so the switch outputs 7."""
    builder = DiagramBuilder("d")
    size = builder.add("size", Abs(), builder.add("u", Constant(value=-2.0)))
    slowly = builder.add("moved", Sum(signs="++"), size, builder.add("t", Clock()))
    large = builder.add("large", CompareToConstant(relation=">", constant=1.0), slowly)
    seven, one = builder.add("seven", Constant(value=7.0)), builder.add("one", Constant(value=1.0))
    out = builder.add("out", Switch(threshold=0.5), seven, large, one)
    builder.add("integral", Integrator(), builder.add("sign", Sign(), builder.add("abs", Abs(), out)))
    result = run(builder.build(), 1.0)
    assert result["out/y"].tolist() == [7.0] * (SAMPLES + 1)
    close(result["integral/y"], result["t"], 1e-12)


@pytest.mark.parametrize("run", [RUNS["adaptive"], RUNS["fixed"]], ids=["adaptive", "fixed"])
def test_a_square_root_of_an_absolute_value_is_integrated_across_its_zero(run: Run) -> None:
    """With a constant mode, a step across the zero needs roots of negative numbers: the step is shortened."""
    builder = DiagramBuilder("d")
    root = builder.add("root", Sqrt(), builder.add("abs", Abs(), builder.add("sine", SineWave())))
    builder.add("integral", Integrator(), root)
    result = run(builder.build(), 4.0)
    assert np.isfinite(result["integral/y"]).all()
    # Beta function: the integral of sqrt(sin) over half a period; its derivative is infinite at the ends
    half = math.gamma(0.75) * math.sqrt(math.pi) / math.gamma(1.25)
    at = np.searchsorted(result["t"], math.pi)
    assert result["integral/y"][at] == pytest.approx(half, abs=5e-3)


def test_without_zero_crossings_there_are_no_events() -> None:
    plain = result_of(with_integral(Abs(zero_crossing=False), SineWave()), 10.0)
    exact = result_of(with_integral(Abs(), SineWave(amplitude=2.0)), 10.0)
    assert plain.run.events == 0
    assert exact.run.events == 3
    assert plain["integral/y"] == pytest.approx(exact["integral/y"] / 2.0, abs=1e-6)


def test_signals_that_change_only_at_ticks_cause_no_events() -> None:
    builder = DiagramBuilder("d")
    held = builder.add("held", ZeroOrderHold(sample_time=0.1), builder.add("sine", SineWave()))
    positive = builder.add("positive", CompareToZero(relation=">"), builder.add("abs", Abs(), held))
    builder.add("integral", Integrator(), positive)
    builder.add("delayed", UnitDelay(sample_time=0.1), positive)
    result = result_of(builder.build(), 10.0)
    assert result.run.events == 0
    assert result["integral/y"][-1] == pytest.approx(9.9, abs=1e-9)


def test_a_sample_at_an_event_has_the_new_value(run: Run) -> None:
    """t reaches 0.5, 1 and 1.5 exactly at samples, where signals are right-continuous."""
    builder = DiagramBuilder("d")
    t = builder.add("t", Clock())
    for k, level in enumerate((0.5, 1.0, 1.5)):
        builder.add(f"c{k}", CompareToConstant(relation=">=", constant=level), t)
    builder.add("whole", Rounding(), t)
    result = run(builder.build(), 2.0)
    for k, level in enumerate((0.5, 1.0, 1.5)):
        assert result[f"c{k}/y"].tolist() == (result["t"] >= level).tolist()
    assert result["whole/y"].tolist() == np.floor(result["t"]).tolist()


@pytest.mark.parametrize("run", [RUNS["adaptive"], RUNS["fixed"]], ids=["adaptive", "fixed"])
def test_a_tank_that_empties_through_a_hole_stays_empty(run: Run) -> None:
    """Torricelli: h' = -2 sqrt(h) with h(0) = 1 is (1 - t)^2 until t = 1; then the tank stays empty."""
    builder = DiagramBuilder("d")
    level = builder.add("level", Integrator(initial=1.0))
    zero = builder.add("zero", Constant(value=0.0))
    positive = builder.add("positive", MinMax(function="max"), level, zero)
    builder.connect(builder.add("out", Gain(gain=-2.0), builder.add("root", Sqrt(), positive)), level["u"])
    result = run(builder.build(), 2.0)
    # the derivative of the root is unbounded towards the end
    close(result["level/y"], np.clip(1.0 - result["t"], 0.0, None) ** 2, 1e-5)


def test_a_dip_that_is_shorter_than_a_step_is_detected() -> None:
    """A parabola that is below its level for only 0.02 s, without states that limit the steps."""
    builder = DiagramBuilder("d")
    t = builder.add("t", Clock())
    shifted = builder.add("s", Sum(signs="+-"), t, builder.add("c", Constant(value=0.0)))
    square = builder.add("square", Product(), shifted, shifted)
    low = builder.add("low", CompareToConstant(relation="<", constant=0.0), square)
    builder.add("integral", Integrator(), low)
    compiled = compile_system(trace_diagram(builder.build()))
    for centre, width in ((3.3, 0.01), (7.77, 0.03), (9.1, 0.1)):
        for solver, step in (("rk45", None), ("rk4", 0.5)):
            values = {"c.value": centre, "low.constant": width**2}
            result = simulate(compiled, options(10.0, solver, step), values)
            assert result["integral/y"][-1] == pytest.approx(2 * width, abs=1e-9)
            assert result.run.events == 2


def test_modes_are_consistent_when_a_run_continues_with_other_parameters() -> None:
    """At 1 s the level is above 0.5 but below the new threshold 2.8, without a crossing."""
    builder = DiagramBuilder("d")
    level = builder.add("level", Integrator(), builder.add("one", Constant(value=1.0)))
    above = builder.add("above", CompareToConstant(relation=">", constant=0.5), level)
    builder.add("time", Integrator(), above)
    compiled = compile_system(trace_diagram(builder.build()))
    first = simulate(compiled, SimulationOptions(stop_time=1.0, rtol=1e-9))
    assert first["time/y"][-1] == pytest.approx(0.5, abs=1e-12)
    longer = SimulationOptions(stop_time=4.0, sample_time=0.5, rtol=1e-9)
    later = simulate(compiled, longer, {"above.constant": 2.8}, initial_state=first.final_state)
    assert later["above/y"].tolist() == [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0]
    assert later["time/y"][-1] == pytest.approx(1.7, abs=1e-9)


@pytest.mark.parametrize("solver", ["rk45", "rodas5p", "rk4"])
@pytest.mark.parametrize("block", [HitCrossing(offset=-0.5), Relay(on_point=0.7)])
def test_a_run_ends_if_rounding_decides_the_sign_of_a_guard(block: Block, solver: str) -> None:
    """The dead zone has no width, so its output minus its input is -0.5 up to rounding.

    The search for an event must end even in a step of ten units in the last place.
    """
    builder = DiagramBuilder("d")
    sine = SineWave(amplitude=1.4424198862237227, frequency=math.pi, phase=0.09497253091345148, bias=-0.5)
    u = builder.add("u", sine)
    zone = builder.add("zone", DeadZone(start=0.5, end=0.5), u)
    constant = builder.add("constant", Sum(signs="+-"), zone, u)
    port = block.output_ports()[0].name
    builder.add("integral", Integrator(), builder.add("block", block, constant)[port])
    step = 0.01 if solver == "rk4" else None
    try:
        result = simulate(
            compiled(builder.build()), SimulationOptions(stop_time=10.0, solver=solver, step=step)
        )
    except SimulationError as error:
        assert "events without end" in str(error) or "extremely short steps" in str(error)
    else:
        np.testing.assert_allclose(result["constant/y"], -0.5, atol=1e-15)
