"""Expansion of a xacro file in a separate process: ``python -m armblocks.formats.urdf.xacro_process``.

xacro evaluates Python expressions of the file. Here each expression is checked first. It may contain numbers,
strings, operators, comprehensions over lists, and calls of the functions that xacro documents. Lambda
functions, names and attributes that begin with an underscore, and attributes of frames and generators are
refused.
The process has limits of memory and processor time, and the process that started it ends it after a time.

Files are included from ``$(find package)``, ``package://`` and paths relative to the file, inside the root of
the request. Environment variables are not read.
"""

from __future__ import annotations

import ast
import importlib
import json
import sys
from pathlib import Path
from typing import Any, NoReturn

from armblocks.errors import ArmblocksError
from armblocks.files import read_bounded
from armblocks.formats.file_findings import FileContext
from armblocks.formats.referenced_files import package_folder, resolved
from armblocks.formats.xml_elements import read_elements

MAX_BYTES = 4 * 2**20
"""Maximum size of an included file."""
MAX_EXPRESSION = 2000
"""Maximum number of characters of an expression."""
MEMORY = 2 * 2**30
"""Maximum memory of the process, bytes."""

_ALLOWED = (
    *(ast.Expression, ast.Constant, ast.Name, ast.Load, ast.Store, ast.Attribute, ast.Call, ast.keyword),
    *(ast.BinOp, ast.UnaryOp, ast.BoolOp, ast.Compare, ast.IfExp, ast.operator, ast.unaryop, ast.boolop),
    *(ast.cmpop, ast.List, ast.Tuple, ast.Dict, ast.Set, ast.Subscript, ast.Slice, ast.Starred),
    *(ast.ListComp, ast.DictComp, ast.SetComp, ast.comprehension, ast.JoinedStr, ast.FormattedValue),
)
_FORBIDDEN = {"type", "vars", "format", "format_map", "mro"}
_FORBIDDEN_PREFIXES = ("_", "gi_", "cr_", "ag_", "f_", "tb_", "co_", "func_")


class RefusalError(Exception):
    """An expression or a file that is not allowed."""


def check_expression(text: str) -> None:
    """Raise ``RefusalError`` for an expression that could do more than compute a value."""
    if len(text) > MAX_EXPRESSION:
        raise RefusalError(f"an expression has {len(text)} characters; at most {MAX_EXPRESSION} are allowed")
    for node in ast.walk(ast.parse(text.strip(), mode="eval")):
        names = (getattr(node, key, None) for key in ("id", "attr", "arg"))
        for name in (name for name in names if isinstance(name, str)):
            if name in _FORBIDDEN or name.startswith(_FORBIDDEN_PREFIXES):
                raise RefusalError(f"the name '{name[:40]}' is not allowed in expressions")
        if not isinstance(node, _ALLOWED):
            raise RefusalError(f"{type(node).__name__} is not allowed in expressions")


def expanded(request: dict[str, Any]) -> str:
    """The URDF text of a request: ``text``, ``folder``, ``root``, ``packages``, ``arguments``."""
    folder = Path(request["folder"]) if request["folder"] else None
    context = FileContext(
        folder=folder,
        root=Path(request["root"]) if request["root"] else None,
        packages={name: Path(path) for name, path in request["packages"].items()},
    )
    xacro: Any = importlib.import_module("xacro")
    _restrict(xacro, context)
    xacro.init_stacks(str((folder or Path()) / request["name"]))
    document = xacro.xml.dom.minidom.parseString(request["text"].encode())
    xacro.process_doc(document, mappings=request["arguments"], verbosity=0)
    return document.toprettyxml(indent=" ")


