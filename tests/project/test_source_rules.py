"""Rules that every file of the package keeps, read from its syntax tree."""

import ast
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[2] / "src" / "armblocks"
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
DOORS = {"studio/server/launch.py": {"socket", "urllib"}}
"""Files that may import one of these, for what they are there for."""
VAGUE_NAMES = {"utils", "util", "helpers", "helper", "manager", "core", "misc", "common"}
LONGEST_FUNCTION = 80
CONTROL_FLOW = re.compile(r"\b(br label|br i1|switch i\d+|indirectbr) | = phi |\.(label|branch)\(")
"""Text of LLVM IR that jumps, branches or merges, and calls that would write it."""


def public_definitions(tree: ast.Module) -> Iterator[ast.FunctionDef | ast.ClassDef]:
    for node in tree.body:
        if not isinstance(node, ast.FunctionDef | ast.ClassDef) or node.name.startswith("_"):
            continue
        # Of an overloaded function the last one, which is the one that runs, has the docstring.
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


def test_a_module_says_what_it_is_for(trees: dict[str, ast.Module]) -> None:
    assert [name for name, tree in trees.items() if not ast.get_docstring(tree)] == []


def test_public_definitions_have_docstrings(trees: dict[str, ast.Module]) -> None:
    assert [
        f"{name}:{node.lineno} {node.name}"
        for name, tree in trees.items()
        for node in public_definitions(tree)
        if not ast.get_docstring(node)
    ] == []


def forbidden_parts(nodes: Iterable[ast.AST], imports: set[str]) -> Iterator[int]:
    """Lines that evaluate text, import one of these modules, or let a file be unpickled."""
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


def test_nothing_is_evaluated_pickled_or_fetched(nodes: dict[str, list[ast.AST]]) -> None:
    assert [
        f"{name}:{line}"
        for name, inside in nodes.items()
        for line in forbidden_parts(inside, FORBIDDEN_IMPORTS - DOORS.get(name, set()))
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
def test_what_is_forbidden_is_found(source: str, lines: list[int]) -> None:
    assert list(forbidden_parts(ast.walk(ast.parse(source)), FORBIDDEN_IMPORTS)) == lines


def test_functions_can_be_read_in_one_sitting(nodes: dict[str, list[ast.AST]]) -> None:
    assert [
        f"{name}: {function.name} has {lines} lines"
        for name, inside in nodes.items()
        for function in inside
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef)
        and (lines := (function.end_lineno or 0) - function.lineno + 1) > LONGEST_FUNCTION
    ] == []


def test_files_are_named_for_their_subject() -> None:
    assert [name for name in NAMES if set(Path(name).with_suffix("").parts) & VAGUE_NAMES] == []
