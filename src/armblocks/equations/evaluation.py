"""Values and exact derivatives of a system at single points, by CasADi's interpreter.

For the few evaluations of an analysis this is faster than compiling native code.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from casadi import SX, Function, densify, jacobian, jacobian_sparsity, vec, vertcat
from numpy.typing import NDArray

from armblocks import interrupts
from armblocks.equations.hybrid_system import Delays, HybridSystem
from armblocks.equations.table_reading import evaluate_with_reads, reads_tables
from armblocks.equations.traced_function import TracedFunction
from armblocks.errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Point:
    """An evaluation point of a system: time (s) and the flat vectors of the system's layouts."""

    t: float
    x: Array
    z: Array
    w: Array
    p: Array

    @property
    def arguments(self) -> list[Array]:
        """The five arguments in the order of the system's functions."""
        return [np.array([self.t]), self.x, self.z, self.w, self.p]


@dataclass(frozen=True, kw_only=True, eq=False)
class Jacobians:
    """Derivatives of one function with respect to time (m, 1), states (m, nx), discrete variables (m, nz),
    unknowns (m, nw), and selected parameters (m, k)."""

    t: Array
    x: Array
    z: Array
    w: Array
    p: Array


def refuse_called(system: HybridSystem, result: str) -> None:
    """Raise ``InputError`` if a block of the system is computed in Python, because it has no equations."""
    if system.called:
        raise InputError(
            f"block '{system.called[0]}' calls Python, which has no {result}",
            where=system.name,
            allowed="blocks with equations",
            fix="use a traceable Python Function, or remove the block",
        )


class EvaluatedSystem:
    """A system's functions and their derivatives as numbers.

    ``parameters``: indices into ``p`` of the parameters for derivatives; ``signals``: the rows of ``y`` to
    compute (``None``: all). Every function is prepared at its first use.
    """

    def __init__(
        self, system: HybridSystem, parameters: Sequence[int] = (), signals: Sequence[int] | None = None
    ) -> None:
        refuse_called(system, "derivatives")
        self.system = system
        self.parameters = list(parameters)
        self._signals = None if signals is None else list(signals)
        self._functions: dict[str, Function] = {}
        self._jacobians: dict[str, Function] = {}

    def _rows(self, traced: TracedFunction) -> SX:
        chosen = self._signals if traced is self.system.signals else None
        result = vertcat(*traced.results, SX(0, 1))
        return result if chosen is None else result[chosen]

    def _call(self, traced: TracedFunction, arguments: Sequence[Array]) -> Array:
        if traced.name not in self._functions:
            self._functions[traced.name] = Function(
                "f", list(traced.arguments), [self._rows(traced)], {"cse": True}
            )
        return _numbers(self._functions[traced.name], arguments).reshape(-1)

    def _differentiate(self, traced: TracedFunction, arguments: Sequence[Array]) -> Jacobians:
        t, x, z, w, p = traced.arguments[:5]
        if traced.name not in self._jacobians:
            chosen = p[self.parameters] if self.parameters else SX(0, 1)
            by = vertcat(t, x, z, w, chosen)
            matrix = jacobian(self._rows(traced), by)
            function = Function("j", list(traced.arguments), [matrix], {"cse": True})
            if reads_tables(function):  # evaluated column by column
                function = Function("j", list(traced.arguments), [vec(densify(matrix))], {"cse": True})
            self._jacobians[traced.name] = function
        count = self._rows(traced).numel()
        whole = _numbers(self._jacobians[traced.name], arguments).reshape(
            (count, 1 + x.numel() + z.numel() + w.numel() + len(self.parameters)), order="F"
        )
        offsets = np.cumsum([1, x.numel(), z.numel(), w.numel()]).tolist()
        by_t, by_x, by_z, by_w, by_p = np.split(whole, offsets, axis=1)
        return Jacobians(t=by_t, x=by_x, z=by_z, w=by_w, p=by_p)

    # Values.

    def derivative(self, point: Point) -> Array:
        """``x'`` (nx,)."""
        return self._call(self.system.derivative, point.arguments)

    def signals(self, point: Point) -> Array:
        """The selected rows of ``y``."""
        return self._call(self.system.signals, point.arguments)

    def residual(self, point: Point) -> Array:
        """``r`` (nw,)."""
        return self._call(self.system.residual, point.arguments)

    def guards(self, point: Point) -> Array:
        """``g`` (ng,)."""
        return self._call(self.system.guards, point.arguments)

    def update(self, point: Point, ticking: Array) -> Array:
        """``z`` (nz,) after the ticks of the clocks with ``ticking[k] = 1``."""
        return self._call(self.system.update, [*point.arguments, ticking])

    def consistent_modes(self, point: Point) -> Array:
        """``z`` (nz,) with all modes consistent with the present values."""
        events = np.zeros(len(self.system.guard_directions))
        reset = self._call(self.system.reset, [*point.arguments, events])
        return reset[self.system.states.size :]

    def start(self, p: Array) -> tuple[Array, Array, Array]:
        """``x(0)``, ``z(0)`` before the first ticks, and the first guess of ``w``."""
        system = self.system
        x, z, w = (
            self._call(traced, [p])
            for traced in (system.initial_states, system.initial_discrete, system.initial_algebraic)
        )
        return x, z, w

    # Derivatives.

    def derivative_jacobians(self, point: Point) -> Jacobians:
        """Derivatives of ``x'``."""
        return self._differentiate(self.system.derivative, point.arguments)

    def signal_jacobians(self, point: Point) -> Jacobians:
        """Derivatives of the selected signals."""
        return self._differentiate(self.system.signals, point.arguments)

    def residual_jacobians(self, point: Point) -> Jacobians:
        """Derivatives of ``r``."""
        return self._differentiate(self.system.residual, point.arguments)

    def update_jacobians(self, point: Point, ticking: Array) -> Jacobians:
        """Derivatives of the new ``z`` at a tick."""
        return self._differentiate(self.system.update, [*point.arguments, ticking])

    # Delays.

    def delay_times(self, point: Point) -> Array:
        """The delay of each delayed scalar (nd,), s."""
        return self._call(self._delays.times, point.arguments)

    def delay_inputs(self, point: Point) -> Array:
        """The inputs of the delays, and their time derivatives (2 nd,)."""
        return self._call(self._delays.inputs, point.arguments)

    def delay_input_jacobians(self, point: Point) -> Jacobians:
        """Derivatives of the inputs of the delays."""
        return self._differentiate(self._delays.inputs, point.arguments)

    @property
    def _delays(self) -> Delays:
        assert self.system.delays is not None
        return self.system.delays

    @cached_property
    def sampled(self) -> NDArray[np.bool_]:
        """The entries of ``z`` that a clock updates (nz,); all others are modes, which events change."""
        update = self.system.update
        updated = np.zeros(self.system.discrete.size, dtype=np.bool_)
        if self.system.clocks:
            updated[jacobian_sparsity(update.results[0], update.arguments[5]).row()] = True
        return updated


def _numbers(function: Function, arguments: Sequence[Array]) -> Array:
    """The single result of a function at a point, including tables that are read by index."""
    if reads_tables(function):
        flat = [np.asarray(argument, dtype=np.float64).reshape(-1) for argument in arguments]
        return np.asarray(evaluate_with_reads(function, flat)[0], dtype=np.float64)
    (value,) = function.call(list(arguments))
    interrupts.check()
    return np.asarray(value.full(), dtype=np.float64)
