"""The variables of an optimisation: names, bounds, start, and their coordinates for the search."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import cast

import numpy as np
from numpy.typing import NDArray

from armblocks.diagram import Diagram
from armblocks.errors import InputError, UnknownNameError
from armblocks.face.fit_model import FittedParameters, parameter_rule
from armblocks.face.model import CompiledDiagram
from armblocks.sweeps.designs import Distribution

Array = NDArray[np.float64]
Bounds = tuple[float, float] | Distribution | None


class Variables:
    """The n variables by name, with ``lower``, ``upper`` and ``start (n,)`` in the units of the parameters.

    The search uses coordinates ``u``, which are linear from 0 to 1 between finite bounds. For
    :func:`armblocks.loguniform` they are linear in the logarithm of the value.
    """

    def __init__(self, model: CompiledDiagram, given: object, start: Mapping[str, float], where: str) -> None:
        bounds = _given_bounds(given, where)
        self._parameters = FittedParameters(model.diagram, model.system, list(bounds), where)
        self.names = tuple(self._parameters.entries)
        wholes = [self._parameters.whole_of(k) for k in range(len(self.names))]
        self.units = tuple(parameter_rule(model.diagram, whole).unit for whole in wholes)
        limits = [
            _limits(model.diagram, name, whole, bounds.get(name, bounds.get(whole)), where)
            for name, whole in zip(self.names, wholes)
        ]
        self.lower, self.upper = (
            np.array([pair[0] for pair in limits]),
            np.array([pair[1] for pair in limits]),
        )
        self.logarithmic = np.array([pair[2] for pair in limits], dtype=np.bool_)
        self.start = self._start(start, where)
        self.bounded = bool(np.isfinite(self.lower).all() and np.isfinite(self.upper).all())
        finite = np.isfinite(self.lower) & np.isfinite(self.upper)
        low, high, begin = (self._straight(values) for values in (self.lower, self.upper, self.start))
        self._offset = np.where(finite, low, begin)
        self._scale = np.where(finite, high - low, np.maximum(np.abs(begin), 1e-3))
        self.u_lower, self.u_upper = self.coordinates(self.lower), self.coordinates(self.upper)

    def _start(self, given: Mapping[str, float], where: str) -> Array:
        start = np.clip(self._parameters.start, self.lower, self.upper)
        for name, value in given.items():
            if name not in self.names:
                raise UnknownNameError("variable", name, self.names, where=where)
            k = self.names.index(name)
            number = float(value)
            if not self.lower[k] <= number <= self.upper[k]:
                raise InputError(
                    f"'{name}' starts at {number:g}, outside its bounds",
                    where=where,
                    allowed=f"{self.lower[k]:g} to {self.upper[k]:g}",
                    fix="change the start or the bounds",
                )
            start[k] = number
        return start

    def _straight(self, x: Array) -> Array:
        """The logarithm where the coordinate is logarithmic."""
        return np.where(self.logarithmic, np.log(np.where(self.logarithmic, x, 1.0)), x)

    def coordinates(self, x: Array) -> Array:
        """The coordinates ``u`` of values ``x``, ``(…, n)``."""
        return (self._straight(x) - self._offset) / self._scale

    def values(self, u: Array) -> Array:
        """The values of coordinates ``(…, n)``, within the bounds."""
        line = self._offset + self._scale * u
        x = np.where(self.logarithmic, np.exp(np.where(self.logarithmic, line, 0.0)), line)
        return np.clip(x, self.lower, self.upper)

    def rates(self, x: Array) -> Array:
        """The derivatives of the values by the coordinates, ``(n,)``."""
        return self._scale * np.where(self.logarithmic, x, 1.0)

    def parameters(self, x: Array) -> dict[str, object]:
        """The values of the whole parameters, as :func:`armblocks.simulate` accepts them."""
        return self._parameters.values(x)

    def require_bounds(self, use: str, where: str) -> None:
        """Raise ``InputError`` if a bound is missing."""
        for name, low, high in zip(self.names, self.lower, self.upper):
            if not (math.isfinite(low) and math.isfinite(high)):
                raise InputError(
                    f"the variable '{name}' has no finite bounds, and {use} needs them",
                    where=where,
                    allowed="{name: (low, high)}, or ab.uniform(low, high), ab.loguniform(low, high)",
                    fix="give bounds",
                )


def _given_bounds(given: object, where: str) -> dict[str, Bounds]:
    if isinstance(given, str):
        return {given: None}
    if isinstance(given, Mapping) and given:
        return dict(cast("Mapping[str, Bounds]", given))
    names = list(cast("Sequence[object]", given)) if isinstance(given, Sequence) else []
    if not names or not all(isinstance(name, str) for name in names):
        raise InputError(
            f"the variables are {given!r:.60}",
            where=where,
            allowed="{'block.parameter': (low, high)}, or a list of names",
            fix="write for example {'pid.P': (0.1, 10)}",
        )
    return dict.fromkeys(cast("list[str]", names))


def _limits(diagram: Diagram, name: str, whole: str, given: Bounds, where: str) -> tuple[float, float, bool]:
    """The bounds of a variable, and whether its coordinate is logarithmic."""
    rule = parameter_rule(diagram, whole)
    least = max(rule.minimum, -math.inf if rule.above is None else rule.above)
    if given is None:
        return least, rule.maximum, False
    if isinstance(given, Distribution) and given.kind in ("uniform", "loguniform"):
        low, high, logarithmic = given.first, given.second, given.kind == "loguniform"
    else:
        pair = given if isinstance(given, Sequence | np.ndarray) else ()
        try:
            low, high = (float(value) for value in cast("Sequence[float]", pair))
        except (TypeError, ValueError):
            low, high = math.nan, math.nan
        logarithmic = False
    at_open_end = rule.above is not None and low <= rule.above and math.isfinite(low)
    if not low < high or low < least or high > rule.maximum or at_open_end:
        raise InputError(
            f"the bounds of '{name}' are {given!r:.60}",
            where=where,
            allowed=f"(low, high) in ascending order within the parameter's rule: {rule.describe()}",
            fix="give the bounds as two numbers, or as ab.loguniform(low, high)",
        )
    return low, high, logarithmic
