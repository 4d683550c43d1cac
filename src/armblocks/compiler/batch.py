"""Tapes over many samples: a native loop that evaluates one sample in each lane of a register."""

from __future__ import annotations

from collections.abc import Sequence

from armblocks.compiler.ir_text import Body, Module
from armblocks.compiler.lane_memory import Line, load_rows, store_rows
from armblocks.compiler.layout import BatchLayout, Layout
from armblocks.compiler.program_text import add_program
from armblocks.compiler.tape import Tape
from armblocks.compiler.tape_operations import Inputs, Registers, emit_operations
from armblocks.compiler.tape_parts import emit_parts, is_long
from armblocks.routines.arithmetic import select
from armblocks.routines.memory import Integers, Reals
from armblocks.routines.routine import Program, Routine, external
from armblocks.routines.values import Boolean, Integer

__all__ = ["BatchLayout", "Layout", "emit_batch", "emit_shares", "pointer_names"]


def emit_batch(module: Module, tape: Tape, layout: BatchLayout, lanes: int, name: str) -> None:
    """Add ``void @name(i64 start, i64 stop, i64 columns, ptr in0, …, ptr out0, …)``.

    It evaluates the samples ``start`` to ``stop - 1``. ``columns`` is N, the length of a line of the arrays
    in column layout. Outputs must not overlap inputs. Values that depend on shared inputs only are computed
    once. Samples that do not fill a register are evaluated with one lane. If a vector function does not
    support a sample, such as the sine of a huge angle, all samples of the register are evaluated with one
    lane. The results are identical.
    """
    _add_block(module, tape, layout, 1, f"{name}.sample")
    if lanes > 1:
        _add_block(module, tape, layout, lanes, f"{name}.lanes")
    sample, block = external(_sample, f"{name}.sample"), external(_lanes, f"{name}.lanes")

    def batch(r: Routine, start: Integer, stop: Integer, columns: Integer, *arrays: Reals) -> None:
        rest = start
        if lanes > 1:
            rest = stop - ((stop - start) & (lanes - 1))
            for first in r.range(start, rest, lanes):
                with r.when(r.call(block, first, columns, *arrays)):
                    for lane in r.range(0, lanes):
                        r.call(sample, first + lane, columns, *arrays)
        for k in r.range(rest, stop):
            r.call(sample, k, columns, *arrays)

    program = Program()
    program.define(batch, name, public=True, distinct=True, rest=pointer_names(tape))
    add_program(module, program)


def emit_shares(module: Module, arrays: Sequence[str], name: str) -> None:
    """Add ``void @name.shares(ptr job, i64 hold, i64 patience, ptr …)``: work sharing.

    It calls ``void @name(i64 start, i64 stop, i64 samples, ptr …)``, which evaluates the samples ``start`` to
    ``stop - 1``, with the pointers that ``arrays`` names. Several threads call the function with one ``job``
    of four i64: the next sample, the number of active threads, the samples of a share, the samples of the
    batch. Each thread takes shares until none is left. Then it spins: always ``hold`` iterations, and up to
    ``patience`` iterations while other threads are active.
    """
    next_sample, active_threads = 0, 1  # indices in the job that threads modify

    def batch(r: Routine, start: Integer, stop: Integer, columns: Integer, *arrays: Reals) -> None:
        """The function that :func:`emit_batch` adds."""

    evaluate = external(batch, name)

    def shares(r: Routine, job: Integers, hold: Integer, patience: Integer, *arrays: Reals) -> None:
        share, samples = job[2], job[3]
        job.fetch_add(active_threads, 1)
        with r.loop() as taking:
            start = job.fetch_add(next_sample, share)
            taking.leave_unless(start < samples)
            end = start + share
            r.call(evaluate, start, select(end < samples, end, samples), samples, *arrays)
        job.fetch_add(active_threads, -1)
        iteration = r.integer(0)
        with r.loop() as spinning:
            passed = iteration.value
            waits = (job.acquire(active_threads) != 0) & (passed < patience)
            spinning.leave_unless((passed < hold) | waits)
            iteration.value = passed + 1

    program = Program()
    program.define(shares, f"{name}.shares", public=True, rest=arrays)
    add_program(module, program)


def _sample(r: Routine, sample: Integer, columns: Integer, *arrays: Reals) -> None:
    """Evaluate one sample; :func:`_add_block` with one lane writes the body."""


def _lanes(r: Routine, first: Integer, columns: Integer, *arrays: Reals) -> Boolean:
    """Evaluate one sample per lane; return whether the samples must be evaluated again with one lane."""
    raise NotImplementedError


def pointer_names(tape: Tape) -> list[str]:
    """Names of the pointers to the inputs and the outputs of a tape."""
    return [f"i{k}" for k in range(len(tape.input_sizes))] + [f"o{k}" for k in range(len(tape.outputs))]


