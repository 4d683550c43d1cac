"""The C function of a kernel's builtin, as LLVM IR: see :mod:`armblocks.compiler.entry`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from armblocks.compiler.entry import (
    ARRAY_DATA,
    ARRAY_DESCR,
    ARRAY_DIMENSIONS,
    ARRAY_FLAGS,
    ARRAY_NDIM,
    BATCHES,
    C_CONTIGUOUS_AND_ALIGNED,
    ENTRY,
    FLOAT_VALUE,
    MOST_BATCH_INPUTS,
    OBJECT_TYPE,
    OWNER_CALL,
    PLACES,
    TABLE,
    WRITEABLE,
)
from armblocks.compiler.ir_routine import Routine
from armblocks.compiler.ir_text import Module
from armblocks.compiler.result_memory import LARGE
from armblocks.equations import Shape, Signature

_OPTIONS = "entry.options"
_NO_SAMPLES = "-1"
_LONG_BATCH = 512
"""From so many samples on, other Python threads may run during the evaluation; fewer take microseconds."""


def emit_entry(module: Module, inputs: Signature, outputs: Signature, evaluate: str) -> None:
    """Add the builtin's C function.

    ``void @evaluate(ptr in0, …, ptr out0, …)`` evaluates one sample. The function whose address stands in
    :data:`~armblocks.compiler.entry.BATCHES` evaluates a batch; its index has bit ``k`` set if input ``k``
    has the samples' axis.
    """
    module.add(TABLE, f"@{TABLE} = global [{len(PLACES)} x ptr] zeroinitializer")
    body = _EntryBody(module)
    body.require(body.let(f"icmp eq i64 %nargs, {len(inputs)}"))
    out = body.out_option(len(inputs))
    arguments = [body.argument(k, slot.shape) for k, slot in enumerate(inputs)]
    samples = body.common_samples(arguments)
    batched = body.let(f"icmp ne i64 {samples}, {_NO_SAMPLES}")
    batch = body.batch_function(arguments, batched)
    shapes = [slot.shape for slot in outputs]
    body.require_small(shapes, samples, out)
    if len(shapes) == 1:
        results = [body.given_or_new(shapes[0], samples, batched, out, arguments)]
    else:  # a tuple of arrays for the results is left to the Python callable
        body.require(body.let(f"icmp eq ptr {out}, null"))
        results = [body.new_result(shape, samples, batched) for shape in shapes]
    body.evaluate(evaluate, batch, samples, [argument.data for argument in arguments], results)
    body.finish(shapes, results)
    module.add(
        ENTRY, body.text(f"define ptr @{ENTRY}(ptr %self, ptr %args, i64 %nargs, ptr %kwnames) nounwind")
    )


@dataclass(frozen=True, kw_only=True)
class _Argument:
    """Values of one argument: address of its numbers, count of samples (or -1), numbers of one sample."""

    data: str
    samples: str
    size: int


@dataclass(frozen=True, kw_only=True)
class _Result:
    """Variables of one result: the object (null for a number that is not made yet) and where to write to."""

    made: str
    target: str


class _EntryBody(Routine):
    """Instructions that look into Python objects."""

    def __init__(self, module: Module) -> None:
        super().__init__(module)
        self._owned: list[str] = []  # variables of objects to release if something later fails

    # ---- Python objects ----------------------------------------------------------------------------------
    def known(self, name: str) -> str:
        """An address that the process filled in."""
        index = PLACES.index(name)
        return self.let(f"load ptr, ptr getelementptr inbounds (ptr, ptr @{TABLE}, i64 {index})")

    def field(self, pointer: str, offset: int, kind: str) -> str:
        """The field of a structure at a byte offset."""
        return self.get(self.let(f"getelementptr inbounds i8, ptr {pointer}, i64 {offset}"), kind)

    def is_same(self, pointer: str, other: str) -> str:
        """Whether two pointers are equal."""
        return self.let(f"icmp eq ptr {pointer}, {other}")

    def require(self, condition: str) -> None:
        """Go to the Python callable unless the condition holds."""
        onward = self.fresh("onward")
        self.branch(condition, onward, "fall")
        self.label(onward)

    def choose(self, condition: str, yes: Callable[[], None], no: Callable[[], None] | None = None) -> None:
        """What ``yes`` writes where the condition holds, else what ``no`` writes."""
        first, second, after = self.fresh("yes"), self.fresh("no"), self.fresh("after")
        self.branch(condition, first, second)
        self.label(first)
        yes()
        self.jump(after)
        self.label(second)
        if no is not None:
            no()
        self.place(after)

    def require_array(self, value: str, flags: int) -> None:
        """Go on only for a plain array of float64 that has all of the flags."""
        self.require(self.is_same(self.field(value, OBJECT_TYPE, "ptr"), self.known("array_type")))
        numbers = self.is_same(self.field(value, ARRAY_DESCR, "ptr"), self.known("float64"))
        found = self.let(f"and i32 {self.field(value, ARRAY_FLAGS, 'i32')}, {flags}")
        self.require(self.both(numbers, self.let(f"icmp eq i32 {found}, {flags}")))

    def require_extents(self, dimensions: str, shape: Shape) -> None:
        """Go on only where the numbers at ``dimensions`` are those of ``shape``."""
        for axis, extent in enumerate(shape):
            self.require(self.word_test("eq", self.field(dimensions, 8 * axis, "i64"), str(extent)))

    # ---- arguments ---------------------------------------------------------------------------------------
    def out_option(self, count: int) -> str:
        """The array of ``out=``, or null. ``threads=1`` passes; other options go to the Python callable."""
        out = self.variable("ptr", "null")

        def read() -> None:
            values = self.at("%args", count, "ptr")
            _add_options(self.module)
            self.require(self.let(f"call i1 @{_OPTIONS}(ptr {values}, ptr %kwnames, ptr {out})"))

        self.choose(self.let("icmp ne ptr %kwnames, null"), read)
        return self.get(out, "ptr")

    def argument(self, k: int, shape: Shape) -> _Argument:
        """The numbers of argument ``k``."""
        value = self.get(self.at("%args", k, "ptr"), "ptr")
        if not shape:
            return self._number_or_samples(value)
        self.require_array(value, C_CONTIGUOUS_AND_ALIGNED)
        axes = self.let(f"sub i32 {self.field(value, ARRAY_NDIM, 'i32')}, {len(shape)}")
        self.require(self.let(f"icmp ult i32 {axes}, 2"))
        batched = self.let(f"icmp eq i32 {axes}, 1")
        dimensions = self.field(value, ARRAY_DIMENSIONS, "ptr")
        self.require_extents(self.at(dimensions, self.let(f"zext i32 {axes} to i64")), shape)
        length = self.get(dimensions, "i64")
        return _Argument(
            data=self.field(value, ARRAY_DATA, "ptr"),
            samples=self.let(f"select i1 {batched}, i64 {length}, i64 {_NO_SAMPLES}"),
            size=math.prod(shape),
        )

    def _number_or_samples(self, value: str) -> _Argument:
        """A float, or an array of one number for each sample."""
        data = self.variable("ptr", self.let(f"getelementptr inbounds i8, ptr {value}, i64 {FLOAT_VALUE}"))
        samples = self.variable("i64", _NO_SAMPLES)
        kind = self.field(value, OBJECT_TYPE, "ptr")
        is_float = self.either(
            self.is_same(kind, self.known("float_type")), self.is_same(kind, self.known("numpy_float_type"))
        )

        def read_array() -> None:
            self.require_array(value, C_CONTIGUOUS_AND_ALIGNED)
            self.require(self.let(f"icmp eq i32 {self.field(value, ARRAY_NDIM, 'i32')}, 1"))
            self.put(self.field(value, ARRAY_DATA, "ptr"), data, "ptr")
            self.put(self.get(self.field(value, ARRAY_DIMENSIONS, "ptr"), "i64"), samples, "i64")

        self.choose(is_float, lambda: None, read_array)
        return _Argument(data=self.get(data, "ptr"), samples=self.get(samples, "i64"), size=1)

    def common_samples(self, arguments: Sequence[_Argument]) -> str:
        """The number of samples, -1 where no argument has the samples' axis; all that have it must agree."""
        common = _NO_SAMPLES
        for argument in arguments:
            none = self.word_test("eq", argument.samples, _NO_SAMPLES)
            first = self.word_test("eq", common, _NO_SAMPLES)
            agree = self.word_test("eq", argument.samples, common)
            self.require(self.either(self.either(none, first), agree))
            common = self.let(f"select i1 {none}, i64 {common}, i64 {argument.samples}")
        return common

    def batch_function(self, arguments: Sequence[_Argument], batched: str) -> str:
        """The address that evaluates a batch with these inputs batched; null for one sample."""
        function = self.variable("ptr", "null")
        count = len(arguments)
        if count > MOST_BATCH_INPUTS:
            self.require(self.let(f"xor i1 {batched}, true"))
            return self.get(function, "ptr")
        kind = f"[{1 << count} x ptr]"
        self.module.add(BATCHES, f"@{BATCHES} = global {kind} zeroinitializer")

        def look_up() -> None:
            index = "0"
            for k, argument in enumerate(arguments):
                own = self.word_test("ne", argument.samples, _NO_SAMPLES)
                bit = self.let(f"select i1 {own}, i64 {1 << k}, i64 0")
                index = self.word_op("or", index, bit)
            found = self.get(self.at(f"@{BATCHES}", index, "ptr"), "ptr")
            self.require(self.let(f"icmp ne ptr {found}, null"))
            self.put(found, function, "ptr")

        self.choose(batched, look_up)
        return self.get(function, "ptr")

    # ---- results -----------------------------------------------------------------------------------------
    def require_small(self, shapes: Sequence[Shape], samples: str, out: str) -> None:
        """Go on only where no new array is large: the memory of large ones is used again."""
        size = max((math.prod(shape) for shape in shapes), default=0)
        if size:
            few = self.word_test("slt", samples, str(-(-LARGE // size)))
            self.require(self.either(few, self.let(f"icmp ne ptr {out}, null")))

    def new_result(self, shape: Shape, samples: str, batched: str) -> _Result:
        """A new array, or room for one number."""
        made, target = self.variable("ptr", "null"), self.variable("ptr", "null")
        self._owned.append(made)
        self._allocate(shape, samples, batched, _Result(made=made, target=target))
        return _Result(made=made, target=target)

    def _allocate(self, shape: Shape, samples: str, batched: str, result: _Result) -> None:
        extents = ", ".join(f"i64 {extent}" for extent in (0, *shape))
        dimensions = self.variable(f"[{len(shape) + 1} x i64]", f"[{extents}]")
        self.put(samples, dimensions, "i64")

        def make() -> None:
            first = self.let(f"select i1 {batched}, i64 0, i64 1")
            axes = self.let(f"select i1 {batched}, i32 {len(shape) + 1}, i32 {len(shape)}")
            descr = self.known("float64")  # a new array takes over one reference
            self.do(f"call void {self.known('reference')}(ptr {descr})")
            array = self.let(
                f"call ptr {self.known('new_array')}(ptr {self.known('array_type')}, ptr {descr}, "
                f"i32 {axes}, ptr {self.at(dimensions, first, 'i64')}, ptr null, ptr null, i32 0, ptr null)"
            )
            self.succeed(array)
            self.put(array, result.made, "ptr")
            self.put(self.field(array, ARRAY_DATA, "ptr"), result.target, "ptr")

        if shape:
            make()
            return
        self.put(self.variable("double", "0.0"), result.target, "ptr")
        self.choose(batched, make)

    def given_or_new(
        self, shape: Shape, samples: str, batched: str, out: str, arguments: Sequence[_Argument]
    ) -> _Result:
        """The array of ``out=`` if there is one, which must be as the call would give it, else a new array.

        An array that may share memory with an input goes to the Python callable.
        """
        result = _Result(made=self.variable("ptr", "null"), target=self.variable("ptr", "null"))

        def take() -> None:
            self.require_array(out, C_CONTIGUOUS_AND_ALIGNED | WRITEABLE)
            extra = self.let(f"zext i1 {batched} to i32")
            axes = self.let(f"sub i32 {self.field(out, ARRAY_NDIM, 'i32')}, {len(shape)}")
            self.require(self.let(f"icmp eq i32 {axes}, {extra}"))
            dimensions = self.field(out, ARRAY_DIMENSIONS, "ptr")
            if shape:
                self.require_extents(self.at(dimensions, self.let(f"zext i1 {batched} to i64")), shape)

            def same_samples() -> None:
                self.require(self.word_test("eq", self.get(dimensions, "i64"), samples))

            self.choose(batched, same_samples)
            data = self.field(out, ARRAY_DATA, "ptr")
            count = self.let(f"select i1 {batched}, i64 {samples}, i64 1")
            for argument in arguments:
                self._require_apart(data, self._end(data, count, math.prod(shape)), argument)
            self.do(f"call void {self.known('reference')}(ptr {out})")
            self.put(out, result.made, "ptr")
            self.put(data, result.target, "ptr")

        self.choose(
            self.let(f"icmp ne ptr {out}, null"),
            take,
            lambda: self._allocate(shape, samples, batched, result),
        )
        self._owned.append(result.made)
        return result

    def _end(self, data: str, samples: str, size: int) -> str:
        """The address behind the numbers of so many samples."""
        return self.at(data, self.word_op("mul", samples, str(size)))

    def _require_apart(self, start: str, end: str, argument: _Argument) -> None:
        """Go on only where the memory from ``start`` to ``end`` has no number of the argument."""
        one = self.word_test("eq", argument.samples, _NO_SAMPLES)
        count = self.let(f"select i1 {one}, i64 1, i64 {argument.samples}")
        before = self.let(f"icmp ule ptr {end}, {argument.data}")
        behind = self.let(f"icmp ule ptr {self._end(argument.data, count, argument.size)}, {start}")
        self.require(self.either(before, behind))

    # ---- evaluation --------------------------------------------------------------------------------------
    def evaluate(
        self, evaluate: str, batch: str, samples: str, inputs: Sequence[str], results: Sequence[_Result]
    ) -> None:
        """Call ``evaluate`` for one sample, ``batch`` (not null) for many."""
        pointers = [*inputs, *(self.get(result.target, "ptr") for result in results)]
        passed = ", ".join(f"ptr {pointer}" for pointer in pointers)

        def many() -> None:
            call = f"call void {batch}(i64 0, i64 {samples}, i64 {samples}, {passed})"

            def unlocked() -> None:
                state = self.let(f"call ptr {self.known('save_thread')}()")
                self.do(call)
                self.do(f"call void {self.known('restore_thread')}(ptr {state})")

            self.choose(self.word_test("ult", samples, str(_LONG_BATCH)), lambda: self.do(call), unlocked)

        one = self.let(f"icmp eq ptr {batch}, null")
        self.choose(one, lambda: self.do(f"call void @{evaluate}({passed})"), many)

    def succeed(self, made: str) -> None:
        """If ``made`` is null, release what is owned and hand the error on."""
        failed, onward = self.fresh("failed"), self.fresh("onward")
        self.branch(self.let(f"icmp eq ptr {made}, null"), failed, onward)
        self.label(failed)
        release = self.known("release")
        for owned in self._owned:  # null is let through
            self.do(f"call void {release}(ptr {self.get(owned, 'ptr')})")
        self.do("ret ptr null")
        self.label(onward)

    def finish(self, shapes: Sequence[Shape], results: Sequence[_Result]) -> None:
        """Return the result, a tuple where there are several; then the way out to Python."""
        for shape, result in zip(shapes, results):
            if not shape:
                self._make_number(result)
        objects = [self.get(result.made, "ptr") for result in results]
        if len(objects) != 1:
            bundle = self.let(f"call ptr {self.known('new_tuple')}(i64 {len(objects)})")
            self.succeed(bundle)
            for k, item in enumerate(objects):  # the tuple takes over the references
                self.let(f"call i32 {self.known('set_item')}(ptr {bundle}, i64 {k}, ptr {item})")
            objects = [bundle]
        self.do(f"ret ptr {objects[0]}")
        self.label("fall")
        vectorcall, fallback = self.known("vectorcall"), self.field("%self", OWNER_CALL, "ptr")
        call = f"tail call ptr {vectorcall}(ptr {fallback}, ptr %args, i64 %nargs, ptr %kwnames)"
        self.do(f"ret ptr {self.let(call)}")

    def _make_number(self, result: _Result) -> None:
        """The ``numpy.float64`` of a scalar result, unless it has been written into an array."""

        def make() -> None:
            value, float64 = self.get(result.target, "ptr"), self.known("float64")
            number = self.let(f"call ptr {self.known('new_scalar')}(ptr {value}, ptr {float64}, ptr null)")
            self.succeed(number)
            self.put(number, result.made, "ptr")

        self.choose(self.let(f"icmp eq ptr {self.get(result.made, 'ptr')}, null"), make)


def _add_options(module: Module) -> None:
    """Add ``i1 @entry.options(ptr values, ptr names, ptr out)``: whether the builtin serves the options.

    These are ``threads=1`` and ``out=``, whose array is written to ``out``. ``out=None`` is as if left away.
    """

    def write() -> str:
        body = _EntryBody(module)
        count = body.let(f"call i64 {body.known('tuple_size')}(ptr %names)")

        def read(index: str) -> None:
            name = body.let(f"call ptr {body.known('tuple_item')}(ptr %names, i64 {index})")
            value = body.get(body.at("%values", index, "ptr"), "ptr")

            def take() -> None:
                none = body.is_same(value, body.known("none"))
                body.put(body.let(f"select i1 {none}, ptr null, ptr {value}"), "%out", "ptr")

            def only_one_thread() -> None:
                threads = body.is_same(name, body.known("threads_name"))
                body.require(body.both(threads, body.is_same(value, body.known("one"))))

            body.choose(body.is_same(name, body.known("out_name")), take, only_one_thread)

        body.count("0", count, read)
        body.do("ret i1 true")
        body.label("fall")
        body.do("ret i1 false")
        return body.text(f"define internal i1 @{_OPTIONS}(ptr %values, ptr %names, ptr %out) nounwind")

    module.define(_OPTIONS, write)
