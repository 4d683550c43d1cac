"""``armblocks diagram``: draws a diagram into a picture file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from armblocks.cli.completion import ModelName
from armblocks.cli.terminal import results_console


def diagram(
    model: ModelName,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="A .svg, .png or .pdf file.", show_default="MODEL.svg"),
    ] = None,
    sheet: Annotated[
        str, typer.Option(metavar="PATH", help="The subsystem to draw, such as controller/filter.")
    ] = "",
    dark: Annotated[
        bool | None,
        typer.Option(
            "--dark/--light", help="The colours.", show_default="light; for SVG the viewer's preference"
        ),
    ] = None,
    rates: Annotated[
        bool, typer.Option("--rates", help="Show the sample times by colours, with a legend.")
    ] = False,
    trust: Annotated[
        bool, typer.Option("--trust", help="Run the Python files that the diagram names.")
    ] = False,
) -> None:
    """Draw a diagram, or one of its subsystems, into a file."""
    import armblocks as ab

    source_diagram = ab.load_diagram(model, trust=trust)
    name = "-".join((source_diagram.name, *sheet.split("/"))) if sheet else source_diagram.name
    theme = None if dark is None else "dark" if dark else "light"
    path = ab.draw_diagram(source_diagram, out or Path(f"{name}.svg"), sheet=sheet, theme=theme, rates=rates)
    results_console().print(f"wrote {path}", soft_wrap=True)
