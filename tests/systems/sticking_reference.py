"""An arm with dry friction integrated from event to event with SciPy: an independent reference for sticking.

The joints that stick are found by trying every combination. The reference shares with the block only the
inertia matrix and the inverse dynamics without friction.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

import armblocks as ab

Torque = Callable[[float], np.ndarray]


class StickingArm:
    """An arm with Coulomb friction, ``forward`` >= 0 and ``backward`` <= 0, and ``viscous``, N m s/rad."""

    def __init__(
        self, arm: ab.Arm, forward: np.ndarray, backward: np.ndarray, viscous: np.ndarray, tau: Torque
    ) -> None:
        self.arm = arm.nofriction("all")
        self.forward, self.backward, self.viscous, self.tau = forward, backward, viscous, tau

    def accelerations(
        self, t: float, q: np.ndarray, qd: np.ndarray, modes: tuple[int, ...]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return qdd and the holding torque of each joint."""
        m = np.array(modes)
        friction = np.where(m > 0, self.forward, np.where(m < 0, self.backward, 0.0)) + self.viscous * qd
        M = np.asarray(self.arm.inertia(q))
        left = self.tau(t) - friction - self.arm.rne(q, qd, np.zeros(len(q)))
        free = np.flatnonzero(m)
        qdd = np.zeros(len(q))
        qdd[free] = np.linalg.solve(M[np.ix_(free, free)], left[free])
        return qdd, left - M @ qdd

    def modes(self, t: float, q: np.ndarray, qd: np.ndarray) -> tuple[int, ...]:
        """Return the consistent combination of sticking and sliding joints."""
        choices = [(int(np.sign(v)),) if v else (0, 1, -1) for v in qd]
        for combination in itertools.product(*choices):
            qdd, holding = self.accelerations(t, q, qd, combination)
            fine = [
                v != 0 or (mode == 0 and low <= h <= high) or (mode != 0 and mode * a > 0)
                for v, mode, h, a, low, high in zip(
                    qd, combination, holding, qdd, self.backward, self.forward, strict=True
                )
            ]
            if all(fine):
                return combination
        raise AssertionError(f"no combination of sticking and sliding joints fits at {t}")

    def run(self, q: np.ndarray, qd: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Integrate from event to event; return q and qd (N, 2n) at the times."""
        n, t, x = len(q), float(times[0]), np.concatenate([q, qd])
        states = [x]
        while len(states) < len(times):
            # evaluated slightly later, when a torque that has just reached the friction limit exceeds it
            modes = self.modes(t + 1e-10, x[:n], x[n:])

            def flow(t: float, x: np.ndarray, modes: tuple[int, ...] = modes) -> np.ndarray:
                return np.concatenate([x[n:], self.accelerations(t, x[:n], x[n:], modes)[0]])

            def margin(
                t: float, x: np.ndarray, k: int, modes: tuple[int, ...] = modes, since: float = t
            ) -> float:
                if modes[k]:
                    return modes[k] * x[n + k] if t > since + 1e-9 else 1.0
                holding = self.accelerations(t, x[:n], x[n:], modes)[1][k]
                return min(self.forward[k] - holding, holding - self.backward[k])

            events = []
            for k in range(n):

                def event(t: float, x: np.ndarray, k: int = k) -> float:
                    return margin(t, x, k)

                event.terminal, event.direction = True, -1.0
                events.append(event)
            left = times[len(states) :]
            run = solve_ivp(
                flow, (t, left[-1]), x, "DOP853", left, events=events, rtol=1e-11, atol=1e-13, max_step=0.01
            )
            states += list(np.reshape(run.y, (2 * n, -1)).T)
            if run.status == 0:
                break
            fired = next(k for k in range(n) if len(run.t_events[k]))
            t, x = float(run.t_events[fired][0]), run.y_events[fired][0].copy()
            x[n:][np.array(modes) == 0] = 0.0
            if modes[fired]:
                x[n + fired] = 0.0
        return np.array(states)
