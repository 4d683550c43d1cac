"""Modes that are rounded inputs: an event occurs where the integer changes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, ceil, fabs, floor, fmax, fmin, if_else, sign

from armblocks.blocks.switching import THRESHOLD_OFFSET, beyond, cell_of
from armblocks.diagram import Block, Guard, Shapes, Signals, State
from armblocks.equations.remainders import nearest

ROUNDINGS: Mapping[str, Callable[[SX], SX]] = {
    "floor": floor,
    "ceil": ceil,
    "round": nearest,
    "fix": lambda u: sign(u) * floor(fabs(u)),
}


def rounding_edges(function: str, n: SX, mirrored: bool = False) -> tuple[SX, SX]:
    """Return the upper end of the interval that is rounded to n, and whether this end is rounded to n + 1.

    With ``mirrored``, the rounding function is -f(-u) instead of f(u).
    """
    if function == "round":
        return n + 0.5, n >= 0.0
    if function == "fix":
        return if_else(n >= 0.0, n + 1.0, n), n >= 0.0
    if (function == "floor") is not mirrored:
        return n + 1.0, SX(1.0)
    return n, SX(0.0)


def step_after(target: SX, before: SX, e: Signals, up: str = "up", down: str = "down") -> SX:
    """Return the mode after the events ``up`` and ``down`` at the ends of its interval.

    ``target`` is the integer for the present signal, ``before`` the mode before the events. A jump may pass
    several integers at once. The mode changes by at least one, although rounding errors at a boundary could
    make ``target`` the old value.
    """
    lower = if_else(e[down] < 0.0, fmin(target, before - 1.0), before)
    return if_else(e[up] > 0.0, fmax(target, before + 1.0), lower)


@dataclass(frozen=True)
class IntegerSteps:
    """Rounding of the input ``signal`` to the mode ``mode``, element by element.

    The methods of a block with the same names return these modes, guards and values. ``function`` is a key
    of :data:`ROUNDINGS`. With ``count`` the integer is limited to 0 … ``count - 1``; without ``count`` it is
    unlimited. The names of the guards begin with ``prefix``.
    """

    signal: str
    function: str = "floor"
    mode: str = "integer"
    count: int | None = None
    prefix: str = ""

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        return (State(self.mode, inputs[self.signal], f"{self.signal} rounded to an integer"),)

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        shape = inputs[self.signal]
        up = Guard(f"{self.prefix}up", shape, f"{self.signal} is rounded to the next integer", 1)
        return (up, Guard(f"{self.prefix}down", shape, f"{self.signal} is rounded to the integer below", -1))

    def guard_values(self, x: Signals, u: Signals) -> Signals:
        integer, value = x[self.mode], u[self.signal]
        edge, upper_end_rounds_up = rounding_edges(self.function, integer)
        below, lower_end_rounds_down = rounding_edges(self.function, -integer, mirrored=True)
        up = value - edge + if_else(upper_end_rounds_up, THRESHOLD_OFFSET, -THRESHOLD_OFFSET)
        down = value + below - if_else(lower_end_rounds_down, THRESHOLD_OFFSET, -THRESHOLD_OFFSET)
        if self.count is not None:
            up = if_else(integer >= self.count - 1.0, -1.0, up)
            down = if_else(integer <= 0.0, 1.0, down)
        return {f"{self.prefix}up": up, f"{self.prefix}down": down}

    def mode_values(self, x: Signals, u: Signals) -> Signals:
        guards = self.guard_values(x, u)
        return {
            self.mode: cell_of(
                self._rounded(u), x[self.mode], guards, f"{self.prefix}up", f"{self.prefix}down"
            )
        }

    def contradictions(self, x: Signals, u: Signals) -> Signals:
        return {self.mode: beyond(self.guard_values(x, u), f"{self.prefix}up", f"{self.prefix}down")}

    def resets(self, x: Signals, u: Signals, e: Signals) -> Signals:
        return {
            self.mode: step_after(self._rounded(u), x[self.mode], e, f"{self.prefix}up", f"{self.prefix}down")
        }

    def _rounded(self, u: Signals) -> SX:
        integer = ROUNDINGS[self.function](u[self.signal])
        return integer if self.count is None else fmin(fmax(integer, 0.0), self.count - 1.0)


class BlockWithSteps(Block):
    """Base class of blocks whose modes are rounded inputs; subclasses declare them in :meth:`_steps`."""

    following_modes: ClassVar[bool] = True

    def _steps(self) -> tuple[IntegerSteps, ...]:
        """The rounded inputs of the block."""
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
