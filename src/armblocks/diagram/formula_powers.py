"""Powers as MATLAB reads them: ``a^b^c`` is ``(a^b)^c`` and ``a^-b^c`` is ``(a^-b)^c``.

Python reads both from the right, ``a ** (b ** c)`` and ``a ** -(b ** c)``. Its syntax trees have no brackets,
but they have the text position of each node, which shows whether a bracket precedes it. Source: MathWorks,
*Operator Precedence*: operators of equal precedence are left-associative; a sign after ``^`` belongs to its
operand.
"""

from __future__ import annotations

import ast


def powers_from_the_left(tree: ast.expr, text: str) -> ast.expr:
    """Make chains of powers in the tree of ``text`` left-associative. Changes the tree in place."""
    lines = [line.encode() for line in text.splitlines()]
    todo: list[ast.AST] = [tree]
    while todo:
        node = todo.pop()
        while isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            signed, inner = _behind_signs(node, lines)
            if inner is None:
                break
            first = ast.BinOp(left=node.left, op=ast.Pow(), right=_with_signs(signed, inner.left))
            ast.copy_location(first, node)
            first.end_lineno, first.end_col_offset = inner.left.end_lineno, inner.left.end_col_offset
            node.left, node.right = first, inner.right
        todo.extend(ast.iter_child_nodes(node))
    return tree


def _behind_signs(node: ast.BinOp, lines: list[bytes]) -> tuple[list[ast.UnaryOp], ast.BinOp | None]:
    """The signs after ``^``, and the power that follows them without a bracket, if any."""
    signs: list[ast.UnaryOp] = []
    start = (node.left.end_lineno or 1, node.left.end_col_offset or 0)
    part = node.right
    while not _opens(lines, start, (part.lineno, part.col_offset)):
        if isinstance(part, ast.BinOp) and isinstance(part.op, ast.Pow):
            return signs, part
        if not (isinstance(part, ast.UnaryOp) and isinstance(part.op, ast.USub | ast.UAdd)):
            break
        signs.append(part)
        start, part = (part.lineno, part.col_offset), part.operand
    return signs, None


def _with_signs(signs: list[ast.UnaryOp], operand: ast.expr) -> ast.expr:
    """The operand after the signs that preceded a power."""
    if not signs:
        return operand
    signs[-1].operand = operand
    for sign in signs:
        sign.end_lineno, sign.end_col_offset = operand.end_lineno, operand.end_col_offset
    return signs[0]


def _opens(lines: list[bytes], start: tuple[int, int], end: tuple[int, int]) -> bool:
    """Whether a bracket is opened between two positions (line from 1, byte offset)."""
    (row, begin), (last, stop) = start, end
    if row == last:
        return b"(" in lines[row - 1][begin:stop]
    between = [lines[row - 1][begin:], *lines[row : last - 1], lines[last - 1][:stop]]
    return any(b"(" in piece for piece in between)
