"""Algebraic loops through continuous switching blocks, with signals at the boundaries of modes.

Each loop is ``u = r + A y``, ``y_i = f_i(u_i)`` with ``|A| < 1`` in the maximum norm and functions of slope
at most 1, so it has exactly one solution. At a boundary the modes on both sides give equal signals up to
rounding.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

import armblocks as ab
from armblocks.blocks import (
    Abs,
    Constant,
    DeadZone,
    Gain,
    LookupTable1D,
    PulseGenerator,
    Saturation,
    SignalGenerator,
    SineWave,
    Sum,
    Trigonometry,
)
from armblocks.diagram import Block

Function = Callable[[NDArray[np.float64]], NDArray[np.float64]]
POSITIONS, TABLE = (-1.0, -0.3, 0.2, 1.0), (-0.5, -0.4, 0.1, 0.5)


def switching_block(random: np.random.Generator) -> tuple[Block, Function]:
    """A random block and its formula; some limits are 0."""
    lower, upper = -round(random.uniform(0.0, 1.0), 1), round(random.uniform(0.0, 1.0), 1)
    choices: list[tuple[Block, Function]] = [
        (DeadZone(start=lower, end=upper), lambda u: u - np.clip(u, lower, upper)),
        (DeadZone(start=0.0, end=0.0), lambda u: u),
        (Saturation(lower=lower, upper=upper), lambda u: np.clip(u, lower, upper)),
        (Saturation(lower=0.0, upper=upper), lambda u: np.clip(u, 0.0, upper)),
        (Abs(), np.abs),
        (LookupTable1D(positions=POSITIONS, table=TABLE), lambda u: np.interp(u, POSITIONS, TABLE)),
        (Trigonometry(function="tanh"), np.tanh),
    ]
    return choices[random.integers(len(choices))]


def source(random: np.random.Generator) -> Block:
    """A random source: smooth, constant with one decimal, or with jumps."""
    amplitude = round(random.uniform(0.5, 3.0), 1)
    return [
        SineWave(amplitude=amplitude, frequency=random.uniform(0.5, 5.0), phase=random.uniform(0.0, 6.0)),
        Constant(value=round(random.uniform(-1.0, 1.0), 1)),
        PulseGenerator(amplitude=amplitude, period=round(random.uniform(0.3, 2.0), 1)),
        SignalGenerator(waveform="sawtooth", frequency=random.uniform(0.5, 3.0)),
    ][random.integers(4)]


def add_loop(
    builder: ab.DiagramBuilder, name: str, random: np.random.Generator
) -> tuple[NDArray[np.float64], list[Function]]:
    """Add a random loop of one to three unknowns; return ``A`` and the functions of the blocks."""
    n = int(random.integers(1, 4))
    entries = random.uniform(-1.0, 1.0, (n, n))
    entries *= random.uniform(0.3, 0.95) / np.abs(entries).sum(axis=1).max()
    A = np.round(entries, 1) if random.random() < 0.4 else entries
    functions: list[Function] = []
    for i in range(n):
        builder.add(f"{name} r{i}", source(random))
        block, function = switching_block(random)
        functions.append(function)
        builder.add(f"{name} y{i}", block, builder.add(f"{name} u{i}", Sum(signs="+" * (n + 1))))
    for i in range(n):
        total = builder[f"{name} u{i}"]
        builder.connect(builder[f"{name} r{i}"], total["u1"])
        for j in range(n):
            gain = builder.add(f"{name} a{i}{j}", Gain(gain=float(A[i, j])), builder[f"{name} y{j}"])
            builder.connect(gain, total[f"u{j + 2}"])
    return A, functions


@pytest.mark.parametrize("seed", range(3))
def test_loops_with_one_solution_are_solved_at_the_boundaries_of_their_modes(seed: int) -> None:
    random = np.random.default_rng(seed)
    builder = ab.DiagramBuilder("loops")
    loops = {f"l{k}": add_loop(builder, f"l{k}", random) for k in range(8)}
    result = ab.simulate(builder.build(), stop_time=3.0, sample_time=0.01)
    for name, (A, functions) in loops.items():
        r, u, y = (np.array([result[f"{name} {kind}{i}"] for i in range(len(A))]) for kind in "ruy")
        assert np.allclose(u, r + A @ y, rtol=0.0, atol=1e-10)
        assert np.allclose(y, [f(row) for f, row in zip(functions, u)], rtol=0.0, atol=1e-10)


@pytest.mark.parametrize(("gain", "end"), [(3.0, 0.3), (0.7, 0.07), (1.1, 0.11), (2.3, 0.23)])
def test_a_constant_at_the_end_of_a_dead_zone_up_to_rounding_gives_0(gain: float, end: float) -> None:
    """``gain * 0.1`` and ``end`` differ by rounding, so both modes may contradict themselves in the loop."""
    builder = ab.DiagramBuilder("rest")
    error = builder.add("error", Sum(signs="+-"), builder.add("r", Constant(value=0.1)))
    zone = builder.add("zone", DeadZone(start=-end, end=end), builder.add("gain", Gain(gain=gain), error))
    builder.connect(zone, error["u2"])
    result = ab.simulate(builder.build(), stop_time=1.0)
    assert np.abs(result["zone"]).max() < 1e-15
    assert result.run.events == 0
