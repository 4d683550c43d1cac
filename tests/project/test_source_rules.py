"""Rules for every file of the package, checked on its syntax tree."""

import ast
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src" / "armblocks"
FRONTEND = ROOT / "frontend"
MODULES = sorted(SOURCE.rglob("*.py"))
NAMES = [path.relative_to(SOURCE).as_posix() for path in MODULES]

FORBIDDEN_CALLS = {"eval", "exec", "__import__", "compile"}
FORBIDDEN_IMPORTS = {
    "pickle",
    "marshal",
    "shelve",
    "dill",
    "cloudpickle",
    "urllib",
    "http",
    "socket",
    "requests",
}
EXCEPTIONS = {"studio/server/launch.py": {"socket", "urllib"}, "studio/view_server.py": {"http"}}
"""Files that may import one of these modules, because it is their purpose."""
VAGUE_NAMES = {"utils", "util", "helpers", "helper", "manager", "core", "misc", "common"}
MAX_FUNCTION_LINES = 80
MAX_LINE_LENGTH = 110
CONTROL_FLOW = re.compile(r"\b(br label|br i1|switch i\d+|indirectbr) | = phi |\.(label|branch)\(")
"""LLVM IR text with jumps, branches or merges, and calls that would generate it."""


def public_definitions(tree: ast.Module) -> Iterator[ast.FunctionDef | ast.ClassDef]:
    for node in tree.body:
        if not isinstance(node, ast.FunctionDef | ast.ClassDef) or node.name.startswith("_"):
            continue
        # The implementation of an overloaded function, its last definition, has the docstring.
        if not any(isinstance(mark, ast.Name) and mark.id == "overload" for mark in node.decorator_list):
            yield node


@pytest.fixture(scope="module")
def trees() -> dict[str, ast.Module]:
    """The syntax tree of every file, by its path in the package."""
    return {
        name: ast.parse(path.read_text(encoding="utf-8"), filename=str(path))
        for name, path in zip(NAMES, MODULES)
    }


@pytest.fixture(scope="module")
def nodes(trees: dict[str, ast.Module]) -> dict[str, list[ast.AST]]:
    """All nodes of the tree of every file."""
    return {name: list(ast.walk(tree)) for name, tree in trees.items()}


def test_modules_have_docstrings(trees: dict[str, ast.Module]) -> None:
    assert [name for name, tree in trees.items() if not ast.get_docstring(tree)] == []


def test_public_definitions_have_docstrings(trees: dict[str, ast.Module]) -> None:
    assert [
        f"{name}:{node.lineno} {node.name}"
        for name, tree in trees.items()
        for node in public_definitions(tree)
        if not ast.get_docstring(node)
    ] == []


def forbidden_parts(nodes: Iterable[ast.AST], imports: set[str]) -> Iterator[int]:
    """Lines that evaluate text, import one of these modules, or permit unpickling of a file."""
    for node in nodes:
        match node:
            case ast.Call(func=ast.Name(id=called)) if called in FORBIDDEN_CALLS:
                yield node.lineno
            case ast.Import(names=names) if {name.name.split(".")[0] for name in names} & imports:
                yield node.lineno
            case ast.ImportFrom(module=module) if (module or "").split(".")[0] in imports:
                yield node.lineno
            case ast.keyword(arg="allow_pickle", value=value):
                if not (isinstance(value, ast.Constant) and value.value is False):
                    yield node.lineno
            case _:
                pass


def test_no_file_evaluates_text_unpickles_files_or_uses_the_network(nodes: dict[str, list[ast.AST]]) -> None:
    assert [
        f"{name}:{line}"
        for name, inside in nodes.items()
        for line in forbidden_parts(inside, FORBIDDEN_IMPORTS - EXCEPTIONS.get(name, set()))
    ] == []


@pytest.mark.parametrize(
    ("source", "lines"),
    [
        ("import numpy\nx = eval('1')", [2]),
        ("import urllib.request", [1]),
        ("from http import client\nfrom . import near", [1]),
        ("load(f, allow_pickle=False)\nload(f, allow_pickle=True)\nload(f, allow_pickle=x)", [2, 3]),
    ],
)
def test_the_check_detects_forbidden_code(source: str, lines: list[int]) -> None:
    assert list(forbidden_parts(ast.walk(ast.parse(source)), FORBIDDEN_IMPORTS)) == lines


