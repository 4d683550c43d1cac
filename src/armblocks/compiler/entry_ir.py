"""The C function of a kernel's builtin, as LLVM IR: see :mod:`armblocks.compiler.entry`."""

from __future__ import annotations

from armblocks.compiler.entry import (
    ARRAY_DATA,
    ARRAY_DESCR,
    ARRAY_DIMENSIONS,
    ARRAY_FLAGS,
    ARRAY_NDIM,
    C_CONTIGUOUS_AND_ALIGNED,
    ENTRY,
    FLOAT_VALUE,
    OBJECT_TYPE,
    PLACES,
    TABLE,
)
from armblocks.compiler.ir_text import Body, Module
from armblocks.equations import Shape, Signature


def emit_entry(module: Module, inputs: Signature, outputs: Signature, evaluate: str) -> None:
    """Add the builtin's C function, which calls ``void @evaluate(ptr in0, …, ptr out0, …)``."""
    module.add(TABLE, f"@{TABLE} = global [{len(PLACES)} x ptr] zeroinitializer")
    body = _EntryBody(module)
    given = body.let(f"icmp eq i64 %nargs, {len(inputs)}")
    body.require(body.both(given, body.let("icmp eq ptr %kwnames, null")))
    arguments = [body.argument(k, slot.shape) for k, slot in enumerate(inputs)]
    results = [body.new_result(k, slot.shape) for k, slot in enumerate(outputs)]
    targets = [
        body.field(result, ARRAY_DATA, "ptr") if slot.shape else result
        for slot, result in zip(outputs, results)
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
        index = PLACES.index(name)
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
        kind = self.field(value, OBJECT_TYPE, "ptr")
        if not shape:
            exact = self.let(f"icmp eq ptr {kind}, {self.place('float_type')}")
            numpy_scalar = self.let(f"icmp eq ptr {kind}, {self.place('numpy_float_type')}")
            self.require(self.either(exact, numpy_scalar))
            return self.let(f"getelementptr inbounds i8, ptr {value}, i64 {FLOAT_VALUE}")
        self.require(self.let(f"icmp eq ptr {kind}, {self.place('array_type')}"))
        ndim = self.let(f"icmp eq i32 {self.field(value, ARRAY_NDIM, 'i32')}, {len(shape)}")
        descr = self.let(f"icmp eq ptr {self.field(value, ARRAY_DESCR, 'ptr')}, {self.place('float64')}")
        flags = self.let(f"and i32 {self.field(value, ARRAY_FLAGS, 'i32')}, {C_CONTIGUOUS_AND_ALIGNED}")
        tidy = self.let(f"icmp eq i32 {flags}, {C_CONTIGUOUS_AND_ALIGNED}")
        self.require(self.both(self.both(ndim, descr), tidy))
        dimensions = self.field(value, ARRAY_DIMENSIONS, "ptr")
        same = [
            self.let(f"icmp eq i64 {self.field(dimensions, 8 * axis, 'i64')}, {extent}")
            for axis, extent in enumerate(shape)
        ]
        for other in same[1:]:
            same[0] = self.both(same[0], other)
        self.require(same[0])
        return self.field(value, ARRAY_DATA, "ptr")

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
