"""A user-written Python function as a parameter value."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import FunctionType

from armblocks.diagram.function_files import UnloadedFunction, line_of, load_function
from armblocks.errors import InputError


@dataclass(frozen=True, eq=False)
class UserFunction:
    """A Python function as a value, compared by identity, or by code if it has no closure.

    Raises ``InputError`` where its arguments cannot be listed.
    """

    function: Callable[..., object]

    def __post_init__(self) -> None:
        try:
            kinds = [entry.kind for entry in inspect.signature(self.function).parameters.values()]
        except (TypeError, ValueError):
            kinds = [inspect.Parameter.VAR_POSITIONAL]
        plain = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
        if not all(kind in plain for kind in kinds):
            raise InputError(
                f"the arguments of {self.name} cannot be listed",
                allowed="a function with named arguments, such as def law(u, t)",
                fix="write a function around it",
                where=self.name,
            )

    @property
    def name(self) -> str:
        """The name of the function."""
        return str(getattr(self.function, "__name__", "the function"))

    @property
    def arguments(self) -> tuple[str, ...]:
        """The arguments without default, in order."""
        parameters = inspect.signature(self.function).parameters.values()
        return tuple(entry.name for entry in parameters if entry.default is inspect.Parameter.empty)

    @property
    def source(self) -> str:
        """``file.py:name`` of a function at the top level of a file, else ``""``."""
        function = self.function
        if isinstance(function, UnloadedFunction):
            return function.source
        if not isinstance(function, FunctionType) or "<" in function.__qualname__:
            return ""
        file = function.__code__.co_filename
        return f"{file}:{function.__qualname__}" if file.endswith(".py") else ""

    @property
    def shown(self) -> str:
        """``file.py:name`` with the path that user interfaces show."""
        return self.function.shown if isinstance(self.function, UnloadedFunction) else self.source

    def failing_line(self, error: BaseException) -> str:
        """``"law.py, line 7: "``, the line of the function's file that led to an error, or ``""``."""
        file = self.source.rpartition(":")[0]
        line = line_of(error, file) if file else 0
        return f"{Path(file).name}, line {line}: " if line else ""

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, UserFunction):
            return NotImplemented
        return self.function == other.function or (self._code is not None and self._code == other._code)

    def __hash__(self) -> int:
        return hash(self._code or self.function)

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle the function by its name in a module or file; the code itself is not pickled.

        Raises ``InputError`` for other functions.
        """
        function = self.function
        if not isinstance(function, FunctionType) or _is_importable(function):
            return UserFunction, (function,)
        if self.source and function.__qualname__.isidentifier():
            return _from_file, (self.source,)
        raise InputError(
            f"the function {self.name} cannot be pickled: other processes cannot find it by name",
            allowed="functions at the top level of a module or .py file; no lambdas or inner functions",
            fix="define it with def at the top level of a .py file, and import it from there",
            where=f"function {self.name}",
        )

    def __deepcopy__(self, copied: object) -> UserFunction:
        return self

    def __copy__(self) -> UserFunction:
        return self

    @property
    def _code(self) -> tuple[object, ...] | None:
        function = self.function
        if not isinstance(function, FunctionType) or function.__closure__ or not self.source:
            return None
        return (function.__code__, repr(function.__defaults__), repr(function.__kwdefaults__))


def _is_importable(function: FunctionType) -> bool:
    """Whether the function is the attribute of that name of its module."""
    attribute: object = sys.modules.get(function.__module__)
    for name in function.__qualname__.split("."):
        attribute = getattr(attribute, name, None)
    return attribute is function


def _from_file(source: str) -> UserFunction:
    return UserFunction(load_function(source, None))
