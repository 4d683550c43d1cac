"""temporary"""

from armblocks.compiler.opcodes import Opcode


def sine_cosine(body, x):
    return body.intrinsic("sin", x), body.intrinsic("cos", x)


def call(body, opcode, values):
    name = {Opcode.POWER: "pow"}.get(opcode, opcode.name.lower())
    if name in (
        "sin",
        "cos",
        "exp",
        "log",
        "pow",
        "tan",
        "asin",
        "acos",
        "atan",
        "atan2",
        "sinh",
        "cosh",
        "tanh",
    ):
        return body.intrinsic(name, *values)
    name = {Opcode.MODULO: "fmod"}.get(opcode, name)
    assert body.lanes == 1
    body.module.declare("double", name, *["double"] * len(values))
    return body.let(f"call double @{name}(" + ", ".join("double " + v for v in values) + ")")
