"""Translation of CasADi graphs to tapes: the only CasADi-dependent module of the numerics."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import casadi
from casadi import SX, Function

from armblocks import interrupts
from armblocks.compiler.matrix_products import with_matrix_products
from armblocks.compiler.opcodes import Opcode
from armblocks.compiler.tape import Tape
from armblocks.compiler.tape_builder import TapeBuilder
from armblocks.equations import TracedFunction
from armblocks.equations.linear_solution import derivative_rule, solution_size
from armblocks.errors import CompileError

# Operations with the same meaning in CasADi and in a tape, by CasADi's name.
_EQUIVALENTS = {
    "OP_ADD": Opcode.ADD,
    "OP_SUB": Opcode.SUBTRACT,
    "OP_MUL": Opcode.MULTIPLY,
    "OP_DIV": Opcode.DIVIDE,
    "OP_NEG": Opcode.NEGATE,
    "OP_SQRT": Opcode.SQUARE_ROOT,
    "OP_FABS": Opcode.ABSOLUTE,
    "OP_SIGN": Opcode.SIGN,
    "OP_FLOOR": Opcode.FLOOR,
    "OP_CEIL": Opcode.CEILING,
    "OP_FMIN": Opcode.MINIMUM,
    "OP_FMAX": Opcode.MAXIMUM,
    "OP_COPYSIGN": Opcode.COPY_SIGN,
    "OP_FMOD": Opcode.MODULO,
    "OP_REMAINDER": Opcode.REMAINDER,
    "OP_LT": Opcode.LESS,
    "OP_LE": Opcode.LESS_EQUAL,
    "OP_EQ": Opcode.EQUAL,
    "OP_NE": Opcode.NOT_EQUAL,
    "OP_NOT": Opcode.NOT,
    "OP_AND": Opcode.AND,
    "OP_OR": Opcode.OR,
    "OP_SIN": Opcode.SIN,
    "OP_COS": Opcode.COS,
    "OP_TAN": Opcode.TAN,
    "OP_ASIN": Opcode.ASIN,
    "OP_ACOS": Opcode.ACOS,
    "OP_ATAN": Opcode.ATAN,
    "OP_ATAN2": Opcode.ATAN2,
    "OP_SINH": Opcode.SINH,
    "OP_COSH": Opcode.COSH,
    "OP_TANH": Opcode.TANH,
    "OP_ASINH": Opcode.ASINH,
    "OP_ACOSH": Opcode.ACOSH,
    "OP_ATANH": Opcode.ATANH,
    "OP_EXP": Opcode.EXP,
    "OP_EXPM1": Opcode.EXPM1,
    "OP_LOG": Opcode.LOG,
    "OP_LOG1P": Opcode.LOG1P,
    "OP_POW": Opcode.POWER,
    "OP_CONSTPOW": Opcode.POWER,
    "OP_HYPOT": Opcode.HYPOT,
    "OP_ERF": Opcode.ERF,
}
_NAMES: dict[int, str] = {
    int(number): name
    for name, number in vars(casadi).items()
    if name.startswith("OP_") and isinstance(number, int)
}
_OPCODES = {
    number: (_EQUIVALENTS[name], _EQUIVALENTS[name].arity)
    for number, name in _NAMES.items()
    if name in _EQUIVALENTS
}


def tape_from(traced: TracedFunction) -> Tape:
    """The tape of a traced function.

    Raises :class:`CompileError` with its name if the graph has an unsupported operation.
    """
    interrupts.check()
    function = Function("f", list(traced.arguments), [*traced.results, traced.rounded], {"cse": True})
    builder = TapeBuilder([slot.size for slot in traced.inputs])
    inputs = [[builder.input(k, index) for index in range(slot.size)] for k, slot in enumerate(traced.inputs)]
    outputs = [[builder.constant(0.0)] * slot.size for slot in traced.outputs]
    rows = [function.sparsity_out(k).row() for k in range(len(outputs))]
    *entries_of_slots, rounded = _inlined(builder, function, inputs, traced.name)
    for slot, entries in enumerate(entries_of_slots):
        for index, handle in zip(rows[slot], entries):
            outputs[slot][index] = handle
    return with_matrix_products(builder.build(outputs, rounded))


def _inlined(
    builder: TapeBuilder, function: Function, inputs: Sequence[Sequence[int]], name: str
) -> list[list[int]]:
    """Handles of all structural entries of a function's outputs, from the handles of its inputs."""
    outputs = [[-1] * function.nnz_out(k) for k in range(function.n_out())]
    work = [-1] * function.sz_w()  # handle of the value that each work slot holds now
    called: SX | None = None
    for k in range(function.n_instructions()):
        number = function.instruction_id(k)
        targets, sources = function.instruction_output(k), function.instruction_input(k)
        equivalent = _OPCODES.get(number)
        if equivalent is not None:
            opcode, arity = equivalent
            operands = [work[source] for source in sources[:arity]]
            work[targets[0]] = builder.add(opcode, *operands)
        elif number == casadi.OP_OUTPUT:
            slot, index = targets
            outputs[slot][index] = work[sources[0]]
        elif number == casadi.OP_INPUT:
            slot, index = sources
            work[targets[0]] = inputs[slot][index]
        elif number == casadi.OP_CONST:
            work[targets[0]] = builder.constant(function.instruction_constant(k))
        elif number == casadi.OP_CALL:
            called = function.instructions_sx() if called is None else called
            arguments = [work[source] for source in sources]
            results = _call(builder, called[k].which_function(), arguments, name)
            for target, handle in zip(targets, results):
                if target >= 0:
                    work[target] = handle
        else:
            work[targets[0]] = _translate(builder, number, [work[source] for source in sources], name)
    return outputs


