"""Kernels: traced functions as native code, called with NumPy arrays."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.compiler.arguments import (
    check_count,
    check_threads,
    count_samples,
    in_order,
    new_outputs,
    read_input,
)
from armblocks.compiler.batch_threads import Shares, evaluate_in_threads, useful_threads
from armblocks.compiler.entry import ENTRY, TABLE, Maker, make_entry, offer_batch
from armblocks.compiler.layout import BatchLayout, Layout
from armblocks.compiler.native import NativeCode, load_code
from armblocks.compiler.tape import OperationCount, Tape
from armblocks.compiler.target import host_target
from armblocks.equations import Shape, Signature

if TYPE_CHECKING:
    from armblocks.equations import TracedFunction

Array = NDArray[np.float64]

_ROWS, _COLUMNS, _SHARED = Layout.ROWS.value, Layout.COLUMNS.value, Layout.SHARED.value


def compile_function(traced: TracedFunction) -> Kernel:
    """The kernel of a traced function. Machine code is compiled at the first call, or loaded from the cache.

    Raises :class:`~armblocks.errors.CompileError` if the equations use an unsupported operation.
    """
    from armblocks.compiler.from_casadi import tape_from

    tape = tape_from(traced)
    return Kernel(traced.name, traced.inputs, traced.outputs, tape.digest, lambda: tape)


class Kernel:
    """``outputs = kernel(*inputs)`` in native code.

    ``name``, ``inputs`` and ``outputs`` are copied from the traced function. Results do not depend on the
    number of samples or threads.
    """

    def __init__(
        self, name: str, inputs: Signature, outputs: Signature, digest: str, tape: Callable[[], Tape]
    ) -> None:
        self.name = name
        self.inputs = inputs
        self.outputs = outputs
        self._digest = digest
        self._make_tape = tape
        self._batches: dict[str, tuple[Callable[..., None], Shares]] = {}
        self._loaded: dict[str, NativeCode] = {}  # code that contains the functions above
        self._lock = threading.RLock()

    @cached_property
    def tape(self) -> Tape:
        """The scalar operations of one evaluation."""
        return self._make_tape()

    @property
    def digest(self) -> str:
        """The digest of the tape, which identifies the equations."""
        return self._digest

    @property
    def count(self) -> OperationCount:
        """The numbers of multiplications, additions, functions and other operations of one evaluation."""
        return self.tape.count

    @cached_property
    def entry(self) -> Callable[..., Any]:
        """A builtin with the same arguments as the kernel; the fastest way to call it."""
        return self.entry_with_fallback(self.__call__)

    def entry_with_fallback(
        self, fallback: Callable[..., Any], maker: Maker | None = None
    ) -> Callable[..., Any]:
        """A builtin like :attr:`entry` with another ``fallback``.

        It handles plain arrays, ``out=`` and ``threads=1``. All other calls, including keyword inputs, go to
        ``fallback`` unchanged. For pickling, ``maker`` creates the object of which the builtin is an
        attribute.
        """
        options = "*, out=None, threads=1"
        names = ", ".join(self.inputs.names)
        shapes = ", ".join(f"{slot.name} {slot.shape}" for slot in self.inputs)
        results = ", ".join(f"{slot.name} {slot.shape}" for slot in self.outputs)
        doc = f"{self.name}({names}, {options})\n--\n\n{shapes} -> {results}; or N samples of each."
        with self._lock:
            code = self._single
            for key in self._batches:
                self._offer_batch(code, key)
            return make_entry(
                name=self.name,
                doc=doc,
                address=code.address(ENTRY),
                table=code.address(TABLE),
                fallback=fallback,
                code=(self, code),
                maker=maker,
            )

    def __call__(self, *arrays: ArrayLike, out: object = None, threads: int = 1, **named: ArrayLike) -> Any:
        """Evaluate one sample or a batch.

        Inputs come in order or by name. Each has its slot's shape, or ``(N, *shape)``; an input without a
        sample axis is used for all samples. Any float or integer dtype and any strides are accepted;
        C-contiguous float64 is read in place. ``out`` receives the result: an array of the shape of the
        result, or a tuple of arrays for several outputs; it may be one of the inputs. ``threads`` is the
        number of threads for a batch.

        Returns one array per output, of the slot's shape or ``(N, *shape)``; a ``numpy.float64`` for one
        scalar. Raises :class:`~armblocks.errors.InputError` for wrong counts, shapes, dtypes and options.
        """
        if named:
            return self.entry(*in_order(self.name, self.inputs, arrays, named), out=out, threads=threads)
        return self._run(arrays, out, threads, columns=False)

    def columns(self, *arrays: ArrayLike, out: object = None, threads: int = 1) -> Any:
        """Evaluate a batch into arrays of column layout: ``(*shape, N)`` for each output.

        Inputs as for a call; at least one must have a sample axis. An input ``(N, n)`` that is the
        transpose of a C-contiguous ``(n, N)`` array is read in place too.
        """
        return self._run(arrays, out, threads, columns=True)

    def _run(self, values: Sequence[ArrayLike], out: object, threads: object, *, columns: bool) -> Any:
        workers = check_threads(self.name, threads)
        check_count(self.name, self.inputs, values)
        arrays = [read_input(self.name, slot, value) for slot, value in zip(self.inputs, values)]
        samples = count_samples(self.name, self.inputs, arrays)
        shapes = [_result_shape(slot.shape, samples, columns=columns) for slot in self.outputs]
        written, results = new_outputs(self.name, self.outputs, shapes, out, arrays)
        if samples is None:
            arrays = [_in_place(array) for array in arrays]
            self._evaluate(*(_address(array) for array in (*arrays, *written)))
        else:
            key, arrays = self._lay_out(arrays, columns=columns)
            batch, shares = self._batches.get(key) or self._load_batch(key)
            addresses = [_address(array) for array in (*arrays, *written)]
            workers = useful_threads(samples, workers)
            if workers == 1:
                batch(0, samples, samples, *addresses)
            else:
                evaluate_in_threads(shares, samples, addresses, workers, code=self)
        for source, result in zip(written, results):
            if source is not result:
                result[...] = source
        if out is None:
            results = [result if result.ndim else result[()] for result in results]
        return results[0] if len(results) == 1 else tuple(results)

    def _lay_out(self, arrays: Sequence[Array], *, columns: bool) -> tuple[str, list[Array]]:
        """The key of the batch layout, and the arrays in this layout."""
        key = ""
        laid_out: list[Array] = []
        for slot, array in zip(self.inputs, arrays):
            shared = array.ndim == len(slot.shape)
            in_columns = columns and not shared and array.ndim == 2 and array.flags.f_contiguous
            if in_columns and array.flags.aligned and not array.flags.c_contiguous:
                key += _COLUMNS
                laid_out.append(array.T)
            else:
                key += _SHARED if shared else _ROWS
                laid_out.append(_in_place(array))
        return f"{key}>{(_COLUMNS if columns else _ROWS) * len(self.outputs)}", laid_out

    @cached_property
    def _single(self) -> NativeCode:
        def write() -> str:
            from armblocks.compiler.entry_function import emit_entry
            from armblocks.compiler.ir_text import Module
            from armblocks.compiler.llvm_ir import emit_function

            module = Module()
            emit_function(module, self.tape, "evaluate", linkage="")
            emit_entry(module, self.inputs, self.outputs, "evaluate")
            return module.text

        shapes = repr([[slot.shape for slot in signature] for signature in (self.inputs, self.outputs)])
        return load_code(("single", self._digest, shapes), write)

    @cached_property
    def _evaluate(self) -> Callable[..., None]:
        with self._lock:
            code = self._single
        prototype = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * (len(self.inputs) + len(self.outputs)))
        return prototype(code.address("evaluate"))

    def _load_batch(self, key: str) -> tuple[Callable[..., None], Shares]:
        with self._lock:
            if key not in self._batches:
                code = load_code(("batch", self._digest, key), lambda: self._write_batch(key))
                pointers = [ctypes.c_void_p] * (len(self.inputs) + len(self.outputs))
                batch = ctypes.CFUNCTYPE(None, *[ctypes.c_int64] * 3, *pointers)
                shares = ctypes.CFUNCTYPE(None, ctypes.c_void_p, *[ctypes.c_int64] * 2, *pointers)
                self._loaded[key] = code
                self._batches[key] = batch(code.address("batch")), shares(code.address("batch.shares"))
                if "_single" in self.__dict__:
                    self._offer_batch(self._single, key)
            return self._batches[key]

    def _offer_batch(self, single: NativeCode, key: str) -> None:
        """Make the batch function available to the builtins in ``single``, unless a layout has columns."""
        inputs = key[: len(self.inputs)]
        if _COLUMNS not in key:
            address = self._loaded[key].address("batch")
            offer_batch(single, [kind == _ROWS for kind in inputs], address)

    def _write_batch(self, key: str) -> str:
        from armblocks.compiler.batch import emit_batch, emit_shares, pointer_names
        from armblocks.compiler.ir_text import Module

        module = Module()
        emit_batch(module, self.tape, BatchLayout.of(key), host_target().lanes, "batch")
        emit_shares(module, pointer_names(self.tape), "batch")
        return module.text

    def __repr__(self) -> str:
        inputs = ", ".join(f"{slot.name} {slot.shape}" for slot in self.inputs)
        outputs = ", ".join(f"{slot.name} {slot.shape}" for slot in self.outputs)
        return f"<Kernel {self.name}: {inputs} -> {outputs}>"


def _result_shape(shape: Shape, samples: int | None, *, columns: bool) -> Shape:
    if samples is None:
        return shape
    return (*shape, samples) if columns else (samples, *shape)


def _in_place(array: Array) -> Array:
    """The array, or a C-contiguous aligned copy."""
    flags = array.flags
    return array if flags.c_contiguous and flags.aligned else array.copy(order="C")


def _address(array: Array) -> int:
    return array.__array_interface__["data"][0]
