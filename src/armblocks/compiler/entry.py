"""The way into a kernel for one sample: a CPython builtin whose code stands in the kernel's own LLVM module.

A call through ``ctypes`` costs several times the work of a whole robot model. The builtin made here has the
signature of ``METH_FASTCALL | METH_KEYWORDS``; it looks at its arguments, and when each is a plain C-contiguous
float64 array of exactly the slot's shape (a float for a scalar slot), it allocates the result and calls the
evaluation: no Python code runs. Anything else (lists, batches, ``out=``, subclasses, a wrong shape) goes to a
Python callable that serves or refuses it with the full text. No C compiler is involved, so the wheel stays pure
Python.

The builtin reads ``PyArrayObject`` by its field offsets, which NumPy's binary interface fixes. They are compared
with a real array once per process; if anything differs (a build without the GIL has another object header),
the Python callable is used directly.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from armblocks.compiler.ir_text import Body, Module
from armblocks.equations import Shape, Signature

ENTRY = "armblocks_entry"
"""Symbol of the builtin's C function."""
TABLE = "armblocks_entry_table"
"""Symbol of the addresses that each process fills in: code on disk must not hold any."""

_FASTCALL_WITH_KEYWORDS = 0x0080 | 0x0002
# Byte offsets in the structures of CPython and NumPy on 64-bit systems.
_TYPE, _FLOAT_VALUE = 8, 16
_DATA, _NDIM, _DIMENSIONS, _DESCR, _FLAGS = 16, 24, 32, 56, 64
_C_CONTIGUOUS_AND_ALIGNED = 0x0001 | 0x0100
# Places in NumPy's table of C functions.
_NUMPY_ARRAY_TYPE, _NUMPY_SCALAR, _NUMPY_NEW_FROM_DESCR = 2, 60, 94

_PLACES = (
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
)

Callback = Callable[..., Any]


def emit_entry(module: Module, inputs: Signature, outputs: Signature, evaluate: str) -> None:
    """Add the builtin's C function, which calls ``void @evaluate(ptr in0, …, ptr out0, …)``."""
    module.add(TABLE, f"@{TABLE} = global [{len(_PLACES)} x ptr] zeroinitializer")
    body = _EntryBody(module)
    given = body.let(f"icmp eq i64 %nargs, {len(inputs)}")
    body.require(body.both(given, body.let("icmp eq ptr %kwnames, null")))
    arguments = [body.argument(k, slot.shape) for k, slot in enumerate(inputs)]
    results = [body.new_result(k, slot.shape) for k, slot in enumerate(outputs)]
    targets = [
        body.field(result, _DATA, "ptr") if slot.shape else result for slot, result in zip(outputs, results)
    ]
    body.do(f"call void @{evaluate}({', '.join(f'ptr {value}' for value in (*arguments, *targets))})")
    body.finish([slot.shape for slot in outputs], results)
    head = f"define ptr @{ENTRY}(ptr %self, ptr %args, i64 %nargs, ptr %kwnames) nounwind {{\nentry:\n"
    module.add(ENTRY, head + "\n".join(body.lines) + "\n}")


