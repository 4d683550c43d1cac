"""Runs in lanes of vector registers are bit-identical to the same runs alone, for any number and split."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import armblocks as ab
from armblocks import blocks
from armblocks.sweeps.batch import RunProgram, RunRows, Worker
from armblocks.sweeps.lanes import reason_against_lanes
from armblocks.sweeps.measures import Measure, observe

FIELDS = ("status", "measures", "steps", "events", "end_time", "kept")
TERMS = (
    *("sin(3*{0})", "{0}*{1}", "-{0}^3", "cos(t)*{1}", "exp(-{0}^2)", "{0}/(1 + {1}^2)", "sqrt(1 + {0}^2)"),
    *("atan2({0}, 1 + {1}^2)", "abs({0})", "log(2 + {1}^2)", "tanh({0}) - {1}", "hypot({0}, {1})"),
)


def random_system(rng: np.random.Generator, states: int) -> ab.Diagram:
    """``x_i' = -x_i + g_i (sum of random terms) + step``, with a gain and a start value for each state."""
    builder = ab.DiagramBuilder("random")
    x = [builder.add(f"x{k}", blocks.Integrator(initial=0.1 * k)) for k in range(states)]
    names = [f"u{k + 1}" for k in range(states)] if states > 1 else ["u"]
    for k in range(states):
        inputs = [names[int(j)] for j in rng.integers(0, states, 4)]
        chosen = rng.choice(TERMS, 2, replace=False)
        text = " + ".join(str(term).format(inputs[2 * j], inputs[2 * j + 1]) for j, term in enumerate(chosen))
        law = builder.add(
            f"law{k}", blocks.Expression(formula=f"-{names[k]} + 0.5*({text})", inputs=states), *x
        )
        gain = builder.add(f"gain{k}", blocks.Gain(gain=1.0 + k), law)
        steps = int(rng.integers(0, 3))
        terms = [gain]
        for j in range(steps):
            time = float(rng.choice([0.25, 0.5, 0.73, 1.0]))
            terms.append(builder.add(f"step{k}_{j}", blocks.Step(time=time, final=float(rng.normal()))))
        total = builder.add(f"sum{k}", blocks.Sum(signs="+" * len(terms)), *terms) if steps else gain
        builder.connect(total["y"], x[k]["u"])
    return builder.build()


def program_of(diagram: ab.Diagram, lanes: int, max_steps: int | None = None, **settings: Any) -> RunProgram:
    compiled = ab.compile_diagram(diagram).compiled
    names = [name for slot in compiled.signals_layout for name in slot.elements if "/y" in name]
    measures = [Measure("rms", names[0]), Measure("peak", f"{{{names[-1]}}} * t"), Measure("final", names[0])]
    observation = observe(measures, (names[0],), compiled.signals_layout, compiled.aliases)
    options = dataclasses.replace(diagram.settings, **settings)
    return RunProgram(compiled, options, observation, max_steps=max_steps, lanes=lanes)


def varied(program: RunProgram, rng: np.random.Generator, count: int, spread: float = 0.5) -> Any:
    p = np.tile(program.compiled.parameter_values, (count, 1))
    return p * (1.0 + spread * rng.standard_normal(p.shape)) + 0.1 * spread * rng.standard_normal(p.shape)


def assert_same(given: RunRows, expected: RunRows, selected: Any = slice(None)) -> None:
    for name in FIELDS:
        values = getattr(expected, name)[selected]
        assert np.array_equal(getattr(given, name), values, equal_nan=name in ("measures", "kept")), name
    assert given.messages == [*np.array(expected.messages, dtype=object)[selected]]


