"""Operating points: all variables of a system at one time, by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.equations import Signature
from armblocks.equations.evaluation import EvaluatedSystem, Point
from armblocks.errors import SimulationError

Array = NDArray[np.float64]

MAX_ITERATIONS = 60
"""Maximum number of Newton steps."""


@dataclass(frozen=True, kw_only=True, eq=False)
class OperatingPoint(metaclass=ArgumentErrors):
    """The values of all variables of a system at ``time`` (s), each by its path and in its shape.

    They are states, discrete variables with modes, unknowns of implicit equations, tunable parameters and
    signals. ``accuracies``: bounds of the rounding errors of computed values, by name and in their shape.
    """

    name: str
    time: float
    states: Mapping[str, Array]
    discrete: Mapping[str, Array]
    algebraic: Mapping[str, Array]
    parameters: Mapping[str, Array]
    signals: Mapping[str, Array]
    accuracies: Mapping[str, Array] = field(default_factory=dict[str, Array])

    def shown(self, name: str, value: Array) -> Array:
        """A value of this point, with 0 for every number that is 0 within its accuracy."""
        accuracy = self.accuracies.get(name)
        return value + 0.0 if accuracy is None else np.where(np.abs(value) <= accuracy, 0.0, value)

    def __repr__(self) -> str:
        head = f"<OperatingPoint of {self.name} at {self.time:g} s>"
        parts = (*self.states.items(), *self.discrete.items())
        width = max((len(name) for name, _ in parts), default=0)
        lines = [
            f"  {name:<{width}}  {np.array2string(self.shown(name, value), precision=6)}"
            for name, value in parts
        ]
        return "\n".join([head, *lines])


def operating_point(evaluated: EvaluatedSystem, point: Point) -> OperatingPoint:
    """A point with its signals, by name. ``evaluated`` must compute all signals."""
    system = evaluated.system
    return OperatingPoint(
        name=system.name,
        time=point.t,
        states=system.states.unpack(point.x),
        discrete=system.discrete.unpack(point.z),
        algebraic=system.algebraic.unpack(point.w),
        parameters=system.parameters.unpack(point.p),
        signals=system.signals_layout.unpack(evaluated.signals(point)),
    )


def initial_point(evaluated: EvaluatedSystem, p: Array) -> Point:
    """The start of a run: after the first ticks, with consistent modes and solved implicit equations.

    Raises ``SimulationError`` if the implicit equations have no solution near their first guess.
    """
    system = evaluated.system
    x, z, w = evaluated.start(p)
    point = solved(evaluated, Point(t=0.0, x=x, z=z, w=w, p=p))
    if system.clocks:
        ticking = np.array([float(clock.offset == 0.0) for clock in system.clocks])
        for marks, follows_events in system.ticks_by_level(ticking):
            if follows_events:
                z = evaluated.consistent_modes(point)
                point = solved(evaluated, Point(t=0.0, x=x, z=z, w=point.w, p=p))
            z = evaluated.update(point, marks)
            point = solved(evaluated, Point(t=0.0, x=x, z=z, w=point.w, p=p))
    if system.discrete.size:
        z = evaluated.consistent_modes(point)
        point = solved(evaluated, Point(t=0.0, x=x, z=z, w=point.w, p=p))
    return point


def transferred_point(
    evaluated: EvaluatedSystem, known: OperatingPoint, parameters: Mapping[str, Array]
) -> Point:
    """The same operating point in a system with more parameters, and possibly other unknowns.

    ``parameters`` are the values of the parameters that ``known`` does not have. Every unknown is the value
    of a signal of ``known``, so Newton's method starts close to the solution.
    """
    system = evaluated.system
    guess = system.initial_algebraic(system.parameter_values)[0].copy()
    for name, entry in system.algebraic.ranges.items():
        value = known.algebraic.get(name, _signal_entry(known.signals, name))
        if value is not None:
            guess[entry] = value
    point = Point(
        t=known.time,
        x=_packed(system.states, known.states),
        z=_packed(system.discrete, known.discrete),
        w=guess,
        p=_packed(system.parameters, {**known.parameters, **parameters}),
    )
    return solved(evaluated, point)


def _packed(layout: Signature, values: Mapping[str, Array]) -> Array:
    return layout.pack({name: values[name] for name in layout.names})


def _signal_entry(signals: Mapping[str, Array], unknown: str) -> Array | None:
    """The value of the signal that an unknown is named after: ``sum/y``, or ``sum/y[2]``."""
    if unknown in signals:
        return signals[unknown].ravel()
    path, bracket, index = unknown.rpartition("[")
    if bracket and path in signals:
        return signals[path].ravel()[int(index.removesuffix("]"))]
    return None


def solved(evaluated: EvaluatedSystem, point: Point) -> Point:
    """The point whose ``w`` solves the implicit equations, by Newton's method with step halving.

    Raises ``SimulationError`` if there is no solution near ``point.w``.
    """
    system = evaluated.system
    if not system.algebraic.size:
        return point
    w = point.w

    def at(values: Array) -> Point:
        return Point(t=point.t, x=point.x, z=point.z, w=values, p=point.p)

    residual = evaluated.residual(point)
    for _ in range(MAX_ITERATIONS):
        jacobian = evaluated.residual_jacobians(at(w)).w
        step = np.linalg.lstsq(jacobian, -residual, rcond=None)[0]
        if np.isfinite(step).all() and np.abs(step).max() <= 1e-14 * max(1.0, float(np.abs(w).max())):
            w = w + step
            break
        fraction = 1.0
        trial = evaluated.residual(at(w + step))
        while not np.linalg.norm(trial) < np.linalg.norm(residual) and fraction > 1e-6:
            fraction /= 2.0
            trial = evaluated.residual(at(w + fraction * step))
        if fraction <= 1e-6:
            break
        w, residual = w + fraction * step, trial
    if np.abs(residual).max() <= 1e-9 * max(1.0, float(np.abs(w).max())):
        return at(w)
    worst = system.algebraic.names[int(np.argmax(np.abs(residual)))]
    raise SimulationError(
        f"the implicit equation of '{worst}' has no solution near the start value",
        where=system.name,
        allowed="points at which every algebraic loop has a solution",
        fix="start from another operating point",
    )
