"""Files of workspaces: tables, pictures and a page."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from armblocks.errors import UnknownNameError
from armblocks.face.arm_pictures import PICTURE_SUFFIXES, picture_encoder
from armblocks.face.workspace.cells import WorkspaceCells
from armblocks.face.workspace.pictures import workspace_picture
from armblocks.files import write_atomically
from armblocks.pictures.style import Theme
from armblocks.pictures.svg import escape, svg_file, svg_inline
from armblocks.report.page_style import page_css
from armblocks.report.page_tables import html_table
from armblocks.report.writing import make_folder
from armblocks.simulation.export import TABLE_SUFFIXES, save_table


def save_workspace(
    workspace: WorkspaceCells, path: str | PathLike[str], content: str, theme: Theme | None
) -> Path:
    """Write a table or a picture, see :meth:`armblocks.Workspace.save`."""
    target = Path(path)
    suffix = target.suffix.lower()
    if content not in ("cells", "points"):
        raise UnknownNameError("content", content, ("cells", "points"), where=str(target))
    if suffix in TABLE_SUFFIXES:
        save_table(target, workspace.table() if content == "cells" else workspace.point_table())
    elif suffix in PICTURE_SUFFIXES:
        write_atomically(target, picture_encoder(target)(workspace_picture(workspace), theme))
    else:
        raise UnknownNameError(
            "file type", target.suffix or target.name, (*TABLE_SUFFIXES, *PICTURE_SUFFIXES), where=str(target)
        )
    return target


def write_workspace(workspace: WorkspaceCells, folder: str | PathLike[str]) -> tuple[Path, ...]:
    """Write the page, the tables and one figure for each measure into a folder."""
    target = Path(folder)
    make_folder(target)
    names = list(workspace.maps) or ["count"]
    figures = {name: workspace_picture(workspace, name) for name in names}
    paths = [target / "workspace.html", target / "workspace.csv", target / "points.csv"]
    save_table(paths[1], workspace.table())
    save_table(paths[2], workspace.point_table())
    for name, picture in figures.items():
        paths.append(target / f"{name}.svg")
        write_atomically(paths[-1], svg_file(picture).encode())
    drawn = "".join(
        f"<figure>{svg_inline(picture, identifier=f'map-{k}')}</figure>"
        for k, picture in enumerate(figures.values())
    )
    write_atomically(paths[0], _page(workspace, drawn).encode())
    return tuple(paths)


def _page(workspace: WorkspaceCells, drawn: str) -> str:
    title = escape(f"Workspace of {workspace.name}")
    facts = "".join(f"<li>{escape(name)}: {escape(text)}</li>" for name, text in workspace.facts())
    rows = [
        f'<tr><th scope="row">{escape(name)}</th>{"".join(f"<td>{escape(cell)}</td>" for cell in cells)}</tr>'
        for name, *cells in workspace.measure_rows()
    ]
    heads = [("measure", ""), ("unit", ""), ("least", ""), ("median of cell maxima", ""), ("most", "")]
    table = html_table("Measures over all reached cells", heads, rows) if rows else ""
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<style>{page_css()}</style></head><body><header class="top"><h1>{title}</h1></header><main>'
        f"<section><h2>Reach</h2><ul>{facts}</ul>{table}</section>"
        f"<section><h2>Maps</h2>{drawn}</section></main></body></html>\n"
    )
