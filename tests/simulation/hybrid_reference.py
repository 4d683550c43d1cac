"""Clocks, events and implicit equations in plain Python: an independent reference for the native loop.

The reference follows the description of the semantics and shares no code with the program under test. Ticks
are listed in advance in rational arithmetic. SciPy's DOP853 with tight tolerances integrates the flow. Zero
crossings are located on a fine grid and by Brent's method, which also solves implicit equations. CasADi's
interpreter evaluates the functions.
"""

from __future__ import annotations

from fractions import Fraction

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from armblocks.equations import HybridSystem

GRID = 30
NAMES = ("derivative", "signals", "residual", "update", "guards", "reset")


class FunctionEvaluator:
    """A CasADi function with fixed buffers for arguments and results: CasADi converts arrays slowly."""

    def __init__(self, function: ca.Function) -> None:
        assert all(function.sparsity_in(k).is_dense() for k in range(function.n_in()))
        assert all(function.sparsity_out(k).is_dense() for k in range(function.n_out()))
        self.arguments = [np.zeros(function.nnz_in(k)) for k in range(function.n_in())]
        self.results = [np.zeros(function.nnz_out(k)) for k in range(function.n_out())]
        self.buffer, self.evaluate = function.buffer()
        for k, array in enumerate(self.arguments):
            self.buffer.set_arg(k, memoryview(array))
        for k, array in enumerate(self.results):
            self.buffer.set_res(k, memoryview(array))

    def __call__(self, *values: float | np.ndarray) -> list[np.ndarray]:
        for array, value in zip(self.arguments, values, strict=True):
            array[:] = value
        self.evaluate()
        return [array.copy() for array in self.results]


class Reference:
    """One run of a system from t = 0; ``run`` returns the signals, ``events`` counts the events."""

    def __init__(self, system: HybridSystem) -> None:
        self.system = system
        self.functions = {name: FunctionEvaluator(getattr(system, name).casadi_function()) for name in NAMES}
        self.p = system.parameter_values
        self.x, self.z, self.w = (
            np.asarray(getattr(system, name)(self.p)[0])
            for name in ("initial_states", "initial_discrete", "initial_algebraic")
        )
        self.t = 0.0
        self.events = 0
        self.signs = np.zeros(len(system.guard_directions))

    def call(self, name: str, t: float, x: np.ndarray, *more: np.ndarray) -> list[np.ndarray]:
        w = self.w
        if w.size and name != "residual":
            w = self.solve(t, x)
        return self.functions[name](t, x, self.z, w, self.p, *more)

    def solve(self, t: float, x: np.ndarray) -> np.ndarray:
        """Solve the implicit equation of one unknown between -10 and 10."""

        def residual(w: float) -> float:
            return float(self.functions["residual"](t, x, self.z, w, self.p)[0][0])

        return np.array([brentq(residual, -10.0, 10.0, xtol=1e-14)])

    def ticks(self, stop: float) -> list[tuple[float, np.ndarray]]:
        """Return all times with ticks, with marks of the clocks that tick."""
        marks: dict[Fraction, np.ndarray] = {}
        for k, clock in enumerate(self.system.clocks):
            period, offset = Fraction(repr(clock.period)), Fraction(repr(clock.offset))
            number = 0
            while offset + number * period <= Fraction(repr(stop)):
                mark = marks.setdefault(offset + number * period, np.zeros(len(self.system.clocks)))
                mark[k] = 1.0
                number += 1
        return [(float(instant), marks[instant]) for instant in sorted(marks)]

    def firing_guards(self, g: np.ndarray) -> np.ndarray:
        signs_now, directions = np.sign(g), np.array(self.system.guard_directions)
        return np.where((signs_now * self.signs < 0) & (signs_now * directions >= 0), signs_now, 0.0)

    def process_events(self) -> None:
        """Process the events at the present time until no guard fires."""
        for _ in range(1000):
            g = self.call("guards", self.t, self.x)[0]
            e = self.firing_guards(g)
            self.signs = np.where(g != 0, np.sign(g), self.signs)
            if not e.any():
                return
            self.events += int(np.abs(e).sum())
            self.x, self.z = self.call("reset", self.t, self.x, e)
            g = self.call("guards", self.t, self.x)[0]
            self.signs = np.where(e != 0, np.sign(g), self.signs)
        raise AssertionError("events without end")

    def flow(self, end: float, samples: np.ndarray, rows: list[np.ndarray]) -> None:
        """Integrate until ``end`` and stop at every event."""
        while self.t < end:
            start, values = self.t, lambda t, x=self.x: x
            if self.x.size:
                solution = solve_ivp(
                    lambda t, x: self.call("derivative", t, x)[0],
                    (start, end),
                    self.x,
                    method="DOP853",
                    rtol=1e-12,
                    atol=1e-13,
                    dense_output=True,
                )
                values = solution.sol
            event_time = self.first_zero(start, end, values)
            end_time = end if event_time is None else event_time
            inside = samples[(samples > start) & (samples < end_time * (1 - 1e-14))]
            for instant in inside[inside > self.last_recorded]:
                rows.append(self.call("signals", instant, values(instant))[0])
                self.last_recorded = instant
            self.t, self.x = end_time, np.asarray(values(end_time))
            if event_time is not None:
                self.process_events()
                self.record_here(samples, rows)

    def record_here(self, samples: np.ndarray, rows: list[np.ndarray]) -> None:
        """Record the sample at the present time, if there is one that is not recorded yet."""
        for sample in samples[np.isclose(samples, self.t, rtol=1e-14, atol=0)]:
            if sample > self.last_recorded:
                rows.append(self.call("signals", sample, self.x)[0])
                self.last_recorded = sample

    def first_zero(self, start: float, end: float, values: object) -> float | None:
        """Return a time just after the first crossing, or ``None``; update the signs of the guards."""
        if not self.signs.size:
            return None
        before = start
        for instant in np.linspace(start, end, GRID)[1:]:
            g = self.call("guards", instant, values(instant))[0]
            e = self.firing_guards(g)
            if e.any():
                roots = []
                for k in np.flatnonzero(e):
                    zero = lambda t, k=k: self.call("guards", t, values(t))[0][k]  # noqa: E731
                    low = before
                    while zero(low) * self.signs[k] <= 0:
                        low += 1e-12
                    root = brentq(zero, low, instant, xtol=1e-15, rtol=1e-15)
                    while zero(root) * self.signs[k] >= 0:
                        root += 4 * np.spacing(root)
                    roots.append(root)
                return min(roots)
            self.signs = np.where(g != 0, np.sign(g), self.signs)
            before = instant
        return None

    def run(self, samples: np.ndarray) -> np.ndarray:
        """Return the signals at the samples, ``(ny, N)``."""
        rows: list[np.ndarray] = []
        self.last_recorded = -1.0
        stop = float(samples[-1])
        instants = self.ticks(stop)
        if not instants or instants[0][0] > 0:
            instants.insert(0, (0.0, np.zeros(len(self.system.clocks))))
        instants.append((stop, np.zeros(len(self.system.clocks))))
        for instant, marks in instants:
            self.flow(instant, samples, rows)
            if marks.any():
                self.z = self.call("update", self.t, self.x, marks)[0]
            self.process_events()
            self.record_here(samples, rows)
        return np.array(rows).T
