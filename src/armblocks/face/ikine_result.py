"""The result of inverse kinematics."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import ArgumentError

Array = NDArray[np.float64]

Reason = Literal["converged", "limits", "out of reach", "singular", "steps"]
"""How the search for a configuration ended: see :class:`IkineResult`."""

AXES = ("x", "y", "z", "rotation about x", "rotation about y", "rotation about z")
SHOWN = 10
"""Maximum number of targets without a solution that the text of a result lists."""


@dataclass(frozen=True, kw_only=True, eq=False)
class IkineResult(metaclass=ArgumentErrors):
    """Configurations for one pose, or for N poses (then every field has a leading axis of N).

    - ``q`` (nq,) rad or m: the solution, or the configuration whose pose is nearest to the target.
    - ``success``: whether ``q`` is a solution, within the tolerance and the limits.
    - ``reason``: one of the texts below.
    - ``position_error`` m, ``rotation_error`` rad: of ``q``, without the components that a mask excludes.
    - ``lost_direction`` (6,): a direction in the world, or in the axes of the mask, first translation (m),
      then rotation (rad). It is NaN unless the reason is ``"out of reach"`` or ``"singular"``.
    - ``excess`` (nq,) rad or m: see ``"limits"``.
    - ``iterations``: evaluations of the kinematics.
    - ``restarts``: starts after the first start.
    - ``names``: the names of the coordinates.

    Reasons:

    - ``"converged"``: ``q`` is a solution.
    - ``"limits"``: there are solutions only beyond the limits of joints. ``excess`` is the amount by which
      one of these solutions exceeds the limits of each coordinate.
    - ``"out of reach"``: no configuration has this pose. ``position_error`` and ``rotation_error`` are those
      of the nearest pose, and ``lost_direction`` is the direction from there to the target.
    - ``"singular"``: ``q`` is near a solution, where the arm cannot move along ``lost_direction``.
    - ``"steps"``: the maximum number of iterations was reached.
    """

    q: Array
    success: bool | NDArray[np.bool_]
    reason: Reason | NDArray[np.str_]
    position_error: float | Array
    rotation_error: float | Array
    iterations: int | NDArray[np.int64]
    restarts: int | NDArray[np.int64]
    excess: Array
    lost_direction: Array
    names: tuple[str, ...]

    @classmethod
    def trusted(cls, **values: object) -> IkineResult:
        """Create a result from all fields without checks; the constructor takes as long as a search."""
        result = object.__new__(cls)
        vars(result).update(values)
        return result

    def __reduce__(self) -> tuple[object, ...]:
        return partial(IkineResult, **self.__dict__), ()

    def __len__(self) -> int:
        """The number of poses N. Raises ArgumentError for the result of one pose."""
        return len(self._batch("len"))

    def __getitem__(self, index: int) -> IkineResult:
        """The result of one pose of a batch. Raises ArgumentError for the result of one pose."""
        self._batch("an index")
        values = {name: getattr(self, name)[index] for name in _BATCHED}
        for name, kind in (("success", bool), ("reason", str), ("iterations", int), ("restarts", int)):
            values[name] = kind(values[name])
        return IkineResult(**values, names=self.names)

    def explain(self) -> str:
        """A sentence about the result of one pose. Raises ArgumentError for the result of a batch."""
        if not isinstance(self.reason, str):
            raise ArgumentError(
                "explain() is for the result of one pose",
                where="IkineResult",
                allowed="a result without a leading axis",
                fix="write result[k].explain()",
            )
        error = f"{_length(float(self.position_error))}, {_angle(float(self.rotation_error))}"
        match self.reason:
            case "converged":
                return f"converged in {self.iterations} iterations to {error}"
            case "limits":
                beyond = [
                    f"{name} by {value:.3g}" for name, value in zip(self.names, self.excess) if value > 0.0
                ]
                return f"solutions exist only beyond joint limits: {', '.join(beyond)}; nearest pose: {error}"
            case "out of reach":
                return f"out of reach: the nearest pose is {error} away, along {self._direction()}"
            case "singular":
                return f"singular: near the pose ({error}) the arm cannot move along {self._direction()}"
            case _:
                return f"no solution after {self.iterations} iterations; nearest pose: {error}"

    def __str__(self) -> str:
        """The explanation of one pose; for a batch, the counts of reasons and the first failures."""
        if isinstance(self.reason, str):
            return self.explain()
        kinds, counts = np.unique(self.reason, return_counts=True)
        lines = [f"{len(self)} poses: " + ", ".join(f"{n} {kind}" for kind, n in zip(kinds, counts))]
        failed = np.flatnonzero(~np.asarray(self.success))
        lines += [f"  {k}: {self[int(k)].explain()}" for k in failed[:SHOWN]]
        if failed.size > SHOWN:
            lines.append(f"  and {failed.size - SHOWN} more")
        return "\n".join(lines)

    def _direction(self) -> str:
        """The sign and the axis of the largest component of the lost direction, such as ``-x``."""
        k = int(np.argmax(np.abs(self.lost_direction)))
        return f"{'-' if self.lost_direction[k] < 0.0 and k < 3 else ''}{AXES[k]}"

    def _batch(self, what: str) -> NDArray[np.str_]:
        if isinstance(self.reason, str):
            raise ArgumentError(
                f"this is the result of one pose, without {what}",
                where="IkineResult",
                allowed="the result of several poses",
                fix="read its fields, such as result.q",
            )
        return self.reason


_BATCHED = (
    *("q", "success", "reason", "position_error", "rotation_error"),
    *("iterations", "restarts", "excess", "lost_direction"),
)


def _length(value: float) -> str:
    return f"{value:.3g} m"


def _angle(value: float) -> str:
    return f"{np.degrees(value):.3g}°"
