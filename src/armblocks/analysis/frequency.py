"""Frequency response and steady-state gain."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.equilibration import equilibrating_factors
from armblocks.analysis.modes import poles
from armblocks.analysis.reduction import minimal, on_path
from armblocks.analysis.scaling import balanced
from armblocks.analysis.state_space import StateSpaceModel
from armblocks.analysis.zeros import zeros

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_MAX_BATCH_ENTRIES = 4_000_000
"""Maximum number of entries of one batch of linear equations."""
SINGULAR_CONDITION = 1e14
"""Condition number of the steady state above which a pole is 0 (sampled: 1)."""
ACCURATE_CONDITION = 1e6
"""Condition number of the steady state above which states that do not affect the path are removed."""


def evaluate(system: StateSpaceModel, points: Complex) -> Complex:
    """``C (s I - A)^-1 B + D`` (N, ny, nu) at complex numbers (N,); infinite at a pole."""
    n = system.order
    result = np.broadcast_to(system.D, (len(points), *system.D.shape)).astype(np.complex128)
    if not n or not system.B.size or not system.C.size:
        return result
    a, b, c = balanced(system.A, system.B, system.C)
    batch_size = max(1, _MAX_BATCH_ENTRIES // (n * n))
    for start in range(0, len(points), batch_size):
        batch = points[start : start + batch_size]
        matrices = batch[:, None, None] * np.eye(n) - a
        try:
            states = np.linalg.solve(matrices, np.broadcast_to(b, (len(batch), *b.shape)))
            result[start : start + batch_size] += c @ states
        except np.linalg.LinAlgError:
            for k, matrix in enumerate(matrices):
                try:
                    result[start + k] += c @ np.linalg.solve(matrix, b)
                except np.linalg.LinAlgError:
                    result[start + k] = complex(math.inf, 0.0)
    return result


def boundary_points(system: StateSpaceModel, frequencies: Array) -> Complex:
    """Points on the stability boundary: ``j w``, or ``exp(j w dt)`` for a sampled system."""
    points = (1j * frequencies).astype(np.complex128)
    return np.exp(points * system.dt) if system.is_discrete else points


def frequency_response(system: StateSpaceModel, frequencies: Array) -> Complex:
    """See :meth:`LinearSystem.frequency_response`."""
    return evaluate(system, boundary_points(system, frequencies))


def gain_and_phase(system: StateSpaceModel, frequencies: Array) -> tuple[Array, Array]:
    """Magnitude and continuous phase in degrees, (N, ny, nu) each, at ascending frequencies (rad/s).

    The first phase is determined up to multiples of 360 degrees. The value nearest to -90 degrees times the
    number of integrators is used. An undamped pole changes the phase by -180 degrees, an undamped zero by
    +180, as in the limit of small damping.
    """
    response = frequency_response(system, frequencies)
    phase = np.degrees(np.unwrap(np.angle(response), axis=0))
    for row in range(phase.shape[1]):
        for column in range(phase.shape[2]):
            path = minimal(system.select([system.outputs[row]], [system.inputs[column]]))
            _correct_phase(path, frequencies, phase[:, row, column])
    return np.abs(response), phase


def _correct_phase(path: StateSpaceModel, frequencies: Array, phase: Array) -> None:
    """Correct the phase, in place, at points where unwrapping is ambiguous."""
    integrators = 0
    for roots, direction in ((poles(path), -1.0), (zeros(path), 1.0)):
        s = as_continuous(path, roots)
        scale = max(float(np.abs(s).max(initial=0.0)), 1e-300)
        integrators -= int(direction) * sum(abs(root) <= 1e-7 * scale for root in s.tolist())
        undamped = (np.abs(s.real) <= 1e-9 * np.abs(s)) & (s.imag > 1e-7 * scale)
        for frequency in s.imag[undamped].tolist():
            k = int(np.searchsorted(frequencies, float(frequency)))
            if 0 < k < len(phase) and direction * (phase[k] - phase[k - 1]) < -90.0:
                phase[k:] += direction * 360.0
    expected = -90.0 * integrators - 1e-6  # selects -180 degrees rather than +180 degrees
    phase += 360.0 * round((expected - float(phase[0])) / 360.0)


def as_continuous(system: StateSpaceModel, roots: Complex) -> Complex:
    """The roots in rad/s; for a sampled system ``log(z) / dt``, without roots at ``z = 0``."""
    if not system.is_discrete:
        return roots
    return np.asarray(np.log(roots[roots != 0.0]) / system.dt, dtype=np.complex128)


def dcgain(system: StateSpaceModel) -> Array:
    """The steady-state gain (ny, nu) from each input to each output; infinite with an integrator."""
    result = np.empty(system.D.shape)
    for row in range(system.D.shape[0]):
        for column in range(system.D.shape[1]):
            path = on_path(system.select([system.outputs[row]], [system.inputs[column]]))
            result[row, column] = _steady_state_gain(path) + 0.0  # without -0
    return result


def _steady_state_gain(path: StateSpaceModel) -> float:
    """The steady-state gain of a system with one input and one output.

    The path has an integrator if relative changes of the entries of ``A`` (sampled: ``I - A``) by about the
    roundoff can make this matrix singular. This decision does not depend on the units of the states.
    """
    matrix, condition = _steady_state_matrix(path)
    roundoff = 10.0 * float(np.finfo(np.float64).eps) * max(path.order, 1)
    if condition > ACCURATE_CONDITION:
        # An integrator on another path must not affect this path.
        reduced = minimal(path)
        if reduced.order < path.order:
            # The rounding errors of the reduction are relative to the size of the whole matrix.
            size = float(np.linalg.norm(balanced(path.A, path.B, path.C)[0])) + path.is_discrete
            path = reduced
            matrix, condition = _steady_state_matrix(path)
            if path.order and np.linalg.norm(matrix, -2) <= roundoff * size:
                return math.inf
    if condition > min(SINGULAR_CONDITION, 1.0 / roundoff):
        return math.inf
    rows, columns = equilibrating_factors(matrix)
    states = columns * np.linalg.solve(matrix * columns * rows[:, None], rows * path.B[:, 0])
    return float(path.D[0, 0] + path.C[0] @ states)


def _steady_state_matrix(path: StateSpaceModel) -> tuple[Array, float]:
    """``-A`` (sampled: ``I - A``) and the condition number of the steady state for changes of entries of A.

    This number is the spectral radius of ``|M^-1| |A|``, the smallest condition number among all scalings of
    rows and columns (Bauer, Numerische Mathematik 5, 1963, 73-87).
    """
    identity = np.eye(path.order) if path.is_discrete else np.zeros_like(path.A)
    matrix = identity - path.A
    rows, columns = equilibrating_factors(matrix)
    scaled = matrix * columns * rows[:, None]
    try:
        inverse = np.linalg.inv(scaled)
    except np.linalg.LinAlgError:
        return matrix, math.inf
    sizes = (np.abs(path.A) + identity) * columns * rows[:, None]
    condition = float(np.abs(np.linalg.eigvals(np.abs(inverse) @ sizes)).max(initial=0.0))
    return matrix, condition


def frequency_range(system: StateSpaceModel) -> tuple[float, float]:
    """The range from a decade below the lowest to a decade above the highest corner frequency, rad/s.

    For a sampled system it ends at the Nyquist frequency at most.
    """
    roots = np.concatenate([poles(system), zeros(system)])
    if system.is_discrete:
        roots = roots[np.abs(roots) > 1e-8]
        roots = np.log(roots) / system.dt
    corners = np.abs(roots)
    corners = corners[corners > 1e-6 * max(1e-6, float(corners.max(initial=0.0)))]
    nyquist = math.pi / system.dt if system.is_discrete else math.inf
    low = float(corners.min()) / 10.0 if corners.size else min(0.1, nyquist / 100.0)
    high = min(float(corners.max()) * 10.0 if corners.size else 10.0, nyquist)
    low, high = 10.0 ** math.floor(math.log10(low) + 1e-9), 10.0 ** math.ceil(math.log10(high) - 1e-9)
    high = min(high, nyquist)
    return min(low, high / 100.0), high


def frequency_grid(system: StateSpaceModel, low: float, high: float, points: int = 500) -> Array:
    """Angular frequencies (rad/s), logarithmically spaced and denser around lightly damped modes."""
    grid = np.geomspace(low, high, points)
    roots = np.concatenate([poles(system), zeros(system)])
    if system.is_discrete:
        roots = np.log(roots[np.abs(roots) > 1e-8]) / system.dt
    extra: list[Array] = []
    for root in roots[roots.imag > 0.0]:
        width = max(abs(root.real), 1e-6 * abs(root))
        if width < 0.3 * abs(root):
            offsets = width * np.sinh(np.linspace(-8.0, 8.0, 81)) / 10.0
            extra.append(root.imag + offsets)
    all_frequencies = np.unique(np.concatenate([grid, *extra]))
    return all_frequencies[(all_frequencies >= low) & (all_frequencies <= high)]
