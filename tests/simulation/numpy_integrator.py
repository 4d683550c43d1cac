"""Runge-Kutta and Rosenbrock integrators in NumPy: an independent reference for the native ones.

Written from the description in Hairer, Norsett, Wanner I, II.4 to II.6, and II, IV.7. Only the tableaux are
shared with the code under test.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from armblocks.integration.butcher_tableau import ButcherTableau
from armblocks.integration.rosenbrock_tableau import RosenbrockTableau, Tableau

Field = Callable[[float, np.ndarray], np.ndarray]


class Counts:
    """Numbers of accepted steps, rejected steps and evaluations."""

    def __init__(self) -> None:
        self.accepted = self.rejected = self.evaluations = 0


def rms(v: np.ndarray) -> float:
    return float(np.sqrt(np.mean(v * v)))


def first_step(
    f: Field, t: float, x: np.ndarray, k0: np.ndarray, end: float, order: int, rtol: float, atol: float
) -> float:
    scale = atol + np.abs(x) * rtol
    d0, d1 = rms(x / scale), rms(k0 / scale)
    h0 = 1e-6 if d0 < 1e-5 or d1 < 1e-5 else 0.01 * d0 / d1
    h0 = min(h0, end - t)
    d2 = rms((f(t + h0, x + h0 * k0) - k0) / scale) / h0
    max_derivative = max(d1, d2)
    h1 = max(1e-6, h0 * 1e-3) if max_derivative <= 1e-15 else (0.01 / max_derivative) ** (1 / (order + 1))
    return min(100 * h0, h1, end - t)


def error_norm(tableau: Tableau, K: np.ndarray, h: float, scale: np.ndarray) -> float:
    if isinstance(tableau, RosenbrockTableau):
        return rms(h * (np.array(tableau.error) @ K[1 : tableau.stages + 1]) / scale)
    e = np.array(tableau.error) @ K[: tableau.stages + 1]
    if tableau.second_error is None:
        return rms(h * e / scale)
    e5 = np.sum((e / scale) ** 2)
    e3 = np.sum((np.array(tableau.second_error) @ K[: tableau.stages + 1] / scale) ** 2)
    return 0.0 if e5 == e3 == 0 else float(h * e5 / np.sqrt((e5 + 0.01 * e3) * scale.size))


def partial_derivatives(f: Field, t: float, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Jacobian and time derivative of ``f`` by complex steps, which have no cancellation error."""
    tiny = 1e-100
    columns = [np.imag(f(t, x + 1j * tiny * unit)) / tiny for unit in np.eye(x.size)]
    return np.column_stack(columns), np.imag(f(t + 1j * tiny, x)) / tiny


def rosenbrock_stages(
    tableau: RosenbrockTableau,
    derivative: Field,
    jacobian: tuple[np.ndarray, np.ndarray],
    t: float,
    x: np.ndarray,
    h: float,
    K: np.ndarray,
) -> np.ndarray:
    """Compute rows 1 … s of K and return the new state."""
    J, T = jacobian
    matrix = np.eye(x.size) / tableau.gamma - h * J
    for i in range(tableau.stages):
        before = K[1 : i + 1]
        f = (
            derivative(t + tableau.nodes[i] * h, x + h * (np.array(tableau.matrix[i]) @ before))
            if i
            else K[0]
        )
        right = f + np.array(tableau.couplings[i]) @ before + h * tableau.time_weights[i] * T
        K[1 + i] = np.linalg.solve(matrix, right)
    return x + h * (np.array(tableau.weights) @ K[1 : tableau.stages + 1])


def defect_norm(
    tableau: RosenbrockTableau,
    derivative: Field,
    J: np.ndarray,
    t: float,
    x: np.ndarray,
    h: float,
    K: np.ndarray,
    scale: np.ndarray,
) -> float:
    """Return the norm of the defect of the dense output in mid-step, as an error of the state."""
    k = K[1 : tableau.stages + 1]
    polynomials = [np.polynomial.Polynomial([0.0, *row]) for row in tableau.dense]
    middle = x + h * np.array([q(0.5) for q in polynomials]) @ k
    defect = derivative(t + 0.5 * h, middle) - np.array([q.deriv()(0.5) for q in polynomials]) @ k
    return rms(h * np.linalg.solve(np.eye(x.size) / tableau.gamma - h * J, defect) / scale)