def _restrict(xacro: Any, context: FileContext) -> None:
    """Replace the functions of xacro that evaluate expressions and open files."""
    substitution: Any = importlib.import_module("xacro.substitution_args")
    evaluate = xacro.safe_eval

    def checked_evaluation(expression: str, symbols: Any, local: Any = None) -> Any:
        check_expression(expression)
        return evaluate(expression, symbols, local)

    def start() -> Path | None:
        return Path(xacro.filestack[-1]).parent if xacro.filestack and xacro.filestack[-1] else None

    def path_of(reference: str) -> str:
        # xacro calls this function again with the path that it returned.
        path = resolved(str(reference), context, start())
        if isinstance(path, str):
            raise RefusalError(f"'{str(reference)[:100]}' is not included: {path}")
        return str(path)

    def find(package: str) -> str:
        folder = package_folder(package, context, start())
        if folder is None:
            raise RefusalError(
                f"the package '{package[:60]}' of $(find …) is not found; give its folder with packages"
            )
        return str(folder)

    def parse(text: Any, file: str | None = None) -> Any:
        data = read_bounded(path_of(file or ""), MAX_BYTES)
        read_elements(data, str(file))  # refuses document types, entities and deep nesting
        return xacro.xml.dom.minidom.parseString(data)

    def load_yaml(file: str) -> Any:
        yaml: Any = importlib.import_module("yaml")
        for unit in xacro.ConstructUnits:
            yaml.SafeLoader.add_constructor(unit.value.tag, unit.constructor)
        return xacro.YamlListWrapper.wrap(yaml.safe_load(read_bounded(path_of(file), MAX_BYTES)))

    def no_environment(name: str) -> NoReturn:
        raise RefusalError(f"$(env {name[:60]}): environment variables are not read; use $(arg …)")

    def default_value(name: str, default: str = "") -> str:
        return default

    def argument_evaluation(expression: str, values: Any) -> str:
        arguments = {
            name: substitution.convert_value(value, "auto") for name, value in values.get("arg", {}).items()
        }
        symbols = {**xacro._global_symbols, **arguments, "arg": arguments.__getitem__, "find": find}
        return str(checked_evaluation(expression, symbols))

    xacro.safe_eval = checked_evaluation
    xacro.abs_filename_spec = path_of
    xacro.parse = parse
    xacro.load_yaml = load_yaml
    xacro._global_symbols["xacro"].update(load_yaml=load_yaml, abs_filename=path_of)
    xacro._global_symbols.update(load_yaml=load_yaml, abs_filename=path_of)
    substitution._eval = argument_evaluation
    substitution._eval_find = find
    substitution._eval_env = no_environment
    substitution._eval_optenv = default_value


def _limit_resources(seconds: float) -> None:
    """Limit memory and processor time, where the system can."""
    try:
        import resource
    except ImportError:  # Windows
        return
    whole = int(seconds) + 1
    for kind, most in ((resource.RLIMIT_AS, MEMORY), (resource.RLIMIT_CPU, whole)):
        try:
            resource.setrlimit(kind, (most, most))
        except (OSError, ValueError):
            continue


def _reason(error: BaseException) -> str:
    """The text of the innermost error."""
    visited_ids: set[int] = set()
    while id(error) not in visited_ids:
        visited_ids.add(id(error))
        inner = getattr(error, "exc", None) or error.__cause__
        if isinstance(inner, BaseException):
            error = inner
    if isinstance(error, ArmblocksError):
        return f"{error.where}: {error.what}"
    if isinstance(error, RefusalError):
        return str(error)
    return f"{error}" if str(error) else type(error).__name__


def main() -> None:
    """Read the request from the standard input, write the reply to the standard output, both as JSON."""
    request = json.load(sys.stdin)
    _limit_resources(request["seconds"])
    output = sys.stdout
    sys.stdout = sys.stderr  # xacro prints messages
    try:
        reply = {"text": expanded(request)}
    except RecursionError:
        reply = {"error": "macros call each other without end"}
    except MemoryError:
        reply = {"error": "the expansion needs too much memory"}
    except Exception as error:  # xacro raises errors of many types
        reply = {"error": _reason(error)[:300]}
    json.dump(reply, output)


if __name__ == "__main__":
    main()
