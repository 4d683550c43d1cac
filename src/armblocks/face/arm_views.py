"""``Arm.plot``, ``Arm.animate`` and ``Arm.teach``: views in a notebook or in the browser, and files.

The views belong to the studio, a higher layer, so they are imported by name at the first call.
"""

from __future__ import annotations

import importlib
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.errors import InputError
from armblocks.face.arm_pictures import (
    Appearance,
    ShownArm,
    checked_rows,
    checked_times,
    poses_of,
    save_animation,
    save_picture,
)
from armblocks.face.trajectory import JointTrajectory

if TYPE_CHECKING:
    from armblocks.pictures.film import FilmProgress

Array = NDArray[np.float64]


class ArmView(Protocol):
    """A view of an arm: a widget in a notebook, or a page in the browser."""

    @property
    def q(self) -> Array:
        """The displayed coordinates (nq,), rad or m."""
        ...

    @q.setter
    def q(self, value: ArrayLike) -> None: ...

    def close(self) -> None:
        """Close the view."""
        ...


def plot(
    arm: ShownArm,
    q: ArrayLike | None,
    *,
    save: str | PathLike[str] | None,
    block: bool,
    theme: object,
    size: object,
    view: object,
) -> ArmView | Path:
    """Show or draw a configuration or a motion, see :meth:`Arm.plot`."""
    where = f"plot of robot '{arm.name}'"
    rows = checked_rows(arm, q, where)
    look = Appearance.checked(theme, size, view, where)
    if save is not None:
        return save_picture(arm, rows, save, look)
    if len(rows) > 1:
        return _show_motion(arm, rows, checked_times(None, len(rows), where), look, block, where)
    poses_of(arm, rows, where)
    return _views().show_arm(arm, rows[0], look, block=block)


def animate(
    arm: ShownArm,
    q: ArrayLike | JointTrajectory,
    dt: ArrayLike | None,
    *,
    save: str | PathLike[str] | None,
    block: bool,
    theme: object,
    size: object,
    view: object,
    rate: float,
    speed: float,
    progress: FilmProgress | None,
) -> ArmView | Path:
    """Play a motion, or write it to a file, see :meth:`Arm.animate`."""
    where = f"animate of robot '{arm.name}'"
    if isinstance(q, JointTrajectory):
        q, dt = q.q, q.t if dt is None else dt
    rows = checked_rows(arm, q, where)
    time = checked_times(dt, len(rows), where)
    look = Appearance.checked(theme, size, view, where)
    if save is None:
        return _show_motion(arm, rows, time, look, block, where)
    return save_animation(arm, rows, time, save, look, rate=rate, speed=speed, progress=progress)


def teach(arm: ShownArm, q: ArrayLike | None, *, block: bool) -> ArmView:
    """Show sliders of the joints, see :meth:`Arm.teach`."""
    where = f"teach of robot '{arm.name}'"
    rows = checked_rows(arm, q, where)
    if len(rows) != 1:
        raise InputError(
            f"q has {len(rows)} rows",
            where=where,
            allowed="one configuration",
            fix="show a motion by arm.animate(q, dt)",
        )
    poses_of(arm, rows, where)
    return _views().show_arm(arm, rows[0], Appearance(), block=block)


def _show_motion(
    arm: ShownArm, rows: Array, time: Array, look: Appearance, block: bool, where: str
) -> ArmView:
    return _views().show_motion(arm, rows, time, poses_of(arm, rows, where), look, block=block)


def _views() -> Any:
    return importlib.import_module("armblocks.studio.arm_views")
