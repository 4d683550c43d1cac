"""Native code of every dynamics function compared with CasADi's interpreter, for batches."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from armblocks.compiler import compile_function
from armblocks.dynamics import TRACES
from armblocks.robot import PrescribedMotion, Robot
from robots_for_tests import RANDOM_ROBOTS, build_puma560

BATCH = 11
"""Number of samples; not a multiple of any lane count."""
PUMA = build_puma560()


def parts(results: object) -> tuple[np.ndarray, ...]:
    """The results of a kernel, also of one with a single result."""
    return tuple(np.asarray(part) for part in (results if isinstance(results, tuple) else (results,)))


CASES = [
    pytest.param(name, robot, id=f"{name}-{robot.name}")
    for name in TRACES
    for robot in (PUMA, RANDOM_ROBOTS[1])
    if robot is PUMA or name != "branches"  # only chains have a closed form
]


@pytest.mark.parametrize(("name", "robot"), CASES)
def test_a_kernel_agrees_with_the_traced_function(robot: Robot, name: str, monkeypatch: pytest.MonkeyPatch):
    """A tree of all joint types is compiled with full optimisation, a Puma 560 without."""
    if robot is PUMA:
        monkeypatch.setenv("ARMBLOCKS_EFFORT", "little")
    if name.startswith("hybrid"):
        motion = PrescribedMotion(name="drive", joint=robot.joint_names[1])
        robot = replace(robot, constraints=(*robot.constraints, motion))
    traced = TRACES[name](robot)
    kernel = compile_function(traced)
    random = np.random.default_rng(0)
    batch = [random.uniform(-2, 2, (BATCH, *slot.shape)) for slot in traced.inputs]
    batch_results = parts(kernel(*batch))
    for k in range(BATCH):
        sample = [values[k] for values in batch]
        # Other sin, cos and fused sums: a few rounding errors of the largest entry, times the condition of M.
        tolerance = 1e-9 if name.startswith(("accel", "hybrid")) else 1e-12
        for expected, single, of_batch in zip(traced(*sample), parts(kernel(*sample)), batch_results):
            size = max(1.0, float(np.nanmax(np.abs(expected), initial=0.0)))
            assert_allclose(of_batch[k], expected, rtol=0, atol=tolerance * size)
            assert_array_equal(single, of_batch[k])
