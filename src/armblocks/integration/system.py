"""A traced system with its native code."""

from __future__ import annotations

import ctypes
import dataclasses
import json
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from armblocks.compiler import cache
from armblocks.compiler.batch import BatchLayout, Layout, emit_batch
from armblocks.compiler.cached_tapes import cached_tape, slots_from_json, slots_to_json, store_tape, tape_of
from armblocks.compiler.ir_text import Module
from armblocks.compiler.llvm_ir import emit_function
from armblocks.compiler.native import Effort, NativeCode, load_code
from armblocks.compiler.tape import Tape
from armblocks.compiler.tape_parts import is_long
from armblocks.compiler.target import host_target
from armblocks.integration.cached_jacobian import CachedJacobian, cached_jacobian
from armblocks.integration.native_integrator import NativeIntegrator
from armblocks.integration.rosenbrock_tableau import Tableau
from armblocks.integration.workspace import DelaySlots, LoopSizes

if TYPE_CHECKING:
    from armblocks.equations import HybridSystem, TracedFunction

Vector = NDArray[np.float64]

ENDING_ACTIONS = ("stop", "fail")
"""The actions of guards that end a run when they are positive."""
_PARAMETER_FUNCTIONS = ("initial_states", "initial_discrete", "initial_algebraic", "breakpoints")
_FUNCTIONS = (
    *("derivative", *_PARAMETER_FUNCTIONS, "signals", "residual", "residual_jacobian"),
    *("update", "guards", "reset"),
)
_SIGNALS_LAYOUT = BatchLayout(
    inputs=(Layout.COLUMNS, Layout.ROWS, Layout.ROWS, Layout.ROWS, Layout.SHARED), outputs=(Layout.COLUMNS,)
)


def compile_system(system: HybridSystem) -> CompiledSystem:
    """The system with native code, which is compiled, or loaded from the disk cache, at its first use.

    Raises :class:`~armblocks.errors.CompileError` if the equations use an unsupported operation.
    """
    tapes = {name: tape_of(function) for name, function in _functions(system).items()}
    return CompiledSystem(_describe(system, tapes), tapes.__getitem__, lambda: system)


def cached_system(key: str, trace: Callable[[], HybridSystem]) -> CompiledSystem:
    """The system that ``key`` identifies, from the disk cache where an earlier process compiled it.

    ``key`` must cover everything that the equations depend on, including parameter values; the sources of
    this package are added to it. ``trace()`` is only called if the key is not in the cache: otherwise neither
    tracing nor CasADi nor the LLVM optimiser is used. Raises the errors of ``trace`` and
    :func:`compile_system`.
    """
    if cache.folder() is None:
        return compile_system(trace())
    name = cache.record_name(f"system {key}")
    stored = cache.load(name)
    if stored is not None:
        try:
            description = json.loads(stored)

            def tape(function: str) -> Tape:
                return cached_tape(description["digests"][function], lambda: _functions(trace())[function])

            return CompiledSystem(description, tape, trace)
        except (ValueError, KeyError, TypeError):
            pass  # a cache entry of another version: compute it again
    system = trace()
    tapes = {name: tape_of(function) for name, function in _functions(system).items()}
    description = _describe(system, tapes)
    for tape_made in tapes.values():
        store_tape(tape_made)
    cache.store(name, json.dumps(description).encode())
    return CompiledSystem(description, tapes.__getitem__, lambda: system)


