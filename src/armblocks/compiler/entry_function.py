"""The C function of a kernel's builtin, as a routine: see :mod:`armblocks.compiler.entry`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ParamSpec, TypeVar

from armblocks.compiler import python_interface as python
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
    MAX_BATCH_INPUTS,
    OBJECT_TYPE,
    OWNER_CALL,
    TABLE,
    TABLE_ENTRIES,
    WRITEABLE,
)
from armblocks.compiler.ir_text import Module
from armblocks.compiler.program_text import add_program
from armblocks.compiler.result_memory import MIN_REUSED
from armblocks.equations import Shape, Signature
from armblocks.routines.arithmetic import select
from armblocks.routines.memory import Address, Addresses, AddressVariable, Integers, Reals
from armblocks.routines.routine import Function, Part, Program, Routine, external
from armblocks.routines.values import Boolean, Integer

P = ParamSpec("P")
R = TypeVar("R")

_OPTIONS = "entry.options"
_NO_SAMPLES = -1
_LONG_BATCH = 512
"""Minimum number of samples for which the interpreter lock is released during the evaluation."""


def emit_entry(module: Module, inputs: Signature, outputs: Signature, evaluate: str) -> None:
    """Add the builtin's C function.

    ``void @evaluate(ptr in0, …, ptr out0, …)`` evaluates one sample. The function whose address is in
    :data:`~armblocks.compiler.entry.BATCHES` evaluates a batch; its index has bit ``k`` set if input ``k``
    has the samples' axis.
    """

    def entry(r: Routine, owner: Address, values: Addresses, count: Integer, names: Address) -> Address:
        with r.part() as served:
            call = _Call(_PythonObjects(r, served), values, names, evaluate)
            call.serve(count, [slot.shape for slot in inputs], [slot.shape for slot in outputs])
        function = _known_function(r, python.vectorcall)
        return r.call(function, owner.pointer(OWNER_CALL), values, count, names)

    program = Program()
    program.define(entry, ENTRY, public=True)
    add_program(module, program)


def _known(r: Routine, name: str) -> Address:
    """An address from the table that the process fills in."""
    return r.filled_in(TABLE, len(TABLE_ENTRIES))[TABLE_ENTRIES.index(name)]


def _known_function(r: Routine, function: Function[P, R]) -> Function[P, R]:
    return function.at(_known(r, function.symbol))


class _PythonObjects:
    """Inspects Python objects, and leaves a part of the routine if they are not of the expected form."""

    def __init__(self, r: Routine, served: Part) -> None:
        self.r = r
        self._served = served

    def require(self, condition: Boolean) -> None:
        """Use the Python callable unless the condition holds."""
        self._served.leave_unless(condition)

    def known(self, name: str) -> Address:
        """An address from the table that the process fills in."""
        return _known(self.r, name)

    def call(self, function: Function[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """Call a function of Python or NumPy."""
        return self.r.call(_known_function(self.r, function), *args, **kwargs)

    def require_array(self, value: Address, flags: int) -> None:
        """Continue only for a plain float64 array with all of the flags."""
        self.require(value.pointer(OBJECT_TYPE) == self.known("array_type"))
        numbers = value.pointer(ARRAY_DESCR) == self.known("float64")
        self.require(numbers & ((value.int32(ARRAY_FLAGS) & flags) == flags))

    def require_extents(self, dimensions: Integers, shape: Shape) -> None:
        """Continue only if the dimensions equal ``shape``."""
        for axis, extent in enumerate(shape):
            self.require(dimensions[axis] == extent)


@dataclass(frozen=True, kw_only=True)
class _Argument:
    """One argument: its numbers, the number of samples (or -1), and the count of numbers in a sample."""

    data: Reals
    samples: Integer
    size: int


@dataclass(frozen=True, kw_only=True)
class _Result:
    """Variables of one result: the Python object, and the address to write to.

    The object is null for a number that has not been created yet.
    """

    object: AddressVariable
    target: AddressVariable


class _Call:
    """Processes one call of the builtin."""

    def __init__(self, objects: _PythonObjects, values: Addresses, names: Address, evaluate: str) -> None:
        self.r = objects.r
        self.objects = objects
        self.require = objects.require
        self.values = values
        self.names = names
        self.evaluation = external(_evaluate, evaluate)
        self.owned: list[AddressVariable] = []
        """Objects to release after an error."""

    def serve(self, count: Integer, inputs: Sequence[Shape], outputs: Sequence[Shape]) -> None:
        """Return the result, or use the Python callable."""
        self.require(count == len(inputs))
        out = self.out_option(len(inputs))
        arguments = [self.argument(k, shape) for k, shape in enumerate(inputs)]
        samples = self.common_samples(arguments)
        batched = samples != _NO_SAMPLES
        batch = self.batch_function(arguments, batched)
        self.require_small(outputs, samples, out)
        if len(outputs) == 1:
            results = [self.given_or_new(outputs[0], samples, batched, out, arguments)]
        else:  # the Python callable handles a tuple of result arrays
            self.require(out.is_null)
            results = [self.new_result(shape, samples, batched) for shape in outputs]
        self.evaluate(batch, samples, [argument.data for argument in arguments], results)
        self.finish(outputs, results)

    # ---- arguments ---------------------------------------------------------------------------------------
    def out_option(self, count: int) -> Address:
        """The array of ``out=``, or null. ``threads=1`` passes; other options go to the Python callable."""
        r = self.r
        out = r.address(r.null)
        with r.unless(self.names.is_null):
            options = r.program.define(_options, _OPTIONS, inlined=False)
            served, output = r.call(options, self.values.after(count), self.names)
            self.require(served)
            out.value = output
        return out.value

    def argument(self, k: int, shape: Shape) -> _Argument:
        """The numbers of argument ``k``."""
        value = self.values[k]
        if not shape:
            return self._number_or_samples(value)
        self.objects.require_array(value, C_CONTIGUOUS_AND_ALIGNED)
        axes = value.int32(ARRAY_NDIM) - len(shape)
        batched = axes == 1
        self.require(batched | (axes == 0))
        dimensions = value.pointer(ARRAY_DIMENSIONS).integers
        self.objects.require_extents(dimensions.after(axes), shape)
        return _Argument(
            data=value.pointer(ARRAY_DATA).reals,
            samples=select(batched, dimensions[0], _NO_SAMPLES),
            size=math.prod(shape),
        )

    def _number_or_samples(self, value: Address) -> _Argument:
        """A float, or an array of one number for each sample."""
        r, objects = self.r, self.objects
        data, samples = r.address(value.after(FLOAT_VALUE)), r.integer(_NO_SAMPLES)
        kind = value.pointer(OBJECT_TYPE)
        with r.unless((kind == objects.known("float_type")) | (kind == objects.known("numpy_float_type"))):
            objects.require_array(value, C_CONTIGUOUS_AND_ALIGNED)
            self.require(value.int32(ARRAY_NDIM) == 1)
            data.value = value.pointer(ARRAY_DATA)
            samples.value = value.pointer(ARRAY_DIMENSIONS).integers[0]
        return _Argument(data=data.value.reals, samples=samples.value, size=1)

    def common_samples(self, arguments: Sequence[_Argument]) -> Integer:
        """The number of samples, or -1 if no argument has the samples' axis. All arguments must agree."""
        common = self.r.constant_integer(_NO_SAMPLES)
        for argument in arguments:
            none = argument.samples == _NO_SAMPLES
            self.require(none | (common == _NO_SAMPLES) | (argument.samples == common))
            common = select(none, common, argument.samples)
        return common

    def batch_function(self, arguments: Sequence[_Argument], batched: Boolean) -> Address:
        """The address of the batch function for these batched inputs; null for one sample."""
        r = self.r
        if len(arguments) > MAX_BATCH_INPUTS:
            self.require(~batched)
            return r.null
        function = r.address(r.null)
        table = r.filled_in(BATCHES, 1 << len(arguments))
        with r.when(batched):
            index = r.constant_integer(0)
            for k, argument in enumerate(arguments):
                index = index | ((argument.samples != _NO_SAMPLES).count() << k)
            batch = table[index]
            self.require(~batch.is_null)
            function.value = batch
        return function.value

    # ---- results -----------------------------------------------------------------------------------------
    def require_small(self, shapes: Sequence[Shape], samples: Integer, out: Address) -> None:
        """Continue only if no new array is large: the Python callable reuses the memory of large arrays."""
        size = max((math.prod(shape) for shape in shapes), default=0)
        if size:
            self.require((samples < -(-MIN_REUSED // size)) | ~out.is_null)

    def new_result(self, shape: Shape, samples: Integer, batched: Boolean) -> _Result:
        """A new array, or memory for one number."""
        result = _Result(object=self.r.address(self.r.null), target=self.r.address(self.r.null))
        self.owned.append(result.object)
        self._allocate(shape, samples, batched, result)
        return result

    def _allocate(self, shape: Shape, samples: Integer, batched: Boolean, result: _Result) -> None:
        if shape:
            self._new_array(shape, samples, batched, result)
            return
        result.target.value = self.r.real(0.0).memory.start
        with self.r.when(batched):
            self._new_array(shape, samples, batched, result)

    def _new_array(self, shape: Shape, samples: Integer, batched: Boolean, result: _Result) -> None:
        r, objects = self.r, self.objects
        dimensions = r.local_integers(len(shape) + 1)
        for axis, extent in enumerate((samples, *shape)):
            dimensions[axis] = extent
        sample_axes = batched.count()
        descr = objects.known("float64")  # a new array takes over one reference
        objects.call(python.reference, descr)
        array = objects.call(
            python.new_array,
            objects.known("array_type"),
            descr,
            (sample_axes + len(shape)).to_int32(),
            dimensions.after(1 - sample_axes),
            r.null,
            r.null,
            r.constant_integer(0).to_int32(),
            r.null,
        )
        self.succeed(array)
        result.object.value = array
        result.target.value = array.pointer(ARRAY_DATA)

    def given_or_new(
        self,
        shape: Shape,
        samples: Integer,
        batched: Boolean,
        out: Address,
        arguments: Sequence[_Argument],
    ) -> _Result:
        """The array of ``out=``, which must have the form of the result, or a new array without ``out=``.

        An array that may share memory with an input goes to the Python callable.
        """
        r = self.r
        result = _Result(object=r.address(r.null), target=r.address(r.null))
        with r.when(out.is_null):
            self._allocate(shape, samples, batched, result)
        with r.otherwise():
            self._require_as_new(out, shape, samples, batched, arguments)
            self.objects.call(python.reference, out)
            result.object.value = out
            result.target.value = out.pointer(ARRAY_DATA)
        self.owned.append(result.object)
        return result

    def _require_as_new(
        self,
        out: Address,
        shape: Shape,
        samples: Integer,
        batched: Boolean,
        arguments: Sequence[_Argument],
    ) -> None:
        """Continue only if the array matches a new array and does not overlap inputs."""
        r, objects = self.r, self.objects
        objects.require_array(out, C_CONTIGUOUS_AND_ALIGNED | WRITEABLE)
        sample_axes = batched.count()
        self.require(out.int32(ARRAY_NDIM) == sample_axes + len(shape))
        dimensions = out.pointer(ARRAY_DIMENSIONS).integers
        if shape:
            objects.require_extents(dimensions.after(sample_axes), shape)
        with r.when(batched):
            self.require(dimensions[0] == samples)
        data = out.pointer(ARRAY_DATA).reals
        end = data.after(select(batched, samples, 1) * math.prod(shape))
        for argument in arguments:
            count = select(argument.samples == _NO_SAMPLES, 1, argument.samples)
            argument_end = argument.data.after(count * argument.size)
            self.require((end.start <= argument.data.start) | (argument_end.start <= data.start))

    # ---- evaluation --------------------------------------------------------------------------------------
    def evaluate(
        self, batch: Address, samples: Integer, inputs: Sequence[Reals], results: Sequence[_Result]
    ) -> None:
        """Evaluate one sample, or evaluate_batch with the function ``batch`` if it is not null."""
        r, objects = self.r, self.objects
        arrays = [*inputs, *(result.target.value.reals for result in results)]
        evaluate_batch = external(_evaluate_batch).at(batch)
        start = r.constant_integer(0)
        with r.when(batch.is_null):
            r.call(self.evaluation, *arrays)
        with r.otherwise():
            with r.when(samples < _LONG_BATCH):
                r.call(evaluate_batch, start, samples, samples, *arrays)
            with r.otherwise():
                state = objects.call(python.save_thread)
                r.call(evaluate_batch, start, samples, samples, *arrays)
                objects.call(python.restore_thread, state)

    def succeed(self, object: Address) -> None:
        """If ``object`` is null, release all owned references and return null, so that an error is raised."""
        with self.r.when(object.is_null, rarely=True):
            for owned in self.owned:
                self.objects.call(python.release, owned.value)
            self.r.return_(self.r.null)

    def finish(self, shapes: Sequence[Shape], results: Sequence[_Result]) -> None:
        """Return the result, or a tuple of several results."""
        r, objects = self.r, self.objects
        for shape, result in zip(shapes, results):
            if not shape:
                self._make_number(result)
        python_objects = [result.object.value for result in results]
        if len(python_objects) == 1:
            r.return_(python_objects[0])
            return
        result_tuple = objects.call(python.new_tuple, r.constant_integer(len(python_objects)))
        self.succeed(result_tuple)
        for k, item in enumerate(python_objects):  # the tuple takes over the references
            objects.call(python.set_item, result_tuple, r.constant_integer(k), item)
        r.return_(result_tuple)

    def _make_number(self, result: _Result) -> None:
        """The ``numpy.float64`` of a scalar result, unless it has been written into an array."""
        with self.r.when(result.object.value.is_null):
            float64 = self.objects.known("float64")
            number = self.objects.call(python.new_scalar, result.target.value, float64, self.r.null)
            self.succeed(number)
            result.object.value = number


def _evaluate(r: Routine, *arrays: Reals) -> None:
    """Evaluate one sample; ``emit_function`` writes the body."""


def _evaluate_batch(r: Routine, start: Integer, stop: Integer, columns: Integer, *arrays: Reals) -> None:
    """Evaluate a batch; :func:`~armblocks.compiler.batch.emit_batch` writes the body in another module."""


def _options(r: Routine, values: Addresses, names: Address) -> tuple[Boolean, Address]:
    """Whether the builtin supports the options, and the array of ``out=``, or null.

    Options are ``threads=1`` and ``out=``. ``out=None`` counts as omitted.
    """
    out = r.address(r.null)
    with r.part() as served:
        objects = _PythonObjects(r, served)
        for k in r.range(0, objects.call(python.tuple_size, names)):
            name, value = objects.call(python.tuple_item, names, k), values[k]
            with r.when(name == objects.known("out_name")):
                out.value = select(value == objects.known("none"), r.null, value)
            with r.otherwise():
                one_thread = (name == objects.known("threads_name")) & (value == objects.known("one"))
                objects.require(one_thread)
        r.return_(r.constant_boolean(True), out.value)
    return r.constant_boolean(False), r.null