class _EntryBody(Body):
    """Instructions that look into Python objects."""

    def __init__(self, module: Module) -> None:
        super().__init__(module)
        self._owned: list[str] = []  # arrays to release if something later fails

    def place(self, name: str) -> str:
        """An address that the process filled in."""
        index = _PLACES.index(name)
        return self.let(f"load ptr, ptr getelementptr inbounds (ptr, ptr @{TABLE}, i64 {index})")

    def field(self, pointer: str, offset: int, kind: str) -> str:
        """The field of a structure at a byte offset."""
        address = self.let(f"getelementptr inbounds i8, ptr {pointer}, i64 {offset}")
        return self.let(f"load {kind}, ptr {address}")

    def require(self, condition: str) -> None:
        """Go to the Python callable unless the condition holds."""
        onward = self.fresh("onward")
        self.do(f"br i1 {condition}, label %{onward}, label %fall")
        self.label(onward)

    def argument(self, k: int, shape: Shape) -> str:
        """Pointer to the numbers of argument ``k``."""
        address = self.let(f"getelementptr inbounds ptr, ptr %args, i64 {k}")
        value = self.let(f"load ptr, ptr {address}")
        kind = self.field(value, _TYPE, "ptr")
        if not shape:
            exact = self.let(f"icmp eq ptr {kind}, {self.place('float_type')}")
            numpy_scalar = self.let(f"icmp eq ptr {kind}, {self.place('numpy_float_type')}")
            self.require(self.either(exact, numpy_scalar))
            return self.let(f"getelementptr inbounds i8, ptr {value}, i64 {_FLOAT_VALUE}")
        self.require(self.let(f"icmp eq ptr {kind}, {self.place('array_type')}"))
        ndim = self.let(f"icmp eq i32 {self.field(value, _NDIM, 'i32')}, {len(shape)}")
        descr = self.let(f"icmp eq ptr {self.field(value, _DESCR, 'ptr')}, {self.place('float64')}")
        flags = self.let(f"and i32 {self.field(value, _FLAGS, 'i32')}, {_C_CONTIGUOUS_AND_ALIGNED}")
        tidy = self.let(f"icmp eq i32 {flags}, {_C_CONTIGUOUS_AND_ALIGNED}")
        self.require(self.both(self.both(ndim, descr), tidy))
        dimensions = self.field(value, _DIMENSIONS, "ptr")
        same = [
            self.let(f"icmp eq i64 {self.field(dimensions, 8 * axis, 'i64')}, {extent}")
            for axis, extent in enumerate(shape)
        ]
        for other in same[1:]:
            same[0] = self.both(same[0], other)
        self.require(same[0])
        return self.field(value, _DATA, "ptr")

    def new_result(self, k: int, shape: Shape) -> str:
        """A new array; for a scalar the stack slot that takes its value."""
        if not shape:
            return self.let("alloca double")
        symbol = f"shape{k}"
        extents = ", ".join(f"i64 {extent}" for extent in shape)
        self.module.add(symbol, f"@{symbol} = internal constant [{len(shape)} x i64] [{extents}]")
        descr = self.place("float64")  # a new array takes over one reference
        self.do(f"call void {self.place('reference')}(ptr {descr})")
        made = self.let(
            f"call ptr {self.place('new_array')}(ptr {self.place('array_type')}, ptr {descr}, "
            f"i32 {len(shape)}, ptr @{symbol}, ptr null, ptr null, i32 0, ptr null)"
        )
        self.succeed(made)
        self._owned.append(made)
        return made

    def succeed(self, made: str) -> None:
        """If ``made`` is null, release what is owned and hand the error on."""
        failed, onward = self.fresh("failed"), self.fresh("onward")
        null = self.let(f"icmp eq ptr {made}, null")
        self.do(f"br i1 {null}, label %{failed}, label %{onward}")
        self.label(failed)
        release = self.place("release")
        for owned in self._owned:
            self.do(f"call void {release}(ptr {owned})")
        self.do("ret ptr null")
        self.label(onward)

    def finish(self, shapes: list[Shape], results: list[str]) -> None:
        """Return the result, a tuple where there are several; then the way out to Python."""
        objects: list[str] = []
        for shape, result in zip(shapes, results):
            if shape:
                objects.append(result)
                continue
            made = self.let(
                f"call ptr {self.place('new_scalar')}(ptr {result}, ptr {self.place('float64')}, ptr null)"
            )
            self.succeed(made)
            self._owned.append(made)
            objects.append(made)
        if len(objects) != 1:
            bundle = self.let(f"call ptr {self.place('new_tuple')}(i64 {len(objects)})")
            self.succeed(bundle)
            for k, item in enumerate(objects):  # the tuple takes over the references
                self.let(f"call i32 {self.place('set_item')}(ptr {bundle}, i64 {k}, ptr {item})")
            objects = [bundle]
        self.do(f"ret ptr {objects[0]}")
        self.label("fall")
        call = f"call ptr {self.place('vectorcall')}(ptr %self, ptr %args, i64 %nargs, ptr %kwnames)"
        self.do(f"ret ptr {self.let(f'tail {call}')}")


