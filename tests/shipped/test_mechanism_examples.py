"""The examples of mechanisms: their closed forms, and the figures that the guide quotes."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armblocks as ab
from armblocks.dynamics.mechanism import Mechanism

EXAMPLES = Path(__file__).parents[2] / "examples"


def example(name: str) -> dict[str, Any]:
    """The names that the script of an example defines."""
    return runpy.run_path(str(EXAMPLES / name / f"{name}.py"))


def test_the_top_precesses_and_nods_as_in_its_closed_forms(capsys: pytest.CaptureFixture[str]) -> None:
    names = example("spinning_top")
    for rate in (*names["steady_rates"](), 0.0):
        assert names["deviation"](rate, ab.simulate(names["diagram"](rate))) < 1e-6
    assert "precession 3.7685 rad/s" in capsys.readouterr().out


def test_the_strokes_of_the_stewart_platform_assemble_at_the_desired_pose() -> None:
    """The closed form of the legs, its derivatives, and six degrees of freedom. The run itself is long."""
    names = example("stewart_platform")
    robot, motion = names["platform"](20.0), names["leg_motion"]()
    mechanism = Mechanism(robot)
    assert mechanism.mobility(robot.neutral).degrees_of_freedom == 6
    legs = [f"leg{k}" for k in range(1, 7)]
    entries = [[entry.name for entry in robot.positions].index(leg) for leg in legs]
    q = robot.neutral.copy()
    q[entries] = motion.q[100]
    q = mechanism.assembled(q, legs)
    displacement, *_ = names["desired"](np.array([1.0]))
    pose = ab.Arm(robot).fkine(q, frame="platform")
    assert pose[:3, 3] == pytest.approx(displacement[0, :3] + (0.0, 0.0, names["HEIGHT"]), abs=1e-9)
    assert pose[:3, :3] == pytest.approx(names["rotations"](displacement[:, 3])[0], abs=1e-9)
    for value, rate in ((motion.q, motion.qd), (motion.qd, motion.qdd)):
        # Errors of the difference quotients: h^2 / 6 times the third derivative, which jumps at the stations.
        difference = (value[2:] - value[:-2]) / 0.02 - rate[1:-1]
        assert np.abs(np.delete(difference, [99, 199], axis=0)).max() < 6e-3
