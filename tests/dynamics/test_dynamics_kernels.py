"""Native code of every dynamics function compared with CasADi's interpreter, for batches."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from armblocks.compiler import compile_function
from armblocks.dynamics import TRACES
from armblocks.robot import Robot
from robots_for_tests import RANDOM_ROBOTS, build_puma560, evaluate

BATCH = 11
"""Number of samples; not a multiple of any lane count."""
PUMA = build_puma560()


@pytest.mark.parametrize("robot", [PUMA, RANDOM_ROBOTS[1]], ids=lambda robot: robot.name)
@pytest.mark.parametrize("name", TRACES)
def test_a_kernel_agrees_with_the_traced_function(robot: Robot, name: str, monkeypatch: pytest.MonkeyPatch):
    """A tree of all joint types is compiled with full optimisation, a Puma 560 without."""
    if robot is PUMA:
        monkeypatch.setenv("ARMBLOCKS_EFFORT", "little")
    traced = TRACES[name](robot)
    kernel = compile_function(traced)
    random = np.random.default_rng(0)
    batch = [random.uniform(-2, 2, (BATCH, *slot.shape)) for slot in traced.inputs]
    batch_result = np.asarray(kernel(*batch))
    for k in range(BATCH):
        sample = [values[k] for values in batch]
        expected = evaluate(robot, name, *sample)
        # Other sin, cos and fused sums: a few rounding errors of the largest entry, times the condition of M.
        tolerance = 1e-9 if name.startswith("accel") else 1e-12
        size = max(1.0, float(np.abs(expected).max()))
        assert_allclose(batch_result[k], expected, rtol=0, atol=tolerance * size)
        assert_array_equal(np.asarray(kernel(*sample)), batch_result[k])
