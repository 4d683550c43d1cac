"""Storage of tapes in the disk cache, and conversion of signatures to JSON."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from armblocks.compiler import cache
from armblocks.compiler.tape import Tape
from armblocks.equations import Signature, Slot
from armblocks.errors import CompileError

if TYPE_CHECKING:
    from armblocks.equations import TracedFunction


def tape_of(traced: TracedFunction) -> Tape:
    """The tape of a traced function. CasADi is imported at the first call."""
    from armblocks.compiler.from_casadi import tape_from

    return tape_from(traced)


def store_tape(tape: Tape) -> None:
    """Store a tape in the disk cache under its digest."""
    cache.store(_cache_name(tape.digest), tape.to_bytes())


def cached_tape(digest: str, trace: Callable[[], TracedFunction]) -> Tape:
    """The tape with this digest, from the disk cache.

    A missing or damaged tape is computed from ``trace()``.
    """
    stored = cache.load(_cache_name(digest))
    if stored is not None:
        try:
            return Tape.from_bytes(stored)
        except CompileError:
            pass
    return tape_of(trace())


def slots_to_json(signature: Signature) -> list[list[Any]]:
    """A signature as a JSON list, with a row ``[name, shape, unit]`` for each slot."""
    return [[slot.name, list(slot.shape), slot.unit] for slot in signature]


def slots_from_json(slots: Sequence[Sequence[Any]]) -> Signature:
    """Inverse of :func:`slots_to_json`. Raises ``TypeError`` or ``ValueError`` for other rows."""
    return Signature(tuple(Slot(name, tuple(shape), unit) for name, shape, unit in slots))


def _cache_name(digest: str) -> str:
    return cache.object_name(("tape", digest))
