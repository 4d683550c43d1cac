"""Every error states its place and a remedy.

The check is static: each construction of an armblocks error under ``src`` has ``where`` and ``fix``.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

from armblocks import errors

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src" / "armblocks"
TREE = {
    name
    for name, kind in vars(errors).items()
    if isinstance(kind, type) and issubclass(kind, errors.ArmblocksError)
}
PROVIDED = {
    "UnknownNameError": {"where", "fix"},  # contains the nearest name and the kind of name
    "UnknownArgumentError": {"where", "fix"},
    "MissingLibraryError": {"where", "fix"},  # states its purpose and the install command
    "AlgebraicLoopError": {"where", "fix"},  # the loop is the place
}
"""Error classes that provide the arguments themselves."""
PATH_ADDED = ("blocks/", "diagram/shape_rules.py")
"""Files in which blocks raise errors without ``where``: a block has no name. ``diagram.shapes``,
``diagram.model`` and ``simulation.calls`` add the path of the block."""


def constructions() -> Iterator[tuple[str, str, ast.Call]]:
    """Every construction of an error: file:line, class of the error, call."""
    for path in sorted(SOURCE.rglob("*.py")):
        place = path.relative_to(SOURCE).as_posix()
        text = path.read_text(encoding="utf-8")
        if place == "errors.py" or not any(name in text for name in TREE):
            continue
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Call) and node.args:
                kind = node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")
                if kind in TREE:
                    yield f"{place}:{node.lineno}", kind, node


def missing_arguments(place: str, kind: str, call: ast.Call) -> set[str]:
    """The missing arguments of an error's construction."""
    message = {keyword.arg for keyword in call.keywords if not _is_empty(keyword.value)}
    missing = {"where", "fix"} - message - PROVIDED.get(kind, set())
    return missing - {"where"} if place.startswith(PATH_ADDED) else missing


def _is_empty(value: ast.expr) -> bool:
    return isinstance(value, ast.Constant) and not value.value


def test_every_error_has_a_place_and_a_remedy() -> None:
    all_errors = list(constructions())
    assert len(all_errors) > 300
    incomplete = [
        f"{place} {kind} lacks {sorted(m)}"
        for place, kind, call in all_errors
        if (m := missing_arguments(place, kind, call))
    ]
    assert incomplete == [], f"{len(incomplete)} errors give no help:\n" + "\n".join(incomplete)


def test_the_check_detects_missing_arguments() -> None:
    call = ast.parse('InputError("x is 3", where="", allowed="2")', mode="eval").body
    assert isinstance(call, ast.Call)
    assert missing_arguments("face/arm.py:1", "InputError", call) == {"where", "fix"}
    assert missing_arguments("blocks/maths.py:1", "InputError", call) == {"fix"}
