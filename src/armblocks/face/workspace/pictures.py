"""Pictures of workspaces: slices with a measure in colours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from armblocks.face.workspace.cells import WorkspaceCells, WorkspaceSlice
from armblocks.pictures.numbers import table_number
from armblocks.pictures.picture import Picture
from armblocks.pictures.style import FIGURE_WIDTH
from armblocks.report.charts.cell_chart import cell_chart
from armblocks.report.charts.path_chart import side_by_side

Array = NDArray[np.float64]

TITLES = {
    "manipulability": "Manipulability",
    "singularity": "Smallest singular value",
    "condition": "Inverse condition number",
    "limits": "Distance to joint limits",
    "payload": "Payload",
    "count": "Samples in a cell",
}
STATISTICS = {"most": "largest", "least": "smallest", "mean": "mean"}
ROWS = {"trans": "translation", "rot": "rotation", "all": "all axes"}


def workspace_picture(
    workspace: WorkspaceCells,
    measure: str | None = None,
    statistic: str = "most",
    normal: str | None = None,
    at: float | None = None,
    width: float = FIGURE_WIDTH,
) -> Picture:
    """The picture of :meth:`armblocks.Workspace.picture`."""
    name = measure or next(iter(workspace.maps), "count")
    if normal is not None or at is not None:
        layers = [workspace.slice(normal or "y", at)]
    else:
        layers = default_slices(workspace)
    values = [_values(workspace, layer, name, statistic) for layer in layers]
    finite = np.concatenate([part[np.isfinite(part)] for part in values])
    span = _span(finite)
    gap = 16.0
    each = (width - gap * (len(layers) - 1)) / len(layers)
    title = _title(workspace, name, statistic)
    beyond = bool(finite.size) and span[1] < float(finite.max())
    charts = [
        cell_chart(
            part,
            layer.first,
            layer.second,
            span=span,
            labels=(f"{layer.axes[0]}, m", f"{layer.axes[1]}, m"),
            caption=title,
            plane=f"{layer.normal} = {table_number(layer.at, 3)} m",
            beyond=beyond,
            unit=workspace.maps[name].unit if name in workspace.maps else "",
            origin=tuple(workspace.base[["xyz".index(axis) for axis in layer.axes]].tolist()),
            width=each,
            height=min(0.9 * each, 520.0),
        )
        for part, layer in zip(values, layers)
    ]
    text = f"Slices of the workspace of {workspace.name}: {title}, {table_number(span[0])} to "
    text += f"{table_number(span[1])}."
    return side_by_side(charts, title=f"Workspace of {workspace.name}", description=text, gap=gap)


def default_slices(workspace: WorkspaceCells) -> list[WorkspaceSlice]:
    """The slice through the base normal to y, and the slice with the most cells normal to z.

    Slices of a region that is a plane or a line are omitted, unless none has an area.
    """
    found: list[WorkspaceSlice] = []
    for normal, k in (("y", 1), ("z", 2), ("x", 0)):
        at = float(workspace.base[k]) if normal != "z" else None
        low = float(workspace.corner[k]) - 0.5 * workspace.cell
        high = low + workspace.cell * workspace.counts.shape[k]
        layer = workspace.slice(normal, at if at is not None and low <= at < high else None)
        if min(layer.counts.shape) > 1:
            found.append(layer)
    return found[:2] or [workspace.slice("y")]


def _values(workspace: WorkspaceCells, layer: WorkspaceSlice, name: str, statistic: str) -> Array:
    if name == "count":
        return np.where(layer.counts > 0, layer.counts, np.nan)
    workspace.value(workspace.base, name)  # raises UnknownNameError
    return layer.maps[name].statistic(statistic)


def _span(finite: Array) -> tuple[float, float]:
    """The values of the first and the last colour: without the largest 1 % if they are far above the rest."""
    if not finite.size:
        return 0.0, 1.0
    usual, largest = float(np.percentile(finite, 99.0)), float(finite.max())
    return float(finite.min()), usual if largest > 2.0 * usual > 0.0 else largest


def _title(workspace: WorkspaceCells, name: str, statistic: str) -> str:
    if name == "count":
        return TITLES[name]
    rows = f" ({ROWS[workspace.axes]})" if name in ("manipulability", "singularity", "condition") else ""
    return f"{TITLES[name]}{rows}, {STATISTICS[statistic]}"
