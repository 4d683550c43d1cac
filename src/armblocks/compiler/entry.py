"""Calling a kernel from Python: a CPython builtin whose code is part of the kernel's LLVM module.

A call through ``ctypes`` takes several times as long as a whole robot model. The builtin has the signature of
``METH_FASTCALL | METH_KEYWORDS``. It checks its arguments. If they are plain C-contiguous float64
arrays of the slots' shapes (floats for scalar slots), with or without the axis of the samples, no Python code
runs: the builtin allocates the result, or takes the array of ``out=``, and calls the evaluation. Other calls
(lists, subclasses, a wrong shape, ``out=`` that shares memory with an input, two threads) go to a Python
callable, which handles them or raises the error. No C compiler is involved, so the wheel is pure
Python.

Batches have separate machine code, which is compiled at the first batch. The first batch therefore goes to
the Python callable; the kernel then stores the address in :data:`BATCHES`.

The builtin reads ``PyArrayObject`` by its field offsets, which NumPy's binary interface fixes. They are
compared with a real array once per process; if anything differs (a build without the GIL has another object
header), the Python callable is used directly.
"""

from __future__ import annotations

import ctypes
import importlib
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from armblocks.compiler.native import NativeCode
from armblocks.errors import InputError

ENTRY = "armblocks_entry"
"""Symbol of the builtin's C function."""
TABLE = "armblocks_entry_table"
"""Symbol of the table of addresses, which each process fills in: cached code must not contain addresses."""
BATCHES = "armblocks_entry_batches"
"""Symbol of the addresses of the batch functions, null until :func:`offer_batch` sets them."""
MAX_BATCH_INPUTS = 8
"""Batches of kernels with more inputs go to the Python callable: the table has 2^inputs entries."""

_FASTCALL_WITH_KEYWORDS = 0x0080 | 0x0002
# Byte offsets in the structures of CPython and NumPy on 64-bit systems.
OBJECT_TYPE, FLOAT_VALUE = 8, 16
ARRAY_DATA, ARRAY_NDIM, ARRAY_DIMENSIONS, ARRAY_DESCR, ARRAY_FLAGS = 16, 24, 32, 56, 64
C_CONTIGUOUS_AND_ALIGNED, WRITEABLE = 0x0001 | 0x0100, 0x0400
OWNER_CALL = 16
# Indices in NumPy's table of C functions.
_NUMPY_ARRAY_TYPE, _NUMPY_SCALAR, _NUMPY_NEW_FROM_DESCR = 2, 60, 94

TABLE_ENTRIES = (
    "array_type",
    "float_type",
    "numpy_float_type",
    "float64",
    "new_array",
    "new_scalar",
    "new_tuple",
    "set_item",
    "reference",
    "release",
    "vectorcall",
    "tuple_size",
    "tuple_item",
    "none",
    "out_name",
    "threads_name",
    "one",
    "save_thread",
    "restore_thread",
)
# Names of options are interned strings and small integers exist once: both are compared by address.
_OUT_NAME, _THREADS_NAME, _ONE = sys.intern("out"), sys.intern("threads"), 1

Callback = Callable[..., Any]


class _MethodDefinition(ctypes.Structure):
    """CPython's ``PyMethodDef``."""

    _fields_ = (
        ("ml_name", ctypes.c_char_p),
        ("ml_meth", ctypes.c_void_p),
        ("ml_flags", ctypes.c_int),
        ("ml_doc", ctypes.c_char_p),
    )


# A builtin reads its definition when it is deallocated, and the garbage collector may clear its ``self``
# before that. Definitions (some hundred bytes each) are therefore kept for the lifetime of the process.
_DEFINITIONS: list[_MethodDefinition] = []


Maker = tuple[Callable[..., object], tuple[object, ...]]
"""For pickling: a function and its arguments that create an object with the builtin as an attribute."""


class _Owner:
    """The builtin's ``self``: the fallback, and the objects that live as long as the builtin.

    The C function reads ``call`` by its offset.
    """

    __slots__ = ("call", "code", "maker")

    def __init__(self, call: Callback, code: object, maker: Maker | None = None) -> None:
        self.call = call
        self.code = code
        self.maker = maker

    def __reduce__(self) -> Maker:
        """The maker: Python pickles a builtin as an attribute of its ``self``, here of the maker's object."""
        if self.maker is None:
            raise InputError(
                "native code cannot be pickled",
                allowed="methods of an Arm, such as arm.fkine",
                fix="pickle the object from which the code was compiled",
                where="kernel",
            )
        return self.maker


def offer_batch(code: NativeCode, batched: Sequence[bool], address: int) -> None:
    """Give the builtin in ``code`` the function for batches in which the inputs ``batched`` have samples.

    The function's code must live as long as the builtin.
    """
    if len(batched) <= MAX_BATCH_INPUTS:
        index = sum(1 << k for k, has_samples in enumerate(batched) if has_samples)
        ctypes.c_void_p.from_address(code.address(BATCHES) + 8 * index).value = address