class CompiledSystem:
    """Native code of a :class:`~armblocks.equations.HybridSystem`.

    Flat vectors are laid out by the system's signatures: states ``x (nx,)``, discrete variables ``z (nz,)``,
    unknowns of implicit equations ``w (nw,)``, parameters ``p (np,)``, signals ``y (ny,)``; time in seconds.
    Array arguments must be float64 and C-contiguous; this is not checked.
    """

    def __init__(
        self, description: Mapping[str, Any], tape: Callable[[str], Tape], trace: Callable[[], HybridSystem]
    ) -> None:
        self.name = str(description["name"])
        self.states = slots_from_json(description["states"])
        self.discrete = slots_from_json(description["discrete"])
        self.algebraic = slots_from_json(description["algebraic"])
        self.parameters = slots_from_json(description["parameters"])
        self.signals_layout = slots_from_json(description["signals"])
        self.parameter_values: Vector = np.array(description["parameter_values"], dtype=np.float64)
        self.parameter_values.flags.writeable = False
        self.aliases: Mapping[str, str] = dict(description["aliases"])
        self.guard_names: tuple[str, ...] = tuple(description["guard_names"])
        self.guard_actions: tuple[str, ...] = tuple(description["guard_actions"])
        self.called: tuple[str, ...] = tuple(description["called"])
        """Blocks whose outputs are computed in Python at their ticks."""
        self.loops: tuple[tuple[str, ...], ...] = tuple(tuple(names) for names in description["loops"])
        """The signals of each linear loop that is solved symbolically."""
        self.sizes = LoopSizes(
            states=self.states.size,
            discrete=self.discrete.size,
            algebraic=self.algebraic.size,
            delays=tuple(
                DelaySlots(value=int(value), derivative=int(derivative), fixed=bool(fixed))
                for value, derivative, fixed in description["delays"]
            ),
            clocks=tuple((float(period), float(offset)) for period, offset in description["clocks"]),
            directions=tuple(int(direction) for direction in description["guard_directions"]),
            stops=tuple(
                k for k, action in enumerate(description["guard_actions"]) if action in ENDING_ACTIONS
            ),
            captures=bool(description["captures"]),
            modes=tuple(int(place) for place in description["modes"]),
            followers=tuple(bool(follows) for follows in description["followers"]),
            hysteresis_modes=tuple(
                (int(mode), int(before), int(working))
                for mode, before, working in description["hysteresis_modes"]
            ),
            recaptured_states=tuple(int(place) for place in description["recaptured_states"]),
            momentary_states=tuple(int(place) for place in description["momentary_states"]),
            disabled_guards=tuple(
                (int(guard), int(place)) for guard, place in description["disabled_guards"]
            ),
            locating_guards=tuple(int(guard) for guard in description["locating_guards"]),
            **_sizes_of_ranks(description["ranks"]),
            parameters=self.parameters.size,
            looped=bool(self.loops) or self.algebraic.size > 0,
            tangents=None if description["tangents"] is None else tuple(description["tangents"]),
        )
        self.reasons_of_invalid_values: Callable[[], Mapping[str, str]] = dict
        """Blocks whose signals can be NaN or infinite for a known reason, for error messages."""
        self._breakpoint_count = int(description["breakpoints"])
        self._digests: Mapping[str, str] = dict(description["digests"])
        self._make_tape = tape
        self._trace = trace
        self._integrators: dict[int, NativeIntegrator] = {}
        self._loaded: list[NativeCode] = []

    def tape(self, function: str) -> Tape:
        """One of the system's functions, ``derivative``, ``signals`` …, as a flat program."""
        return self._make_tape(function)

    def digest(self, function: str) -> str:
        """The digest of the tape of one of the system's functions, which identifies its equations."""
        return self._digests[function]

    def _functions_of(self, names: Sequence[str], pointers: int) -> Mapping[str, Callable[..., None]]:
        """Some of the system's functions for single points, compiled with little optimisation: calls are
        rare."""

        def write() -> str:
            module = Module()
            for name in names:
                emit_function(module, self.tape(name), name, linkage="")
            return module.text

        code = load_code(("points", *(self._digests[name] for name in names)), write, Effort.LITTLE)
        return {name: self._entry(code, name, 0, pointers) for name in names}

    def _entry(self, code: NativeCode, name: str, integers: int, pointers: int) -> Callable[..., None]:
        self._loaded.append(code)  # the code must stay alive during every call
        kind = ctypes.CFUNCTYPE(None, *[ctypes.c_int64] * integers, *[ctypes.c_void_p] * pointers)
        return kind(code.address(name))

    @cached_property
    def _start_functions(self) -> Mapping[str, Callable[..., None]]:
        return self._functions_of(_PARAMETER_FUNCTIONS, 2)

    @cached_property
    def _point_functions(self) -> Mapping[str, Callable[..., None]]:
        return self._functions_of(("derivative", *(("residual",) if self.sizes.algebraic else ())), 6)

    @cached_property
    def _update_function(self) -> Callable[..., None]:
        return self._functions_of(("update",), 7)["update"]

    @cached_property
    def _signals(self) -> Callable[..., None]:
        def write() -> str:
            module, tape = Module(), self.tape("signals")
            # Code for several lanes is compiled in addition to the code for one. For large systems the extra
            # compilation takes longer than it saves in most runs.
            lanes = 1 if is_long(tape) else host_target().lanes
            emit_batch(module, tape, _SIGNALS_LAYOUT, lanes, "signals")
            return module.text

        return self._entry(load_code(("signals", self._digests["signals"]), write), "signals", 3, 6)

    def _of_parameters(self, name: str, size: int, p: Vector) -> Vector:
        result = np.empty(size)
        if size:
            self._start_functions[name](p.ctypes.data, result.ctypes.data)
        return result

    def prepare(self, tableau: Tableau | None) -> None:
        """Compile, or load from disk, all code that a run with this method needs (``None``: no
        integration)."""
        _ = self._signals, self._start_functions
        if tableau is not None:
            self.integrator(tableau)

    @property
    def addresses(self) -> Mapping[str, int]:
        """The addresses of the functions of a run by name, for native code that calls these functions.

        The names are ``signals`` and the names of the functions of the parameters, such as
        ``initial_states``.
        """
        functions = {**self._start_functions, "signals": self._signals}
        return {
            name: ctypes.cast(cast("Any", call), ctypes.c_void_p).value or 0
            for name, call in functions.items()
        }

    @property
    def breakpoint_count(self) -> int:
        """The number of times at which sources jump."""
        return self._breakpoint_count

    def initial_states(self, p: Vector) -> Vector:
        """``x(0)``, ``(nx,)``, for parameters ``p`` ``(np,)``."""
        return self._of_parameters("initial_states", self.states.size, p)

    def initial_discrete(self, p: Vector) -> Vector:
        """``z(0)``, ``(nz,)``, before the first ticks."""
        return self._of_parameters("initial_discrete", self.discrete.size, p)

    def initial_algebraic(self, p: Vector) -> Vector:
        """The first guess of ``w``, ``(nw,)``."""
        return self._of_parameters("initial_algebraic", self.algebraic.size, p)

    def breakpoints(self, p: Vector) -> Vector:
        """Times at which sources jump, ``(nb,)`` s, in any order."""
        return self._of_parameters("breakpoints", self._breakpoint_count, p)

    def _at_point(self, name: str, size: int, t: float, vectors: tuple[Vector, ...]) -> Vector:
        result = np.empty(size)
        if size:
            time = np.array([t], dtype=np.float64)
            addresses = [vector.ctypes.data for vector in (time, *vectors, result)]
            self._point_functions[name](*addresses)
        return result

    def derivative(self, t: float, x: Vector, z: Vector, w: Vector, p: Vector) -> Vector:
        """``x'``, ``(nx,)``, at one time."""
        return self._at_point("derivative", self.states.size, t, (x, z, w, p))

    def residual(self, t: float, x: Vector, z: Vector, w: Vector, p: Vector) -> Vector:
        """Residual ``(nw,)`` at one time: zero if ``w`` solves the implicit equations."""
        return self._at_point("residual", self.algebraic.size, t, (x, z, w, p))

    def updated(self, t: float, x: Vector, z: Vector, w: Vector, p: Vector, m: Vector) -> Vector:
        """``z``, ``(nz,)``, after a tick of the clocks that ``m (nm,)`` marks with 1."""
        result = np.empty(self.discrete.size)
        time = np.array([t], dtype=np.float64)
        self._update_function(*(vector.ctypes.data for vector in (time, x, z, w, p, m, result)))
        return result

    def evaluate_signals(self, t: Vector, x: Vector, z: Vector, w: Vector, p: Vector) -> Vector:
        """Signals ``(ny, N)`` at N times, several in each vector instruction.

        ``t (N,)``, ``x (N, nx)``, ``z (N, nz)``, ``w (N, nw)``, ``p (np,)``.
        """
        y = np.empty((self.signals_layout.size, t.size))
        if y.size:
            addresses = [array.ctypes.data for array in (t, x, z, w, p, y)]
            self._signals(0, t.size, t.size, *addresses)
        return y

    def loop_matrices(self, t: Vector, x: Vector, z: Vector, w: Vector, p: Vector) -> list[Vector]:
        """The matrices ``(N, n, n)`` of the equations of each loop with n signals, at N times.

        The tape is interpreted: condition numbers are needed at few times, and compilation would take longer.
        """
        from armblocks.compiler.interpret import interpret

        (entries,) = interpret(self.tape("loop_matrices"), [t[:, None], x, z, w, p], fused=False)
        sizes = [len(names) for names in self.loops]
        parts = np.split(entries, np.cumsum([size**2 for size in sizes])[:-1], axis=-1)
        return [part.reshape(t.size, size, size) for part, size in zip(parts, sizes)]

    @cached_property
    def _flow_jacobian(self) -> CachedJacobian:
        return cached_jacobian(self._digests["derivative"], self._digests["residual"], self._trace)

    def integrator(self, tableau: Tableau) -> NativeIntegrator:
        """The native loop that integrates this system with a method; created once for each method."""
        integrator = self._integrators.get(id(tableau))
        if integrator is None:
            # The integrator keeps its tableau alive, so no other tableau can get the same identity.
            if not tableau.needs_jacobian:
                integrator = NativeIntegrator(self.sizes, self._digests, self.tape, tableau)
            else:
                jacobian = self._flow_jacobian
                digests = {**self._digests, "flow_jacobian": jacobian.digest}

                def tape(function: str) -> Tape:
                    return jacobian.tape() if function == "flow_jacobian" else self.tape(function)

                integrator = NativeIntegrator(self.sizes, digests, tape, tableau, jacobian.pattern)
            self._integrators[id(tableau)] = integrator
        return integrator


