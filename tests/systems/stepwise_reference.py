"""Hybrid systems run in Python: small fixed steps, events by bisection. Slow, and independent."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from armblocks.diagram import Diagram, trace_diagram

NEVER = 1000


class Reference:
    """One run: RK4 steps of at most ``step``, each event bisected to the last bit by stepping again."""

    def __init__(self, diagram: Diagram, step: float) -> None:
        self.system = system = trace_diagram(diagram)
        self.step = step
        self.functions = {
            name: getattr(system, name).casadi_function()
            for name in (
                "derivative",
                "signals",
                "residual",
                "residual_jacobian",
                "update",
                "guards",
                "reset",
            )
        }
        self.p = system.parameter_values
        self.x, self.z, self.w = (
            getattr(system, name)(self.p)[0]
            for name in ("initial_states", "initial_discrete", "initial_algebraic")
        )
        self.directions = np.array(system.guard_directions)
        self.events: list[tuple[float, tuple[str, ...]]] = []

    def call(self, name: str, t: float, x: np.ndarray, *more: np.ndarray) -> list[np.ndarray]:
        values = [np.array([t]), x, self.z, self.implicit(t, x), self.p, *more]
        return [np.asarray(part).ravel() for part in self.functions[name].call(values)]

    def implicit(self, t: float, x: np.ndarray) -> np.ndarray:
        for _ in range(20 if self.w.size else 0):
            values = [np.array([t]), x, self.z, self.w, self.p]
            (r,) = self.functions["residual"].call(values)
            (J,) = self.functions["residual_jacobian"].call(values)
            n = self.w.size
            self.w = self.w - np.linalg.solve(np.asarray(J).reshape(n, n), np.asarray(r).ravel())
        return self.w

    def stepped(self, t: float, h: float, clamp: float) -> np.ndarray:
        def f(time: float, x: np.ndarray) -> np.ndarray:
            return self.call("derivative", min(time, clamp), x)[0]

        a = f(t, self.x)
        b = f(t + h / 2, self.x + h / 2 * a)
        c = f(t + h / 2, self.x + h / 2 * b)
        d = f(t + h, self.x + h * c)
        return self.x + h / 6 * (a + 2 * b + 2 * c + d)

    def fired(self, t: float, x: np.ndarray) -> np.ndarray:
        if not self.directions.size:
            return np.zeros(0)
        now = np.sign(self.call("guards", t, x)[0])
        crossed = np.where((now != 0) & (self.signs != 0) & (now != self.signs), now, 0.0)
        return np.where((self.directions == 0) | (self.directions == crossed), crossed, 0.0)

    def note_signs(self, t: float) -> None:
        if self.directions.size:
            now = np.sign(self.call("guards", t, self.x)[0])
            self.signs = np.where(now == 0, self.signs, now)

    def handle_events(self, t: float) -> None:
        for _ in range(NEVER):
            e = self.fired(t, self.x)
            if not e.any():
                self.note_signs(t)
                return
            names = tuple(sorted({self.system.guard_names[k] for k in np.flatnonzero(e)}))
            self.events.append((t, names))
            self.x, z = self.call("reset", t, self.x, e)
            self.z = z
            before = self.signs
            self.signs = np.where(e != 0, e, before)
        raise AssertionError("events without end")

    def flow(self, t: float, stop: float, clamp: float) -> None:
        while t < stop:
            h = min(self.step, stop - t)
            end = stop if t + self.step >= stop else t + h
            x = self.stepped(t, h, clamp)
            if self.fired(min(end, clamp), x).any():
                low, high = 0.0, h
                while t + low < (middle := t + (low + high) / 2) < t + high:
                    if self.fired(min(middle, clamp), self.stepped(t, (low + high) / 2, clamp)).any():
                        high = (low + high) / 2
                    else:
                        low = (low + high) / 2
                self.x = self.stepped(t, high, clamp)
                t = min(t + high, stop)
                self.handle_events(min(t, clamp))
            else:
                self.x, t = x, end
                self.note_signs(min(t, clamp))

    def run(self, times: Sequence[float]) -> dict[str, np.ndarray]:
        """Signals at the times, the first of which is 0."""
        stop = Fraction(repr(float(times[-1])))
        ticks: dict[Fraction, np.ndarray] = {}
        for k, clock in enumerate(self.system.clocks):
            period, at = Fraction(repr(clock.period)), Fraction(repr(clock.offset))
            while at <= stop:
                ticks.setdefault(at, np.zeros(len(self.system.clocks)))[k] = 1.0
                at += period
        jumps = {Fraction(float(time)) for time in self.system.breakpoints(self.p)[0] if 0 < time <= stop}
        recorded = {Fraction(repr(float(time))) for time in times}
        self.signs = np.zeros(self.directions.size)
        rows: list[np.ndarray] = []
        now = Fraction(0)
        for instant in sorted({Fraction(0), *ticks, *jumps, *recorded}):
            t = float(instant)
            clamp = np.nextafter(t, -np.inf) if instant in jumps else np.inf
            if instant > 0:
                self.flow(float(now), t, clamp)
            if instant in ticks:
                (self.z,) = self.call("update", t, self.x, ticks[instant])
            if instant == 0:
                for _ in range(self.directions.size + 1):  # a mode may depend on another one
                    self.x, self.z = self.call("reset", t, self.x, np.zeros(self.directions.size))
                self.note_signs(t)
            else:
                self.handle_events(t)
            if instant in recorded:
                rows.append(self.call("signals", t, self.x)[0])
            now = instant
        return self.system.signals_layout.unpack(np.array(rows))


def run_reference(diagram: Diagram, times: Sequence[float], step: float = 0.01) -> dict[str, np.ndarray]:
    """Signals ``(N, *shape)`` by path at ``times`` (N,), beginning with 0."""
    return Reference(diagram, step).run(times)
