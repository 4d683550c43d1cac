"""Tapes as LLVM IR.

To write native code around compiled equations, such as the loop of an integrator::

    def write() -> str:
        module = Module()
        emit_function(module, tape, "f")      # define internal void @f(ptr in0, …, ptr out0, …)
        program = Program()                   # armblocks.routines
        program.define(loop, public=True)     # … r.call(f, t, x, p, xd) …, with f declared as external
        add_program(module, program)
        return module.text

    code = load_code(("loop", tape.digest), write)       # armblocks.compiler.native, with the disk cache
    address = code.address("loop")

Each pointer points to the flat ``double`` vector of one slot of a :class:`~armblocks.equations.Signature`.
"""

from __future__ import annotations

from collections.abc import Sequence

from armblocks.compiler.ir_text import Body, Module
from armblocks.compiler.lane_memory import Line
from armblocks.compiler.tape import Tape
from armblocks.compiler.tape_operations import Inputs, Registers, emit_operations
from armblocks.compiler.tape_parts import emit_parts, is_long
from armblocks.routines.llvm import number_text

MIN_TABLE_CONSTANTS = 32
"""Minimum number of constants of an output that are copied from a table."""


def emit_function(module: Module, tape: Tape, name: str, *, linkage: str = "internal") -> None:
    """Add ``void @name(ptr in0, …, ptr out0, …)``: one evaluation of the tape, one lane.

    One pointer to flat doubles for each input slot, then one for each output slot, 8-byte aligned, in the
    order of the signatures (``derivative``: ``t, x, p, xd``). Outputs must not overlap inputs or each other.
    Slots of size 0 also have a pointer, which is not read. Every output is written on each call. ``linkage``
    is ``internal`` for functions called within the module, or ``""`` (external) for functions whose address
    is needed.
    """

    pointers = [("ptr noalias readonly", f"%i{k}") for k in range(len(tape.input_sizes))]
    pointers += [("ptr noalias", f"%o{k}") for k in range(len(tape.outputs))]

    def inputs_of(body: Body) -> Inputs:
        def address(register: int) -> str:
            slot, index = tape.input_position(register)
            return body.let(f"getelementptr inbounds double, ptr %i{slot}, i64 {index}")

        def load(register: int) -> str:
            return body.let(f"load double, ptr {address(register)}, align 8")

        def line(register: int) -> Line:
            return Line(address=address(register))

        return Inputs(load, line)

    def write() -> str:
        body = Body(module)
        outputs: dict[int, list[str]] = {}
        for slot, members in enumerate(tape.outputs):
            copied = _copy_constants(body, tape, members, slot, f"{name}.constants{slot}")
            for index, register in enumerate(members):
                if not (copied and tape.first_constant <= register < tape.first_operation):
                    outputs.setdefault(register, []).append(f"ptr %o{slot}, i64 {index}")

        def store(body: Body, registers: Registers, register: int) -> None:
            for index in outputs[register]:
                address = body.let(f"getelementptr inbounds double, {index}")
                body.do(f"store double {registers.number(register)}, ptr {address}, align 8")

        if is_long(tape):
            groups = {register: (register,) for register in outputs}
            emit_parts(body, tape, name, pointers, groups, inputs_of, store)
        else:
            # Each result is stored as soon as it is computed. Thousands of results stored at the end would be
            # spilled and reloaded, and the compile time would grow with the square of their number.
            stored: set[int] = set()

            def written(register: int, registers: Registers) -> None:
                if register in outputs:
                    stored.add(register)
                    store(body, registers, register)

            registers = emit_operations(body, tape, inputs_of(body), written)
            for register in outputs:
                if register not in stored:
                    store(body, registers, register)
        body.do("ret void")
        arguments = ", ".join(f"{kind} {pointer}" for kind, pointer in pointers)
        head = f"define {linkage} void @{name}({arguments}) nounwind {{\nentry:\n"
        return head + "\n".join(body.lines) + "\n}"

    module.define(name, write)


def _copy_constants(body: Body, tape: Tape, members: Sequence[int], slot: int, symbol: str) -> bool:
    """Copy an output with many constants, such as a Jacobian, from a table; return whether this was done.

    LLVM would search for the neighbours of each store of a constant, which takes long.
    """
    span = range(tape.first_constant, tape.first_operation)
    values = [tape.constants[k - span.start] if k in span else 0.0 for k in members]
    if sum(k in span for k in members) < MIN_TABLE_CONSTANTS:
        return False
    module = body.module
    numbers = ", ".join(f"double {number_text(value)}" for value in values)
    module.add(symbol, f"@{symbol} = internal constant [{len(values)} x double] [{numbers}]")
    module.declare("void", "llvm.memcpy.p0.p0.i64", "ptr", "ptr", "i64", "i1")
    size = f"i64 {8 * len(values)}, i1 false"
    body.do(f"call void @llvm.memcpy.p0.p0.i64(ptr align 8 %o{slot}, ptr align 8 @{symbol}, {size})")
    return True
