"""Integers that follow a signal, as modes whose changes are events."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, ceil, fabs, floor, fmax, fmin, if_else, sign

from armblocks.blocks.switching import THRESHOLD_OFFSET, beyond, cell_of
from armblocks.diagram import Block, Guard, Shapes, Signals, State


def nearest(u: SX) -> SX:
    """Round to the nearest integer, halves away from zero, exactly for every double."""
    whole = floor(fabs(u))
    return sign(u) * (whole + (fabs(u) - whole >= 0.5))


ROUNDINGS: Mapping[str, Callable[[SX], SX]] = {
    "floor": floor,
    "ceil": ceil,
    "round": nearest,
    "fix": lambda u: sign(u) * floor(fabs(u)),
}


def rounding_edges(function: str, n: SX, mirrored: bool = False) -> tuple[SX, SX]:
    """The boundary above which a rounding exceeds n, and whether the boundary itself is rounded to more than
    n.

    ``mirrored``: the same for -f(-u) instead of f(u).
    """
    if function == "round":
        return n + 0.5, n >= 0.0
    if function == "fix":
        return if_else(n >= 0.0, n + 1.0, n), n >= 0.0
    if (function == "floor") is not mirrored:
        return n + 1.0, SX(1.0)
    return n, SX(0.0)


def step_after(target: SX, before: SX, e: Signals, up: str = "up", down: str = "down") -> SX:
    """An integer after the events at both ends of its interval; ``target``: computed from the present values.

    A jump may pass several integers at once. The integer changes by at least one, because at a boundary
    rounding errors could give the old value again.
    """
    lower = if_else(e[down] < 0.0, fmin(target, before - 1.0), before)
    return if_else(e[up] > 0.0, fmax(target, before + 1.0), lower)


@dataclass(frozen=True)
class IntegerSteps:
    """Rounding of the input ``signal`` to the mode ``mode``, element by element.

    A block returns these modes, guards and values from its methods. With ``count`` the integer is limited to
    0 … ``count - 1``; without ``count`` it is unlimited. ``mark`` is the prefix of the guard names.
    """

    signal: str
    function: str = "floor"
    mode: str = "integer"
    count: int | None = None
    mark: str = ""

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State(self.mode, inputs[self.signal], f"{self.signal} as an integer"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        shape = inputs[self.signal]
        up = Guard(f"{self.mark}up", shape, f"{self.signal} reaches the next integer", 1)
        return (up, Guard(f"{self.mark}down", shape, f"{self.signal} reaches the integer below", -1))

    def guard_values(self, x: Signals, u: Signals) -> Signals:
        integer, value = x[self.mode], u[self.signal]
        edge, owned = rounding_edges(self.function, integer)
        below, below_owned = rounding_edges(self.function, -integer, mirrored=True)
        up = value - edge + if_else(owned, THRESHOLD_OFFSET, -THRESHOLD_OFFSET)
        down = value + below - if_else(below_owned, THRESHOLD_OFFSET, -THRESHOLD_OFFSET)
        if self.count is not None:
            up = if_else(integer >= self.count - 1.0, -1.0, up)
            down = if_else(integer <= 0.0, 1.0, down)
        return {f"{self.mark}up": up, f"{self.mark}down": down}

    def mode_values(self, x: Signals, u: Signals) -> Signals:
        ends = self.guard_values(x, u)
        return {
            self.mode: cell_of(self._rounded(u), x[self.mode], ends, f"{self.mark}up", f"{self.mark}down")
        }

    def contradictions(self, x: Signals, u: Signals) -> Signals:
        return {self.mode: beyond(self.guard_values(x, u), f"{self.mark}up", f"{self.mark}down")}

    def resets(self, x: Signals, u: Signals, e: Signals) -> Signals:
        return {
            self.mode: step_after(self._rounded(u), x[self.mode], e, f"{self.mark}up", f"{self.mark}down")
        }

    def _rounded(self, u: Signals) -> SX:
        integer = ROUNDINGS[self.function](u[self.signal])
        return integer if self.count is None else fmin(fmax(integer, 0.0), self.count - 1.0)


class BlockWithSteps(Block):
    """Base class of blocks with integers that follow inputs, given by :meth:`_steps`."""

    following_modes: ClassVar[bool] = True

    def _steps(self) -> tuple[IntegerSteps, ...]:
        """The integers whose changes are events."""
        raise NotImplementedError

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return tuple(state for steps in self._steps() for state in steps.modes(inputs))

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        return tuple(guard for steps in self._steps() for guard in steps.guards(inputs))

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return _joined(steps.guard_values(x, u) for steps in self._steps())

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return _joined(steps.mode_values(x, u) for steps in self._steps())

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return _joined(steps.contradictions(x, u) for steps in self._steps())

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        return _joined(steps.resets(x, u, e) for steps in self._steps())


def _joined(parts: Iterable[Signals]) -> Signals:
    return {name: value for part in parts for name, value in part.items()}
