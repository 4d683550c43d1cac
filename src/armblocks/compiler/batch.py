"""Tapes over many samples: a native loop that evaluates as many samples at a time as a register has lanes."""

from __future__ import annotations

from armblocks.compiler.ir_text import Body, Module
from armblocks.compiler.lane_memory import load_rows, store_rows
from armblocks.compiler.layout import BatchLayout, Layout
from armblocks.compiler.llvm_ir import Registers, emit_operations
from armblocks.compiler.tape import Tape

__all__ = ["BatchLayout", "Layout", "emit_batch"]


def emit_batch(module: Module, tape: Tape, layout: BatchLayout, lanes: int, name: str) -> None:
    """Add ``void @name(i64 start, i64 stop, i64 columns, ptr in0, …, ptr out0, …)``.

    It evaluates the samples ``start`` to ``stop - 1``. ``columns`` is N, the length of a line of the arrays
    in column layout. Outputs must not overlap inputs. What only depends on shared inputs is worked out
    once. Samples that do not fill a register, and blocks with a sample that a vector function leaves
    undecided (the sine of a huge angle), are evaluated with one lane: the bits are the same.
    """
    pointers = [f"%i{k}" for k in range(len(tape.input_sizes))] + [f"%o{k}" for k in range(len(tape.outputs))]
    passed = ", ".join(["i64 %columns", *(f"ptr {pointer}" for pointer in pointers)])
    declared = ", ".join(
        ["i64 %columns"] + [f"ptr noalias {'readonly ' if p.startswith('%i') else ''}{p}" for p in pointers]
    )
    sample = Body(module)
    _emit_block(sample, tape, layout, "%k")
    module.add(
        f"{name}.sample",
        "\n".join(
            [
                f"define internal void @{name}.sample(i64 %k, {declared}) nounwind noinline {{",
                "entry:",
                *sample.lines,
                "  ret void\n}",
            ]
        ),
    )
    call = [f"  call void @{name}.sample(i64 %tail, {passed})"]
    if lanes == 1:
        lines = ["  br label %tail.enter", *_loop("tail", "%start", "%stop", 1, call)]
    else:
        block = Body(module, lanes)
        _emit_block(block, tape, layout, "%vector")
        again = _retry(block, name, passed)
        lines = [
            "  %count = sub i64 %stop, %start",
            f"  %odd = and i64 %count, {lanes - 1}",
            "  %first = sub i64 %stop, %odd",
            "  br label %vector.enter",
            *_loop("vector", "%start", "%first", lanes, block.lines + again),
            "  br label %tail.enter",
            *_loop("tail", "%first", "%stop", 1, call),
        ]
    head = f"define void @{name}(i64 %start, i64 %stop, {declared}) nounwind {{\nentry:"
    module.add(name, "\n".join([head, *lines, "  ret void\n}"]))


def _loop(name: str, start: str, stop: str, step: int, body: list[str]) -> list[str]:
    """Text of ``for (%name = start; %name < stop; %name += step)``, entered at the label ``name.enter``."""
    return [
        f"{name}.enter:",
        f"  %{name}.any = icmp slt i64 {start}, {stop}",
        f"  br i1 %{name}.any, label %{name}.head, label %{name}.done",
        f"{name}.head:",
        f"  %{name} = phi i64 [ {start}, %{name}.enter ], [ %{name}.next, %{name}.latch ]",
        *body,
        f"  br label %{name}.latch",
        f"{name}.latch:",
        f"  %{name}.next = add nsw i64 %{name}, {step}",
        f"  %{name}.more = icmp slt i64 %{name}.next, {stop}",
        f"  br i1 %{name}.more, label %{name}.head, label %{name}.done",
        f"{name}.done:",
    ]


