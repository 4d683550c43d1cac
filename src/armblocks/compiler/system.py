"""A traced system with its native code: what a simulation runs."""

from __future__ import annotations

import ctypes
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from armblocks.compiler.batch import BatchLayout, Layout, emit_batch
from armblocks.compiler.butcher_tableau import ButcherTableau
from armblocks.compiler.from_casadi import tape_from
from armblocks.compiler.ir_text import Module
from armblocks.compiler.llvm_ir import emit_function
from armblocks.compiler.native import NativeCode, load_code
from armblocks.compiler.native_integrator import NativeIntegrator
from armblocks.compiler.tape import Tape
from armblocks.compiler.target import host_target
from armblocks.equations import HybridSystem, Signature

Vector = NDArray[np.float64]

_SIGNALS_LAYOUT = BatchLayout(inputs=(Layout.COLUMNS, Layout.ROWS, Layout.SHARED), outputs=(Layout.COLUMNS,))


def compile_system(system: HybridSystem) -> CompiledSystem:
    """The system, ready to be run. Machine code is made, or found in the disk cache, when first needed."""
    return CompiledSystem(system)


class CompiledSystem:
    """Native code of a :class:`~armblocks.equations.HybridSystem`.

    Flat vectors are laid out by the system's signatures: states ``x (nx,)``, parameters ``p (np,)``, signals
    ``y (ny,)``; time in seconds. Arrays that are given are float64 and C-contiguous, and nothing is checked.
    """

    def __init__(self, system: HybridSystem) -> None:
        self.name = system.name
        self.states: Signature = system.states
        self.parameters: Signature = system.parameters
        self.signals_layout: Signature = system.signals_layout
        self.parameter_values: Vector = np.array(system.parameter_values, dtype=np.float64)
        self.parameter_values.flags.writeable = False
        self.aliases = system.aliases
        self._system = system
        self._integrators: dict[int, NativeIntegrator] = {}

    @cached_property
    def derivative_tape(self) -> Tape:
        """The derivative as a flat program."""
        return tape_from(self._system.derivative)

    @cached_property
    def signals_tape(self) -> Tape:
        """The signals as a flat program."""
        return tape_from(self._system.signals)

    @cached_property
    def _code(self) -> NativeCode:
        tapes = {
            "derivative": self.derivative_tape,
            "initial_states": tape_from(self._system.initial_states),
            "breakpoints": tape_from(self._system.breakpoints),
        }

        def write() -> str:
            module = Module()
            for name, tape in tapes.items():
                emit_function(module, tape, name, linkage="")
            emit_batch(module, self.signals_tape, _SIGNALS_LAYOUT, host_target().lanes, "signals")
            return module.text

        digests = (tape.digest for tape in (*tapes.values(), self.signals_tape))
        return load_code(("system", *digests), write)

    def _entry(self, name: str, integers: int, pointers: int) -> ctypes._CFunctionType:  # pyright: ignore
        kind = ctypes.CFUNCTYPE(None, *[ctypes.c_int64] * integers, *[ctypes.c_void_p] * pointers)
        return kind(self._code.address(name))

    @cached_property
    def _derivative(self) -> ctypes._CFunctionType:  # pyright: ignore
        return self._entry("derivative", 0, 4)

    @cached_property
    def _signals(self) -> ctypes._CFunctionType:  # pyright: ignore
        return self._entry("signals", 3, 4)

    def initial_states(self, p: Vector) -> Vector:
        """``x(0)``, ``(nx,)``, for parameters ``p`` ``(np,)``."""
        x = np.empty(self.states.size)
        self._entry("initial_states", 0, 2)(p.ctypes.data, x.ctypes.data)
        return x

    def breakpoints(self, p: Vector) -> Vector:
        """Known instants at which signals jump, ``(nb,)`` s, in no order."""
        times = np.empty(self._system.breakpoints.outputs.size)
        if times.size:
            self._entry("breakpoints", 0, 2)(p.ctypes.data, times.ctypes.data)
        return times

    def derivative(self, t: float, x: Vector, p: Vector) -> Vector:
        """``x'``, ``(nx,)``, at one instant."""
        slope = np.empty(self.states.size)
        self._derivative(ctypes.byref(ctypes.c_double(t)), x.ctypes.data, p.ctypes.data, slope.ctypes.data)
        return slope

    def evaluate_signals(self, t: Vector, x: Vector, p: Vector) -> Vector:
        """Signals ``(ny, N)`` at many instants, several at a time: ``t (N,)``, ``x (N, nx)``, ``p (np,)``."""
        y = np.empty((self.signals_layout.size, t.size))
        if y.size:
            self._signals(0, t.size, t.size, t.ctypes.data, x.ctypes.data, p.ctypes.data, y.ctypes.data)
        return y

    def integrator(self, tableau: ButcherTableau) -> NativeIntegrator:
        """The native loop that steps this system by a method; made once."""
        found = self._integrators.get(id(tableau))
        if found is None:
            # The integrator keeps its tableau alive, so the identity stays its own.
            found = self._integrators[id(tableau)] = NativeIntegrator(self.derivative_tape, tableau)
        return found