def integrate(
    f: Field,
    tableau: Tableau,
    x0: Sequence[float],
    samples: np.ndarray,
    breakpoints: Sequence[float] = (),
    *,
    step: float = 0.0,
    rtol: float = 1e-6,
    atol: float = 1e-9,
) -> tuple[np.ndarray, Counts]:
    """Return the states at the samples, ``(N, n)``, and the numbers of steps and evaluations."""
    counts = Counts()
    t, x, stop = float(samples[0]), np.array(x0, dtype=float), float(samples[-1])
    rows: list[np.ndarray] = [x.copy()]
    ends = [b for b in sorted(set(breakpoints)) if t < b <= stop]
    limits = [float(np.nextafter(b, -np.inf)) for b in ends]
    if not ends or ends[-1] < stop:
        ends, limits = [*ends, stop], [*limits, stop]
    s = tableau.stages
    for end, limit in zip(ends, limits):

        def derivative(time: float, state: np.ndarray, limit: float = limit) -> np.ndarray:
            counts.evaluations += 1
            return np.asarray(f(min(time, limit), state))

        jacobian = np.zeros((0, 0)), np.zeros(0)

        def complex_derivative(time: float, state: np.ndarray) -> np.ndarray:
            return np.asarray(f(time, state))

        K = np.zeros((tableau.rows, x.size))
        K[0] = derivative(t, x)
        h = step
        if tableau.adaptive:
            h = first_step(derivative, t, x, K[0], end, tableau.error_order, rtol, atol)
        while t < end:
            rejected = False
            while True:
                t_new = t + h
                if not tableau.adaptive:
                    k = int(np.floor(t / step)) - 1
                    while k * step <= t:
                        k += 1
                    t_new = k * step
                    t_new = end if t_new + 1e-9 * step >= end else t_new
                t_new = min(t_new, end)
                h = t_new - t
                if isinstance(tableau, RosenbrockTableau):
                    jacobian = partial_derivatives(complex_derivative, min(t, limit), x)
                    x_new = rosenbrock_stages(tableau, derivative, jacobian, t, x, h, K)
                else:
                    for i in range(1, s):
                        K[i] = derivative(
                            t + tableau.nodes[i] * h, x + h * (np.array(tableau.matrix[i]) @ K[:i])
                        )
                    x_new = x + h * (np.array(tableau.weights) @ K[:s])
                K[tableau.end_row] = derivative(t_new, x_new)
                if not tableau.adaptive:
                    break
                scale = atol + rtol * np.maximum(np.abs(x), np.abs(x_new))
                norm = error_norm(tableau, K, h, scale)
                if isinstance(tableau, RosenbrockTableau):
                    norm = max(norm, defect_norm(tableau, derivative, jacobian[0], t, x, h, K, scale))
                factor = 10.0 if norm == 0 else 0.9 * norm ** (-1 / (tableau.error_order + 1))
                if norm < 1:
                    h_next = h * min(1.0 if rejected else 10.0, factor)
                    break
                h *= max(0.2, factor)
                rejected = True
                counts.rejected += 1
            counts.accepted += 1
            inside = samples[(samples > t) & (samples <= t_new)]
            if isinstance(tableau, ButcherTableau) and tableau.extra_nodes and np.any(inside < t_new):
                for i, node in enumerate(tableau.extra_nodes):
                    weights = np.array(tableau.extra_matrix[i])
                    K[s + 1 + i] = derivative(t + node * h, x + h * (weights @ K[: s + 1 + i]))
            for instant in inside:
                theta = (instant - t) / h
                powers = theta ** np.arange(1, len(tableau.dense[0]) + 1)
                value = x + h * ((np.array(tableau.dense_rows) @ powers) @ K[: len(tableau.dense_rows)])
                rows.append(x_new.copy() if instant == t_new else value)
            t, x = t_new, x_new
            K[0] = K[tableau.end_row]
            if tableau.adaptive:
                h = h_next
    return np.array(rows), counts