def _functions(system: HybridSystem) -> dict[str, TracedFunction]:
    """All functions of a system by name."""
    functions: dict[str, TracedFunction] = {name: getattr(system, name) for name in _FUNCTIONS}
    if system.contradictions is not None:
        # One native function, because both need the same signals.
        functions["guards"] = system.guards.joined(system.contradictions)
    if system.delays is not None:
        functions["delay_inputs"] = system.delays.inputs
        functions["delay_times"] = system.delays.times
        functions["delay_bounds"] = system.delays.bounds
    if system.loops is not None:
        functions["loop_matrices"] = system.loops.matrices
    return functions


def _sizes_of_ranks(ranks: Mapping[str, Any] | None) -> dict[str, Any]:
    """The fields of ``LoopSizes`` for the ranks of events."""
    if ranks is None:
        return {}
    return {
        "ranks_before_ticks": tuple(int(rank) for rank in ranks["before_ticks"]),
        "guard_ranks": tuple(int(rank) for rank in ranks["guards"]),
        "hysteresis_ranks": tuple(int(rank) for rank in ranks["hysteresis_modes"]),
        "recaptured_ranks": tuple(int(rank) for rank in ranks["recaptured_states"]),
        "controls": tuple((int(mode), int(old), int(rank)) for mode, old, rank in ranks["controls"]),
    }