def _add_block(module: Module, tape: Tape, layout: BatchLayout, lanes: int, name: str) -> None:
    """Add the function :func:`_sample` (one lane) or :func:`_lanes`.

    It loads one sample for each lane, evaluates the tape and stores the outputs.
    """
    groups = _groups(tape, layout, lanes)
    stores = {k: registers for k, (_, _, registers) in enumerate(groups)}

    def inputs_of(body: Body) -> Inputs:
        return _inputs(body, tape, layout, "%sample")

    def store(body: Body, registers: Registers, k: int) -> None:
        slot, first, members = groups[k]
        columns = [registers.number(register) for register in members]
        if layout.outputs[slot] is Layout.COLUMNS:
            address = _column(body, f"%o{slot}", first, "%sample")
            body.do(f"store {body.real} {columns[0]}, ptr {address}, align 8")
            return
        size = len(tape.outputs[slot])
        row = _row(body, "%sample", size)
        base = body.let(f"getelementptr inbounds double, ptr %o{slot}, i64 {row}")
        store_rows(body, base, size, first, columns)

    declared = [("i64", "%sample"), ("i64", "%columns")]
    declared += [(f"ptr noalias{' readonly' if p[0] == 'i' else ''}", f"%{p}") for p in pointer_names(tape)]
    body = Body(module, lanes)
    if is_long(tape):
        unsupported = emit_parts(body, tape, name, declared, stores, inputs_of, store)
    else:
        registers = emit_operations(body, tape, inputs_of(body))
        for k in stores:
            store(body, registers, k)
        unsupported = None
        if body.unsupported is not None:
            unsupported = body.let(f"bitcast {body.bit} {body.unsupported} to i{lanes}")
    if lanes == 1:
        result, inlined = "void", "noinline"
        body.do("ret void")
    else:
        # The function is inlined into the loop, so that LLVM computes values of shared inputs before the
        # first iteration. Its parameters are not "noalias", unlike the parameters of the loop; otherwise
        # inlining would add metadata to every access.
        result, inlined = "i1", "alwaysinline"
        declared = [(kind.split()[0], argument) for kind, argument in declared]
        is_any = "false" if unsupported is None else body.let(f"icmp ne i{lanes} {unsupported}, 0")
        body.do(f"ret i1 {is_any}")
    arguments = ", ".join(f"{kind} {argument}" for kind, argument in declared)
    head = f"define internal {result} @{name}({arguments}) nounwind {inlined} {{\nentry:\n"
    module.add(name, head + "\n".join(body.lines) + "\n}")


def _groups(tape: Tape, layout: BatchLayout, lanes: int) -> list[tuple[int, int, tuple[int, ...]]]:
    """Slot, first index and registers of values that are stored together: a column, or part of a row."""
    groups: list[tuple[int, int, tuple[int, ...]]] = []
    for slot, (members, kind) in enumerate(zip(tape.outputs, layout.outputs)):
        if kind is Layout.COLUMNS:
            groups += [(slot, index, (register,)) for index, register in enumerate(members)]
            continue
        for chunk in range(0, len(members), lanes):
            first = min(chunk, max(0, len(members) - lanes))
            groups.append((slot, first, members[first : first + lanes]))
    return groups


def _inputs(body: Body, tape: Tape, layout: BatchLayout, sample: str) -> Inputs:
    bases: dict[int, str] = {}
    loaded: dict[int, str] = {}

    def load(register: int) -> str:
        if register in loaded:
            return loaded[register]
        slot = next(k for k, end in enumerate(tape.input_starts[1:]) if register < end)
        start, size, kind = tape.input_starts[slot], tape.input_sizes[slot], layout.inputs[slot]
        index = register - start
        if kind is Layout.SHARED:
            address = body.let(f"getelementptr inbounds double, ptr %i{slot}, i64 {index}")
            return body.broadcast(body.let(f"load double, ptr {address}, align 8"))
        if kind is Layout.COLUMNS:
            return body.let(f"load {body.real}, ptr {_column(body, f'%i{slot}', index, sample)}, align 8")
        if slot not in bases:
            row = _row(body, sample, size)
            bases[slot] = body.let(f"getelementptr inbounds double, ptr %i{slot}, i64 {row}")
        first = min(index - index % body.lanes, max(0, size - body.lanes))
        for k, value in enumerate(load_rows(body, bases[slot], size, first)[:size]):
            loaded.setdefault(start + first + k, value)
        return loaded[register]

    def line(register: int) -> Line:
        slot, index = tape.input_position(register)
        kind, size, step, lane_stride = layout.inputs[slot], tape.input_sizes[slot], "1", "0"
        if kind is Layout.COLUMNS:
            begin, step, lane_stride = _column(body, f"%i{slot}", index, sample), "%columns", "1"
        else:
            first = "0" if kind is Layout.SHARED else _row(body, sample, size)
            entry = body.let(f"add nsw i64 {first}, {index}")
            begin = body.let(f"getelementptr inbounds double, ptr %i{slot}, i64 {entry}")
            lane_stride = "0" if kind is Layout.SHARED else str(size)
        return Line(address=begin, step=step, lane_stride=lane_stride)

    return Inputs(load, line)


def _row(body: Body, sample: str, size: int) -> str:
    return body.let(f"mul nsw i64 {sample}, {size}")


def _column(body: Body, pointer: str, index: int, sample: str) -> str:
    line = body.let(f"mul nsw i64 %columns, {index}")
    offset = body.let(f"add nsw i64 {line}, {sample}")
    return body.let(f"getelementptr inbounds double, ptr {pointer}, i64 {offset}")
