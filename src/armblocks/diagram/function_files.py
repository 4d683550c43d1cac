"""Python functions in files: the only place that runs the code of a file.

:func:`load_function` and :func:`run_source` run code and are for trusted files. :func:`functions_of` parses a
file as data and runs nothing.
"""

from __future__ import annotations

import ast
import inspect
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib.abc import SourceLoader
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

from armblocks.errors import FormatError

Signature = tuple[inspect.Parameter, ...]
_ALLOWED = "file.py:name, relative to the diagram"


def load_function(reference: str, folder: Path | None) -> Callable[..., object]:
    """The function ``file.py:name``. **Runs the file.**

    The path is relative to ``folder``. Raises ``FormatError`` where there is no such file or function, or the
    file's code fails.
    """
    path, name = split_reference(reference)
    file = Path(path) if folder is None else folder / path
    if not file.is_file():
        raise _no_function(reference)
    spec = spec_from_file_location(file.stem, file)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    return _function_in(module, spec.loader.exec_module, file, path, name)


def run_source(source: bytes, file: Path, path: str, name: str) -> Callable[..., object]:
    """The function ``name`` of a file with this content. **Runs the content**, not the file.

    ``path`` is the file's name in messages. Raises ``FormatError`` as :func:`load_function` does.
    """
    loader = _Source(source, file)
    spec = spec_from_file_location(file.stem, file, loader=loader)
    assert spec is not None
    return _function_in(module_from_spec(spec), loader.exec_module, file, path, name)


class _Source(SourceLoader):
    """Loads a module from given bytes; bytecode files are neither read nor written."""

    def __init__(self, source: bytes, file: Path) -> None:
        self._source = source
        self._file = file

    def get_filename(self, fullname: str) -> str:
        return str(self._file)

    def get_data(self, path: str | bytes) -> bytes:
        return self._source


def _function_in(
    module: ModuleType, run: Callable[[ModuleType], None], file: Path, path: str, name: str
) -> Callable[..., object]:
    try:
        run(module)
    except Exception as error:
        line = line_of(error, str(file))
        raise FormatError(
            f"the code of {path}{f', line {line},' if line else ''} fails: {type(error).__name__}: {error}"[
                :300
            ],
            where=str(file),
            fix="run the file with Python, and correct the reported error",
        ) from error
    function = vars(module).get(name)
    if not callable(function):
        raise FormatError(
            f"{path} has no function named '{name}'",
            fix="correct the name",
            where=str(file),
            allowed="a function at the top level of the file",
        )
    return function


def split_reference(reference: str) -> tuple[str, str]:
    """The path and the name of ``file.py:name``. Raises ``FormatError``."""
    path, _, name = reference.rpartition(":")
    if not path.endswith(".py") or not name.isidentifier():
        raise _no_function(reference)
    return path, name


def _no_function(reference: str) -> FormatError:
    return FormatError(
        f"'{reference}' is not a function of a file",
        allowed=_ALLOWED,
        where=f"function '{reference[:80]}'",
        fix="write the file's path from the diagram's folder, a colon, and the function's name",
    )


def line_of(error: BaseException, file: str) -> int:
    """The line of a file at which an error occurred, 0 if the file is not part of the traceback."""
    line = 0
    if isinstance(error, SyntaxError) and error.filename == file:
        line = error.lineno or 0
    trace = error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == file:
            line = trace.tb_lineno
        trace = trace.tb_next
    return line


@dataclass(frozen=True)
class FunctionOutline:
    """A function at the top level of a file: name, arguments, line number and first line of its docstring."""

    name: str
    arguments: Signature
    line: int
    doc: str


def functions_of(source: bytes, path: str) -> Mapping[str, FunctionOutline]:
    """The functions that a file defines with ``def`` at its top level. The file is parsed and not run.

    Raises ``FormatError`` for a file that is not Python.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about invalid escape sequences in strings
            tree = ast.parse(source, path)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        line = error.lineno if isinstance(error, SyntaxError) else None
        problem = error.msg if isinstance(error, SyntaxError) else str(error) or "it is nested too deeply"
        raise FormatError(
            f"the file is not Python{f': line {line}' if line else ''}: {problem}"[:300],
            where=path,
            fix="correct this line",
        ) from None
    return {
        node.name: FunctionOutline(
            node.name,
            tuple(_arguments(node.args)),
            node.lineno,
            (ast.get_docstring(node) or "").split("\n")[0],
        )
        for node in tree.body
        if isinstance(node, ast.FunctionDef)
    }


def _arguments(declared: ast.arguments) -> Iterator[inspect.Parameter]:
    kinds = inspect.Parameter
    plain = [*declared.posonlyargs, *declared.args]
    for k, argument in enumerate(plain):
        kind = kinds.POSITIONAL_ONLY if k < len(declared.posonlyargs) else kinds.POSITIONAL_OR_KEYWORD
        default = ... if k >= len(plain) - len(declared.defaults) else kinds.empty
        yield kinds(argument.arg, kind, default=default)
    if declared.vararg is not None:
        yield kinds(declared.vararg.arg, kinds.VAR_POSITIONAL)
    for argument, value in zip(declared.kwonlyargs, declared.kw_defaults):
        yield kinds(argument.arg, kinds.KEYWORD_ONLY, default=kinds.empty if value is None else ...)
    if declared.kwarg is not None:
        yield kinds(declared.kwarg.arg, kinds.VAR_KEYWORD)


@dataclass(frozen=True, eq=False)
class UnloadedFunction:
    """Placeholder for a function of a file whose code has not been run; a call raises ``fault``.

    ``source`` is ``/folder/file.py:name``, ``shown`` the same with the path that user interfaces show.
    """

    source: str
    shown: str
    arguments: Signature
    fault: FormatError

    @property
    def __name__(self) -> str:
        return self.source.rpartition(":")[2]

    @property
    def __signature__(self) -> inspect.Signature:
        return inspect.Signature(self.arguments)

    def __call__(self, *_: object, **__: object) -> object:
        raise self.fault

    def __eq__(self, other: object) -> bool:
        return isinstance(other, UnloadedFunction) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)

    @property
    def _content(self) -> tuple[str, Signature]:
        return self.source, self.arguments


def unloaded(function: object) -> UnloadedFunction | None:
    """The placeholder itself if the function is not loaded, else ``None``."""
    return function if isinstance(function, UnloadedFunction) else None
