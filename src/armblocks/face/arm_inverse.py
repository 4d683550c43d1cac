"""The inverse kinematics of one arm: compiled searches by frame and options, and the closed form."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.face.arm_kernels import ArmKernels
from armblocks.face.ikine import IkineCall, check_axes, checked_options
from armblocks.face.ikine_branches import ClosedForm, chosen_branch, configuration_of
from armblocks.face.ikine_result import IkineResult
from armblocks.face.ikine_targets import Target

Array = NDArray[np.float64]


class ArmInverse:
    """The inverse kinematics of an arm with these kernels."""

    def __init__(self, kernels: ArmKernels) -> None:
        self._robot = kernels.robot
        self._kernels = kernels
        self._calls: dict[object, IkineCall] = {}

    def call(
        self,
        mask: ArrayLike | None,
        limits: object,
        frame: str | None,
        axes: str,
        tolerance: object,
        restarts: object,
        seed: object,
    ) -> IkineCall:
        """The search with the options of :meth:`armblocks.Arm.ikine`. Raises InputError, UnknownNameError."""
        # True and 1 are equal keys, but 1 is an error.
        key = (frame, axes, limits is True, limits is False, tolerance, restarts, seed)
        known = self._calls.get(key) if mask is None else None
        if known is not None:
            return known
        where = f"ikine of robot '{self._robot.name}'"
        options = checked_options(mask, limits, tolerance, restarts, seed, where)
        axes = check_axes(axes, where)
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

    def with_letters(self, T: Target, configuration: object, limits: object, threads: int) -> IkineResult:
        """The solution with the toolbox's letters, see :meth:`armblocks.Arm.ikine6s`."""
        index = configuration_of(self.closed_form, configuration)
        return chosen_branch(self._robot, self.closed_form.branches(T, limits, 1e-9, threads), index)
