"""The content of a user's Python function for hashing: its code, and the global names that it uses."""

from __future__ import annotations

from collections.abc import Callable
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any, cast

import numpy as np

_PURE_BUILTINS = frozenset(
    (
        *(
            "abs",
            "all",
            "any",
            "divmod",
            "enumerate",
            "filter",
            "isinstance",
            "len",
            "map",
            "max",
            "min",
            "pow",
        ),
        *("range", "reversed", "round", "slice", "sorted", "sum", "zip"),
        *("bool", "complex", "dict", "float", "frozenset", "int", "list", "set", "str", "tuple", "type"),
        *("Exception", "IndexError", "KeyError", "RuntimeError", "TypeError", "ValueError"),
    )
)
_KNOWN_MODULES = ("math", "cmath", "numpy", "casadi", "armblocks")
"""Modules whose content is identified by their versions."""
_IMPURE_NAMES = frozenset(
    ("fromfile", "fromregex", "genfromtxt", "load", "loadtxt", "memmap", "open_memmap", "random")
)
"""Names in those modules whose results depend on files, or differ at each call."""


class UnknownContentError(Exception):
    """The content cannot be determined; caught by :func:`~armblocks.diagram.content_key`."""


def function_parts(function: Callable[..., object]) -> list[object]:
    """Values that identify the function: numbers, lists, arrays and strings.

    The values cover code, default values, closure variables, and the content of the global names that it
    uses, including functions. Raises ``UnknownContentError`` where the content of a name cannot be
    determined.
    """
    return _parts(function, [])


def _parts(function: object, callers: list[object]) -> list[object]:
    if any(function is other for other in callers):
        return ["calls itself", next(k for k, other in enumerate(callers) if other is function)]
    module = str(getattr(function, "__module__", None) or "")
    if _is_known_module(module) and isinstance(
        function, FunctionType | BuiltinFunctionType | np.ufunc | type
    ):
        return ["known", module, getattr(function, "__qualname__", function.__name__)]
    if isinstance(function, np.ufunc):
        return ["known", "numpy", function.__name__]
    if not isinstance(function, FunctionType):
        raise UnknownContentError(f"{function!r}")
    callers = [*callers, function]
    try:
        cells = [cell.cell_contents for cell in function.__closure__ or ()]
    except ValueError:
        raise UnknownContentError("a closure variable without a value") from None
    module_globals = cast("dict[str, object]", function.__globals__)
    parts: list[object] = ["code", *_code_parts(function.__code__)]
    parts += [_value(value, callers) for value in function.__defaults__ or ()]
    parts += [[name, _value(value, callers)] for name, value in (function.__kwdefaults__ or {}).items()]
    parts += [_value(value, callers) for value in cells]
    for name in sorted(_global_names(function.__code__)):
        if name in module_globals:
            parts.append([name, _value(module_globals[name], callers)])
        elif name not in _PURE_BUILTINS:
            raise UnknownContentError(name)
    return parts


def _value(value: object, callers: list[object]) -> object:
    """The content of a default value, a closure variable or the value of a global name."""
    if isinstance(value, ModuleType):
        if not _is_known_module(value.__name__):
            raise UnknownContentError(value.__name__)
        return ["module", value.__name__]
    if isinstance(value, tuple | list):
        return [_value(entry, callers) for entry in cast("tuple[object, ...]", value)]
    if isinstance(value, dict):
        entries = cast("dict[object, object]", value)
        return ["dict", *([_value(key, callers), _value(entry, callers)] for key, entry in entries.items())]
    if value is None or isinstance(value, bool | int | float | complex | str | bytes):
        return value
    if isinstance(value, np.ndarray | np.generic) and not cast("Any", value).dtype.hasobject:
        return cast("object", value)
    return _parts(cast("object", value), callers)


def _code_parts(code: CodeType) -> list[object]:
    """The bytecode with its constants and names, without file names and line numbers."""
    constants = [_constant(entry) for entry in code.co_consts]
    names = [list(part) for part in (code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars)]
    counts = [code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags]
    return [code.co_code, code.co_exceptiontable, *counts, *names, constants]


def _constant(entry: object) -> object:
    if isinstance(entry, CodeType):
        return _code_parts(entry)
    if isinstance(entry, tuple | frozenset):
        parts = [_constant(part) for part in cast("tuple[object, ...]", entry)]
        return parts if isinstance(entry, tuple) else sorted(map(repr, parts))
    return "..." if entry is ... else entry


def _global_names(code: CodeType) -> set[str]:
    """The global names that the function uses.

    Raises ``UnknownContentError`` where it imports a user's module or reads files.
    """
    import dis  # imported here: most diagrams have no function

    names: set[str] = set()
    for instruction in dis.get_instructions(code):
        if instruction.opname in ("LOAD_GLOBAL", "LOAD_NAME"):
            names.add(str(instruction.argval))
        elif instruction.opname == "IMPORT_NAME" and not _is_known_module(str(instruction.argval)):
            raise UnknownContentError(str(instruction.argval))
    if _IMPURE_NAMES.intersection(code.co_names):
        raise UnknownContentError(", ".join(_IMPURE_NAMES.intersection(code.co_names)))
    for entry in code.co_consts:
        if isinstance(entry, CodeType):
            names |= _global_names(entry)
    return names


def _is_known_module(name: str) -> bool:
    return name.split(".")[0] in _KNOWN_MODULES
