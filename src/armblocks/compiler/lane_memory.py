"""Loads and stores of samples: sample ``k + lane`` of a block is in lane ``lane``.

Arrays in row layout (one sample after the other) are read and written in full registers, which are transposed
by log2(lanes) rounds of shuffles. This is much faster than one element at a time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armblocks.compiler.ir_text import Body
from armblocks.compiler.program_text import add_program
from armblocks.routines.memory import Reals
from armblocks.routines.routine import Program, Routine
from armblocks.routines.values import Integer


@dataclass(frozen=True, kw_only=True)
class Line:
    """The memory positions of an input register and the following registers of its slot.

    The first is at ``address``. ``step`` is the stride from a register to the next, ``lane_stride`` from a
    lane to the next, both in doubles and as LLVM values of type i64.
    """

    address: str
    step: str = "1"
    lane_stride: str = "0"

    def is_plain_array(self, lanes: int) -> bool:
        """Whether the numbers are contiguous, and the same in all ``lanes``."""
        return self.step == "1" and (lanes == 1 or self.lane_stride == "0")

    def read(self, body: Body, index: str) -> str:
        """The number at ``index``, counted in registers from the first; ``index`` has one value per lane."""

        def address(entry: str, lane: int) -> str:
            offset = body.let(f"mul nsw i64 {entry}, {self.step}")
            if lane > 0 and self.lane_stride != "0":
                lane_offset = body.let(f"mul nsw i64 {self.lane_stride}, {lane}")
                offset = body.let(f"add nsw i64 {offset}, {lane_offset}")
            return body.let(f"getelementptr inbounds double, ptr {self.address}, i64 {offset}")

        return body.gather(address, index)

    def copy(self, body: Body, target: str, length: int) -> None:
        """Copy ``length`` numbers to ``target``: for each number a row with its value in every lane."""
        if body.lanes == 1 and self.step == "1":
            body.module.declare("void", "llvm.memcpy.p0.p0.i64", "ptr", "ptr", "i64", "i1")
            pointers = f"ptr align 8 {target}, ptr align 8 {self.address}"
            body.do(f"call void @llvm.memcpy.p0.p0.i64({pointers}, i64 {8 * length}, i1 false)")
            return
        lanes = body.lanes

        def copied(
            r: Routine, target: Reals, source: Reals, count: Integer, step: Integer, apart: Integer
        ) -> None:
            for k in r.range(0, count):
                for lane in range(lanes):
                    target[k * lanes + lane] = source[k * step + apart * lane]

        program = Program()
        symbol = program.define(copied, f"copied.{lanes}", inlined=False).symbol
        add_program(body.module, program)
        steps = f"i64 {length}, i64 {self.step}, i64 {self.lane_stride}"
        body.do(f"call void @{symbol}(ptr {target}, ptr {self.address}, {steps})")


def load_rows(body: Body, pointer: str, size: int, first: int) -> list[str]:
    """Columns ``first`` … ``first + lanes - 1`` of the block of rows at ``pointer``, each over all lanes.

    ``pointer`` is to the first row of the block; rows have ``size`` numbers and follow each other. Columns
    beyond ``size`` are poison. Nothing outside the block is read.
    """
    lanes = body.lanes
    if lanes == 1 or size == 1:
        return [_load(body, pointer, first)] + ["poison"] * (lanes - 1)
    rows: list[str] = []
    for row in range(lanes):
        begin = row * size + first
        excess = max(0, begin + lanes - lanes * size)
        value = _load(body, pointer, begin - excess)
        if excess:  # read the last full register of the block, then shift
            lane_indices = [lane + excess if lane + excess < lanes else None for lane in range(lanes)]
            value = shuffle(body, value, "poison", lane_indices)
        rows.append(value)
    return transpose(body, rows)


def store_rows(body: Body, pointer: str, size: int, first: int, columns: Sequence[str]) -> None:
    """Write ``columns`` as columns ``first`` … of the block of rows at ``pointer``.

    There are ``lanes`` columns, or ``size`` if ``size`` is smaller. Nothing outside the block is written.
    """
    lanes = body.lanes
    if lanes == 1 or size == 1:
        _store(body, pointer, first, columns[0])
        return
    width = len(columns)
    rows = transpose(body, [*columns, *["poison"] * (lanes - width)])
    for row, value in enumerate(rows):
        begin = row * size + first
        if width == lanes or begin + lanes <= lanes * size:
            # Lanes beyond the end of the row overwrite the next row, which is written afterwards.
            _store(body, pointer, begin, value)
            continue
        done = 0
        while done < width:
            count = 1 << ((width - done).bit_length() - 1)
            _store_part(body, pointer, begin + done, value, range(done, done + count))
            done += count


def transpose(body: Body, rows: Sequence[str]) -> list[str]:
    """Transpose a square block with as many rows as lanes (a power of two)."""
    lanes = body.lanes
    values = list(rows)
    half = 1
    while half < lanes:
        # Swap the off-diagonal half x half blocks within each 2 half x 2 half block.
        for upper in range(lanes):
            if upper & half:
                continue
            lower = upper + half
            a, b = values[upper], values[lower]
            low = [lane if not lane & half else lanes + lane - half for lane in range(lanes)]
            high = [lane + half if not lane & half else lanes + lane for lane in range(lanes)]
            values[upper], values[lower] = shuffle(body, a, b, low), shuffle(body, a, b, high)
        half *= 2
    return values


def shuffle(body: Body, a: str, b: str, indices: Sequence[int | None]) -> str:
    """A vector of selected lanes: ``indices`` are positions into ``a`` followed by ``b``; None: any value."""
    if a == "poison" and b == "poison":
        return "poison"
    mask = ", ".join("i32 poison" if index is None else f"i32 {index}" for index in indices)
    vector = f"<{body.lanes} x double>"
    return body.let(f"shufflevector {vector} {a}, {vector} {b}, <{len(indices)} x i32> <{mask}>")


def _load(body: Body, pointer: str, offset: int) -> str:
    address = body.let(f"getelementptr inbounds double, ptr {pointer}, i64 {offset}")
    return body.let(f"load {body.real}, ptr {address}, align 8")


def _store(body: Body, pointer: str, offset: int, value: str) -> None:
    address = body.let(f"getelementptr inbounds double, ptr {pointer}, i64 {offset}")
    body.do(f"store {body.real} {value}, ptr {address}, align 8")


def _store_part(body: Body, pointer: str, offset: int, value: str, lanes: range) -> None:
    address = body.let(f"getelementptr inbounds double, ptr {pointer}, i64 {offset}")
    if len(lanes) == 1:
        element = body.let(f"extractelement {body.real} {value}, i64 {lanes[0]}")
        body.do(f"store double {element}, ptr {address}, align 8")
        return
    part = shuffle(body, value, "poison", list(lanes))
    body.do(f"store <{len(lanes)} x double> {part}, ptr {address}, align 8")
