"""Linear algebraic loops compared with NumPy: continuous, at ticks, with modes, and differentiated."""

from __future__ import annotations

import itertools
import re
from fractions import Fraction

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    Clock,
    Constant,
    DeadZone,
    Gain,
    Hypot,
    Integrator,
    MatrixGain,
    Saturation,
    SineWave,
    Sum,
    ZeroOrderHold,
)
from armblocks.compiler.from_casadi import tape_from
from armblocks.compiler.interpret import interpret
from armblocks.diagram import DiagramBuilder, trace_diagram
from armblocks.equations import HybridSystem
from armblocks.simulation.loop_conditions import loop_conditions

EPS = np.finfo(np.float64).eps


def loop(M: np.ndarray, c: np.ndarray) -> ab.Diagram:
    """A diagram of the loop s = c + M s."""
    builder = DiagramBuilder("loop")
    s = builder.add("s", Sum(), builder.add("c", Constant(value=c)))
    builder.connect(builder.add("M", MatrixGain(gain=M), s), s["u2"])
    return builder.build()


def interpreted_signals(system: HybridSystem) -> dict[str, np.ndarray]:
    """Evaluate the signals of a system without states at t = 0 with the interpreter of the tape."""
    empty = np.empty(0)
    (y,) = interpret(tape_from(system.signals), [np.zeros(1), empty, empty, empty, system.parameter_values])
    return system.signals_layout.unpack(y)


def hilbert(n: int) -> np.ndarray:
    return 1.0 / (np.add.outer(np.arange(n), np.arange(n)) + 1.0)


def permuted_triangle(n: int, random: np.random.Generator) -> np.ndarray:
    """A regular matrix with zeros on the diagonal: elimination without row exchanges divides by zero."""
    triangle = np.triu(random.uniform(0.5, 2.0, (n, n)))
    return triangle[np.roll(np.arange(n), 1)]


@pytest.mark.parametrize("n", [3, 4, 5, 6, 8, 12])
def test_a_loop_of_vectors_is_solved_as_accurately_as_by_numpy(n: int) -> None:
    random = np.random.default_rng(n)
    kinds = [np.eye(n) + random.normal(size=(n, n)), permuted_triangle(n, random)]
    kinds += [hilbert(n)] if n <= 8 else []
    for matrix in kinds:
        c, M = random.normal(size=n), np.eye(n) - matrix
        expected = np.linalg.solve(np.eye(n) - M, c)
        error = np.abs(interpreted_signals(trace_diagram(loop(M, c)))["s/y"] - expected).max()
        assert error <= 5.0 * n * EPS * np.linalg.cond(matrix) * np.abs(expected).max()


def exact_solution(A: list[list[Fraction]], b: list[Fraction]) -> list[Fraction]:
    """Solve A x = b by elimination in fractions."""
    rows = [[*row, right] for row, right in zip(A, b)]
    for k in range(len(b)):
        pivot = next(i for i in range(k, len(b)) if rows[i][k])
        rows[k], rows[pivot] = rows[pivot], [entry / rows[pivot][k] for entry in rows[pivot]]
        for i in range(len(b)):
            if i != k and (factor := rows[i][k]):
                rows[i] = [entry - factor * own for entry, own in zip(rows[i], rows[k])]
    return [row[-1] for row in rows]


@pytest.mark.parametrize("seed", range(24))
def test_every_signal_of_a_loop_is_as_accurate_as_its_condition_allows(seed: int) -> None:
    """Up to eight sums of a constant and other sums, with one or two gains of 1e-9 to 1e9 between them."""
    random = np.random.default_rng(seed)
    n = 1 + seed % 8
    fed = random.uniform(size=(n, n)) < (2.0 / n if n > 2 else 1.0)
    fed |= np.roll(np.eye(n, dtype=bool), 1, axis=1)  # one loop through all sums
    gains = 10.0 ** random.uniform(-9.0, 9.0, (2, n, n)) * random.choice([-1.0, 1.0], (2, n, n))
    gains[1][random.uniform(size=(n, n)) < 0.5] = 1.0
    gains[1] = np.where(np.abs(gains[0] * gains[1]) > 1e9, 1.0, gains[1])
    c = random.normal(size=n) * 10.0 ** random.uniform(-3.0, 3.0, n)
    builder = DiagramBuilder("sums and gains")
    sums = [
        builder.add(f"s{i}", Sum(signs="+" * (1 + fed[i].sum())), builder.add(f"c{i}", Constant(value=c[i])))
        for i in range(n)
    ]
    for i in range(n):
        for port, j in enumerate(np.flatnonzero(fed[i]).tolist()):
            first = builder.add(f"g{i}_{j}", Gain(gain=gains[0, i, j]), sums[j])
            second = builder.add(f"h{i}_{j}", Gain(gain=gains[1, i, j]), first)
            builder.connect(second, sums[i][f"u{port + 2}"])
    signals = interpreted_signals(trace_diagram(builder.build()))

    G = [
        [Fraction(gains[0, i, j]) * Fraction(gains[1, i, j]) * int(fed[i, j]) for j in range(n)]
        for i in range(n)
    ]
    A = [[int(i == j) - G[i][j] for j in range(n)] for i in range(n)]
    x = exact_solution(A, [Fraction(value) for value in c])
    # Skeel's condition number of each signal: every term of every sum may have a rounding error.
    terms = [abs(Fraction(c[i])) + abs(x[i]) + sum(abs(G[i][j] * x[j]) for j in range(n)) for i in range(n)]
    inverse = [exact_solution(A, [Fraction(int(i == k)) for i in range(n)]) for k in range(n)]
    for i in range(n):
        condition = sum(abs(inverse[k][i]) * terms[k] for k in range(n)) / abs(x[i])
        bound = 4.0 * n * EPS * float(condition)
        if bound > 1e-3:
            continue  # too close to singular for a first-order bound
        solution = {f"s{i}": x[i]}
        solution |= {f"g{k}_{i}": x[i] * Fraction(gains[0, k, i]) for k in range(n) if fed[k, i]}
        solution |= {f"h{k}_{i}": x[i] * G[k][i] for k in range(n) if fed[k, i]}
        for name, exact in solution.items():
            assert abs(Fraction(float(signals[f"{name}/y"])) / exact - 1) <= bound, name


