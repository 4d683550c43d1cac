"""Inverse kinematics of an arm: checks of the arguments, and the result."""

from __future__ import annotations

from collections.abc import Callable
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.compiler.arguments import check_threads
from armblocks.errors import InputError, UnknownNameError
from armblocks.face.ikine_reasons import Reasons
from armblocks.face.ikine_result import IkineResult
from armblocks.face.ikine_search import ArmSearch, Options
from armblocks.face.ikine_targets import (
    Target,
    check_distances,
    is_plain,
    mask_array,
    raise_invalid_target,
    start_array,
    target_array,
)
from armblocks.inverse_kinematics.layout import Count, Status

Array = NDArray[np.float64]

CONVERGED = int(Status.CONVERGED)
MASK_AXES = ("tool", "world")


class IkineCall:
    """Inverse kinematics of a frame of an arm with checked options: ``call(T, q0, threads)``."""

    def __init__(self, search: ArmSearch, options: Options) -> None:
        self._search, self._options = search, options
        self._prepared = search.prepared(options)
        self._has_constraints = bool(search.robot.constraints)
        self._one: Callable[[Array], tuple[Array, list[float]]] | None = None
        self._no_excess = np.zeros(search.robot.nq)
        self._no_direction = np.full(6, np.nan)
        for array in (self._no_excess, self._no_direction):
            array.flags.writeable = False

    def __call__(self, T: Target, q0: ArrayLike | None, threads: int) -> IkineResult:
        """Search for configurations at the targets, see :meth:`armblocks.Arm.ikine`."""
        if q0 is None and threads == 1 and is_plain(T) and T.shape == (4, 4) and not self._has_constraints:
            result = self._of_plain(T)
            if result is not None:
                return result
        return self._of_any(T, q0, threads)

    def _of_plain(self, T: Array) -> IkineResult | None:
        """The result of one pose; None without a solution."""
        if self._one is None:
            prepared = self._prepared
            self._one = self._search.search.of_one_target(prepared.settings, prepared.bounds, prepared.table)
        q, (position, rotation, _, status, steps, attempts) = self._one(T)
        if status != CONVERGED:
            return None
        return IkineResult.trusted(
            q=q,
            success=True,
            reason="converged",
            position_error=position,
            rotation_error=rotation,
            iterations=int(steps),
            restarts=int(attempts) - 1,
            excess=self._no_excess,
            lost_direction=self._no_direction,
            names=self._search.names,
        )

    def _of_any(self, T: Target, q0: ArrayLike | None, threads: int) -> IkineResult:
        search = self._search
        targets, batch = target_array(T, search.where)
        count = targets.shape[0] if batch else None
        starts = None if q0 is None else start_array(q0, search.robot.nq, count, search.where)
        workers = check_threads(search.where, threads)
        targets = targets.reshape(-1, 16)
        check_distances(targets, batch, search.where)
        found = search.run(targets, starts, self._prepared, workers)
        for k in np.flatnonzero(found.counts[:, Count.STATUS] == Status.INVALID_TARGET)[:1]:
            raise_invalid_target(targets[k].reshape(4, 4), int(k) if batch else None, search.where)
        result = Reasons(search, targets, found, self._options, self._prepared).result()
        return result if batch else result[0]


def checked_options(
    mask: ArrayLike | None, limits: object, tolerance: object, restarts: object, seed: object, where: str
) -> Options:
    """The options of a call. Raises InputError for invalid options."""
    if not isinstance(limits, bool):
        raise InputError(
            f"limits={limits!r}",
            where=where,
            allowed="True or False",
            fix="write limits=False to allow solutions beyond the joint limits",
        )
    if isinstance(tolerance, bool) or not isinstance(tolerance, float | int) or not 1e-14 <= tolerance < 1.0:
        raise InputError(
            f"tolerance={tolerance!r}",
            where=where,
            allowed="a number from 1e-14 to 1, for the errors in m and rad",
            fix="omit tolerance= for 1e-9",
        )
    for name, value in (("restarts", restarts), ("seed", seed)):
        if isinstance(value, bool) or not isinstance(value, int) or value < 0:
            raise InputError(
                f"{name}={value!r}",
                where=where,
                allowed="an integer, zero or more",
                fix=f"omit {name}= for the default",
            )
    counts = cast("tuple[int, int]", (restarts, seed))
    return Options(mask_array(mask, where), limits, float(tolerance), *counts)


def check_axes(axes: object, where: str) -> str:
    """The axes of a mask. Raises UnknownNameError."""
    if axes not in MASK_AXES:
        raise UnknownNameError("choice of axes", str(axes), MASK_AXES, where=where)
    return str(axes)
