"""Tapes over many samples: a native loop that evaluates as many samples at a time as a register has lanes."""

from __future__ import annotations

from dataclasses import dataclass

from armblocks.compiler.ir_text import Body, Module
from armblocks.compiler.lane_memory import load_rows, store_rows
from armblocks.compiler.layout import BatchLayout, Layout
from armblocks.compiler.pieces import emit_pieces, is_long
from armblocks.compiler.tape import Tape
from armblocks.compiler.tape_operations import Inputs, Registers, emit_operations

__all__ = ["BatchLayout", "Layout", "emit_batch", "emit_shares"]


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
    sample = _block(module, tape, layout, 1, f"{name}.sample", "%k", pointers)
    module.add(
        f"{name}.sample",
        "\n".join(
            [
                f"define internal void @{name}.sample(i64 %k, {declared}) nounwind noinline {{",
                "entry:",
                *sample.room,
                *sample.lines,
                "  ret void\n}",
            ]
        ),
    )
    call = [f"  call void @{name}.sample(i64 %tail, {passed})"]
    if lanes == 1:
        lines = ["  br label %tail.enter", *_loop("tail", "%start", "%stop", 1, call)]
    else:
        block = _block(module, tape, layout, lanes, f"{name}.lanes", "%vector", pointers)
        again = _retry(block, name, passed, lanes)
        lines = [
            *block.room,
            "  %count = sub i64 %stop, %start",
            f"  %odd = and i64 %count, {lanes - 1}",
            "  %first = sub i64 %stop, %odd",
            "  br label %vector.enter",
            *_loop("vector", "%start", "%first", lanes, [*block.lines, *again]),
            "  br label %tail.enter",
            *_loop("tail", "%first", "%stop", 1, call),
        ]
    head = f"define void @{name}(i64 %start, i64 %stop, {declared}) nounwind {{\nentry:"
    module.add(name, "\n".join([head, *lines, "  ret void\n}"]))


def emit_shares(module: Module, tape: Tape, name: str) -> None:
    """Add ``void @name.shares(ptr job, i64 hold, i64 patience, ptr in0, …, ptr out0, …)``.

    Several threads call it with one ``job`` of four i64: the next sample, the count of threads at work, the
    samples of a share, the samples of the batch. Each takes shares until there are none. Then it spins:
    ``hold`` turns in any case, and up to ``patience`` turns while other threads are at work.
    """
    pointers = [f"%i{k}" for k in range(len(tape.input_sizes))] + [f"%o{k}" for k in range(len(tape.outputs))]
    passed = ", ".join(f"ptr {pointer}" for pointer in pointers)
    call = f"  call void @{name}(i64 %start, i64 %stop, i64 %samples, {passed})"
    lines = [
        f"define void @{name}.shares(ptr %job, i64 %hold, i64 %patience, {passed}) nounwind {{",
        "entry:",
        "  %running = getelementptr inbounds i64, ptr %job, i64 1",
        "  %share.at = getelementptr inbounds i64, ptr %job, i64 2",
        "  %samples.at = getelementptr inbounds i64, ptr %job, i64 3",
        "  %share = load i64, ptr %share.at",
        "  %samples = load i64, ptr %samples.at",
        "  %joined = atomicrmw add ptr %running, i64 1 acq_rel",
        "  br label %take",
        "take:",
        "  %start = atomicrmw add ptr %job, i64 %share acq_rel",
        "  %some = icmp slt i64 %start, %samples",
        "  br i1 %some, label %work, label %leave",
        "work:",
        "  %end = add nsw i64 %start, %share",
        "  %whole = icmp slt i64 %end, %samples",
        "  %stop = select i1 %whole, i64 %end, i64 %samples",
        call,
        "  br label %take",
        "leave:",
        "  %left = atomicrmw sub ptr %running, i64 1 acq_rel",
        "  br label %spin",
        "spin:",
        "  %turn = phi i64 [ 0, %leave ], [ %turn.next, %spin ]",
        "  %turn.next = add nsw i64 %turn, 1",
        "  %others = load atomic i64, ptr %running acquire, align 8",
        "  %busy = icmp ne i64 %others, 0",
        "  %patient = icmp slt i64 %turn, %patience",
        "  %waiting = and i1 %busy, %patient",
        "  %holding = icmp slt i64 %turn, %hold",
        "  %stays = or i1 %holding, %waiting",
        "  br i1 %stays, label %spin, label %done",
        "done:",
        "  ret void\n}",
    ]
    module.add(f"{name}.shares", "\n".join(lines))


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


