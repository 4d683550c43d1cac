"""Runs the native integrator loop: one object per method and system, one :class:`Integration` per run."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from armblocks.compiler.butcher_tableau import ButcherTableau
from armblocks.compiler.integrator_workspace import (
    Count,
    Real,
    Status,
    slope_place,
    state_place,
    trial_place,
    workspace_size,
)
from armblocks.compiler.ir_text import Module
from armblocks.compiler.llvm_ir import emit_function
from armblocks.compiler.native import load_code
from armblocks.compiler.runge_kutta import emit_integrator

if TYPE_CHECKING:
    from armblocks.compiler.tape import Tape

Vector = NDArray[np.float64]

_ADVANCE = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * 7, ctypes.c_int64)


class NativeIntegrator:
    """``x' = f(t, x, p)`` of one tape, stepped by one method in machine code."""

    def __init__(self, states: int, digest: str, tape: Callable[[], Tape], tableau: ButcherTableau) -> None:
        """``digest`` is that of the derivative's tape, which ``tape()`` gives if the disk cache lacks it."""
        self.tableau = tableau
        self.states = states

        def write() -> str:
            module = Module()
            emit_function(module, tape(), "derivative")
            emit_integrator(module, tableau, self.states, "advance", "derivative")
            return module.text

        # The code object must outlive every call into it.
        self._code = load_code(("runge_kutta", tableau.content, digest), write)
        self._advance = _ADVANCE(self._code.address("advance"))

    def begin(
        self,
        x0: Vector,
        p: Vector,
        samples: Vector,
        breakpoints: Vector,
        *,
        step: float = 0.0,
        rtol: float = 1e-6,
        atol: float = 1e-9,
        max_step: float = float("inf"),
    ) -> Integration:
        """A run from ``x0`` (n,) at ``samples[0]`` to ``samples[-1]``, ready for its first step.

        ``samples`` (N,) s, rising strictly: the instants whose states are recorded. ``breakpoints`` (nb,) s,
        in any order: a step ends exactly on each that lies inside, what comes before sees ``f`` at most at
        the last double before it, and what comes after starts anew. ``step`` s: grid of a fixed-step method
        (its instants are ``k step``); ``rtol``, ``atol``, ``max_step`` s: for adaptive methods. Nothing is
        checked.
        """
        start, stop = float(samples[0]), float(samples[-1])
        inside = np.unique(breakpoints[(breakpoints > start) & (breakpoints <= stop)])
        ends = inside if inside.size and inside[-1] == stop else np.append(inside, stop)
        clamps = ends.copy()
        clamps[: inside.size] = np.nextafter(inside, -np.inf)
        run = Integration(self, p, samples, ends, clamps)
        run.reals[Real.TIME] = start
        run.reals[Real.STEP] = step
        run.reals[Real.RTOL] = rtol
        run.reals[Real.ATOL] = atol
        run.reals[Real.MAX_STEP] = max_step
        run.state[:] = x0
        if stop <= start:
            run.states[0] = x0
            run.counts[Count.SAMPLE] = 1
            run.status = Status.DONE
        return run

    def advance(self, addresses: tuple[int, ...], max_steps: int) -> Status:
        """The native call. The interpreter's lock is released while it works."""
        return Status(self._advance(*addresses, max_steps))


class Integration:
    """One run: all of its state is in two arrays, so any chunking of the steps gives the same bits."""

    def __init__(
        self, integrator: NativeIntegrator, p: Vector, samples: Vector, ends: Vector, clamps: Vector
    ) -> None:
        n = integrator.states
        self.integrator = integrator
        self.reals = np.zeros(workspace_size(integrator.tableau, n))
        self.counts = np.zeros(Count.END, dtype=np.int64)
        self.states = np.empty((samples.size, n))
        """States at the sample instants, ``(N, n)``: valid up to ``recorded``."""
        self.counts[Count.SAMPLES] = samples.size
        self.counts[Count.SEGMENTS] = ends.size
        self.status = Status.PAUSED
        self._kept = (np.ascontiguousarray(p), np.ascontiguousarray(samples), ends, clamps)
        arrays = (self.reals, self.counts, *self._kept, self.states)
        self._addresses = tuple(array.ctypes.data for array in arrays)

    def advance(self, max_steps: int) -> Status:
        """Take at most ``max_steps`` accepted steps."""
        if self.status is Status.PAUSED:
            self.status = self.integrator.advance(self._addresses, max_steps)
        return self.status

    @property
    def time(self) -> float:
        """Time that the last accepted step reached, s."""
        return float(self.reals[Real.TIME])

    @property
    def state(self) -> Vector:
        """State there, ``(n,)``: a view."""
        return self._vector(state_place())

    def _vector(self, place: int) -> Vector:
        return self.reals[place : place + self.integrator.states]

    @property
    def last_step(self) -> float:
        """Length of the step tried last, s."""
        return float(self.reals[Real.TRIED])

    @property
    def recorded(self) -> int:
        """How many sample instants are written."""
        return int(self.counts[Count.SAMPLE])

    @property
    def accepted(self) -> int:
        """Steps taken."""
        return int(self.counts[Count.ACCEPTED])

    @property
    def rejected(self) -> int:
        """Steps tried and thrown away, because their error was too large."""
        return int(self.counts[Count.REJECTED])

    @property
    def evaluations(self) -> int:
        """Evaluations of the derivative."""
        return int(self.counts[Count.EVALUATIONS])

    def _stage_derivatives(self) -> Vector:
        n = self.integrator.states
        return self.reals[slope_place(n, 0) :].reshape(self.integrator.tableau.rows, n)

    def weighted_errors(self) -> Vector:
        """Error of every state in the step tried last, over what is allowed, ``(n,)`` (adaptive methods)."""
        weights = np.array(self.integrator.tableau.error)
        after = self._vector(trial_place(self.integrator.states))
        rtol, atol = self.reals[Real.RTOL], self.reals[Real.ATOL]
        error = self.last_step * (weights @ self._stage_derivatives()[: weights.size])
        return np.abs(error) / (atol + rtol * np.maximum(np.abs(self.state), np.abs(after)))

    def first_non_finite_stage(self) -> tuple[float, Vector]:
        """Time and state at which the derivative of the step tried last became NaN or infinite first."""
        tableau = self.integrator.tableau
        K, h, clamp = self._stage_derivatives(), self.last_step, self._kept[3][self.counts[Count.SEGMENT]]
        bad = [stage for stage in range(tableau.stages) if not np.isfinite(K[stage]).all()]
        stage = bad[0] if bad else tableau.stages
        row = [*tableau.matrix, tableau.weights][stage]
        state = self.state.copy()
        for weight, slope in zip(row, K):
            state += h * weight * slope
        return min(self.time + [*tableau.nodes, 1.0][stage] * h, float(clamp)), state
