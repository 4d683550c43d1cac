"""Operating points at a limit or at a jump, about which a linear system holds for changes to one side only.

The derivatives are compared with differences to both sides, along one change of all continuous states and
inputs. The error of a difference decreases with the change, except at a kink or a jump. Sampled values are
not changed, because they may be flags or indices.
"""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.operating_point import solved
from armblocks.equations.evaluation import EvaluatedSystem, Jacobians, Point
from armblocks.errors import SimulationError, warn

Array = NDArray[np.float64]

STEP, CLOSER = 1e-6, 1.0 / 16.0
"""The relative change of the states and inputs, and the ratio of a second change to it."""
KINK, ROUNDING = 1e-2, 1e-13
"""The smallest relative difference of two derivatives at a kink, and the relative rounding error."""
GOLDEN_RATIO = (1.0 + np.sqrt(5.0)) / 2.0


def warn_of_one_side(
    evaluated: EvaluatedSystem, point: Point, flow: Jacobians, outputs: Jacobians, update: Jacobians | None
) -> None:
    """Warn if a linear system about a point holds to one side only.

    ``flow``, ``outputs`` and ``update`` (of ticks of all clocks) are the total derivatives at the point.
    Nothing is checked if the implicit equations have no solution beside the point.
    """
    blocks: list[str] = []
    with contextlib.suppress(SimulationError):
        blocks = _Sides(evaluated, point).blocks(flow, outputs, update)
    if blocks:
        names = ", ".join(f"'{block}'" for block in blocks[:3])
        subject, verb = ("block", "is") if len(blocks) == 1 else ("the blocks", "are")
        warn(
            f"{evaluated.system.name}: {subject} {names} {verb} exactly at a limit or at a jump at "
            f"{point.t:.9g} s, so the linear system does not hold for changes to both sides. Linearize at "
            "points beside the limit too"
        )


class _Sides:
    """A point, and the points beside it."""

    def __init__(self, evaluated: EvaluatedSystem, point: Point) -> None:
        self.evaluated, self.system, self.point = evaluated, evaluated.system, point
        self.chosen = list(evaluated.parameters)
        self.x, self.p = (_weights(part.size) * (1.0 + np.abs(part)) for part in (point.x, point.p))
        self.p[np.setdiff1d(np.arange(point.p.size), self.chosen)] = 0.0
        self._exclude_held_states()

    def _exclude_held_states(self) -> None:
        """Do not change the states of a block if this would change its modes: modes are constant."""
        z = [self._beside(step).z for step in (-STEP, STEP)]
        elements = [name for slot in self.system.discrete for name in slot.elements]
        changed = np.flatnonzero((z[0] != z[1]) & ~self.evaluated.sampled)
        holding = {elements[k].rpartition("/")[0] for k in changed.tolist()}
        states = [name.rpartition("/")[0] for slot in self.system.states for name in slot.elements]
        self.x[[block in holding for block in states]] = 0.0

    def blocks(self, flow: Jacobians, outputs: Jacobians, update: Jacobians | None) -> list[str]:
        """The blocks at a limit or at a jump; empty if none has an effect on the given derivatives."""
        tables = [flow, outputs] if update is None else [flow, outputs, update]
        rates = [j.x @ self.x + j.p @ self.p[self.chosen] for j in tables]
        rates[2:] = [rate[self.evaluated.sampled] for rate in rates[2:]]
        rate = np.concatenate(rates)
        values = self._values(self.point)
        kinks = np.zeros(values.size, dtype=np.bool_)
        with np.errstate(invalid="ignore", over="ignore"):
            for step in (-STEP, STEP):
                far, near = (
                    np.abs((self._values(self._beside(part)) - values) / part - rate)
                    for part in (step, step * CLOSER)
                )
                limit = KINK * (1.0 + np.abs(rate)) + ROUNDING * np.abs(values / step)
                kinks |= (far > limit) & (near > far / 2.0)
        if not kinks.any():
            return []
        states = [name for slot in self.system.states for name in slot.elements]
        rows = np.flatnonzero(kinks[: len(states)]).tolist()
        return self._kinked_blocks() or _blocks(states[k] for k in rows)

    def _values(self, point: Point) -> Array:
        """The flow, the outputs, and the sampled variables after ticks of all clocks."""
        parts = [self.evaluated.derivative(point), self.evaluated.signals(point)]
        if self.system.clocks:
            updated = self.evaluated.update(point, np.ones(len(self.system.clocks)))
            parts.append(updated[self.evaluated.sampled])
        return np.concatenate(parts)

    def _kinked_blocks(self) -> list[str]:
        """The blocks of the signals with a kink or a jump: those with guards, or else all."""
        signals = EvaluatedSystem(self.system, self.chosen).signals
        here, *beside = (signals(point) for point in (self.point, self._beside(-STEP), self._beside(STEP)))
        with np.errstate(invalid="ignore"):
            before, after = (side - here for side in beside)
            size = np.abs(before) + np.abs(after)
            kinks = np.abs(before + after) > KINK * (STEP + size) + ROUNDING * np.abs(here)
            kinks |= size > KINK * (1.0 + np.abs(here))
        elements = [name for slot in self.system.signals_layout for name in slot.elements]
        blocks = _blocks(elements[k] for k in np.flatnonzero(kinks).tolist())
        return [block for block in blocks if block in set(self.system.guard_names)] or blocks

    def _beside(self, step: float) -> Point:
        """The point after a change, with consistent modes and solved implicit equations."""
        here = self.point
        point = dataclasses.replace(here, x=here.x + step * self.x, p=here.p + step * self.p)
        point = solved(self.evaluated, point)
        for _ in range(len(self.system.guard_directions)):
            z = self.evaluated.consistent_modes(point)
            if np.array_equal(z, point.z, equal_nan=True):
                break
            point = solved(self.evaluated, dataclasses.replace(point, z=z))
        return point


def _weights(size: int) -> Array:
    """Different numbers between 1 and 2, so that no two changes cancel."""
    return 1.0 + np.arange(size) * GOLDEN_RATIO % 1.0


def _blocks(names: Iterable[str]) -> list[str]:
    """The blocks of some states or signals, each once."""
    return list(dict.fromkeys(name.rpartition("/")[0] for name in names))
