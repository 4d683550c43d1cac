"""Guards that are zero at the start of a step: masses that start from rest, and a throw from the ground."""

from __future__ import annotations

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    CompareToZero,
    Constant,
    CoulombFriction,
    HitCrossing,
    Integrator,
    Ramp,
    Relay,
    SecondOrderLag,
    Sign,
    SineWave,
    Step,
)
from armblocks.diagram import Block


def masses(random: np.random.Generator) -> ab.Diagram:
    """Nine masses; each speed, which leaves zero before the position, is the input of a switching block."""
    builder = ab.DiagramBuilder("masses")
    kinds = (CoulombFriction(), Sign(), CompareToZero(relation=">"), Relay(), HitCrossing())
    for k in range(9):
        size = float(random.choice((-1.0, 1.0)) * random.uniform(0.5, 6.0))
        inputs: tuple[Block, ...] = (
            SineWave(amplitude=np.sign(size), frequency=abs(size)),
            Ramp(slope=size, start=0.3 * (k % 2)),
            Step(time=0.3, initial=0.0, final=size),
        )
        mass = SecondOrderLag(
            natural_frequency=float(random.uniform(1.0, 6.0)), damping=float(random.uniform(0.1, 1.5))
        )
        lag = builder.add(f"mass {k}", mass, builder.add(f"drive {k}", inputs[k % 3]))
        builder.add(f"passes {k}", HitCrossing(), lag["y"])
        builder.add(f"switch {k}", kinds[int(random.integers(5))], lag["rate"])
    return builder.build()


@pytest.mark.parametrize(
    "settings",
    [
        {"solver": "rk45"},
        {"solver": "dop853"},
        {"solver": "tsitouras"},
        {"solver": "rk4", "step": 0.01},
        {"solver": "ros23"},
        {"solver": "rodas5p"},
        {"solver": "ros5", "step": 0.01},
    ],
    ids=lambda settings: str(settings["solver"]),
)
def test_a_mass_that_starts_from_rest_causes_no_false_zero_crossing(settings: dict[str, float]) -> None:
    for seed in range(3):
        result = ab.simulate(
            masses(np.random.default_rng(seed)), stop_time=3.0, sample_time=0.01, rtol=1e-8, **settings
        )
        for k in range(9):
            y = result[f"mass {k}/y"]
            passed = np.count_nonzero(np.diff(np.sign(y[np.abs(y) > 1e-8])))
            assert result[f"passes {k}/count"][-1] == passed, (seed, k)


@pytest.mark.parametrize("solver", ["rk3", "rk4", "ros5", "heun"])
@pytest.mark.parametrize("step", [0.3, 0.5, 0.7, 1.0, 1.5])
def test_a_thrown_body_returns_to_the_ground_within_a_step_or_at_its_end(solver: str, step: float) -> None:
    builder = ab.DiagramBuilder("throw")
    speed = builder.add("speed", Integrator(initial=5.0), builder.add("weight", Constant(value=-10.0)))
    height = builder.add("height", Integrator(), speed)
    for direction in ("either", "falling", "rising"):
        builder.add(direction, HitCrossing(direction=direction), height)
    result = ab.simulate(builder.build(), stop_time=3.0, sample_time=3.0, solver=solver, step=step)
    for direction, count in (("either", 1), ("falling", 1), ("rising", 0)):
        assert result[f"{direction}/count"][-1] == count, direction
        assert result[f"{direction}/last"][-1] == pytest.approx(count, abs=1e-12), direction