def _call(builder: TapeBuilder, function: Function, arguments: Sequence[int], name: str) -> list[int]:
    """A linear solution (:mod:`armblocks.equations.linear_solution`), or one of its derivatives."""
    size = solution_size(function.name())
    if size is not None:
        # CasADi stores matrices by columns.
        by_rows = [arguments[column * size + row] for row in range(size) for column in range(size)]
        solved = builder.add(Opcode.SOLVE, *by_rows, *arguments[size * size :])
        return [builder.add(Opcode.MEMBER, solved, builder.constant(float(k))) for k in range(size)]
    rule = derivative_rule(function.name())
    if rule is None:
        raise CompileError(
            f"the equations call the function {function.name()}",
            where=name,
            allowed="calls of linear_solution",
            fix="let CasADi inline the function",
        )
    starts = itertools.accumulate((rule.nnz_in(k) for k in range(rule.n_in())), initial=0)
    inputs = [arguments[start:end] for start, end in itertools.pairwise(starts)]
    return [handle for entries in _inlined(builder, rule, inputs, name) for handle in entries]


def _translate(builder: TapeBuilder, number: int, operands: Sequence[int], name: str) -> int:
    """An operation of CasADi that needs several tape operations."""
    if number == casadi.OP_SQ:
        return builder.add(Opcode.MULTIPLY, operands[0], operands[0])
    if number == casadi.OP_TWICE:
        return builder.add(Opcode.ADD, operands[0], operands[0])
    if number == casadi.OP_INV:
        return builder.add(Opcode.DIVIDE, builder.constant(1.0), operands[0])
    if number == casadi.OP_IF_ELSE_ZERO:
        return builder.add(Opcode.SELECT, operands[0], operands[1], builder.constant(0.0))
    if number == casadi.OP_ASSIGN:
        return operands[0]
    if number == casadi.OP_PRINTME:
        return _read(builder, operands[0], operands[1], name)
    raise CompileError(
        f"the equations use the operation {_NAMES.get(number, number)}",
        where=name,
        allowed="CasADi SX operations with a scalar meaning, such as +, sin, if_else",
        fix="write the equation with other operations",
    )


def _read(builder: TapeBuilder, table: int, second: int, name: str) -> int:
    """An indexed read in the form of :mod:`armblocks.equations.table_reading`."""
    count = builder.value(second)
    if count is not None and count < 0.0:
        return builder.add(Opcode.READ, table, builder.constant(-count), builder.constant(0.0))
    start = builder.operands_of(table, Opcode.READ)
    if start is None or not builder.is_input(start[0]):
        raise CompileError(
            "a table that is not a parameter of the system is read",
            where=name,
            allowed="tables that are parameters, not computed from other parameters",
            fix="pass the table as a parameter of the block",
        )
    return builder.add(Opcode.READ, start[0], start[1], second)
