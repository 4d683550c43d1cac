"""Kernels from the disk cache by key: without tracing, CasADi or the LLVM optimiser."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING

from armblocks.compiler import cache
from armblocks.compiler.cached_tapes import cached_tape, slots_from_json, slots_to_json, store_tape, tape_of
from armblocks.compiler.kernel import Kernel

if TYPE_CHECKING:
    from armblocks.equations import TracedFunction


def cached_kernel(key: str, trace: Callable[[], TracedFunction]) -> Kernel:
    """The kernel of the equations that ``key`` identifies.

    ``key`` must cover everything that the equations depend on (their type, and all numbers traced into them);
    the sources of this package are added to it. ``trace()`` is called only if the record of the key
    or its tape is missing in the disk cache. Raises the errors of ``trace`` and of
    :func:`~armblocks.compiler.compile_function`.
    """
    name = cache.record_name(key)
    record = cache.load(name)
    kernel = _kernel_of(record, trace) if record is not None else None
    if kernel is None:
        traced = trace()
        tape = tape_of(traced)
        store_tape(tape)
        cache.store(name, _record_of(traced, tape.digest))
        kernel = Kernel(traced.name, traced.inputs, traced.outputs, tape.digest, lambda: tape)
    return kernel


def _record_of(traced: TracedFunction, digest: str) -> bytes:
    record = {
        "name": traced.name,
        "inputs": slots_to_json(traced.inputs),
        "outputs": slots_to_json(traced.outputs),
        "tape": digest,
    }
    return json.dumps(record).encode()


def _kernel_of(data: bytes, trace: Callable[[], TracedFunction]) -> Kernel | None:
    try:
        record = json.loads(data)
        inputs, outputs = slots_from_json(record["inputs"]), slots_from_json(record["outputs"])
        name, digest = str(record["name"]), str(record["tape"])
    except (ValueError, KeyError, TypeError):
        return None
    return Kernel(name, inputs, outputs, digest, lambda: cached_tape(digest, trace))