def test_a_loop_of_high_gain_has_an_accurate_error_signal() -> None:
    """e = r - K e, so e = r / (1 + K), and y = K e."""
    builder = DiagramBuilder("follower")
    e = builder.add("e", Sum(signs="+-"), builder.add("r", Constant(value=1.3)))
    builder.connect(builder.add("y", Gain(gain=1e9), e), e["u2"])
    signals = interpreted_signals(trace_diagram(builder.build()))
    assert float(signals["e/y"]) == pytest.approx(1.3 / (1.0 + 1e9), rel=4.0 * EPS)
    assert float(signals["y/y"]) == pytest.approx(1.3e9 / (1.0 + 1e9), rel=4.0 * EPS)


def test_an_ill_conditioned_loop_is_reported_at_the_end_of_the_run() -> None:
    message = ab.simulate(loop(np.eye(8) - hilbert(8), np.ones(8)), stop_time=0.0).run.message
    assert re.search(
        r"the loop of 's/y\[0\]', .* and 5 more signals has the condition number 2e\+10 at 0 s", message
    )
    assert "about 6 correct digits" in message
    assert not ab.simulate(loop(np.eye(6) - hilbert(6), np.ones(6)), stop_time=0.0).run.message


def test_the_condition_of_a_loop_does_not_depend_on_units() -> None:
    random = np.random.default_rng(4)
    gains = np.array([0.5, -3.0, 0.999])
    assert loop_conditions(gains[:, None, None] - 1.0) == pytest.approx(
        (1 + np.abs(gains)) / np.abs(1 - gains)
    )
    M = random.normal(size=(4, 4))
    units = 10.0 ** random.uniform(-9.0, 9.0, 4)
    both = np.array([M, units[:, None] * M / units]) - np.eye(4)
    radius = np.abs(np.linalg.eigvals(np.abs(np.linalg.inv(both[0])) @ (np.eye(4) + np.abs(M)))).max()
    assert loop_conditions(both) == pytest.approx(radius, rel=0.1)
    assert loop_conditions(np.zeros((1, 2, 2))) == [0.0]


def test_a_loop_of_fifty_unknowns_is_solved() -> None:
    random = np.random.default_rng(50)
    M, c = random.normal(size=(50, 50)), random.normal(size=50)
    result = ab.simulate(loop(M, c), stop_time=1.0, sample_time=0.5)
    np.testing.assert_allclose(result["s"], [np.linalg.solve(np.eye(50) - M, c)] * 3, rtol=1e-10)


def test_a_loop_of_vectors_with_saturation_is_solved() -> None:
    """s = c - M sat(s) with c = t c0: the consistent one of 27 linear pieces is found."""
    c0 = np.array([1.0, -2.0, 1.5])
    M = np.array([[1.0, 0.5, 0.2], [0.3, 2.0, -0.4], [-0.2, 0.6, 1.5]])
    builder = DiagramBuilder("pieces")
    s = builder.add(
        "s", Sum(signs="+-"), builder.add("c", MatrixGain(gain=c0[:, None]), builder.add("t", Clock()))
    )
    limited = builder.add("limited", Saturation(lower=-1.0, upper=1.0), s)
    builder.connect(builder.add("M", MatrixGain(gain=M), limited), s["u2"])
    builder.add("x", Integrator(initial=np.zeros(3)), s)
    result = ab.simulate(builder.build(), stop_time=4.0, sample_time=0.25, rtol=1e-9, atol=1e-9)

    def piece(c: np.ndarray) -> np.ndarray:
        for sides in itertools.product((-1.0, 0.0, 1.0), repeat=3):
            side = np.array(sides)
            free = np.diag(side == 0.0)
            actual = np.linalg.solve(np.eye(3) + M @ free, c - M @ side)
            if (np.where(side == 0.0, np.abs(actual) <= 1.0, actual * side >= 1.0)).all():
                return actual
        raise AssertionError

    expected = np.array([piece(t * c0) for t in result.time])
    np.testing.assert_allclose(result["s"], expected, rtol=1e-12, atol=1e-12)
    assert len({tuple(np.sign(row) * (np.abs(row) > 1.0)) for row in expected}) > 2