@pytest.mark.parametrize(
    ("seed", "settings", "lanes"),
    [
        (1, {"solver": "rk45", "sample_time": 0.013}, 8),
        (2, {"solver": "dop853", "sample_time": 0.05, "rtol": 1e-9}, 4),
        (3, {"solver": "rk4", "step": 0.01, "sample_time": 0.017}, 8),
        (4, {"solver": "auto", "sample_time": 2.0, "record_jumps": False}, 2),
        (5, {"solver": "euler", "step": 0.003, "sample_time": 0.1}, 4),
        (6, {"solver": "rk23", "rtol": 1e-4, "max_step": 0.07, "sample_time": 0.03}, 8),
    ],
)
def test_lanes_of_random_systems_are_runs_alone(seed: int, settings: dict[str, Any], lanes: int) -> None:
    rng = np.random.default_rng(seed)
    diagram = random_system(rng, states=int(rng.integers(1, 12)))
    program = program_of(diagram, lanes, stop_time=2.0, **settings)
    assert program.lanes == lanes and not program.against_lanes
    p = varied(program, rng, 2 * lanes + 3)
    alone = program.empty_rows(len(p))
    for run in range(len(p)):
        program.run_alone(p[run], alone, run)
    worker = Worker(program)
    together = worker.compute(p)
    assert together.general == 0
    assert_same(together, alone)
    # Other neighbours, fewer runs than lanes, one run.
    order = rng.permutation(len(p))
    assert_same(worker.compute(p[order]), alone, order)
    for part in (order[:1], order[1 : lanes // 2 + 1], order[lanes // 2 + 1 :]):
        assert_same(worker.compute(p[part]), alone, part)


def failing_system() -> ab.Diagram:
    """``x' = a x^2 + sin(phase(t))``: for some values x grows beyond all bounds, or the angle is huge."""
    builder = ab.DiagramBuilder("failing")
    x = builder.add("x", blocks.Integrator(initial=1.0))
    square = builder.add("square", blocks.Expression(formula="u^2 - 1", inputs=1), x)
    gain = builder.add("gain", blocks.Gain(gain=-1.0), square)
    clock = builder.add("clock", blocks.Clock())
    phase = builder.add("phase", blocks.Gain(gain=1.0), clock)
    sine = builder.add("sine", blocks.Expression(formula="sin(u)", inputs=1), phase)
    builder.connect(builder.add("sum", blocks.Sum(signs="++"), gain, sine)["y"], x["u"])
    return builder.build()


def test_runs_that_lanes_cannot_complete_are_runs_alone() -> None:
    """Failures, derivatives that are not finite at the start, huge angles, the limit of steps."""
    program = program_of(failing_system(), 8, max_steps=60, stop_time=3.0, sample_time=0.1)
    names = [name for slot in program.compiled.parameters for name in slot.elements]
    gain, phase, start = (names.index(name) for name in ("gain.gain", "phase.gain", "x.initial"))
    p = np.tile(program.compiled.parameter_values, (24, 1))
    p[:, gain] = np.linspace(-2.0, 2.0, 24)
    p[3::6, phase] = 1e10
    p[5::6, phase] = 300.0
    p[7, start], p[9, start] = 1e308, 1e200
    alone = program.empty_rows(len(p))
    for run in range(len(p)):
        program.run_alone(p[run], alone, run)
    assert set(alone.status.tolist()) == {0, 2, 3}
    assert_same(Worker(program).compute(p), alone)


def test_stiff_runs_change_their_method_also_in_lanes() -> None:
    builder = ab.DiagramBuilder("stiff")
    x = builder.add("x", blocks.Integrator(initial=1.0))
    clock = builder.add("clock", blocks.Clock())
    error = builder.add("error", blocks.Expression(formula="cos(u2) - u1", inputs=2), x, clock)
    builder.connect(builder.add("rate", blocks.Gain(gain=1.0), error)["y"], x["u"])
    program = program_of(builder.build(), 4, stop_time=20.0, sample_time=20.0)
    names = [name for slot in program.compiled.parameters for name in slot.elements]
    p = np.tile(program.compiled.parameter_values, (6, 1))
    p[:, names.index("rate.gain")] = [1.0, 2e5, 3.0, 10.0, 1e6, 0.0]
    alone = program.empty_rows(len(p))
    for run in range(len(p)):
        program.run_alone(p[run], alone, run)
    rows = Worker(program).compute(p)
    assert_same(rows, alone)
    assert rows.general == 2


@pytest.mark.parametrize(
    ("name", "settings", "reason"),
    [
        ("bouncing_ball", {}, "events"),
        ("dc_motor_sampled_pid", {}, "the model has sampled blocks"),
        ("robertson_kinetics", {"solver": "rodas5p"}, "solves linear equations"),
    ],
)
def test_reasons_against_lanes(name: str, settings: dict[str, Any], reason: str) -> None:
    program = program_of(ab.load_diagram(name), 8, **settings)
    assert program.lanes == 1
    assert reason in program.against_lanes
    assert reason_against_lanes(program.compiled, program.plan) == program.against_lanes


def test_sweeps_in_lanes_have_the_same_table() -> None:
    vary = {"gain.gain": ab.uniform(-1, 2), "phase.gain": ab.uniform(0, 9)}
    settings: dict[str, Any] = {"runs": 40, "stop_time": 2.0, "measures": {"peak": "peak(x/y)"}}
    first, second = (
        ab.sweep(failing_system(), vary, lanes=lanes, threads=2, **settings) for lanes in (True, False)
    )
    for name in first.names:
        kind = first[name].dtype.kind
        assert np.array_equal(first[name], second[name], equal_nan=kind == "f"), name
    assert first.remark == second.remark
    slow = ab.sweep("bouncing_ball", {"ball.initial": [1.0, 2.0]}, lanes=True)
    assert "one run at a time in each thread, because the model has" in slow.remark
