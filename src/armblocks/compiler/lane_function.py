"""A tape as a function of rows of lanes, for native loops that evaluate a sample in each lane."""

from __future__ import annotations

from armblocks.compiler.ir_text import Body, Module
from armblocks.compiler.lane_memory import Line
from armblocks.compiler.tape import Tape
from armblocks.compiler.tape_operations import Inputs, Registers, emit_operations
from armblocks.compiler.tape_parts import emit_parts, is_long


def emit_lane_function(
    module: Module, tape: Tape, name: str, lanes: int, *, reports_unsupported: bool = False
) -> None:
    """Add ``void @name(ptr in0, …, ptr out0, …)``: the tape in each lane.

    Each pointer points to rows of one double for each lane, aligned to the size of a row, with one row for
    each number of the slot. Outputs must not overlap inputs or each other. Unlike the functions of a batch,
    lanes with arguments that vector functions do not support, such as the sine of 1e300, are not evaluated
    again. Their results are invalid; the caller must avoid such arguments. With ``reports_unsupported`` the
    function returns these lanes: an integer (i64) with a bit for each lane.
    """
    pointers = [("ptr noalias readonly", f"%i{k}") for k in range(len(tape.input_sizes))]
    pointers += [("ptr noalias", f"%o{k}") for k in range(len(tape.outputs))]

    def row(body: Body, pointer: str, index: int) -> str:
        return body.let(f"getelementptr inbounds {body.real}, ptr {pointer}, i64 {index}")

    def inputs_of(body: Body) -> Inputs:
        def address(register: int) -> str:
            slot, index = tape.input_position(register)
            return row(body, f"%i{slot}", index)

        def load(register: int) -> str:
            return body.let(f"load {body.real}, ptr {address(register)}, align {8 * lanes}")

        def line(register: int) -> Line:
            return Line(address=address(register), step=str(lanes), lane_stride="1")

        return Inputs(load, line)

    places = {
        slot_start + index: (slot, index)
        for slot, slot_start in enumerate(_starts(tape.output_sizes))
        for index in range(tape.output_sizes[slot])
    }

    def store(body: Body, registers: Registers, place: int) -> None:
        slot, index = places[place]
        value = registers.number(tape.outputs[slot][index])
        target = row(body, f"%o{slot}", index)
        body.do(f"store {body.real} {value}, ptr {target}, align {8 * lanes}")

    def write() -> str:
        body = Body(module, lanes)
        if is_long(tape):
            groups = {place: (tape.outputs[slot][index],) for place, (slot, index) in places.items()}
            unsupported = emit_parts(body, tape, name, pointers, groups, inputs_of, store)
        else:
            registers = emit_operations(body, tape, inputs_of(body))
            for place in places:
                store(body, registers, place)
            unsupported = None
            if reports_unsupported and body.unsupported is not None:
                unsupported = body.let(f"bitcast {body.bit} {body.unsupported} to i{lanes}")
        result = "void"
        if reports_unsupported:
            result = "i64"
            body.do(f"ret i64 {body.let(f'zext i{lanes} {unsupported} to i64') if unsupported else '0'}")
        else:
            body.do("ret void")
        arguments = ", ".join(f"{kind} {pointer}" for kind, pointer in pointers)
        head = f"define internal {result} @{name}({arguments}) nounwind {{\nentry:\n"
        return head + "\n".join(body.lines) + "\n}"

    module.define(name, write)


def _starts(sizes: tuple[int, ...]) -> list[int]:
    starts = [0]
    for size in sizes:
        starts.append(starts[-1] + size)
    return starts[:-1]
