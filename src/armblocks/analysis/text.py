"""Display of a linear system as text and in notebooks."""

from __future__ import annotations

import math
from html import escape

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.shown_values import growth, shown_matrices, shown_modes, shown_poles
from armblocks.analysis.state_space import StateSpaceModel
from armblocks.errors import counted

Array = NDArray[np.float64]

MAX_SHOWN = 12
"""Maximum number of rows and columns of a matrix that is displayed completely."""

STYLE = """
.ab-linear{font:13px/1.45 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif;color:inherit;max-width:1120px}
.ab-linear h3{font-size:15px;margin:0 0 2px;font-weight:600}
.ab-linear p{margin:0 0 8px;opacity:.78}
.ab-linear table{border-collapse:collapse;margin:0 0 10px;font-variant-numeric:tabular-nums}
.ab-linear caption{text-align:left;font-weight:600}
.ab-linear th,.ab-linear td{padding:1px 9px;text-align:right;border:0;background:none;color:inherit}
.ab-linear th{font-weight:500;opacity:.75}
"""


def number(value: float, digits: int = 5) -> str:
    """A number as text, without trailing zeros."""
    return f"{value + 0.0:.{digits}g}"


def complex_number(value: complex, digits: int = 5) -> str:
    """A complex number as text, such as ``-1.5`` or ``-0.5 + 2j``."""
    if value.imag == 0.0:
        return number(value.real, digits)
    sign = "+" if value.imag >= 0 else "-"
    return f"{number(value.real, digits)} {sign} {number(abs(value.imag), digits)}j"


def heading(system: StateSpaceModel) -> str:
    """One line with the name, the type, the sizes and the stability of a system."""
    kind = f"sampled every {system.dt:g} s" if system.is_discrete else "continuous"
    counts = ", ".join(
        counted(count, word)
        for count, word in (
            (system.order, "state"),
            (len(system.inputs), "input"),
            (len(system.outputs), "output"),
        )
    )
    when = f" at {system.point.time:g} s" if system.point is not None else ""
    return f"{system.name or 'linear system'}{when}: {kind}, {counts}, {stability(system)}"


def stability(system: StateSpaceModel) -> str:
    """Stability as text, with a separate text for a pole on the stability boundary."""
    largest = growth(system)
    if largest < 0.0:
        return "stable"
    return "on the stability boundary" if largest == 0.0 else "unstable"


def matrix_lines(matrix: Array, rows: tuple[str, ...], columns: tuple[str, ...]) -> list[str]:
    """A matrix with names, in columns; the middle of a large matrix is omitted."""
    chosen_rows, chosen_columns = _shown(len(rows)), _shown(len(columns))
    table = [["", *("…" if k is None else columns[k] for k in chosen_columns)]]
    for i in chosen_rows:
        cells = ["…" if i is None or k is None else number(float(matrix[i, k])) for k in chosen_columns]
        table.append(["…" if i is None else rows[i], *cells])
    widths = [max(len(row[k]) for row in table) for k in range(len(table[0]))]
    return [
        "  ".join(
            [row[0].ljust(widths[0]), *(cell.rjust(w) for cell, w in zip(row[1:], widths[1:]))]
        ).rstrip()
        for row in table
    ]


def _shown(count: int) -> list[int | None]:
    if count <= MAX_SHOWN:
        return list(range(count))
    half = MAX_SHOWN // 2
    return [*range(half), None, *range(count - half, count)]


def matrices(system: StateSpaceModel) -> list[tuple[str, Array, tuple[str, ...], tuple[str, ...]]]:
    """Letter, displayed matrix, names of its rows and columns; without empty matrices."""
    A, B, C, D = shown_matrices(system)
    all_four = [
        ("A", A, system.states, system.states),
        ("B", B, system.states, system.inputs),
        ("C", C, system.outputs, system.states),
        ("D", D, system.outputs, system.inputs),
    ]
    return [entry for entry in all_four if entry[1].size]


def system_text(system: StateSpaceModel) -> str:
    """Heading, matrices and poles as text."""
    lines = [f"<LinearSystem {heading(system)}>"]
    for letter, matrix, rows, columns in matrices(system):
        lines.append(f"  {letter}")
        lines += [f"    {line}" for line in matrix_lines(matrix, rows, columns)]
    if system.order:
        lines.append(
            "  poles: " + ", ".join(complex_number(pole) for pole in shown_poles(system).tolist()[:30])
        )
    return "\n".join(lines)


def system_html(system: StateSpaceModel) -> str:
    """Heading, matrices and a table of the poles, as self-contained HTML."""
    parts = [
        f'<div class="ab-linear"><style>{STYLE}</style><h3>Linear system</h3><p>{escape(heading(system))}</p>'
    ]
    for letter, matrix, rows, columns in matrices(system):
        chosen_rows, chosen_columns = _shown(len(rows)), _shown(len(columns))
        head = "".join(f"<th>{'…' if k is None else escape(columns[k])}</th>" for k in chosen_columns)
        body = "".join(
            f"<tr><th>{'…' if i is None else escape(rows[i])}</th>"
            + "".join(
                f"<td>{'…' if i is None or k is None else number(float(matrix[i, k]))}</td>"
                for k in chosen_columns
            )
            + "</tr>"
            for i in chosen_rows
        )
        parts.append(f"<table><caption>{letter}</caption><tr><th></th>{head}</tr>{body}</table>")
    if system.order:
        rows_html = "".join(
            f"<tr><td>{complex_number(mode.pole)}</td><td>{number(mode.frequency)}</td>"
            f"<td>{number(mode.damping)}</td><td>{_time(mode.time_constant)}</td></tr>"
            for mode in shown_modes(system)
        )
        parts.append(
            "<table><caption>Poles</caption><tr><th>pole</th><th>frequency, rad/s</th><th>damping</th>"
            f"<th>time constant, s</th></tr>{rows_html}</table>"
        )
    return "".join(parts) + "</div>"


def _time(value: float) -> str:
    return "∞" if math.isinf(value) else number(value)
