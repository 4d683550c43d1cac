"""Algebraic loops: symbolic solution of linear loops, implicit equations, and refused singular loops."""

from __future__ import annotations

import numpy as np
import pytest

from armblocks.blocks import (
    Clock,
    Constant,
    Derivative,
    Gain,
    Integrator,
    MatrixGain,
    Product,
    Sum,
    Trigonometry,
    UnitDelay,
    ZeroOrderHold,
)
from armblocks.diagram import BlockHandle, DiagramBuilder, trace_diagram
from armblocks.equations import HybridSystem
from armblocks.errors import AlgebraicLoopError, DiagramError


def signals_at(system: HybridSystem, t: float = 0.0, w: object = ()) -> dict[str, np.ndarray]:
    x = np.zeros(system.states.size)
    (y,) = system.signals(t, x, np.zeros(system.discrete.size), w, system.parameter_values)
    return system.signals_layout.unpack(y)


def feedback(builder: DiagramBuilder, gain: float, source: BlockHandle, signs: str = "++") -> BlockHandle:
    """``sum = source ± gain sum``"""
    total = builder.add("sum", Sum(signs=signs), source)
    builder.connect(builder.add("gain", Gain(gain=gain), total), total["u2"])
    return total


def test_a_scalar_linear_loop_is_solved() -> None:
    builder = DiagramBuilder("d")
    feedback(builder, 1.0, builder.add("one", Constant()), "+-")
    system = trace_diagram(builder.build())
    assert system.algebraic.size == 0
    assert float(signals_at(system)["sum/y"]) == 0.5


def test_a_linear_loop_of_vectors_that_depends_on_time_is_solved() -> None:
    """y = t c - M y, so y = (1 + M)^-1 t c."""
    M, c = np.array([[0.5, 2.0, 0.0], [-1.0, 0.3, 0.7], [0.2, 0.0, 4.0]]), np.array([1.0, -2.0, 3.0])
    builder = DiagramBuilder("d")
    source = builder.add("source", Product(), builder.add("t", Clock()), builder.add("c", Constant(value=c)))
    y = builder.add("y", Sum(signs="+-"), source)
    builder.connect(builder.add("M", MatrixGain(gain=M), y), y["u2"])
    builder.add("rate", Derivative(), y)
    system = trace_diagram(builder.build())
    assert system.algebraic.size == 0
    expected = np.linalg.solve(np.eye(3) + M, c)
    # about ten rounding errors, times the condition number of 1 + M
    assert signals_at(system, 2.0)["y/y"] == pytest.approx(2.0 * expected, rel=1e-14)
    assert signals_at(system, 2.0)["rate/y"] == pytest.approx(expected, rel=1e-14)


def test_two_coupled_loops_with_a_zero_diagonal_are_solved() -> None:
    """a = 1 + a + b and b = 2 + a: the diagonal of the equations is zero."""
    builder = DiagramBuilder("d")
    one, two = builder.add("one", Constant()), builder.add("two", Constant(value=2.0))
    a = builder.add("a", Sum(signs="+++"), one)
    b = builder.add("b", Sum(), two, a)
    builder.connect(builder.add("a1", Gain(), a), a["u2"])
    builder.connect(builder.add("b1", Gain(), b), a["u3"])
    signals = signals_at(trace_diagram(builder.build()))
    assert float(signals["a/y"]) == -3.0
    assert float(signals["b/y"]) == -1.0


def test_a_nonlinear_loop_becomes_an_equation_with_its_exact_jacobian() -> None:
    builder = DiagramBuilder("d")
    u = builder.add("u", Trigonometry(function="cos"))
    builder.connect(u, u)
    system = trace_diagram(builder.build())
    assert system.algebraic.names == ("u/y",)
    p, w = system.parameter_values, system.initial_algebraic(system.parameter_values)[0]
    for _ in range(8):
        (r,) = system.residual(0.0, (), (), w, p)
        (J,) = system.residual_jacobian(0.0, (), (), w, p)
        assert J.shape == (1, 1)
        w = w - np.linalg.solve(J, r)
    assert w[0] == pytest.approx(0.7390851332151607, abs=1e-16)
    assert float(signals_at(system, w=w)["u/y"]) == pytest.approx(0.7390851332151607, abs=1e-15)


def test_a_linear_loop_after_a_nonlinear_one_is_solved() -> None:
    """v = w + v / 2 with w = cos w: v = 2 w."""
    builder = DiagramBuilder("d")
    w = builder.add("w", Trigonometry(function="cos"))
    builder.connect(w, w)
    feedback(builder, 0.5, w)
    system = trace_diagram(builder.build())
    assert system.algebraic.size == 1
    # the unknown is either w or cos(w)
    assert float(signals_at(system, w=[0.25])["sum/y"]) in (0.5, 2.0 * np.cos(0.25))


