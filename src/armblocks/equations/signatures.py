"""The layout of named quantities in flat vectors.

A ``Slot`` is one named quantity; a ``Signature`` is an ordered set of them. In a flat vector the slots are
contiguous, and matrices are row-major (C order), so that ``numpy.reshape`` converts them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.errors import InputError, UnknownNameError

Shape = tuple[int, ...]
"""``()`` a scalar, ``(n,)`` a vector, ``(m, n)`` a matrix, ``(k, m, n)`` a stack of matrices."""


@dataclass(frozen=True)
class Slot:
    """One named quantity: its shape and its SI unit (``""`` if it has none or its entries differ).

    ``entries`` are the names of the entries of a vector, such as joint names; without names they are
    numbered. ``title`` is the name that a user has given to the signal.
    """

    name: str
    shape: Shape = ()
    unit: str = ""
    entries: tuple[str, ...] = ()
    title: str = ""

    @property
    def size(self) -> int:
        """Number of scalars."""
        return math.prod(self.shape)

    @property
    def elements(self) -> tuple[str, ...]:
        """A name for each scalar, row by row: ``clock/y``; ``fkine/T[0,3]``; ``rne/tau[elbow]``, …"""
        if not self.shape:
            return (self.name,)
        return tuple(f"{self.name}[{entry}]" for entry in self.entry_names)

    @property
    def entry_names(self) -> tuple[str, ...]:
        """A name for each entry: ``entries``, else indices such as ``0`` or ``0,3``; an empty name for a
        scalar."""
        if self.entries:
            return self.entries
        indices = itertools.product(*(range(count) for count in self.shape))
        return tuple(",".join(map(str, index)) for index in indices)


@dataclass(frozen=True)
class Signature:
    """Ordered, uniquely named slots and their positions in one flat vector."""

    slots: tuple[Slot, ...] = ()

    def __post_init__(self) -> None:
        names: set[str] = set()
        for slot in self.slots:
            if slot.name in names:
                raise InputError(
                    f"the name '{slot.name}' occurs twice in one signature",
                    fix="rename one of them",
                    where="signature",
                )
            names.add(slot.name)

    @cached_property
    def size(self) -> int:
        """Length of the flat vector."""
        return sum(slot.size for slot in self.slots)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The slots' names, in order."""
        return tuple(slot.name for slot in self.slots)

    @cached_property
    def ranges(self) -> Mapping[str, slice]:
        """The slice of each slot in the flat vector."""
        slices: dict[str, slice] = {}
        start = 0
        for slot in self.slots:
            slices[slot.name] = slice(start, start + slot.size)
            start += slot.size
        return slices

    @cached_property
    def _by_name(self) -> Mapping[str, Slot]:
        return {slot.name: slot for slot in self.slots}

    def __len__(self) -> int:
        return len(self.slots)

    def __iter__(self) -> Iterator[Slot]:
        return iter(self.slots)

    def __getitem__(self, name: str) -> Slot:
        if name not in self._by_name:
            raise UnknownNameError("quantity", name, self.names)
        return self._by_name[name]

    def slot_of(self, name: str) -> Slot:
        """The slot of this name, or the slot with an entry of this name: ``g.gain[1]``, ``g.gain[0,2]``.

        Raises ``UnknownNameError`` for an unknown slot, ``InputError`` for an unknown entry.
        """
        head, bracket, _ = name.rpartition("[")
        if name in self._by_name or not bracket or head not in self._by_name:
            return self[name]
        slot = self[head]
        if name not in slot.elements:
            first_and_last = dict.fromkeys((slot.elements[0], slot.elements[-1])) if slot.size else {}
            raise InputError(
                f"'{name}' is not an entry of '{head}', which "
                + (f"has shape {slot.shape}" if slot.shape else "is a scalar"),
                allowed=" to ".join(first_and_last) or "no entry",
                fix="correct the index",
                where="signature",
            )
        return slot

    def range_of(self, name: str) -> slice:
        """The slice of a slot, or of one entry of a slot, in the flat vector; raises as ``slot_of``."""
        slot = self.slot_of(name)
        entries = self.ranges[slot.name]
        if name == slot.name:
            return entries
        index = entries.start + slot.elements.index(name)
        return slice(index, index + 1)

    def with_entries(self, entries: Mapping[str, tuple[str, ...]]) -> Signature:
        """The same quantities, with names of entries for the quantities in ``entries``."""
        if not entries:
            return self
        return Signature(
            tuple(
                replace(slot, entries=entries[slot.name]) if slot.name in entries else slot for slot in self
            )
        )

    def with_titles(self, titles: Mapping[str, str]) -> Signature:
        """The same quantities with titles, by name."""
        if not titles:
            return self
        return Signature(tuple(replace(slot, title=titles.get(slot.name, "")) for slot in self))

    def pack(self, values: Mapping[str, ArrayLike]) -> NDArray[np.float64]:
        """Copy named values, each with the shape of its slot, into a new flat vector of shape ``(size,)``."""
        for name in values:
            if name not in self.ranges:
                raise UnknownNameError("quantity", name, self.names)
        flat = np.empty(self.size)
        for slot in self.slots:
            if slot.name not in values:
                raise InputError(
                    f"no value is given for '{slot.name}'",
                    allowed=", ".join(self.names),
                    where="signature",
                    fix=f"give '{slot.name}' a value",
                )
            value = np.asarray(values[slot.name], dtype=np.float64)
            if value.shape != slot.shape:
                raise InputError(
                    f"'{slot.name}' has shape {value.shape}",
                    allowed=f"shape {slot.shape}",
                    fix="reshape it",
                    where="signature",
                )
            flat[self.ranges[slot.name]] = value.ravel()
        return flat

    def unpack(self, flat: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Views of a flat array of shape ``(..., size)``: each slot as ``(..., *slot.shape)``."""
        lead = flat.shape[:-1]
        return {
            slot.name: flat[..., self.ranges[slot.name]].reshape((*lead, *slot.shape)) for slot in self.slots
        }


def signature(*slots: Slot | tuple[str, Sequence[int]] | tuple[str, Sequence[int], str]) -> Signature:
    """A signature from slots or tuples: ``signature(("q", (n,), "rad"), ("qd", (n,), "rad/s"))``."""
    return Signature(
        tuple(
            slot
            if isinstance(slot, Slot)
            else Slot(slot[0], tuple(slot[1]), slot[2] if len(slot) > 2 else "")
            for slot in slots
        )
    )