def test_a_loop_of_vectors_is_solved_at_a_tick_with_the_new_samples() -> None:
    M = np.array([[0.0, 2.0, 0.0], [0.5, 0.3, 0.7], [0.2, 0.0, -4.0]])
    builder = DiagramBuilder("ticks")
    held = builder.add("held", ZeroOrderHold(sample_time=0.5), builder.add("t", Clock()))
    wide = builder.add("wide", MatrixGain(gain=[[1.0], [2.0], [3.0]]), held)
    s = builder.add("s", Sum(), wide)
    builder.connect(builder.add("M", MatrixGain(gain=M), s), s["u2"])
    builder.add("again", ZeroOrderHold(), s)
    system = trace_diagram(builder.build())
    (z,) = system.update(1.5, (), np.zeros(system.discrete.size), (), system.parameter_values, [1.0])
    expected = 1.5 * np.linalg.solve(np.eye(3) - M, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(system.discrete.unpack(z)["again/y"], expected, rtol=1e-13)


def test_linearisation_and_sensitivity_of_a_loop_of_vectors_agree_with_closed_forms() -> None:
    """The system is x' = s with s = g M s - x."""
    M = np.array([[0.0, 2.0, 0.0], [0.5, 0.3, 0.7], [0.2, 0.0, -4.0]])
    builder = DiagramBuilder("inside")
    x = builder.add("x", Integrator(initial=[1.0, -2.0, 0.5]))
    s = builder.add("s", Sum(signs="-+"), x)
    gain = builder.add("g", Gain(gain=1.0), s)
    builder.connect(builder.add("M", MatrixGain(gain=M), gain), s["u2"])
    builder.connect(s, x["u"])
    diagram = builder.build()
    system = ab.linearize(diagram)
    np.testing.assert_allclose(system.A, -np.linalg.inv(np.eye(3) - M), rtol=1e-12, atol=1e-13)

    settings = {"stop_time": 1.0, "sample_time": 0.5, "rtol": 1e-11, "atol": 1e-13}
    actual = ab.sensitivity(diagram, "g.gain", "x", **settings)
    runs = [ab.simulate(diagram, parameters={"g.gain": 1.0 + d}, **settings)["x"] for d in (1e-5, -1e-5)]
    np.testing.assert_allclose(actual["x", "g.gain"], (runs[0] - runs[1]) / 2e-5, rtol=1e-6, atol=1e-8)
    stiff = ab.simulate(diagram, **(settings | {"solver": "rodas", "rtol": 1e-9, "atol": 1e-12}))
    np.testing.assert_allclose(stiff["x"], sum(runs) / 2.0, rtol=1e-6)


def test_a_loop_through_the_corner_of_a_norm_is_solved() -> None:
    """y = sqrt(u^2 + 0.09 y^2): at u = 0 the solution is 0, where the norm has no derivative."""
    builder = ab.DiagramBuilder("norm")
    sine = builder.add("sine", SineWave(amplitude=2.0, frequency=np.pi))
    held = builder.add("held", ZeroOrderHold(sample_time=0.5), sine)
    level = builder.add("level", DeadZone(start=-1.0, end=1.0), held)
    norm = builder.add("norm", Hypot(), level)
    builder.connect(builder.add("share", Gain(gain=0.3), norm), norm["v"])
    result = ab.simulate(builder.build(), stop_time=4.0)
    assert set(np.round(result["level"], 12).tolist()) == {-1.0, 0.0, 1.0}
    assert result["norm"] == pytest.approx(np.abs(result["level"]) / np.sqrt(0.91), abs=1e-12)


@pytest.mark.parametrize("gain", [0.7, 2.0, 1e3, 1e6])
def test_a_saturation_in_a_loop_reaches_its_limits(gain: float) -> None:
    """``y = clip(K (r - y), -1, 1)`` is ``clip(K r / (1 + K), -1, 1)``, also at the limits themselves."""
    builder = DiagramBuilder("limited follower")
    sine = builder.add("sine", SineWave(amplitude=2.0 + 2.0 / gain, frequency=3.0))
    error = builder.add("error", Sum(signs="+-"), sine)
    amplified = builder.add("K", Gain(gain=gain), error)
    y = builder.add("y", Saturation(lower=-1.0, upper=1.0), amplified)
    builder.connect(y, error["u2"])
    builder.add("integral", Integrator(), y)
    result = ab.simulate(builder.build(), stop_time=5.0, sample_time=0.01)
    expected = np.clip(gain / (1.0 + gain) * result["sine"], -1.0, 1.0)
    np.testing.assert_allclose(result["y"], expected, atol=1e-12)
