"""From traced equations to machine code: tape, LLVM IR, kernels, the disk cache.

The modules here are independent of robots, diagrams and blocks, and only
:mod:`armblocks.compiler.from_casadi` depends on CasADi. ``llvmlite`` is imported at the first compilation or
load.
"""

from armblocks.compiler.kernel import Kernel, compile_function
from armblocks.compiler.kernel_cache import cached_kernel
from armblocks.compiler.opcodes import Opcode
from armblocks.compiler.tape import OperationCount, Tape

__all__ = ["Kernel", "Opcode", "OperationCount", "Tape", "cached_kernel", "compile_function"]
