"""The Jacobian of a system's derivative: differentiated at the first use by a stiff solver, cached on
disk."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from armblocks.compiler import cache
from armblocks.compiler.cached_tapes import cached_tape, store_tape, tape_of
from armblocks.compiler.tape import Tape
from armblocks.integration.elimination_plan import JacobianPattern

if TYPE_CHECKING:
    from armblocks.equations import FlowJacobian, HybridSystem


@dataclass(frozen=True, kw_only=True)
class CachedJacobian:
    """The sparsity pattern, and the digest of the tape that computes the entries."""

    pattern: JacobianPattern
    digest: str
    tape: Callable[[], Tape]


def cached_jacobian(derivative: str, residual: str, trace: Callable[[], HybridSystem]) -> CachedJacobian:
    """The Jacobian of the flow whose tapes have these digests.

    The system is traced, and CasADi is loaded, only if the result is not in the disk cache.
    """
    name = cache.object_name(("flow_jacobian", derivative, residual))
    stored = cache.load(name)
    if stored is not None:
        try:
            entry = json.loads(stored)
            pattern = JacobianPattern(
                states=int(entry["states"]),
                size=int(entry["size"]),
                rows=tuple(entry["rows"]),
                columns=tuple(entry["columns"]),
            )
            digest = str(entry["digest"])
            tape = lambda: cached_tape(digest, lambda: _traced(trace).function)  # noqa: E731
            return CachedJacobian(pattern=pattern, digest=digest, tape=tape)
        except (ValueError, KeyError, TypeError):
            pass  # a cache entry of another version: compute it again
    traced = _traced(trace)
    new_tape = tape_of(traced.function)
    states, size = (slot.size for slot in (traced.function.inputs["x"], traced.function.outputs["T"]))
    pattern = JacobianPattern(states=states, size=size, rows=traced.rows, columns=traced.columns)
    store_tape(new_tape)
    record = {
        "states": states,
        "size": size,
        "rows": pattern.rows,
        "columns": pattern.columns,
        "digest": new_tape.digest,
    }
    cache.store(name, json.dumps(record).encode())
    return CachedJacobian(pattern=pattern, digest=new_tape.digest, tape=lambda: new_tape)


def _traced(trace: Callable[[], HybridSystem]) -> FlowJacobian:
    from armblocks.equations import trace_flow_jacobian

    return trace_flow_jacobian(trace())
