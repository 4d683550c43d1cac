"""Tables of the functions of formulas and scripts for the documentation."""

from __future__ import annotations

from armblocks.matlab.functions import TABLE


def function_tables() -> str:
    """Markdown tables of all functions and constants of formulas and scripts, one for each group."""
    groups = dict.fromkeys(function.group for function in TABLE.values())
    lines: list[str] = []
    for group in groups:
        kind = "constant" if group == "Constants" else "function"
        lines += [f"### {group}", "", f"| {kind} | value |", "|---|---|"]
        for name, function in TABLE.items():
            if function.group == group:
                call = (
                    f"{name}({function.arguments})" if function.max_arguments else name
                )
                lines.append(
                    f"| `{call}` | {function.meaning.replace('|', chr(92) + '|')} |"
                )
        lines.append("")
    return "\n".join(lines)