def make_entry(
    *,
    name: str,
    doc: str,
    address: int,
    table: int,
    fallback: Callback,
    code: object,
    maker: Maker | None = None,
) -> Callback:
    """The builtin for the C function at ``address``.

    ``table`` is the address of the module's :data:`TABLE`. Calls that the C function does not handle go to
    ``fallback``. ``code`` (the machine code) lives as long as the builtin, which is pickled by its ``maker``.
    Where the binary interface of Python or NumPy differs from the expected interface, ``fallback`` itself is
    returned.
    """
    addresses = _addresses()
    if addresses is None:
        return fallback
    (ctypes.c_void_p * len(addresses)).from_address(table)[:] = addresses
    definition = _MethodDefinition(name.encode(), address, _FASTCALL_WITH_KEYWORDS, doc.encode())
    _DEFINITIONS.append(definition)
    new = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p, ctypes.py_object, ctypes.c_void_p)(
        ("PyCFunction_NewEx", ctypes.pythonapi)
    )
    return new(ctypes.addressof(definition), _Owner(fallback, code, maker), None)


@dataclass(frozen=True)
class _View:
    """Raw memory of an object."""

    start: int

    def word(self, offset: int) -> int:
        return ctypes.c_uint64.from_address(self.start + offset).value

    def half(self, offset: int) -> int:
        return ctypes.c_uint32.from_address(self.start + offset).value


@cache
def _addresses() -> list[int] | None:
    """The content of the table, in order; None if an interface differs from the expected interface."""
    if ctypes.sizeof(ctypes.c_void_p) != 8 or not _layout_is_known():
        return None
    try:
        capsule = vars(importlib.import_module("numpy._core._multiarray_umath"))["_ARRAY_API"]
        pointer = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.py_object, ctypes.c_char_p)(
            ("PyCapsule_GetPointer", ctypes.pythonapi)
        )(capsule, None)
    except (ImportError, KeyError, ValueError):
        return None
    functions = _View(int(pointer))
    if functions.word(8 * _NUMPY_ARRAY_TYPE) != id(np.ndarray):
        return None
    addresses = {
        "array_type": id(np.ndarray),
        "float_type": id(float),
        "numpy_float_type": id(np.float64),
        "float64": id(np.dtype(np.float64)),
        "new_array": functions.word(8 * _NUMPY_NEW_FROM_DESCR),
        "new_scalar": functions.word(8 * _NUMPY_SCALAR),
        "new_tuple": _python_function("PyTuple_New"),
        "set_item": _python_function("PyTuple_SetItem"),
        "reference": _python_function("Py_IncRef"),
        "release": _python_function("Py_DecRef"),
        "vectorcall": _python_function("PyObject_Vectorcall"),
        "tuple_size": _python_function("PyTuple_Size"),
        "tuple_item": _python_function("PyTuple_GetItem"),
        "none": id(None),
        "out_name": id(_OUT_NAME),
        "threads_name": id(_THREADS_NAME),
        "one": id(_ONE),
        "save_thread": _python_function("PyEval_SaveThread"),
        "restore_thread": _python_function("PyEval_RestoreThread"),
    }
    return [addresses[entry] for entry in TABLE_ENTRIES]


def _python_function(name: str) -> int:
    return ctypes.cast(getattr(ctypes.pythonapi, name), ctypes.c_void_p).value or 0


def _layout_is_known() -> bool:
    """Compare the offsets with arrays, floats and an owner of known content."""
    array = np.empty((3, 5))
    transposed = array.T
    read_only = np.empty(2)
    read_only.flags.writeable = False
    owner = _Owner(len, None)
    view, other = _View(id(array)), _View(id(transposed))
    number = 0.1234567890123
    return (
        view.word(OBJECT_TYPE) == id(np.ndarray)
        and view.word(ARRAY_DATA) == array.__array_interface__["data"][0]
        and view.half(ARRAY_NDIM) == 2
        and (_View(view.word(ARRAY_DIMENSIONS)).word(0), _View(view.word(ARRAY_DIMENSIONS)).word(8)) == (3, 5)
        and view.word(ARRAY_DESCR) == id(np.dtype(np.float64))
        and view.half(ARRAY_FLAGS) & C_CONTIGUOUS_AND_ALIGNED == C_CONTIGUOUS_AND_ALIGNED
        and other.half(ARRAY_FLAGS) & C_CONTIGUOUS_AND_ALIGNED == 0x0100
        and view.half(ARRAY_FLAGS) & WRITEABLE == WRITEABLE
        and _View(id(read_only)).half(ARRAY_FLAGS) & WRITEABLE == 0
        and _View(id(owner)).word(OWNER_CALL) == id(len)
        and all(
            _View(id(value)).word(OBJECT_TYPE) == id(type(value))
            and ctypes.c_double.from_address(id(value) + FLOAT_VALUE).value == number
            for value in (number, np.float64(number))
        )
    )
