"""The native hybrid loop compared with an independent reference."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hybrid_reference import Reference
from hybrid_systems import bouncing_ball, column, hybrid, relay_oscillator, sampled_loop, stick_slip

from armblocks.equations import HybridSystem, SimulationOptions
from armblocks.integration.system import compile_system
from armblocks.simulation import simulate


def thermostat_with_controller() -> HybridSystem:
    """A system with two clocks, one with an offset, a relay, a state reset and an implicit equation."""
    return hybrid(
        "everything",
        states=("plant/x", "plant/v", "timer/s"),
        discrete=("fast/u", "slow/r", "relay/m", "timer/n"),
        algebraic=("drag/f",),
        signals=("plant/x", "plant/v", "timer/s", "fast/u", "slow/r", "relay/m", "timer/n", "drag/f"),
        x0=(0.2, 0.0, 0.0),
        z0=(0.0, 0.5, 1.0, 0.0),
        w0=(0.1,),
        clocks=((0.05, 0.0), (0.3, 0.1)),
        guards=(("relay", 1), ("relay", -1), ("timer", 1)),
        derivative=lambda t, x, z, w, p: column(x[1], z[0] + z[2] - x[0] - w[0], 1.7 + ca.sin(x[0])),
        outputs=lambda t, x, z, w, p: column(x, z, w),
        residual=lambda t, x, z, w, p: w + 0.2 * w**3 - 0.5 * x[1] - 0.1 * ca.cos(t),
        update=lambda t, x, z, w, p, m: column(
            ca.if_else(m[0] > 0, 2 * (ca.if_else(m[1] > 0, ca.sin(t), z[1]) - x[0]), z[0]),
            ca.if_else(m[1] > 0, ca.sin(t), z[1]),
            z[2],
            z[3],
        ),
        guard=lambda t, x, z, w, p: column(x[0] - 0.6, x[0] + 0.3, x[2] - 1.0),
        reset=lambda t, x, z, w, p, e: (
            column(x[0], ca.if_else(e[2] > 0, 0.9 * x[1], x[1]), ca.if_else(e[2] > 0, 0, x[2])),
            column(
                z[0],
                z[1],
                ca.if_else(e[0] > 0, -1, ca.if_else(e[1] < 0, 1, z[2])),
                ca.if_else(e[2] > 0, z[3] + 1, z[3]),
            ),
        ),
    )


@pytest.mark.parametrize(
    ("system", "stop", "events"),
    [
        (bouncing_ball(), 1.8, 3),
        (sampled_loop(0.2), 1.0, 0),
        (relay_oscillator(), 4.0, 4),
        (stick_slip(), 2.0, 1),
        (thermostat_with_controller(), 3.0, 7),
    ],
)
def test_runs_agree_with_the_reference(system: HybridSystem, stop: float, events: int) -> None:
    compiled, reference = compile_system(system), Reference(system)
    expected: np.ndarray | None = None
    for solver, step in (("dop853", None), ("rk45", None), ("rk5", 0.002)):
        options = SimulationOptions(
            stop_time=stop, sample_time=0.047, solver=solver, step=step, rtol=1e-11, atol=1e-12
        )
        result = simulate(compiled, options)
        if expected is None:
            expected = reference.run(result.time)
        # Both runs have an error of 1e-11 per step, which successive events amplify. No event is at a sample.
        np.testing.assert_allclose(result.signals, expected, rtol=0, atol=2e-9)
        assert result.run.events == reference.events == events
