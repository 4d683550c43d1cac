"""Functions of CPython and NumPy that the builtin of a kernel calls.

Each process sets their addresses by the names in :data:`~armblocks.compiler.entry.TABLE_ENTRIES`. Python
objects are given as addresses.
"""

from __future__ import annotations

from armblocks.routines.memory import Address, Addresses, Integers
from armblocks.routines.routine import Routine, external
from armblocks.routines.values import Int32, Integer


@external
def reference(r: Routine, item: Address) -> None:
    """``Py_IncRef``: add a reference, unless the address is null."""


@external
def release(r: Routine, item: Address) -> None:
    """``Py_DecRef``: release a reference, unless the address is null."""


@external
def new_array(
    r: Routine,
    kind: Address,
    descr: Address,
    axes: Int32,
    dimensions: Integers,
    strides: Address,
    data: Address,
    flags: Int32,
    base: Address,
) -> Address:
    """``PyArray_NewFromDescr``; it takes over a reference to ``descr``. Null if a Python error is set."""
    raise NotImplementedError


@external
def new_scalar(r: Routine, data: Address, descr: Address, base: Address) -> Address:
    """``PyArray_Scalar``: the NumPy number at an address. Null if a Python error is set."""
    raise NotImplementedError


@external
def new_tuple(r: Routine, length: Integer) -> Address:
    """``PyTuple_New``. Null if a Python error is set."""
    raise NotImplementedError


@external
def set_item(r: Routine, items: Address, index: Integer, item: Address) -> Int32:
    """``PyTuple_SetItem``; it takes over the reference to the item."""
    raise NotImplementedError


@external
def tuple_size(r: Routine, items: Address) -> Integer:
    """``PyTuple_Size``."""
    raise NotImplementedError


@external
def tuple_item(r: Routine, items: Address, index: Integer) -> Address:
    """``PyTuple_GetItem``: a borrowed reference."""
    raise NotImplementedError


@external
def vectorcall(r: Routine, function: Address, values: Addresses, count: Integer, names: Address) -> Address:
    """``PyObject_Vectorcall``. Null if a Python error is set."""
    raise NotImplementedError


@external
def save_thread(r: Routine) -> Address:
    """``PyEval_SaveThread``: release the interpreter lock."""
    raise NotImplementedError


@external
def restore_thread(r: Routine, state: Address) -> None:
    """``PyEval_RestoreThread``: acquire the interpreter lock again."""