def test_functions_have_at_most_80_lines(nodes: dict[str, list[ast.AST]]) -> None:
    assert [
        f"{name}: {function.name} has {lines} lines"
        for name, inside in nodes.items()
        for function in inside
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef)
        and (lines := (function.end_lineno or 0) - function.lineno + 1) > MAX_FUNCTION_LINES
    ] == []


def test_lines_of_the_front_end_have_at_most_110_characters() -> None:
    """Ruff checks the same for Python; prettier breaks code, but neither comments nor text."""
    sources = (path for folder in ("src", "tests") for path in (FRONTEND / folder).rglob("*.ts*"))
    assert [
        f"{path.relative_to(FRONTEND).as_posix()}:{number}"
        for path in sources
        if path.name != "protocol.ts"  # generated
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if len(line) > MAX_LINE_LENGTH
    ] == []


def test_plurals_of_counts_come_from_counted() -> None:
    """``counted`` of ``armblocks.errors`` writes "1 row" and "2 rows"; no other code appends an s."""
    plural = re.compile(r"""(["'])\1 if [^"']* else (["'])s\2|(["'])s\3 \*""")
    assert plural.search("""row{'' if n == 1 else 's'}""") and plural.search("""row{'s' * (n != 1)}""")
    assert [name for name, path in zip(NAMES, MODULES) if plural.search(path.read_text("utf-8"))] == []


def test_files_do_not_have_generic_names() -> None:
    assert [name for name in NAMES if set(Path(name).with_suffix("").parts) & VAGUE_NAMES] == []


def imported_modules(nodes: Iterable[ast.AST], modules: Collection[str]) -> Iterator[str]:
    """Every module among ``modules`` from which an import takes something.

    Imports in functions and under ``TYPE_CHECKING`` are included, because a reader of the module needs them.
    """
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in modules)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                if inner in modules:
                    yield inner
                elif node.module in modules:
                    yield node.module


def import_cycles(graph: Mapping[str, set[str]]) -> list[list[str]]:
    """The groups of mutually dependent modules (Tarjan's strongly connected components), sorted."""
    number: dict[str, int] = {}
    lowest: dict[str, int] = {}
    waiting: list[str] = []
    groups: list[list[str]] = []

    def visit(module: str) -> None:
        number[module] = lowest[module] = len(number)
        waiting.append(module)
        for other in graph[module]:
            if other not in number:
                visit(other)
            if other in waiting:
                lowest[module] = min(lowest[module], lowest[other])
        if lowest[module] == number[module]:
            group = waiting[waiting.index(module) :]
            del waiting[-len(group) :]
            if len(group) > 1 or module in graph[module]:
                groups.append(sorted(group))

    for module in graph:
        if module not in number:
            visit(module)
    return sorted(groups)


@pytest.mark.parametrize(
    ("graph", "expected"),
    [
        ({"a": {"b", "c"}, "b": {"c"}, "c": set[str]()}, []),
        ({"a": {"a"}}, [["a"]]),
        (
            {"a": {"b"}, "b": {"c"}, "c": {"b", "d"}, "d": {"e"}, "e": {"d"}},
            [["b", "c"], ["d", "e"]],
        ),
        ({"a": {"b"}, "b": {"c", "d"}, "c": {"d"}, "d": {"a"}, "e": {"a"}}, [["a", "b", "c", "d"]]),
    ],
)
def test_import_cycles_are_detected(graph: dict[str, set[str]], expected: list[list[str]]) -> None:
    assert import_cycles(graph) == expected


def test_every_kind_of_import_is_included() -> None:
    source = """
from typing import TYPE_CHECKING
import armblocks.a
from armblocks import b
from armblocks.c import name
if TYPE_CHECKING:
    from armblocks.d import Type
def late():
    from armblocks.e import (f, g)
"""
    modules = {f"armblocks.{name}" for name in ("a", "b", "c", "d", "e", "e.f", "unused")}
    groups = set(imported_modules(ast.walk(ast.parse(source)), modules))
    assert groups == {f"armblocks.{name}" for name in ("a", "b", "c", "d", "e", "e.f")}


def test_there_are_no_import_cycles(nodes: dict[str, list[ast.AST]]) -> None:
    modules = {
        ".".join(("armblocks", *Path(name).with_suffix("").parts)).removesuffix(".__init__"): inside
        for name, inside in nodes.items()
    }
    assert (
        import_cycles({name: set(imported_modules(inside, modules)) for name, inside in modules.items()})
        == []
    )
