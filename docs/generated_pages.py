"""Pages that are written from the code: the blocks of the library, the shipped robots and examples."""

from __future__ import annotations

import inspect
import re
import warnings
from pathlib import Path

import armblocks as ab
from armblocks.blocks import BLOCKS
from armblocks.compiler.butcher_tableau import ButcherTableau
from armblocks.diagram import Block, Parameter
from armblocks.simulation.tableaux import TABLEAUX


def write_generated_pages(folder: Path) -> None:
    """Write the pages into ``folder``; a page whose text is unchanged is left alone."""
    folder.mkdir(exist_ok=True)
    pages = {"blocks.md": blocks_page(), "shipped.md": shipped_page(), "solver-table.txt": solver_table()}
    for name, text in pages.items():
        path = folder / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def blocks_page() -> str:
    """Every block of the library by family: what it does and what its parameters mean."""
    lines = [
        "# Blocks",
        "",
        f"The library has {len(BLOCKS)} blocks. A parameter marked *tunable* can be given another value for",
        "each run without compiling again.",
    ]
    for family, kinds in BLOCKS.by_family().items():
        lines += ["", f"## {family.capitalize()}"]
        for kind in kinds:
            lines += block_section(kind)
    return "\n".join(lines) + "\n"


def block_section(kind: type[Block]) -> list[str]:
    """Heading, docstring and parameter table of one block."""
    title = kind.type_name() if kind.title == kind.type_name() else f"{kind.type_name()} ({kind.title})"
    lines = ["", f"### {title}", "", prose(inspect.cleandoc(kind.__doc__ or ""))]
    if kind.parameters():
        lines += ["", "| parameter | unit | default | tunable | meaning |", "|---|---|---|---|---|"]
        lines += [parameter_row(rule) for rule in kind.parameters()]
    return lines


def prose(docstring: str) -> str:
    """A docstring as Markdown: code stays code, and all else, formulas with stars included, is plain text."""
    parts = re.split(r"(?::\w+:)?(`+)(.+?)\1", docstring)
    text = [
        re.sub(r"([*_\[\]|$<>#])", r"\\\1", plain) + (f"`{code}`" if code else "")
        for plain, code in zip(parts[::3], [*parts[2::3], ""])
    ]
    return "".join(text)


def parameter_row(rule: Parameter) -> str:
    """One row of a block's parameter table."""
    default = "" if rule.required else f"`{rule.default}`"
    meaning = f"{rule.doc}: {rule.describe()}" if rule.choices else rule.doc
    cells = (f"`{rule.name}`", rule.unit, default, "yes" if rule.tunable else "", prose(meaning))
    return "| " + " | ".join(cells) + " |"


def shipped_page() -> str:
    """The shipped robots and examples, one line each."""
    lines = [
        "# Shipped robots and examples",
        "",
        "## Robots",
        "",
        "| name | joints | what it is |",
        "|---|---|---|",
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ab.errors.InertiaWarning)
        for name in ab.list_robots():
            robot = ab.load_robot(name).robot
            about = "; ".join(text for text in (robot.manufacturer, robot.comment) if text)
            lines.append(f"| `{name}` | {robot.joint_letters} | {about} |")
        lines += ["", "## Examples", "", "| name | what it shows | stop time | blocks |", "|---|---|---|---|"]
        for name in ab.list_examples():
            diagram = ab.load_diagram(name)
            kinds = sorted({block.type_name() for block in diagram.blocks.values()})
            cells = (f"`{name}`", diagram.description, f"{diagram.settings.stop_time:g} s", ", ".join(kinds))
            lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def solver_table() -> str:
    """Every integrator."""
    heads = ("name", "also known as", "order", "step", "kind", "method", "source")
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    for tableau in TABLEAUX:
        aliases = ", ".join(f"`{alias}`" for alias in tableau.aliases)
        step = "adaptive" if tableau.adaptive else "fixed"
        kind = "explicit" if isinstance(tableau, ButcherTableau) else "for stiff systems"
        cells = (f"`{tableau.name}`", aliases, str(tableau.order), step, kind, tableau.title, tableau.source)
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"