def _retry(block: Body, name: str, passed: str) -> list[str]:
    """Text that evaluates the block's samples one by one if a function was undecided in any lane."""
    if block.undecided is None:
        return []
    lines = [
        f"  %doubt = bitcast {block.bit} {block.undecided} to i{block.lanes}",
        f"  %doubtful = icmp ne i{block.lanes} %doubt, 0",
        "  br i1 %doubtful, label %retry.enter, label %retry.done",
    ]
    body = [
        "  %retry.place = add i64 %vector, %retry",
        f"  call void @{name}.sample(i64 %retry.place, {passed})",
    ]
    return lines + _loop("retry", "0", str(block.lanes), 1, body)


def _emit_block(body: Body, tape: Tape, layout: BatchLayout, sample: str) -> None:
    """Load the samples from ``sample`` on, one per lane, evaluate the tape, store the outputs."""
    bases = {
        slot: body.let(f"getelementptr inbounds double, ptr %i{slot}, i64 {_row(body, sample, size)}")
        for slot, (size, kind) in enumerate(zip(tape.input_sizes, layout.inputs))
        if kind is Layout.ROWS
    }
    loaded: dict[int, str] = {}

    def load(register: int) -> str:
        if register in loaded:
            return loaded[register]
        slot = next(k for k, end in enumerate(tape.input_starts[1:]) if register < end)
        start, size, kind = tape.input_starts[slot], tape.input_sizes[slot], layout.inputs[slot]
        place = register - start
        if kind is Layout.SHARED:
            address = body.let(f"getelementptr inbounds double, ptr %i{slot}, i64 {place}")
            return body.broadcast(body.let(f"load double, ptr {address}, align 8"))
        if kind is Layout.COLUMNS:
            return body.let(f"load {body.real}, ptr {_column(body, f'%i{slot}', place, sample)}, align 8")
        first = min(place - place % body.lanes, max(0, size - body.lanes))
        for k, value in enumerate(load_rows(body, bases[slot], size, first)[:size]):
            loaded.setdefault(start + first + k, value)
        return loaded[register]

    def load_entry(first: int, behind: str) -> str:
        slot, place = tape.input_place(first)
        kind, size = layout.inputs[slot], tape.input_sizes[slot]

        def address(entry: str, lane: int) -> str:
            there = body.let(f"add nsw i64 {entry}, {place}")
            if kind is not Layout.SHARED:
                own = body.let(f"add nsw i64 {sample}, {lane}")
                line, across = (there, "%columns") if kind is Layout.COLUMNS else (own, str(size))
                begin = body.let(f"mul nsw i64 {line}, {across}")
                there = body.let(f"add nsw i64 {begin}, {own if kind is Layout.COLUMNS else there}")
            return body.let(f"getelementptr inbounds double, ptr %i{slot}, i64 {there}")

        return body.gather(address, behind)

    registers = emit_operations(body, tape, load, load_entry)
    for slot, (members, kind) in enumerate(zip(tape.outputs, layout.outputs)):
        if kind is Layout.COLUMNS:
            for place, register in enumerate(members):
                address = _column(body, f"%o{slot}", place, sample)
                body.do(f"store {body.real} {registers.number(register)}, ptr {address}, align 8")
        else:
            _store_slot(body, slot, members, registers, sample)


def _store_slot(body: Body, slot: int, members: tuple[int, ...], registers: Registers, sample: str) -> None:
    size = len(members)
    base = body.let(f"getelementptr inbounds double, ptr %o{slot}, i64 {_row(body, sample, size)}")
    for chunk in range(0, size, body.lanes):
        first = min(chunk, max(0, size - body.lanes))
        columns = [registers.number(register) for register in members[first : first + body.lanes]]
        store_rows(body, base, size, first, columns)


def _row(body: Body, sample: str, size: int) -> str:
    return body.let(f"mul nsw i64 {sample}, {size}")


def _column(body: Body, pointer: str, place: int, sample: str) -> str:
    line = body.let(f"mul nsw i64 %columns, {place}")
    offset = body.let(f"add nsw i64 {line}, {sample}")
    return body.let(f"getelementptr inbounds double, ptr {pointer}, i64 {offset}")