def _retry(block: _Block, name: str, passed: str, lanes: int) -> list[str]:
    """Text that evaluates the block's samples one by one if a function was undecided in any lane."""
    if block.doubtful is None:
        return []
    lines = [
        f"  %doubtful = icmp ne i{lanes} {block.doubtful}, 0",
        "  br i1 %doubtful, label %retry.enter, label %retry.done",
    ]
    body = [
        "  %retry.place = add i64 %vector, %retry",
        f"  call void @{name}.sample(i64 %retry.place, {passed})",
    ]
    return lines + _loop("retry", "0", str(lanes), 1, body)


@dataclass(frozen=True, kw_only=True)
class _Block:
    """Text that evaluates as many samples as lanes; ``doubtful``: the lanes to be done again, as bits."""

    room: tuple[str, ...] = ()
    lines: tuple[str, ...]
    doubtful: str | None


def _block(
    module: Module, tape: Tape, layout: BatchLayout, lanes: int, name: str, sample: str, pointers: list[str]
) -> _Block:
    """Load the samples from ``sample`` on, one per lane, evaluate the tape, store the outputs."""
    groups = _groups(tape, layout, lanes)
    stores = {k: registers for k, (_, _, registers) in enumerate(groups)}

    def inputs_of(body: Body) -> Inputs:
        return _inputs(body, tape, layout, sample)

    def store(body: Body, registers: Registers, k: int) -> None:
        slot, first, members = groups[k]
        columns = [registers.number(register) for register in members]
        if layout.outputs[slot] is Layout.COLUMNS:
            address = _column(body, f"%o{slot}", first, sample)
            body.do(f"store {body.real} {columns[0]}, ptr {address}, align 8")
            return
        size = len(tape.outputs[slot])
        base = body.let(f"getelementptr inbounds double, ptr %o{slot}, i64 {_row(body, sample, size)}")
        store_rows(body, base, size, first, columns)

    if is_long(tape):
        declared = [("i64", sample), ("i64", "%columns")]
        declared += [(f"ptr noalias{' readonly' if p.startswith('%i') else ''}", p) for p in pointers]
        calls = emit_pieces(module, tape, name, lanes, declared, stores, inputs_of, store)
        return _Block(room=(calls.room,), lines=calls.lines, doubtful=calls.doubtful)
    body = Body(module, lanes)
    registers = emit_operations(body, tape, inputs_of(body))
    for k in stores:
        store(body, registers, k)
    doubtful = None
    if body.undecided is not None:
        doubtful = body.let(f"bitcast {body.bit} {body.undecided} to i{lanes}")
    return _Block(lines=tuple(body.lines), doubtful=doubtful)


def _groups(tape: Tape, layout: BatchLayout, lanes: int) -> list[tuple[int, int, tuple[int, ...]]]:
    """Slot, first place and registers of what is stored together: a column, or as many of a row as lanes."""
    groups: list[tuple[int, int, tuple[int, ...]]] = []
    for slot, (members, kind) in enumerate(zip(tape.outputs, layout.outputs)):
        if kind is Layout.COLUMNS:
            groups += [(slot, place, (register,)) for place, register in enumerate(members)]
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
        place = register - start
        if kind is Layout.SHARED:
            address = body.let(f"getelementptr inbounds double, ptr %i{slot}, i64 {place}")
            return body.broadcast(body.let(f"load double, ptr {address}, align 8"))
        if kind is Layout.COLUMNS:
            return body.let(f"load {body.real}, ptr {_column(body, f'%i{slot}', place, sample)}, align 8")
        if slot not in bases:
            row = _row(body, sample, size)
            bases[slot] = body.let(f"getelementptr inbounds double, ptr %i{slot}, i64 {row}")
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

    def block(register: int) -> str | None:
        slot, place = tape.input_place(register)
        kind, size = layout.inputs[slot], tape.input_sizes[slot]
        if kind is Layout.COLUMNS or (kind is Layout.ROWS and body.lanes > 1):
            return None
        begin = "0" if kind is Layout.SHARED else _row(body, sample, size)
        there = body.let(f"add nsw i64 {begin}, {place}")
        return body.let(f"getelementptr inbounds double, ptr %i{slot}, i64 {there}")

    return Inputs(load, load_entry, block)


def _row(body: Body, sample: str, size: int) -> str:
    return body.let(f"mul nsw i64 {sample}, {size}")


def _column(body: Body, pointer: str, place: int, sample: str) -> str:
    line = body.let(f"mul nsw i64 %columns, {place}")
    offset = body.let(f"add nsw i64 {line}, {sample}")
    return body.let(f"getelementptr inbounds double, ptr {pointer}, i64 {offset}")
