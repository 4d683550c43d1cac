"""Inverse kinematics of an arm: checks of the arguments, and the result."""

from __future__ import annotations

from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from armblocks.compiler.arguments import check_threads
from armblocks.errors import InputError, UnknownNameError
from armblocks.face.ikine_reasons import Reasons
from armblocks.face.ikine_result import IkineResult
from armblocks.face.ikine_search import ArmSearch, Options
from armblocks.face.ikine_targets import (
    Target,
    mask_array,
    raise_invalid_target,
    start_array,
    target_array,
)
from armblocks.inverse_kinematics.layout import Count, Status
from armblocks.inverse_kinematics.solver import Solutions

MASK_AXES = ("tool", "world")


def solve(search: ArmSearch, T: Target, q0: ArrayLike | None, options: Options, threads: int) -> IkineResult:
    """Search configurations for the targets, see :meth:`armblocks.Arm.ikine`."""
    targets, batch = target_array(T, search.where)
    count = targets.shape[0] if batch else None
    starts = None if q0 is None else start_array(q0, search.robot.nq, count, search.where)
    workers = check_threads(search.where, threads)
    prepared = search.prepared(options)
    targets = targets.reshape(-1, 16)
    found = search.run(targets, starts, prepared, workers)
    status = found.counts[:, Count.STATUS]
    if count is None and status[0] == Status.CONVERGED and not search.robot.constraints:
        return _single(search, found)
    for k in np.flatnonzero(status == Status.INVALID_TARGET)[:1]:
        raise_invalid_target(targets[k].reshape(4, 4), int(k) if batch else None, search.where)
    result = Reasons(search, targets, found, options, prepared).result()
    return result if batch else result[0]


def _single(search: ArmSearch, found: Solutions) -> IkineResult:
    """The result of one target with a solution."""
    position, rotation = found.numbers[0, :2].tolist()
    _, steps, attempts = found.counts[0].tolist()
    return IkineResult(
        q=found.q[0],
        success=True,
        reason="converged",
        position_error=position,
        rotation_error=rotation,
        iterations=steps,
        restarts=attempts - 1,
        excess=np.zeros(search.robot.nq),
        lost_direction=np.full(6, np.nan),
        names=search.names,
    )


def checked_options(
    mask: ArrayLike | None, limits: object, tolerance: object, restarts: object, seed: object, where: str
) -> Options:
    """The options of a call. Raises InputError for invalid ones."""
    if not isinstance(limits, bool):
        raise InputError(
            f"limits={limits!r}",
            where=where,
            allowed="True or False",
            fix="write limits=False to allow joints beyond their limits",
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
        raise UnknownNameError("axes of a mask", str(axes), MASK_AXES, where=where)
    return str(axes)
