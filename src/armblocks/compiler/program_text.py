"""Routines as functions of a module of LLVM IR."""

from __future__ import annotations

from armblocks.compiler.ir_text import Module
from armblocks.routines.llvm import definitions
from armblocks.routines.routine import Program


def add_program(module: Module, program: Program) -> None:
    """Add all functions and tables of a program. External functions must be defined in the module."""
    for symbol, text in definitions(program).items():
        module.add(symbol, text)
