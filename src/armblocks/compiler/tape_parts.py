"""Divides long tapes into parts; each part becomes a function.

LLVM's compile time grows faster than linearly with the length of a function, mainly because it compares loads
and stores pairwise. Ten thousand operations take minutes in one function and seconds in parts. Values that a
later part reads are passed through memory. This is slow if many values are reused, as in the dynamics of an
arm, and fast in a chain of blocks. In the length of a part, reads and writes therefore have a higher weight
than arithmetic. The operations and their order are unchanged, and so are the results.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from armblocks.compiler.ir_text import Body
from armblocks.compiler.opcodes import ELEMENTARY, VECTORS, Opcode
from armblocks.compiler.tape import Tape
from armblocks.compiler.tape_operations import Inputs, Registers, emit_operations
from armblocks.compiler.work_space import WorkSpace

MAX_WEIGHT = 2600
"""Maximum weight of a function that is not divided."""
PART_WEIGHT = 600
"""Approximate weight of a part."""
ACCESS_WEIGHT, FUNCTION_WEIGHT = 4, 8
"""Weights of a read or write, and of an elementary function, in operations."""


@dataclass(frozen=True, kw_only=True)
class TapePart:
    """Operations ``first`` to ``last - 1``, and the numbers of the store groups that follow them."""

    first: int
    last: int
    stores: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class DividedTape:
    """A tape divided into parts; ``slots`` are the memory slots of the registers that later parts read."""

    parts: tuple[TapePart, ...]
    slots: dict[int, int]
    size: int


def is_long(tape: Tape) -> bool:
    """Whether a tape should be divided into parts."""
    # The operands of a vector operation are copied in blocks, not read one by one.
    read = {r for opcode, operands in tape.operations if opcode not in VECTORS for r in operands}
    accesses = sum(register < tape.first_constant for register in read) + sum(tape.output_sizes)
    return len(tape.operations) + ACCESS_WEIGHT * accesses > MAX_WEIGHT


Stores = Mapping[int, Sequence[int]]
"""Groups of outputs that are stored together: the registers of each group, by its number."""


def divide(tape: Tape, stores: Stores) -> DividedTape:
    """Divide a tape into parts."""
    first = tape.first_operation
    groups_by_register: dict[int, list[int]] = {}
    for number, registers in stores.items():
        groups_by_register.setdefault(max(registers, default=0), []).append(number)
    parts: list[TapePart] = []
    begin, weight = 0, 0
    pending: list[int] = []
    read: set[int] = set()
    for k, (opcode, operands) in enumerate(tape.operations):
        complete = groups_by_register.pop(first + k, [])
        pending += complete
        single = () if opcode in VECTORS else operands
        new = {register for register in single if register < tape.first_constant} - read
        read |= new
        weight += FUNCTION_WEIGHT if opcode in ELEMENTARY else 1
        weight += ACCESS_WEIGHT * (len(complete) + len(new))
        following = tape.operations[k + 1].opcode if k + 1 < len(tape.operations) else None
        # The members of a vector are in the part that computes it.
        if weight >= PART_WEIGHT and following is not Opcode.MEMBER:
            parts.append(TapePart(first=begin, last=k + 1, stores=tuple(pending)))
            begin, weight, pending = k + 1, 0, []
            read.clear()
    pending += [
        number for numbers in groups_by_register.values() for number in numbers
    ]  # only inputs and constants
    end, limit = len(tape.operations), PART_WEIGHT // ACCESS_WEIGHT
    for start in range(0, max(1, len(pending)), limit):
        parts.append(TapePart(first=begin, last=end, stores=tuple(pending[start : start + limit])))
        begin = end
    return _with_slots(tape, stores, parts)


def _with_slots(tape: Tape, stores: Stores, parts: Sequence[TapePart]) -> DividedTape:
    """Assign memory to each register that a later part reads, reusable after the last of these parts."""
    first = tape.first_operation
    computed_in: dict[int, int] = {}
    last_read: dict[int, int] = {}
    for number, part in enumerate(parts):
        for k in range(part.first, part.last):
            computed_in[first + k] = number
        read = [r for k in range(part.first, part.last) for r in tape.operations[k].operands]
        read += [r for store in part.stores for r in stores[store]]
        for register in read:
            if register >= first:
                last_read[register] = number
    ends: dict[int, list[int]] = {}
    slots: dict[int, int] = {}
    free: list[int] = []
    size = 0
    shared = sorted(register for register, part in last_read.items() if part > computed_in[register])
    starts: dict[int, list[int]] = {}
    for register in shared:
        starts.setdefault(computed_in[register], []).append(register)
    for number in range(len(parts)):
        for register in starts.get(number, []):
            if not free:
                free.append(size)
                size += 1
            slots[register] = free.pop()
            ends.setdefault(last_read[register], []).append(slots[register])
        free += ends.pop(number, [])
    return DividedTape(parts=tuple(parts), slots=slots, size=size)


def emit_parts(
    caller: Body,
    tape: Tape,
    name: str,
    arguments: Sequence[tuple[str, str]],
    stores: Stores,
    inputs_of: Callable[[Body], Inputs],
    store_group: Callable[[Body, Registers, int], None],
) -> str | None:
    """Add the functions of a tape's parts, and to ``caller`` the calls of all of them.

    ``arguments`` are the types and names of the arguments that ``caller`` passes on. ``inputs_of(body)``
    returns the functions with which a body reads the inputs, ``store_group(body, registers, k)`` stores group
    ``k`` of ``stores``. The result has a bit for each lane that must be evaluated with one lane; ``None`` if
    there are no such lanes.
    """
    module, lanes = caller.module, caller.lanes
    divided = divide(tape, stores)
    memory = WorkSpace(caller, divided.size)
    declared = ", ".join([f"{kind} {argument}" for kind, argument in arguments] + ["ptr noalias %memory"])
    passed = [f"{kind.split()[0]} {argument}" for kind, argument in arguments] + [f"ptr {memory.address}"]
    bits = f"i{lanes}"
    unsupported: str | None = None
    for number, part in enumerate(divided.parts):
        body = Body(module, lanes)
        _emit_part(body, tape, divided, part, inputs_of(body), store_group)
        symbol, result = f"{name}.{number}", "void" if body.unsupported is None else bits
        call = f"call {result} @{symbol}({', '.join(passed)})"
        if body.unsupported is None:
            body.do("ret void")
            caller.do(call)
        else:
            body.do(f"ret {bits} {body.let(f'bitcast {body.bit} {body.unsupported} to {bits}')}")
            new = caller.let(call)
            unsupported = new if unsupported is None else caller.let(f"or {bits} {new}, {unsupported}")
        head = f"define internal {result} @{symbol}({declared}) nounwind noinline {{\nentry:\n"
        module.add(symbol, head + "\n".join(body.lines) + "\n}")
    memory.free()
    return unsupported


def _emit_part(
    body: Body,
    tape: Tape,
    divided: DividedTape,
    part: TapePart,
    inputs: Inputs,
    store_group: Callable[[Body, Registers, int], None],
) -> None:
    def address(register: int) -> str:
        offset = divided.slots[register] * body.lanes
        return body.let(f"getelementptr inbounds double, ptr %memory, i64 {offset}")

    def load(register: int) -> str:
        if register < tape.first_operation:
            return inputs.load(register)
        return body.let(f"load {body.real}, ptr {address(register)}, align {8 * body.lanes}")

    registers = emit_operations(body, tape, Inputs(load, inputs.line), selection=range(part.first, part.last))
    for store in part.stores:
        store_group(body, registers, store)
    for register in range(tape.first_operation + part.first, tape.first_operation + part.last):
        if register in divided.slots:
            value = registers.number(register)
            body.do(f"store {body.real} {value}, ptr {address(register)}, align {8 * body.lanes}")
