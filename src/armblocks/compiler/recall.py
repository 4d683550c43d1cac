"""Kernels by a key that an earlier process knew: no tracing, no CasADi, no LLVM optimiser."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from armblocks.compiler import cache
from armblocks.compiler.kernel import Kernel
from armblocks.compiler.tape import Tape
from armblocks.equations import Signature, Slot
from armblocks.errors import CompileError

if TYPE_CHECKING:
    from armblocks.equations import TracedFunction


def recall(key: str, trace: Callable[[], TracedFunction]) -> Kernel:
    """The kernel of the equations that ``key`` identifies.

    ``key`` must say everything that the equations depend on (which ones, and all numbers traced into them);
    the sources of this package are added to it. ``trace()`` is only called when the disk cache does not
    know the key. Raises what ``trace`` and :func:`~armblocks.compiler.compile_function` raise.
    """
    name = cache.record_name(key)
    record = cache.load(name)
    kernel = _read(record, key, trace) if record is not None else None
    if kernel is None:
        traced = trace()
        tape = _tape_of(traced)
        cache.store(_tape_name(tape.digest), tape.to_bytes())
        cache.store(name, _write(traced, tape.digest))
        kernel = Kernel(traced.name, traced.inputs, traced.outputs, tape.digest, lambda: tape)
    return kernel


def _tape_of(traced: TracedFunction) -> Tape:
    from armblocks.compiler.from_casadi import tape_from

    return tape_from(traced)


def _tape_name(digest: str) -> str:
    return cache.object_name(("tape", digest))


def _write(traced: TracedFunction, digest: str) -> bytes:
    def slots(signature: Signature) -> list[Any]:
        return [[slot.name, slot.shape, slot.unit] for slot in signature]

    record = {
        "name": traced.name,
        "inputs": slots(traced.inputs),
        "outputs": slots(traced.outputs),
        "tape": digest,
    }
    return json.dumps(record).encode()


def _read(data: bytes, key: str, trace: Callable[[], TracedFunction]) -> Kernel | None:
    def signature(slots: Sequence[Any]) -> Signature:
        return Signature(tuple(Slot(name, tuple(shape), unit) for name, shape, unit in slots))

    try:
        record = json.loads(data)
        inputs, outputs = signature(record["inputs"]), signature(record["outputs"])
        name, digest = str(record["name"]), str(record["tape"])
    except (ValueError, KeyError, TypeError):
        return None

    def tape() -> Tape:
        stored = cache.load(_tape_name(digest))
        if stored is not None:
            try:
                return Tape.from_bytes(stored)
            except CompileError:
                pass
        return _tape_of(trace())

    return Kernel(name, inputs, outputs, digest, tape)
