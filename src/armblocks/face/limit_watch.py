"""Limit warnings for runs from Python."""

from __future__ import annotations

from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.diagram import Diagram, flat_diagram
from armblocks.report.motion import MovingArm, moving_arms
from armblocks.report.motion_summary import limit_findings, warn_of_limits
from armblocks.robot.plausibility import MAX_MOTION_ANGLE, warn_of_degrees
from armblocks.simulation import SimulationResult

_Array = NDArray[np.float64]


class LimitWatch:
    """Checks the joint signals of every run of a diagram. The check is fast if no limit is exceeded."""

    def __init__(self, diagram: Diagram, result: SimulationResult) -> None:
        self._arms = [(arm, *_limits(arm)) for arm in moving_arms(diagram, result)]
        self._is_revolute = [
            np.array([entry.unit == "rad" for entry in arm[0].robot.positions]) for arm in self._arms
        ]
        _warn_of_angles(diagram)

    def warn(self, result: SimulationResult) -> None:
        """Issue a ``LimitWarning`` for each limit of position, speed or torque that the run exceeds.

        Joint angles at the start that look like degrees give an ``ArmblocksWarning``.
        """
        for (arm, q_low, q_high, qd_max, tau_max), is_revolute in zip(self._arms, self._is_revolute):
            q = result[arm.q]
            if any(abs(value) > MAX_MOTION_ANGLE for value in q[:1].ravel().tolist()):
                warn_of_degrees(q[:1, is_revolute], f"{arm.q} at the start")
            qd = None if arm.qd is None else result[arm.qd]
            tau = None if arm.tau is None else result[arm.tau]
            if (
                _exceeds(q, q_low, q_high)
                or (qd is not None and _exceeds(qd, -qd_max, qd_max))
                or (tau is not None and _exceeds(tau, -tau_max, tau_max))
            ):
                warn_of_limits(limit_findings(arm.robot, result.time, q, qd, tau))


def _limits(arm: MovingArm) -> tuple[_Array, _Array, _Array, _Array]:
    robot = arm.robot
    return robot.qlim[:, 0], robot.qlim[:, 1], robot.speed_limits, robot.torque_limits


def _exceeds(values: _Array, low: _Array, high: _Array) -> bool:
    return bool((values.min(axis=0) < low).any() or (values.max(axis=0) > high).any())


def _warn_of_angles(diagram: Diagram) -> None:
    """Issue a warning for parameters in rad whose values look like degrees."""
    for name, block in flat_diagram(diagram).blocks.items():
        for rule in block.parameters():
            if rule.unit == "rad":
                where = f"block '{name}' ({block.title}), {rule.name}"
                warn_of_degrees(cast("ArrayLike", block.parameter_value(rule.name)), where)
