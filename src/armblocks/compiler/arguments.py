"""Checks and conversion of the arrays that users pass to kernels."""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.compiler.result_memory import new_result
from armblocks.equations import Shape, Signature, Slot
from armblocks.errors import ArgumentError, InputError, UnknownArgumentError, counted

Array = NDArray[np.float64]


def check_count(name: str, signature: Signature, values: Sequence[object]) -> None:
    """Raise :class:`ArgumentError` unless there is one value per slot."""
    if len(values) != len(signature):
        raise ArgumentError(
            f"{counted(len(values), 'argument is', 'arguments are')} given",
            where=name,
            allowed=_listing(signature),
            fix=f"call {name}({', '.join(signature.names)})",
        )


def in_order(
    name: str,
    signature: Signature,
    values: Sequence[ArrayLike],
    named: Mapping[str, ArrayLike],
    options: Sequence[str] = ("out", "threads"),
) -> tuple[ArrayLike, ...]:
    """All inputs in the order of the slots: first ``values``, then ``named``.

    Raises :class:`UnknownArgumentError` for a name that is neither an input nor one of the ``options`` of
    the call, :class:`ArgumentError` for a missing or duplicate input.
    """
    remaining = signature.names[len(values) :]
    if set(named) == set(remaining):
        return (*values, *[named[slot_name] for slot_name in remaining])
    for argument in named:
        if argument not in signature.names:
            raise UnknownArgumentError(argument, [*signature.names, *options], where=name)
    duplicates = [argument for argument in named if argument not in remaining]
    missing = [slot_name for slot_name in remaining if slot_name not in named]
    raise ArgumentError(
        f"'{duplicates[0]}' is given twice" if duplicates else f"'{missing[0]}' is missing",
        where=name,
        allowed=_listing(signature),
        fix=f"call {name}({', '.join(signature.names)}), positional or by keyword",
    )


def read_input(name: str, slot: Slot, value: ArrayLike) -> Array:
    """``value`` as a float64 array of the slot's shape, or with a leading sample axis.

    Strides are kept. Raises :class:`InputError` for a wrong shape or dtype (complex, text, objects,
    booleans).
    """
    try:
        array = np.asarray(value)
    except (ValueError, TypeError) as error:
        raise InputError(
            f"'{slot.name}' cannot be read as an array: {error}",
            where=name,
            allowed=_allowed(slot),
            fix="give rows of equal length",
        ) from error
    if array.dtype.kind not in "fiu":
        raise InputError(
            f"'{slot.name}' holds {array.dtype}",
            where=name,
            allowed="real numbers: any float or integer type",
            fix="convert it with numpy.asarray(…, dtype=float)",
        )
    if array.shape != slot.shape and (array.ndim == 0 or array.shape[1:] != slot.shape):
        raise InputError(
            f"'{slot.name}' has shape {array.shape}", where=name, allowed=_allowed(slot), fix="reshape it"
        )
    return array.astype(np.float64, copy=False)


def count_samples(name: str, signature: Signature, arrays: Sequence[Array]) -> int | None:
    """The number of samples N, None if no array has samples. Raises :class:`InputError` if they disagree."""
    counts = {
        slot.name: array.shape[0] for slot, array in zip(signature, arrays) if array.ndim > len(slot.shape)
    }
    if len(set(counts.values())) > 1:
        sizes = ", ".join(f"'{slot}' {count}" for slot, count in counts.items())
        raise InputError(
            f"the inputs hold different numbers of samples: {sizes}",
            where=name,
            allowed="one number of samples; an input without a sample axis is used for all samples",
            fix="give equal numbers of samples",
        )
    return next(iter(counts.values()), None)


def new_outputs(
    name: str, signature: Signature, shapes: Sequence[Shape], out: object, inputs: Sequence[Array]
) -> tuple[list[Array], list[Array]]:
    """Arrays to write to and arrays to return: the same, unless ``out`` shares memory with an input.

    Raises :class:`InputError` unless ``out`` has the shape of the result and is float64, C-contiguous and
    writable; a tuple of such arrays for several outputs.
    """
    if out is None:
        new_arrays = [new_result(shape) for shape in shapes]
        return new_arrays, new_arrays
    arrays = cast("tuple[object, ...]", out) if isinstance(out, tuple) else (out,)
    if len(arrays) != len(signature):
        raise InputError(
            f"out= holds {counted(len(arrays), 'array')}",
            where=name,
            allowed=f"one per output: {_listing(signature)}",
            fix="omit out=, or give one array for each output",
        )
    written: list[Array] = []
    returned: list[Array] = []
    for slot, shape, array in zip(signature, shapes, arrays):
        checked = _check_output(name, slot, shape, array)
        returned.append(checked)
        aliased = any(np.may_share_memory(checked, other) for other in (*inputs, *returned[:-1]))
        written.append(np.empty(shape) if aliased else checked)
    return written, returned


def _check_output(name: str, slot: Slot, shape: Shape, array: object) -> Array:
    values = cast("Array", array)
    if not isinstance(array, np.ndarray):
        problem = f"is a {type(array).__name__}"
    elif values.dtype != np.float64 or not values.dtype.isnative:
        problem = f"holds {values.dtype.str}"
    elif values.shape != shape:
        problem = f"has shape {values.shape}"
    elif not values.flags.c_contiguous or not values.flags.aligned:
        problem = "is not C-contiguous"
    elif not values.flags.writeable:
        problem = "is read-only"
    else:
        return values
    raise InputError(
        f"out= for '{slot.name}' {problem}",
        where=name,
        allowed=f"a writable C-contiguous float64 array of shape {shape}",
        fix="omit out=, or allocate it with numpy.empty",
    )


def check_threads(name: str, threads: object) -> int:
    """The number of threads. Raises :class:`InputError` unless it is a positive integer."""
    try:
        count = 0 if isinstance(threads, bool) else operator.index(cast("int", threads))
    except TypeError:
        count = 0
    if count < 1:
        raise InputError(
            f"threads={threads!r}",
            where=name,
            allowed="a positive integer",
            fix="omit threads= for one thread",
        )
    return count


def _allowed(slot: Slot) -> str:
    if not slot.shape:
        return "a number, or shape (N,) for N samples"
    return f"shape {slot.shape}, or (N, {', '.join(map(str, slot.shape))}) for N samples"


def _listing(signature: Signature) -> str:
    return ", ".join(f"{slot.name} {slot.shape}" for slot in signature) if len(signature) else "none"
