"""Pages that are generated from the code: the blocks of the library, the shipped robots and examples."""

from __future__ import annotations

import inspect
import re
import warnings
from pathlib import Path

from block_pages import block_pages, drawing_html, prose, style_sheet
from function_tables import function_tables
from reference_signatures import arm_page
from robot_pages import robot_pages
from tutorial_figure import controller_figure

import armblocks as ab
from armblocks.drawing import diagram_picture
from armblocks.integration.butcher_tableau import ButcherTableau
from armblocks.simulation.tableaux import TABLEAUX


def write_generated_pages(folder: Path) -> None:
    """Write all generated pages into ``folder``.

    Unchanged files keep their modification times. Files that are not generated pages are removed.
    """
    pages = {
        "examples.md": examples_page(),
        "solver-table.txt": solver_table(),
        "function-tables.txt": function_tables(),
        "arm.txt": arm_page(),
        "public-names.txt": public_names(),
        "controller-figure.txt": controller_figure(),
        "static/pictures.css": style_sheet(),
        **dict(block_pages()),
        **dict(robot_pages()),
    }
    for name, text in pages.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
    for path in folder.rglob("*"):
        if path.is_file() and path.relative_to(folder).as_posix() not in pages:
            path.unlink()


def examples_page() -> str:
    """The page of the shipped examples, each with its drawing and links to the pages of its blocks."""
    lines = [
        "# Shipped examples",
        "",
        "`armblocks run NAME` runs an example and writes its report. `armblocks studio NAME` opens the",
        "example.",
        "",
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ab.errors.InertiaWarning)
        for name in ab.list_examples():
            diagram = ab.load_diagram(name)
            drawing = drawing_html(diagram_picture(diagram), f"example-{name}")
            kinds = sorted({block.type_name() for block in diagram.blocks.values()})
            links = ", ".join(f"[{kind}](blocks/{kind}.md)" for kind in kinds)
            description = diagram.description[:1].upper() + diagram.description[1:]
            lines += [
                f"## {name}",
                "",
                f"{prose(description)}. The run ends at {diagram.settings.stop_time:g} s.",
                "",
            ]
            lines += [drawing, "", f"Blocks: {links}.", ""]
    return "\n".join(lines) + "\n"


def public_names() -> str:
    """A table of all names of ``armblocks``, with a link and the first sentence of the docstring."""
    lines = ["| name | description |", "|---|---|"]
    for name in sorted(ab.__all__, key=str.casefold):
        value = getattr(ab, name)
        if not inspect.ismodule(value):
            role = "class" if inspect.isclass(value) else "func"
            lines.append(
                f"| {{py:{role}}}`~armblocks.{name}` | {prose(_first_sentence(value))} |"
            )
    return "\n".join(lines) + "\n"


def _first_sentence(value: object) -> str:
    paragraph = (
        inspect.cleandoc(value.__doc__ or "").partition("\n\n")[0].replace("\n", " ")
    )
    sentence = re.split(r"(?<=[.:]) (?=[A-Z])|::$", paragraph)[0].rstrip(":")
    return sentence if sentence.endswith(".") else f"{sentence}."


def solver_table() -> str:
    """Markdown table of all solvers, followed by the list of their sources."""
    headings = ("name", "other names", "order", "step", "kind", "method")
    lines = ["| " + " | ".join(headings) + " |", "|---" * len(headings) + "|"]
    for tableau in TABLEAUX:
        aliases = ", ".join(f"`{alias}`" for alias in tableau.aliases)
        step = "adaptive" if tableau.adaptive else "fixed"
        kind = (
            "explicit" if isinstance(tableau, ButcherTableau) else "for stiff systems"
        )
        cells = (
            f"`{tableau.name}`",
            aliases,
            str(tableau.order),
            step,
            kind,
            tableau.title,
        )
        lines.append("| " + " | ".join(cells) + " |")
    names: dict[str, list[str]] = {}
    for tableau in TABLEAUX:
        names.setdefault(tableau.source, []).append(f"`{tableau.name}`")
    lines += ["", "Sources of the methods:", ""]
    lines += [f"- {', '.join(solvers)}: {source}." for source, solvers in names.items()]
    return "\n".join(lines) + "\n"
