"""Rules that every file of the package keeps, read from its syntax tree."""

import ast
import re
from collections.abc import Iterator
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
DOORS = {"studio/launch.py": {"socket", "urllib"}}
"""Files that may import one of these, for what they are there for."""
VAGUE_NAMES = {"utils", "util", "helpers", "helper", "manager", "core", "misc", "common"}
LONGEST_FUNCTION = 80
CONTROL_FLOW = re.compile(r"\b(br label|br i1|switch i\d+|indirectbr) | = phi |\.(label|branch)\(")
"""Text of LLVM IR that jumps, branches or merges, and calls that would write it."""


def functions(tree: ast.AST) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node


def public_definitions(tree: ast.Module) -> Iterator[ast.FunctionDef | ast.ClassDef]:
    for node in tree.body:
        if not isinstance(node, ast.FunctionDef | ast.ClassDef) or node.name.startswith("_"):
            continue
        # Of an overloaded function the last one, which is the one that runs, has the docstring.
        if not any(isinstance(mark, ast.Name) and mark.id == "overload" for mark in node.decorator_list):
            yield node


@pytest.fixture(params=MODULES, ids=NAMES)
def tree(request: pytest.FixtureRequest) -> ast.Module:
    path: Path = request.param
    return ast.parse(path.read_text(encoding="utf-8"), filename=str(path))


def test_a_module_says_what_it_is_for(tree: ast.Module) -> None:
    assert ast.get_docstring(tree), "a module without a docstring"


def test_public_definitions_have_docstrings(tree: ast.Module) -> None:
    assert [node.name for node in public_definitions(tree) if not ast.get_docstring(node)] == []


def test_nothing_is_evaluated_pickled_or_fetched(tree: ast.Module, request: pytest.FixtureRequest) -> None:
    forbidden = FORBIDDEN_IMPORTS - DOORS.get(request.node.callspec.id, set())
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id not in FORBIDDEN_CALLS, f"line {node.lineno}"
        if isinstance(node, ast.Import):
            assert not {name.name.split(".")[0] for name in node.names} & forbidden, f"line {node.lineno}"
        if isinstance(node, ast.ImportFrom):
            assert (node.module or "").split(".")[0] not in forbidden, f"line {node.lineno}"
        if isinstance(node, ast.keyword) and node.arg == "allow_pickle":
            assert isinstance(node.value, ast.Constant), f"line {node.lineno}"
            assert node.value.value is False, f"line {node.lineno}"


def test_functions_can_be_read_in_one_sitting(tree: ast.Module) -> None:
    long = {
        f"{function.name}: {lines}"
        for function in functions(tree)
        if (lines := (function.end_lineno or 0) - function.lineno + 1) > LONGEST_FUNCTION
    }
    assert long == set()


def test_control_flow_of_native_code_is_written_in_the_routine_language() -> None:
    found = [
        name for name, path in zip(NAMES, MODULES) if CONTROL_FLOW.search(path.read_text(encoding="utf-8"))
    ]
    assert found == ["routines/llvm.py"]


def test_files_are_named_for_their_subject() -> None:
    assert [name for name in NAMES if set(Path(name).with_suffix("").parts) & VAGUE_NAMES] == []
