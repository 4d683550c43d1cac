"""Every error says where it arose and what to do about it.

The check is static: each construction of an armblocks error under ``src`` names ``where`` and ``fix``.
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
OWN = {
    "UnknownNameError": {"where", "fix"},  # says the nearest name; its kind says of what it is a name
    "MissingLibraryError": {"where", "fix"},  # says what it is needed for, and how to install it
    "AlgebraicLoopError": {"where", "fix"},  # the loop itself is the place
}
"""Errors whose class itself supplies the help."""
PLACE_IS_ADDED = ("blocks/", "diagram/shape_rules.py")
"""A block does not know its own name: shapes are checked by ``diagram.shapes``, equations by
``diagram.model``, calls by ``simulation.calls``, which add the block's path."""


def constructions() -> Iterator[tuple[str, str, ast.Call]]:
    """Every place where an error is made: file:line, the error's class, the call."""
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


def lacking(place: str, kind: str, call: ast.Call) -> set[str]:
    """What an error's construction does not say, though it could."""
    said = {keyword.arg for keyword in call.keywords if not _is_empty(keyword.value)}
    missing = {"where", "fix"} - said - OWN.get(kind, set())
    return missing - {"where"} if place.startswith(PLACE_IS_ADDED) else missing


def _is_empty(value: ast.expr) -> bool:
    return isinstance(value, ast.Constant) and not value.value


def test_every_error_says_where_and_what_to_do() -> None:
    found = list(constructions())
    assert len(found) > 300
    silent = [
        f"{place} {kind} lacks {sorted(m)}"
        for place, kind, call in found
        if (m := lacking(place, kind, call))
    ]
    assert silent == [], f"{len(silent)} errors give no help:\n" + "\n".join(silent)


def test_the_check_sees_what_is_missing() -> None:
    call = ast.parse('InputError("x is 3", where="", allowed="2")', mode="eval").body
    assert isinstance(call, ast.Call)
    assert lacking("face/arm.py:1", "InputError", call) == {"where", "fix"}
    assert lacking("blocks/maths.py:1", "InputError", call) == {"fix"}
