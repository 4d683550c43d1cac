"""Each run of the native loop over runs is bit-identical to the same run alone."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import BLOCKS
from armblocks.face.python_calls import called_functions
from armblocks.integration import jump_record
from armblocks.sweeps.batch import RunProgram, RunRows, Worker
from armblocks.sweeps.measures import KINDS, Measure, observe

FIELDS = ("status", "measures", "steps", "events", "end_time", "kept")


def all_measures(signal: str) -> list[Measure]:
    options: dict[str, dict[str, float]] = {
        "crossing_time": {"level": 0.1},
        "time_outside": {"low": -0.2, "high": 0.3},
        "itae": {"reference": 0.3},
    }
    return [Measure(kind, "" if kind == "events" else signal, options.get(kind, {})) for kind in KINDS]


def rows_of(diagram: ab.Diagram, seed: int, **settings: Any) -> tuple[RunRows, RunRows]:
    """The rows of four runs with random parameters: computed by the native loop, and each run alone."""
    rng = np.random.default_rng(seed)
    model = ab.compile_diagram(diagram)
    compiled = model.compiled
    names = [name for slot in compiled.signals_layout for name in slot.elements]
    first, second = (str(name) for name in rng.choice(names, 2))
    measures = [*all_measures(first), *all_measures(f"{{{first}}} * t - abs({{{second}}})")]
    observation = observe(measures, (first, second), compiled.signals_layout, compiled.aliases)
    program = RunProgram(
        compiled,
        dataclasses.replace(diagram.settings, **settings),
        observation,
        calls=called_functions(diagram, compiled),
    )
    p = np.tile(compiled.parameter_values, (4, 1)).copy()
    p[1:] *= 1.0 + 1e-2 * rng.standard_normal(p[1:].shape) * (p[1:] != np.round(p[1:]))
    alone = program.empty_rows(len(p))
    for run in range(len(p)):
        program.run_alone(p[run], alone, run)
    return Worker(program).compute(p), alone


def assert_same(native: RunRows, alone: RunRows) -> None:
    for name in FIELDS:
        given, expected = getattr(native, name), getattr(alone, name)
        assert np.array_equal(given, expected, equal_nan=name in ("measures", "kept")), name
    assert native.messages == alone.messages


@pytest.mark.parametrize("seed", range(8))
def test_runs_of_random_blocks_are_those_of_runs_alone(seed: int) -> None:
    """Each block example has other states, events, ticks, delays, modes and sources."""
    name = sorted(BLOCKS)[int(np.random.default_rng(seed).integers(len(BLOCKS)))]
    assert_same(*rows_of(ab.block_example(name), seed))


@pytest.mark.parametrize(
    ("model", "settings"),
    [
        ("bouncing_ball", {}),
        ("van_der_pol_pid", {"stop_time": 3.0, "solver": "rk4", "step": 0.01}),
        ("robertson_kinetics", {}),
        ("kr180model", {"sample_time": 0.11}),
        ("dc_motor_sampled_pid", {"record_jumps": False}),
    ],
)
def test_runs_of_examples_are_those_of_runs_alone(model: str, settings: dict[str, Any]) -> None:
    native, alone = rows_of(ab.load_diagram(model), 3, **settings)
    assert native.general == 0
    assert_same(native, alone)


def test_memory_for_jumps_grows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs with too many jumps are computed alone until the memory of the native loop is large enough."""
    monkeypatch.setattr(jump_record, "INITIAL_SIZE", 64)
    diagram = ab.load_diagram("dc_motor_sampled_pid")
    compiled = ab.compile_diagram(diagram).compiled
    name = next(slot.elements[0] for slot in compiled.signals_layout)
    observation = observe([Measure("rms", name)], (), compiled.signals_layout, compiled.aliases)
    program = RunProgram(compiled, diagram.settings, observation)
    worker = Worker(program)
    p = compiled.parameter_values[np.newaxis]
    rows = [worker.compute(p) for _ in range(16)]
    assert rows[0].general == 1 and rows[-1].general == 0
    for later in rows[1:]:
        assert_same(later, rows[0])
