"""Routines as LLVM IR text.

A temporary is a name that is assigned once; a local variable is a stack slot, which LLVM turns into a
register. Parts of the tree become basic blocks in the order in which they were written. No fast-math flag is
set, and ``fma`` is emitted only on request, so the same operations give the same bits on every processor.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from armblocks.routines.routine import Program
from armblocks.routines.tree import (
    Call,
    Compute,
    Constant,
    Copy,
    FetchAdd,
    Function,
    Jump,
    Kind,
    Load,
    Local,
    Locate,
    Mark,
    Operand,
    Operation,
    Region,
    Return,
    Stage,
    Statement,
    Store,
    Table,
    Temporary,
    When,
)

_TYPES = {
    Kind.REAL: "double",
    Kind.INTEGER: "i64",
    Kind.INT32: "i32",
    Kind.BYTE: "i8",
    Kind.BOOLEAN: "i1",
    Kind.ADDRESS: "ptr",
}
_OF_EACH_LANE = {Kind.LANES: Kind.REAL, Kind.MASK: Kind.BOOLEAN, Kind.INTEGER_LANES: Kind.INTEGER}
_SAME_BITS = {
    (Operation.BITS, Kind.LANES): Kind.INTEGER_LANES,
    (Operation.FROM_BITS, Kind.INTEGER_LANES): Kind.LANES,
}

_TWO_REALS = {
    Operation.ADD: "fadd",
    Operation.SUBTRACT: "fsub",
    Operation.MULTIPLY: "fmul",
    Operation.DIVIDE: "fdiv",
    Operation.LESS: "fcmp olt",
    Operation.LESS_EQUAL: "fcmp ole",
    Operation.EQUAL: "fcmp oeq",
    Operation.NOT_EQUAL: "fcmp une",
    Operation.GREATER: "fcmp ogt",
    Operation.GREATER_EQUAL: "fcmp oge",
    Operation.ORDERED: "fcmp ord",
}
_TWO_INTEGERS = {
    Operation.ADD: "add",
    Operation.SUBTRACT: "sub",
    Operation.MULTIPLY: "mul",
    Operation.DIVIDE: "sdiv",
    Operation.DIVIDE_UNSIGNED: "udiv",
    Operation.REMAINDER_UNSIGNED: "urem",
    Operation.SHIFT_LEFT: "shl",
    Operation.SHIFT_RIGHT: "ashr",
    Operation.AND: "and",
    Operation.OR: "or",
    Operation.LESS: "icmp slt",
    Operation.LESS_EQUAL: "icmp sle",
    Operation.EQUAL: "icmp eq",
    Operation.NOT_EQUAL: "icmp ne",
    Operation.GREATER: "icmp sgt",
    Operation.GREATER_EQUAL: "icmp sge",
}
_TWO_BOOLEANS = {Operation.AND: "and", Operation.OR: "or"}
_TWO_ADDRESSES = {
    Operation.EQUAL: "icmp eq",
    Operation.NOT_EQUAL: "icmp ne",
    Operation.LESS_EQUAL: "icmp ule",
}
_OF_TWO = {
    Kind.REAL: _TWO_REALS,
    Kind.INTEGER: _TWO_INTEGERS,
    Kind.BOOLEAN: _TWO_BOOLEANS,
    Kind.ADDRESS: _TWO_ADDRESSES,
}
_INTRINSICS = {Operation.SQUARE_ROOT: "sqrt", Operation.ABSOLUTE: "fabs"}
_CONVERSIONS = {
    (Operation.TO_REAL, Kind.INTEGER): "sitofp i64 {} to double",
    (Operation.TO_INTEGER, Kind.REAL): "fptosi double {} to i64",
    (Operation.TO_INTEGER, Kind.INT32): "sext i32 {} to i64",
    (Operation.TO_INTEGER, Kind.BOOLEAN): "zext i1 {} to i64",
    (Operation.TO_INT32, Kind.INTEGER): "trunc i64 {} to i32",
    (Operation.BITS, Kind.REAL): "bitcast double {} to i64",
    (Operation.FROM_BITS, Kind.INTEGER): "bitcast i64 {} to double",
}


def number_text(value: float) -> str:
    """A double, exact, as LLVM writes it."""
    return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"


def definitions(program: Program) -> dict[str, str]:
    """The text of every function, table and intrinsic of a program by its symbol."""
    texts: dict[str, str] = {}
    for symbol, part in program.parts.items():
        if isinstance(part, Table):
            texts[symbol] = _table(part)
        else:
            writer = _FunctionText(program.lanes)
            texts[symbol] = writer.text(part)
            texts.update(writer.declared)
    return texts


def _table(table: Table) -> str:
    kind = _TYPES[table.element]
    if table.filled_in:
        return f"@{table.symbol} = global [{len(table.numbers)} x {kind}] zeroinitializer"
    numbers = ", ".join(f"{kind} {_literal(table.element, number)}" for number in table.numbers)
    # An array without elements may have the address of another object.
    numbers = numbers or f"{kind} {_literal(table.element, 0)}"
    return f"@{table.symbol} = internal constant [{max(1, len(table.numbers))} x {kind}] [{numbers}]"


def _literal(kind: Kind, value: float | None) -> str:
    if value is None:
        return "null"
    if kind is Kind.REAL:
        return number_text(value)
    return str(value).lower() if kind is Kind.BOOLEAN else str(int(value))


class _FunctionText:
    """The text of one function."""

    def __init__(self, lanes: int) -> None:
        self.lanes = lanes
        self.declared: dict[str, str] = {}
        self._lines: list[str] = []
        self._slots: list[str] = []
        self._names: dict[Temporary | Local, str] = {}
        self._labels: dict[Mark, str] = {}
        self._results: tuple[Kind, ...] = ()
        self._count = 0
        self._ended = False
        """Whether the last line ends a basic block: a branch or a return."""

    def text(self, function: Function) -> str:
        """The whole definition."""
        self._results = function.results
        for parameter in function.parameters:
            self._names[parameter] = f"%{parameter.name}"
        self._part(function.body)
        alias = " noalias" if function.distinct else ""
        arguments = ", ".join(
            f"{self._type(parameter.kind)}{alias if parameter.kind is Kind.ADDRESS else ''} %{parameter.name}"
            for parameter in function.parameters
        )
        linkage = "" if function.public else "internal "
        inlined = {True: " alwaysinline", False: " noinline", None: ""}[function.inlined]
        head = f"define {linkage}{self._result(function.results)} @{function.symbol}({arguments})"
        head += f"{inlined} nounwind {{"
        return "\n".join([head, "entry:", *self._slots, *self._lines, "}"])

    # Types and names.

    def _type(self, kind: Kind) -> str:
        if kind not in _OF_EACH_LANE:
            return _TYPES[kind]
        single = _TYPES[_OF_EACH_LANE[kind]]
        return single if self.lanes == 1 else f"<{self.lanes} x {single}>"

    def _result(self, kinds: Sequence[Kind]) -> str:
        """The type that a function returns."""
        types = ", ".join(map(self._type, kinds))
        return types if len(kinds) == 1 else f"{{ {types} }}" if kinds else "void"

    def _typed(self, operand: Operand) -> str:
        """The type of an operand; for a variable or a table, the type of its address."""
        return "ptr" if isinstance(operand, Local | Table) else self._type(operand.kind)

    def _constant(self, constant: Constant) -> str:
        if constant.kind not in _OF_EACH_LANE:
            return _literal(constant.kind, constant.value)
        kind = _OF_EACH_LANE[constant.kind]
        literal = _literal(kind, constant.value)
        return literal if self.lanes == 1 else f"splat ({_TYPES[kind]} {literal})"

    def _operand(self, operand: Operand) -> str:
        if isinstance(operand, Constant):
            return self._constant(operand)
        if isinstance(operand, Table):
            return f"@{operand.symbol}"
        name = self._names.get(operand)
        if name is None:  # the first use of a variable; a temporary gets its name where it is computed
            assert isinstance(operand, Local), "a value is used where it is not valid"
            name = self._names[operand] = f"%x{len(self._slots) + 1}"
            kind = self._type(operand.kind)
            kind = kind if operand.count == 1 else f"[{operand.count} x {kind}]"
            self._slots.append(f"  {name} = alloca {kind}")
        return name

    def _assign(self, temporary: Temporary, text: str) -> str:
        """Append the line that computes a temporary; return its name."""
        name = self._names[temporary] = self._append_value(text)
        return name

    def _append_value(self, text: str) -> str:
        """Append a line that computes a value; return its name."""
        self._count += 1
        self._lines.append(f"  %v{self._count} = {text}")
        return f"%v{self._count}"

    def _label(self, mark: Mark) -> str:
        label = self._labels.get(mark)
        if label is None:
            label = self._labels[mark] = self._new_label(mark.name)
        return label

    def _new_label(self, name: str) -> str:
        self._count += 1
        return f"{name.replace(' ', '.')}{self._count}"

    # Blocks.

    def _begin_block(self, label: str) -> None:
        """Begin a basic block; the previous block branches to it, unless that block has ended."""
        if not self._ended:
            self._lines.append(f"  br label %{label}")
        self._lines.append(f"{label}:")
        self._ended = False

    def _end_block(self, line: str) -> None:
        self._lines.append(f"  {line}")
        self._ended = True

    def _part(self, statements: Sequence[Statement]) -> None:
        for statement, next_statement in zip(statements, [*statements[1:], None]):
            if not self._ended or isinstance(statement, Stage):  # unreachable statements are omitted
                self._statement(statement, next_statement)

    def _statement(self, statement: Statement, next_statement: Statement | None) -> None:
        match statement:
            case Jump(mark):
                self._end_block(f"br label %{self._label(mark)}")
            case Return(values):
                self._return(values)
            case Stage(mark):
                self._begin_block(self._label(mark))
            case Region():
                self._region(statement)
            case When():
                self._when(statement, next_statement)
            case _:
                self._simple_statement(statement)

    def _return(self, values: Sequence[Operand]) -> None:
        if not values:
            return self._end_block("ret void")
        text, result = self._operand(values[0]), self._result(self._results)
        if len(values) > 1:
            text = "poison"
            for k, value in enumerate(values):
                part = f"{self._typed(value)} {self._operand(value)}"
                text = self._append_value(f"insertvalue {result} {text}, {part}, {k}")
        return self._end_block(f"ret {result} {text}")

    def _region(self, region: Region) -> None:
        if region.start.used:
            self._begin_block(self._label(region.start))
        self._part(region.body)
        if region.end.used:
            self._begin_block(self._label(region.end))

    def _when(self, when: When, next_statement: Statement | None) -> None:
        """A conditional branch. If a part, or the statement after it, is only a jump, the branch goes to the
        target of the jump."""
        condition = self._operand(when.condition)
        if when.rarely:
            self._declare("i1", "llvm.expect.i1", "i1", "i1")
            condition = self._append_value(f"call i1 @llvm.expect.i1(i1 {condition}, i1 false)")
        jumps = [self._only_jump(when.yes), self._only_jump(when.no)]
        jump_follows = isinstance(next_statement, Jump)
        after = (
            self._label(next_statement.mark) if isinstance(next_statement, Jump) else self._new_label("after")
        )
        parts: list[tuple[str, list[Statement]]] = []
        for k, (name, part) in enumerate((("when", when.yes), ("otherwise", when.no))):
            if not part:
                jumps[k] = after
            elif not jumps[k]:
                jumps[k] = self._new_label(name)
                parts.append((jumps[k], part))
        self._end_block(f"br i1 {condition}, label %{jumps[0]}, label %{jumps[1]}")
        joined = after in jumps
        for label, part in parts:
            self._begin_block(label)
            self._part(part)
            if not self._ended:
                joined = True
                self._end_block(f"br label %{after}")
        if joined and not jump_follows:
            self._begin_block(after)

    def _only_jump(self, part: Sequence[Statement]) -> str:
        return self._label(part[0].mark) if part and isinstance(part[0], Jump) else ""

    # Statements.

    def _simple_statement(self, statement: Statement) -> None:
        match statement:
            case Compute(result, operation, operands):
                self._assign(result, self._operation(operation, operands))
            case Locate(result, base, index, element):
                text = f"getelementptr inbounds {self._type(element)}, ptr {self._operand(base)}"
                self._assign(result, f"{text}, i64 {self._operand(index)}")
            case Load(result, address, acquiring):
                kind = self._type(result.kind)
                atomic, order = (" atomic", " acquire, align 8") if acquiring else ("", "")
                self._assign(result, f"load{atomic} {kind}, ptr {self._operand(address)}{order}")
            case FetchAdd(result, address, value):
                pointer = self._operand(address)
                self._assign(result, f"atomicrmw add ptr {pointer}, i64 {self._operand(value)} acq_rel")
            case Store(value, address):
                self._line(f"store {self._typed(value)} {self._operand(value)}, ptr {self._operand(address)}")
            case Copy(source, target, size):
                self._declare("void", "llvm.memcpy.p0.p0.i64", "ptr", "ptr", "i64", "i1")
                target, source, size = (self._operand(operand) for operand in (target, source, size))
                arguments = f"ptr {target}, ptr {source}, i64 {size}, i1 false"
                self._line(f"call void @llvm.memcpy.p0.p0.i64({arguments})")
            case Call():
                self._call(statement)
            case _:
                raise AssertionError(statement)

    def _call(self, call: Call) -> None:
        arguments = ", ".join(
            f"{self._typed(argument)} {self._operand(argument)}" for argument in call.arguments
        )
        result = self._result([result.kind for result in call.results])
        name = f"@{call.function}" if isinstance(call.function, str) else self._operand(call.function)
        text = f"call {result} {name}({arguments})"
        if not call.results:
            self._line(text)
        elif len(call.results) == 1:
            self._assign(call.results[0], text)
        else:
            together = self._append_value(text)
            for k, part in enumerate(call.results):
                self._assign(part, f"extractvalue {result} {together}, {k}")

    def _line(self, text: str) -> None:
        self._lines.append(f"  {text}")

    def _operation(self, operation: Operation, operands: Sequence[Operand]) -> str:
        kind = Kind.ADDRESS if isinstance(operands[0], Local | Table) else operands[0].kind
        texts = [self._operand(operand) for operand in operands]
        if operation is Operation.SELECT:
            second = self._typed(operands[1])
            return f"select {self._type(kind)} {texts[0]}, {second} {texts[1]}, {second} {texts[2]}"
        if operation is Operation.ANY:
            return self._any(texts[0])
        if operation is Operation.LANE_BITS:
            return self._lane_bits(texts[0])
        if (operation, kind) in _SAME_BITS:
            return f"bitcast {self._type(kind)} {texts[0]} to {self._type(_SAME_BITS[operation, kind])}"
        if operation is Operation.SPREAD:
            return self._in_all_lanes(texts[0])
        if operation is Operation.FMA:
            return self._fma(kind, texts)
        if operation in _INTRINSICS:
            return self._intrinsic(_INTRINSICS[operation], kind, *texts)
        if operation is Operation.NEGATE:
            return f"fneg {self._type(kind)} {texts[0]}"
        if operation is Operation.NOT:
            return f"xor {self._type(kind)} {texts[0]}, {self._constant(Constant(kind, True))}"
        if (operation, kind) in _CONVERSIONS:
            return _CONVERSIONS[operation, kind].format(texts[0])
        table = _OF_TWO[_OF_EACH_LANE.get(kind, kind)]
        return f"{table[operation]} {self._type(kind)} {texts[0]}, {texts[1]}"

    def _in_all_lanes(self, number: str) -> str:
        if self.lanes == 1:
            return f"bitcast double {number} to double"
        lanes = self._type(Kind.LANES)
        first = self._append_value(f"insertelement {lanes} poison, double {number}, i64 0")
        return f"shufflevector {lanes} {first}, {lanes} poison, <{self.lanes} x i32> zeroinitializer"

    def _any(self, mask: str) -> str:
        if self.lanes == 1:
            return f"or i1 {mask}, false"
        bits = self._append_value(f"bitcast {self._type(Kind.MASK)} {mask} to i{self.lanes}")
        return f"icmp ne i{self.lanes} {bits}, 0"

    def _lane_bits(self, mask: str) -> str:
        if self.lanes == 1:
            return f"zext i1 {mask} to i64"
        bits = self._append_value(f"bitcast {self._type(Kind.MASK)} {mask} to i{self.lanes}")
        return f"zext i{self.lanes} {bits} to i64"

    def _fma(self, kind: Kind, operands: Sequence[str]) -> str:
        call = self._intrinsic("fma", kind, *operands)
        if self._type(kind) != "double":
            return call
        # For -(a b + c) LLVM selects ARM64's FNMADD, which computes (-a) b + (-c). If the sum is exactly zero
        # that gives +0 instead of -0. The barrier keeps the two operations apart. Vectors have no such
        # instruction.
        return self._intrinsic("arithmetic.fence", kind, self._append_value(call))

    def _intrinsic(self, name: str, kind: Kind, *operands: str) -> str:
        number = self._type(kind)
        symbol = f"llvm.{name}.{'f64' if number == 'double' else f'v{self.lanes}f64'}"
        self._declare(number, symbol, *[number] * len(operands))
        return f"call {number} @{symbol}({', '.join(f'{number} {operand}' for operand in operands)})"

    def _declare(self, result: str, symbol: str, *arguments: str) -> None:
        self.declared[symbol] = f"declare {result} @{symbol}({', '.join(arguments)})"
