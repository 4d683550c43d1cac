"""Compiled systems: native functions compared with CasADi, and loading from the cache without tracing."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from armblocks.compiler import cache, tape_parts
from armblocks.equations import HybridSystem, TracedFunction, continuous_system, signature
from armblocks.errors import CompileError
from armblocks.integration.system import CompiledSystem, cached_system, compile_system


def pendulum(length: float = 2.0) -> HybridSystem:
    """A pendulum with two states, two signals, a parameter and a breakpoint."""
    ends = signature(("t", ()), ("x", (2,)), ("p", (2,)))
    p = signature(("p", (2,)))
    return continuous_system(
        name="pendulum",
        states=signature(("arm/q", (2,), "rad")),
        parameters=signature(("arm.g", (), "m/s^2"), ("step.time", (), "s")),
        signals_layout=signature(("arm/q", (2,)), ("tip/p", (2,), "m"), ("step/y", ())),
        parameter_values=np.array([9.81, 0.3]),
        derivative=TracedFunction.trace(
            "f",
            ends,
            signature(("xd", (2,))),
            lambda t, x, p: ca.vertcat(x[1], -p[0] / length * ca.sin(x[0])),
        ),
        signals=TracedFunction.trace(
            "y",
            ends,
            signature(("y", (5,))),
            lambda t, x, p: ca.vertcat(
                x, length * ca.sin(x[0]), -length * ca.cos(x[0]), ca.if_else(t < p[1], 0, 1)
            ),
        ),
        initial_states=TracedFunction.trace(
            "x0", p, signature(("x0", (2,))), lambda p: ca.vertcat(p[0] / 10, 0)
        ),
        breakpoints=TracedFunction.trace("b", p, signature(("times", (1,))), lambda p: p[1]),
        aliases={"step": "step/y"},
    )


@pytest.mark.parametrize("count", [1, 3, 8, 100, 1001])
def test_signals_of_a_batch_agree_with_casadi(count: int) -> None:
    system = pendulum()
    compiled = compile_system(system)
    random = np.random.default_rng(count)
    empty = np.empty((count, 0))
    t, x, p = random.uniform(0, 1, count), random.normal(size=(count, 2)), np.array([9.81, 0.3])
    y = compiled.evaluate_signals(t, x, empty, empty, p)
    assert y.shape == (5, count)
    expected = np.array([system.signals(t[k], x[k], (), (), p)[0] for k in range(min(count, 20))])
    np.testing.assert_allclose(y[:, :20].T, expected, rtol=1e-14, atol=1e-15)


def test_signals_at_one_time_and_at_many_times_have_the_same_bits() -> None:
    compiled = compile_system(pendulum())
    random = np.random.default_rng(5)
    empty = np.empty((37, 0))
    t, x, p = random.uniform(0, 1, 37), random.normal(size=(37, 2)), np.array([9.81, 0.3])
    whole = compiled.evaluate_signals(t, x, empty, empty, p)
    for k in range(37):
        assert (
            compiled.evaluate_signals(t[k : k + 1], x[k : k + 1], empty[:1], empty[:1], p)[:, 0].tobytes()
            == whole[:, k].tobytes()
        )


def test_code_of_a_long_tape_without_lanes_gives_the_same_bits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    random = np.random.default_rng(6)
    empty = np.empty((37, 0))
    t, x, p = random.uniform(0, 1, 37), random.normal(size=(37, 2)), np.array([9.81, 0.3])
    x[5] = 1e300
    in_lanes = compile_system(pendulum()).evaluate_signals(t, x, empty, empty, p)
    monkeypatch.setenv("ARMBLOCKS_CACHE_DIR", "")
    monkeypatch.setattr(tape_parts, "MAX_WEIGHT", 0)
    assert compile_system(pendulum()).evaluate_signals(t, x, empty, empty, p).tobytes() == in_lanes.tobytes()


def test_derivative_start_and_breakpoints_depend_on_the_parameters() -> None:
    compiled = compile_system(pendulum())
    p = np.array([5.0, 0.7])
    assert compiled.initial_states(p).tolist() == [0.5, 0.0]
    assert compiled.breakpoints(p).tolist() == [0.7]
    np.testing.assert_allclose(
        compiled.derivative(0.0, np.array([0.4, 1.0]), np.empty(0), np.empty(0), p),
        [1.0, -2.5 * np.sin(0.4)],
        rtol=1e-15,
    )


def same(one: CompiledSystem, other: CompiledSystem) -> bool:
    empty = np.empty((9, 0))
    t, x = np.linspace(0, 1, 9), np.linspace(-1, 1, 18).reshape(9, 2)
    p = one.parameter_values
    return (
        one.name == other.name
        and (one.states, one.parameters, one.signals_layout)
        == (other.states, other.parameters, other.signals_layout)
        and one.aliases == other.aliases
        and p.tobytes() == other.parameter_values.tobytes()
        and one.evaluate_signals(t, x, empty, empty, p).tobytes()
        == other.evaluate_signals(t, x, empty, empty, p).tobytes()
    )


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("ARMBLOCKS_CACHE_DIR", str(tmp_path))
    return tmp_path


def never() -> HybridSystem:
    raise AssertionError("was traced again")


def test_a_cached_system_is_loaded_without_tracing(own_cache: Path) -> None:
    first = cached_system("pendulum 2 m", pendulum)
    first.evaluate_signals(
        np.zeros(1), np.zeros((1, 2)), np.empty((1, 0)), np.empty((1, 0)), first.parameter_values
    )
    second = cached_system("pendulum 2 m", never)
    assert same(first, second)
    assert second.tape("derivative").digest == first.tape("derivative").digest
    other = cached_system("pendulum 3 m", lambda: pendulum(3.0))
    assert not same(first, other)


def test_damaged_records_and_tapes_are_written_again(own_cache: Path) -> None:
    first = cached_system("pendulum", pendulum)
    for content in (b"[]", b"not json", b'{"name": "pendulum"}'):
        cache.store(cache.record_name("system pendulum"), content)
        assert same(first, cached_system("pendulum", pendulum))
    cache.store(cache.object_name(("tape", first.tape("signals").digest)), b"no tape")
    again = cached_system("pendulum", pendulum)
    assert again.tape("signals").digest == first.tape("signals").digest
    for path in own_cache.glob("??/*"):
        path.unlink()
    assert same(first, again)


def test_without_a_cache_the_system_is_traced_each_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ARMBLOCKS_CACHE_DIR", "")
    assert same(cached_system("x", pendulum), cached_system("x", pendulum))
    with pytest.raises(AssertionError, match="was traced again"):
        cached_system("x", never)


def test_an_operation_without_a_tape_opcode_is_refused_on_compilation(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The error is raised before a run starts."""

    def refuse(traced: TracedFunction) -> None:
        raise CompileError("the equations use the operation OP_PRINTME", where=traced.name)

    monkeypatch.setattr("armblocks.compiler.from_casadi.tape_from", refuse)
    with pytest.raises(CompileError, match="f: the equations use the operation OP_PRINTME"):
        compile_system(pendulum())
