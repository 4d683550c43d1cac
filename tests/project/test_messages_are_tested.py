"""Every error and warning of the package is checked by a test.

The check is static and approximate. It takes the literal words of the message (what, allowed, fix) from each
construction of an armblocks error or warning. Three consecutive words must occur in a file under ``tests``.
"""

import ast
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from armblocks import errors

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src" / "armblocks"
TREE = {
    name
    for name, kind in vars(errors).items()
    if isinstance(kind, type) and issubclass(kind, errors.ArmblocksError | errors.ArmblocksWarning)
}
RUN_OF_WORDS = 3


def words(text: str) -> list[str]:
    """The words of a message or a test, without quotes, regular-expression escapes and punctuation."""
    return re.findall(r"[^\W_]+(?:[-'.][^\W_]+)*", text.replace("\\", ""))


def literal_pieces(node: ast.expr, names: dict[str, ast.expr]) -> Iterator[str]:
    """The constant texts in an expression; local variables are replaced by their assigned expressions."""
    for part in ast.walk(node):
        if isinstance(part, ast.Constant) and isinstance(part.value, str):
            yield part.value
        elif isinstance(part, ast.Name) and part.id in names:
            value = names[part.id]
            yield from (
                inner.value
                for inner in ast.walk(value)
                if isinstance(inner, ast.Constant) and isinstance(inner.value, str)
            )


def is_message(node: ast.AST) -> bool:
    """Whether the node constructs an error or a warning."""
    if not isinstance(node, ast.Call) or not node.args:
        return False
    kind = called_name(node)
    return kind in TREE or (
        kind == "warn"
        and any(isinstance(argument, ast.Name) and argument.id in TREE for argument in node.args[1:])
    )


def called_name(node: ast.Call) -> str:
    """The last part of the name of the called function."""
    return node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")


def messages() -> Iterator[tuple[str, list[str]]]:
    """Every construction of an error or warning, with the literal pieces of its message."""
    for path in sorted(SOURCE.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        if path.name == "errors.py" or not any(name in text for name in TREE):
            continue
        tree = ast.parse(text)
        scopes = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
        visited: set[ast.Call] = set()
        for scope in (*scopes, tree):
            inside = list(ast.walk(scope))
            calls = [node for node in inside if isinstance(node, ast.Call) and is_message(node)]
            if not visited.issuperset(calls):
                names = assignments(inside)
                for node in calls:
                    if node not in visited:
                        visited.add(node)
                        yield f"{path.relative_to(SOURCE).as_posix()}:{node.lineno}", pieces_of(node, names)


def assignments(nodes: Sequence[ast.AST]) -> dict[str, ast.expr]:
    """The expressions assigned to each name."""
    return {
        target.id: node.value
        for node in nodes
        if isinstance(node, ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Name)
    }


def pieces_of(node: ast.Call, names: dict[str, ast.expr]) -> list[str]:
    """The literal pieces of the constructed message."""
    pieces = list(literal_pieces(node.args[0], names))
    if called_name(node) == "UnknownNameError":
        pieces = [f"there is no {' '.join(pieces)} named"]
    for keyword in node.keywords:
        if keyword.arg in ("allowed", "fix"):
            pieces += literal_pieces(keyword.value, names)
    return pieces


def runs(pieces: list[str]) -> Iterator[tuple[str, ...]]:
    """Word sequences that identify a message: three consecutive words, or a shorter complete piece.

    Pieces of one word count only if there is no longer piece.
    """
    split = [words(piece) for piece in pieces]
    min_words = min(2, max((len(piece) for piece in split), default=0))
    for piece in split:
        size = min(RUN_OF_WORDS, len(piece))
        if size >= max(min_words, 1):
            for start in range(len(piece) - size + 1):
                yield tuple(piece[start : start + size])


@pytest.fixture(scope="module")
def tested_sequences() -> set[tuple[str, ...]]:
    """All sequences of one, two and three words in the texts of the tests."""
    sequences: set[tuple[str, ...]] = set()
    for path in sorted((ROOT / "tests").rglob("*.py")):
        if path == Path(__file__):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                text = words(node.value)
                for size in range(1, RUN_OF_WORDS + 1):
                    sequences.update(
                        tuple(text[start : start + size]) for start in range(len(text) - size + 1)
                    )
    return sequences


def test_every_message_occurs_in_a_test(tested_sequences: set[tuple[str, ...]]) -> None:
    untested = []
    for place, pieces in messages():
        candidates = [run for run in runs(pieces) if run]
        if candidates and not any(run in tested_sequences for run in candidates):
            untested.append(f"{place}: {' … '.join(pieces)}")
    assert untested == [], f"{len(untested)} messages that no test reads:\n" + "\n".join(untested)