class _MethodDefinition(ctypes.Structure):
    """CPython's ``PyMethodDef``."""

    _fields_ = (
        ("ml_name", ctypes.c_char_p),
        ("ml_meth", ctypes.c_void_p),
        ("ml_flags", ctypes.c_int),
        ("ml_doc", ctypes.c_char_p),
    )


class _Owner:
    """The builtin's ``self``: what it falls back to, and what must live as long as it does."""

    __slots__ = ("call", "definition", "kept")

    def __init__(self, call: Callback, kept: object) -> None:
        self.call = call
        self.kept = kept
        self.definition = _MethodDefinition()

    def __call__(self, *arguments: object, **options: object) -> object:
        return self.call(*arguments, **options)


def make_entry(
    *, name: str, doc: str, address: int, table: int, fallback: Callback, kept: object
) -> Callback:
    """The builtin for the C function at ``address``.

    ``table`` is the address of the module's :data:`TABLE`. Calls that the C function does not serve go to
    ``fallback``. ``kept`` (the machine code) lives as long as the builtin. Where the binary interface of Python
    or NumPy is not the expected one, ``fallback`` itself is given back.
    """
    addresses = _addresses()
    if addresses is None:
        return fallback
    (ctypes.c_void_p * len(addresses)).from_address(table)[:] = addresses
    owner = _Owner(fallback, kept)
    owner.definition.ml_name = name.encode()
    owner.definition.ml_meth = address
    owner.definition.ml_flags = _FASTCALL_WITH_KEYWORDS
    owner.definition.ml_doc = doc.encode()
    new = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p, ctypes.py_object, ctypes.c_void_p)(
        ("PyCFunction_NewEx", ctypes.pythonapi)
    )
    return new(ctypes.addressof(owner.definition), owner, None)


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
    """What the table holds, in the order of the places; None where the binary interface is not as expected."""
    if ctypes.sizeof(ctypes.c_void_p) != 8 or not _layout_is_known():
        return None
    try:
        from numpy._core import _multiarray_umath

        capsule = _multiarray_umath._ARRAY_API  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType, reportAttributeAccessIssue]
        pointer = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.py_object, ctypes.c_char_p)(
            ("PyCapsule_GetPointer", ctypes.pythonapi)
        )(capsule, None)
    except (ImportError, AttributeError, ValueError):
        return None
    functions = _View(int(pointer))
    if functions.word(8 * _NUMPY_ARRAY_TYPE) != id(np.ndarray):
        return None
    found = {
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
    }
    return [found[place] for place in _PLACES]


def _python_function(name: str) -> int:
    return ctypes.cast(getattr(ctypes.pythonapi, name), ctypes.c_void_p).value or 0


def _layout_is_known() -> bool:
    """Compare the offsets with arrays and floats of known content."""
    array = np.empty((3, 5))
    turned = array.T
    view, other = _View(id(array)), _View(id(turned))
    number = 0.1234567890123
    return (
        view.word(_TYPE) == id(np.ndarray)
        and view.word(_DATA) == array.__array_interface__["data"][0]
        and view.half(_NDIM) == 2
        and (_View(view.word(_DIMENSIONS)).word(0), _View(view.word(_DIMENSIONS)).word(8)) == (3, 5)
        and view.word(_DESCR) == id(np.dtype(np.float64))
        and view.half(_FLAGS) & _C_CONTIGUOUS_AND_ALIGNED == _C_CONTIGUOUS_AND_ALIGNED
        and other.half(_FLAGS) & _C_CONTIGUOUS_AND_ALIGNED == 0x0100
        and all(
            _View(id(value)).word(_TYPE) == id(type(value))
            and ctypes.c_double.from_address(id(value) + _FLOAT_VALUE).value == number
            for value in (number, np.float64(number))
        )
    )
