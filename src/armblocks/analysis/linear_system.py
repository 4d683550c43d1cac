"""The public class ``LinearSystem``: matrices and names, with methods for analysis."""

from __future__ import annotations

import dataclasses
from os import PathLike
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.analysis.connections import feedback, parallel, series
from armblocks.analysis.export import save, to_control
from armblocks.analysis.frequency import dcgain, evaluate, frequency_response
from armblocks.analysis.gramians import gramians
from armblocks.analysis.margins import Margins, bandwidth, margins
from armblocks.analysis.modes import Mode, modes, poles
from armblocks.analysis.reduction import minimal, on_path, reachable_dimensions
from armblocks.analysis.shown_values import is_stable
from armblocks.analysis.state_space import StateSpaceModel
from armblocks.analysis.text import system_html, system_text
from armblocks.analysis.time_response import TimeResponse, forced_response, impulse_response, step_response
from armblocks.analysis.transfer_function import TransferFunction, transfer_function
from armblocks.analysis.zeros import zeros

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@final
class LinearSystem(StateSpaceModel):
    """The system ``x' = A x + B u, y = C x + D u``, or ``x[k+1] = A x[k] + B u[k]`` for ``dt > 0`` (s).

    ``A (nx, nx)``, ``B (nx, nu)``, ``C (ny, nx)``, ``D (ny, nu)``. All quantities are deviations from the
    operating ``point``. ``states``, ``inputs`` and ``outputs`` name the scalars, with their SI units; without
    names they are ``x1``, ``u1``, ``y1`` … Raises ``InputError`` for matrices that do not fit together or
    have entries that are not finite.
    """

    @property
    def is_stable(self) -> bool:
        """Whether the system is asymptotically stable.

        All poles are left of the imaginary axis, or inside the unit circle for a sampled system. A pole on
        the stability boundary, within the accuracy of the computation, counts as unstable.
        """
        return is_stable(self)

    # Poles and zeros.

    def poles(self) -> Complex:
        """Eigenvalues of A (nx,), rad/s or per step, slowest first."""
        return poles(self)

    def zeros(self) -> Complex:
        """Invariant zeros: the numbers at which the system matrix loses rank.

        They include uncontrollable and unobservable modes.
        """
        return zeros(self)

    def damp(self) -> tuple[Mode, ...]:
        """Natural frequency, damping ratio and time constant of every pole."""
        return modes(self)

    def transfer_function(self) -> TransferFunction:
        """Zeros, poles and gain of a system with one input and one output.

        Raises ``InputError`` for other systems.
        """
        return transfer_function(self)

    # Frequency domain.

    def at(self, s: complex) -> Complex:
        """``C (s I - A)^-1 B + D`` (ny, nu) at one complex number: ``s``, or ``z`` of a discrete system."""
        return evaluate(self, np.array([s], dtype=np.complex128))[0]

    def dcgain(self) -> Array:
        """The steady-state gain (ny, nu); infinite with an integrator."""
        return dcgain(self)

    def frequency_response(self, frequencies: ArrayLike) -> Complex:
        """Response (N, ny, nu) at angular frequencies (N,) in rad/s."""
        return frequency_response(self, np.asarray(frequencies, dtype=np.float64))

    def margins(self) -> Margins:
        """Gain, phase and delay margins of the loop with negative feedback around this system."""
        return margins(self)

    def bandwidth(self, drop: float = 3.0) -> float:
        """First angular frequency (rad/s) at which the gain is ``drop`` dB below the steady-state gain."""
        return bandwidth(self, drop)

    # Time domain.

    def step_response(self, stop_time: float | None = None, points: int = 600) -> TimeResponse[LinearSystem]:
        """Every output after a unit step of every input, exact at the returned times."""
        return step_response(self, stop_time, points)

    def impulse_response(
        self, stop_time: float | None = None, points: int = 600
    ) -> TimeResponse[LinearSystem]:
        """Every output after a unit impulse of every input (discrete: a 1 for one sample)."""
        return impulse_response(self, stop_time, points)

    def response(
        self, time: ArrayLike, inputs: ArrayLike, start: ArrayLike | None = None
    ) -> TimeResponse[LinearSystem]:
        """Outputs for ``inputs`` (N, nu) at the times ``time`` (N,), s, interpolated linearly.

        The initial state is ``start`` (nx,), by default zero.
        """
        return forced_response(self, time, inputs, start)

    # Structure.

    def controllability(self) -> int:
        """The rank of the controllability matrix: the dimension of the controllable subspace."""
        return reachable_dimensions(self.A, self.B)

    def observability(self) -> int:
        """The rank of the observability matrix."""
        return reachable_dimensions(self.A.T, self.C.T)

    def gramians(self) -> tuple[Array, Array]:
        """Controllability and observability Gramian (nx, nx).

        Raises ``InputError`` if the system is not stable.
        """
        return gramians(self)

    def minimal(self) -> LinearSystem:
        """A system with the same transfer function and the minimum number of states, named ``x1`` …"""
        return minimal(self)

    def on_path(self) -> LinearSystem:
        """The system without the states that no input affects or that affect no output.

        The remaining states keep their names.
        """
        return on_path(self)

    # Connections.

    def __neg__(self) -> LinearSystem:
        return dataclasses.replace(self, C=-self.C, D=-self.D)

    def __add__(self, other: LinearSystem) -> LinearSystem:
        return parallel(self, other)

    def __sub__(self, other: LinearSystem) -> LinearSystem:
        return self + -other

    def __matmul__(self, other: LinearSystem) -> LinearSystem:
        """``second @ first``: the outputs of the right system are the inputs of the left system."""
        return series(self, other)

    def feedback(self, other: LinearSystem | float = 1.0, *, sign: int = -1) -> LinearSystem:
        """The closed loop ``(1 - sign L K)^-1 L`` of this system L with ``other`` K in the feedback path."""
        return feedback(self, other, sign)

    # Export.

    def to_control(self) -> Any:
        """A ``StateSpace`` of python-control, which must be installed."""
        return to_control(self)

    def save(self, path: str | PathLike[str]) -> None:
        """Write ``.json``, ``.npz`` or ``.mat``, atomically."""
        save(self, path)

    def __repr__(self) -> str:
        return system_text(self)

    def _repr_html_(self) -> str:
        return system_html(self)
