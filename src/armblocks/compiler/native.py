"""Machine code of IR text in this process, with the disk cache."""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
import threading
from collections.abc import Callable, Sequence
from enum import Enum
from functools import cache as once
from typing import TYPE_CHECKING

from armblocks.compiler import cache
from armblocks.compiler.target import Target, host_target
from armblocks.errors import InputError

if TYPE_CHECKING:
    from llvmlite import binding as llvm

LONG_MODULE, VERY_LONG_MODULE = 8_000, 100_000
"""Numbers of IR lines from which on optimisation is reduced: memory access limits the speed of such code."""

_LOCK = threading.Lock()  # LLVM's global context is not thread-safe


class NativeCode:
    """Loaded machine code. It stays in memory as long as this object lives."""

    def __init__(self, engine: llvm.ExecutionEngine) -> None:
        self._engine = engine

    def address(self, symbol: str) -> int:
        """Address of an external function or variable. Raises ``KeyError`` for an unknown symbol."""
        with _LOCK:
            engine = self._engine
            address = engine.get_function_address(symbol) or engine.get_global_value_address(symbol)
        if not address:
            raise KeyError(symbol)
        return address


class Effort(Enum):
    """LLVM's optimisation effort for a module: it changes the speed of the code, not its results."""

    LITTLE = 0
    """For code that runs a few times: no passes, fast register allocation."""
    FULL = 1
    """For code that runs often: passes according to the length of the module."""


def allowed_effort() -> Effort:
    """The maximum effort by ``$ARMBLOCKS_EFFORT``: ``little`` or ``full`` (the default).

    Raises ``InputError`` for another word.
    """
    requested = os.environ.get("ARMBLOCKS_EFFORT") or Effort.FULL.name.lower()
    for effort in Effort:
        if effort.name.lower() == requested:
            return effort
    raise InputError(
        f"'{requested}' is not a valid effort",
        where="the environment variable ARMBLOCKS_EFFORT",
        allowed=", ".join(f"'{effort.name.lower()}'" for effort in Effort),
        fix="set one of these, or remove the variable for fast code",
    )


def load_code(key: Sequence[str], write: Callable[[], str], effort: Effort = Effort.FULL) -> NativeCode:
    """Machine code of the module whose IR text ``write()`` returns.

    ``key`` identifies the module: the name of the variant, tape digests, options, everything that the text
    depends on. Target and versions are added here. If the disk cache contains the key, ``write`` is not
    called. ``ARMBLOCKS_EFFORT=little`` limits the effort. Raises ``InputError`` for any other value of this
    variable.
    """
    target, effort = host_target(), Effort(min(effort.value, allowed_effort().value))
    name = cache.object_name((*key, effort.name, target.key))
    code = cache.load(name)
    if code is not None:
        try:
            return _link(code, target)
        except RuntimeError:
            pass  # LLVM cannot read the cached object: compile it again
    code = compile_object(write(), target, effort=effort)
    cache.store(name, code)
    return _link(code, target)


def compile_object(text: str, target: Target, *, jit: bool = True, effort: Effort = Effort.FULL) -> bytes:
    """Optimise IR text and return an object file for the target."""
    from llvmlite import binding as llvm

    with _LOCK:
        lines = text.count("\n")
        level = (
            0 if effort is Effort.LITTLE or lines >= VERY_LONG_MODULE else 1 if lines >= LONG_MODULE else 2
        )
        machine = target.machine(jit=jit, opt=level)
        module = llvm.parse_assembly(text)
        module.triple = target.triple
        module.data_layout = str(machine.target_data)
        if level == 2:
            module.verify()
            _optimise(module, machine)
        elif effort is Effort.FULL:
            _simplify(module, machine)
        return machine.emit_object(module)


def _optimise(module: llvm.ModuleRef, machine: llvm.TargetMachine) -> None:
    """Run all passes that make straight-line code faster."""
    from llvmlite import binding as llvm

    tuning = llvm.create_pipeline_tuning_options(speed_level=2)
    # The code is already vectorised; these passes would only take time.
    tuning.slp_vectorization = False
    tuning.loop_vectorization = False
    tuning.loop_unrolling = False
    builder = llvm.create_pass_builder(machine, tuning)
    builder.getModulePassManager().run(module, builder)


def _simplify(module: llvm.ModuleRef, machine: llvm.TargetMachine) -> None:
    """Run the two passes with the largest effect on loops around long code: SROA and CFG simplification."""
    from llvmlite import binding as llvm

    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=1))
    passes = llvm.create_new_function_pass_manager()
    passes.add_sroa_pass()
    passes.add_simplify_cfg_pass()
    for function in module.functions:
        if not function.is_declaration:
            passes.run(function, builder)


def _link(code: bytes, target: Target) -> NativeCode:
    from llvmlite import binding as llvm

    with _LOCK:
        _provide_runtime()
        engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), target.machine())
        engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        engine.finalize_object()
    return NativeCode(engine)


@once
def _provide_runtime() -> None:
    """Define the addresses of the few C functions that LLVM may call but cannot find by itself.

    Processors without fused multiply-add or rounding instructions (x86-64 before 2013) need ``fma`` and
    ``floor``, both exact in any C library; long work spaces come from ``malloc``; Windows checks large stack
    frames.
    """
    from llvmlite import binding as llvm

    libraries: tuple[str | None, ...]
    names: tuple[str, ...]
    if sys.platform == "win32":
        libraries, names = ("ucrtbase", "vcruntime140", "ntdll"), ("__chkstk",)
    else:
        libraries, names = (None,), ()  # the libraries of the process include the C library
    for name in ("fma", "floor", "ceil", "memcpy", "memmove", "memset", "malloc", "free", *names):
        for library in libraries if llvm.address_of_symbol(name) is None else ():
            with contextlib.suppress(OSError, AttributeError):
                function = getattr(ctypes.CDLL(library), name)
                llvm.add_symbol(name, ctypes.cast(function, ctypes.c_void_p).value or 0)
                break