def _describe(system: HybridSystem, tapes: Mapping[str, Tape]) -> dict[str, Any]:
    """All of a system except its equations, as plain values that JSON reproduces exactly."""

    return {
        "name": system.name,
        "states": slots_to_json(system.states),
        "discrete": slots_to_json(system.discrete),
        "algebraic": slots_to_json(system.algebraic),
        "clocks": [[clock.period, clock.offset] for clock in system.clocks],
        "captures": system.captures,
        "modes": list(system.modes),
        "followers": list(system.followers),
        "hysteresis_modes": [list(places) for places in system.hysteresis_modes],
        "recaptured_states": list(system.recaptured_states),
        "momentary_states": list(system.momentary_states),
        "disabled_guards": [list(places) for places in system.disabled_guards],
        "locating_guards": list(system.locating_guards),
        "ranks": None if system.ranks is None else dataclasses.asdict(system.ranks),
        "tangents": system.tangents,
        "guard_directions": list(system.guard_directions),
        "guard_names": list(system.guard_names),
        "guard_actions": list(system.guard_actions),
        "called": list(system.called),
        "delays": []
        if system.delays is None
        else list(zip(system.delays.values, system.delays.derivatives, system.delays.fixed)),
        "loops": [] if system.loops is None else [list(names) for names in system.loops.signals],
        "parameters": slots_to_json(system.parameters),
        "signals": slots_to_json(system.signals_layout),
        "parameter_values": np.asarray(system.parameter_values, dtype=np.float64).tolist(),
        "aliases": dict(system.aliases),
        "breakpoints": system.breakpoints.outputs.size,
        "digests": {name: tape.digest for name, tape in tapes.items()},
    }