def test_a_loop_without_solution_is_refused_with_the_names_of_its_signals() -> None:
    builder = DiagramBuilder("d")
    feedback(builder, 1.0, builder.add("one", Constant()))
    with pytest.raises(AlgebraicLoopError, match="algebraic loop with no solution: ") as caught:
        trace_diagram(builder.build())
    assert set(caught.value.loop) == {"sum/y", "gain/y"}
    assert "loops whose gain is not 1" in str(caught.value)


def test_a_loop_with_infinitely_many_solutions_is_refused() -> None:
    builder = DiagramBuilder("d")
    u = builder.add("u", Gain())
    builder.connect(u, u)
    with pytest.raises(AlgebraicLoopError, match="with infinitely many solutions: u/y -> u/y"):
        trace_diagram(builder.build())


def test_a_singular_loop_that_depends_on_time_is_refused() -> None:
    builder = DiagramBuilder("d")
    feedback(builder, 1.0, builder.add("clock", Clock()))
    with pytest.raises(AlgebraicLoopError, match="with no solution or infinitely many: "):
        trace_diagram(builder.build())


def test_a_solved_loop_is_the_derivative_of_a_state() -> None:
    """x' = u with u = -x - u, so x' = -x / 2."""
    builder = DiagramBuilder("d")
    x = builder.add("x", Integrator(initial=1.0))
    u = builder.add("u", Sum(signs="--"), x)
    builder.connect(builder.add("again", Gain(), u), u["u2"])
    builder.connect(u, x)
    system = trace_diagram(builder.build())
    assert system.derivative(0.0, [3.0], (), (), system.parameter_values)[0].tolist() == [-1.5]


def test_a_linear_loop_is_solved_at_a_tick_with_the_new_samples() -> None:
    """s = hold(t) - s, sampled again: at the tick the new s is t / 2."""
    builder = DiagramBuilder("d")
    hold = builder.add("hold", ZeroOrderHold(sample_time=0.5), builder.add("t", Clock()))
    total = feedback(builder, 1.0, hold, "+-")
    builder.add("again", ZeroOrderHold(), total)
    system = trace_diagram(builder.build())
    (z,) = system.update(1.5, (), np.zeros(2), (), system.parameter_values, [1.0])
    assert system.discrete.unpack(z)["again/y"] == 0.75


def test_a_nonlinear_loop_between_blocks_of_the_same_clock_is_refused() -> None:
    builder = DiagramBuilder("d")
    hold = builder.add("hold", ZeroOrderHold(sample_time=0.5), builder.add("t", Clock()))
    total = builder.add("sum", Sum(), hold)
    builder.connect(builder.add("cos", Trigonometry(function="cos"), total), total["u2"])
    builder.add("again", ZeroOrderHold(), total)
    with pytest.raises(DiagramError, match="is not linear, depends on a sampled signal, and is sampled"):
        trace_diagram(builder.build())


def test_a_nonlinear_loop_of_states_may_be_sampled() -> None:
    builder = DiagramBuilder("d")
    total = builder.add("sum", Sum(), builder.add("t", Clock()))
    builder.connect(builder.add("cos", Trigonometry(function="cos"), total), total["u2"])
    builder.add("hold", ZeroOrderHold(sample_time=0.5), total)
    system = trace_diagram(builder.build())
    p, w = system.parameter_values, np.array([1.5])
    for _ in range(9):
        (r,) = system.residual(1.5, (), [0.0], w, p)
        (J,) = system.residual_jacobian(1.5, (), [0.0], w, p)
        w = w - np.linalg.solve(J, r)
    (z,) = system.update(1.5, (), [0.0], w, p, [1.0])
    assert z[0] == pytest.approx(1.5 + np.cos(z[0]), rel=1e-15)


def test_a_loop_of_sampled_blocks_with_feedthrough_is_refused() -> None:
    builder = DiagramBuilder("d")
    total = builder.add("sum", Sum(), builder.add("one", Constant()))
    builder.connect(builder.add("hold", ZeroOrderHold(sample_time=1.0), total), total["u2"])
    with pytest.raises(AlgebraicLoopError, match="Fix: put a Unit Delay into the loop") as caught:
        builder.build()
    assert set(caught.value.loop) == {"sum/y", "hold/y"}


def test_a_unit_delay_breaks_a_loop() -> None:
    """y(k) = 1 + y(k-1) counts the ticks."""
    builder = DiagramBuilder("d")
    total = builder.add("sum", Sum(), builder.add("one", Constant()))
    builder.connect(builder.add("delay", UnitDelay(sample_time=1.0), total), total["u2"])
    system = trace_diagram(builder.build())
    z = system.initial_discrete(system.parameter_values)[0]
    counts = []
    for k in range(4):
        (z,) = system.update(float(k), (), z, (), system.parameter_values, [1.0])
        (y,) = system.signals(float(k), (), z, (), system.parameter_values)
        counts.append(float(system.signals_layout.unpack(y)["sum/y"]))
    assert counts == [1.0, 2.0, 3.0, 4.0]
