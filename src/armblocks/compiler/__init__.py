"""From traced equations to machine code: tape, LLVM IR, kernels, the disk cache.

No module here knows of robots, diagrams or blocks, and only :mod:`armblocks.compiler.from_casadi` knows
CasADi's graphs. ``llvmlite`` is imported when something is first compiled or loaded.
"""

from armblocks.compiler.kernel import Kernel, compile_function
from armblocks.compiler.opcodes import Opcode
from armblocks.compiler.recall import recall
from armblocks.compiler.tape import OperationCount, Tape

__all__ = ["Kernel", "Opcode", "OperationCount", "Tape", "compile_function", "recall"]
