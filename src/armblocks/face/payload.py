"""Payloads: run-time inputs of the dynamics, which need no new compilation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Payload(metaclass=ArgumentErrors):
    """A rigid body fixed to the tool.

    ``mass`` kg; ``centre`` (3,) m: its centre of mass in the tool frame; ``inertia`` (6,) kg m2: xx yy zz xy
    yz xz about that centre, along the tool axes (the toolbox's order).
    """

    mass: float
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    inertia: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        try:
            vector = self.numbers
        except (TypeError, ValueError):
            vector = np.empty(0)
        if vector.shape != (10,) or not np.isfinite(vector).all():
            raise InputError(
                f"payload {self} is not made of 1 + 3 + 6 finite numbers",
                allowed="mass, centre (x, y, z), inertia (xx, yy, zz, xy, yz, xz)",
                where="Payload",
                fix="correct the numbers",
            )
        object.__setattr__(self, "mass", float(vector[0]))
        if self.mass < 0:
            raise InputError(
                f"payload mass {self.mass} kg is negative",
                allowed="zero or more",
                where="Payload",
                fix="give the mass in kg",
            )

    def __reduce__(self) -> tuple[object, ...]:
        return partial(Payload, mass=self.mass, centre=self.centre, inertia=self.inertia), ()

    @cached_property
    def numbers(self) -> NDArray[np.float64]:
        """The ten numbers in the order of the compiled dynamics' input, read-only."""
        numbers = np.array([self.mass, *self.centre, *self.inertia], dtype=np.float64)
        numbers.flags.writeable = False
        return numbers

    def vector(self) -> NDArray[np.float64]:
        """A copy of :attr:`numbers`."""
        return self.numbers.copy()


def payload_numbers(payload: ArrayLike | None) -> ArrayLike:
    """The ten numbers of a payload that is given as a mass (kg), ``None`` or ten numbers."""
    if payload is None:
        return _ZERO_PAYLOAD
    return Payload(mass=float(payload)).numbers if isinstance(payload, float | int) else payload


_ZERO_PAYLOAD = Payload(mass=0.0).numbers
