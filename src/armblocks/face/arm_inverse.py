"""The inverse kinematics of one arm: compiled searches by frame and options, and the closed form."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.errors import RobotError
from armblocks.face.arm_kernels import ArmKernels
from armblocks.face.ikine import IkineCall, check_axes, checked_options
from armblocks.face.ikine_branches import ClosedForm, IkineBranches, chosen_branch, configuration_of
from armblocks.face.ikine_result import IkineResult
from armblocks.face.ikine_targets import Target, checked_poses
from armblocks.robot.tree import KinematicTree

if TYPE_CHECKING:
    from armblocks.face.ikine_closed_loops import ClosedLoopCall

Array = NDArray[np.float64]


class ArmInverse:
    """The inverse kinematics of an arm with these kernels."""

    def __init__(self, kernels: ArmKernels) -> None:
        self._robot = kernels.robot
        self._kernels = kernels
        self._calls: dict[object, IkineCall | ClosedLoopCall] = {}

    def call(
        self,
        mask: ArrayLike | None,
        limits: object,
        frame: str | None,
        axes: str,
        tolerance: object,
        restarts: object,
        seed: object,
    ) -> IkineCall | ClosedLoopCall:
        """The search with the options of :meth:`armblocks.Arm.ikine`. Raises InputError, UnknownNameError."""
        # True and 1 are equal keys, but 1 is an error.
        key = (frame, axes, limits is True, limits is False, tolerance, restarts, seed)
        known = self._calls.get(key) if mask is None else None
        if known is not None:
            return known
        where = f"ikine of robot '{self._robot.name}'"
        options = checked_options(mask, limits, tolerance, restarts, seed, where)
        axes = check_axes(axes, where)
        if self._robot.closures:
            from armblocks.dynamics.pose_error import ErrorAxes
            from armblocks.face.ikine_closed_loops import ClosedLoopCall

            return ClosedLoopCall(self._robot, self._kernels.near, frame, ErrorAxes(axes), options)
        # Without a mask, the solution does not depend on the axes, and world axes need the fewest operations.
        made = IkineCall(self._kernels.search(frame, "world" if mask is None else axes), options)
        if mask is None:
            self._calls[key] = made
        return made

    @cached_property
    def closed_form(self) -> ClosedForm:
        """The closed-form solution. Raises RobotError for arms without a closed form."""

        def iterate(targets: Array, starts: Array | None) -> IkineResult:
            restarts = 100 if starts is None else 0
            return self.call(None, False, None, "tool", 1e-9, restarts, 0)(targets, starts, 1)

        return ClosedForm.of(self._robot, self._kernels.kernel("branches"), iterate)

    def branches(
        self, T: Target, limits: object, frame: str | None, tolerance: float, threads: int
    ) -> IkineBranches:
        """All branches, see :meth:`armblocks.Arm.ikine_all`."""
        form = self.closed_form
        return form.branches(T if frame is None else self._at_tool(T, frame), limits, tolerance, threads)

    def _at_tool(self, T: Target, frame: str) -> Array:
        """The poses of the tool for poses of a frame. Raises RobotError for a frame of another link."""
        tree = KinematicTree.of(self._robot)
        tool, end = tree.tool, tree.with_tool_at(frame).tool
        where = f"ikine_all of robot '{self._robot.name}'"
        if end.body != tool.body:
            raise RobotError(
                f"frame '{frame}' moves relative to the tool",
                where=where,
                allowed="frames that are fixed to the link of the tool",
                fix="use arm.ikine(T, frame=…)",
            )
        targets, batch = checked_poses(T, where)
        at_tool = targets @ (end.pose.inverse() @ tool.pose).matrix
        at_tool[:, 3] = (0.0, 0.0, 0.0, 1.0)
        return at_tool if batch else at_tool[0]

    def with_letters(self, T: Target, configuration: object, limits: object, threads: int) -> IkineResult:
        """The solution with the toolbox's letters, see :meth:`armblocks.Arm.ikine6s`."""
        index = configuration_of(self.closed_form, configuration)
        return chosen_branch(self._robot, self.closed_form.branches(T, limits, 1e-9, threads), index)
