"""Flattening of diagrams with subsystems, tags and buses: blocks named by paths, direct connections only.

Flattening does not change the values of signals. A block ``pid`` inside the subsystem ``controller`` becomes
the block ``controller/pid``; each input is traced back through virtual blocks to the output of a real block.
A diagram without virtual blocks is its own flat form. The steps are the passes of
:mod:`armblocks.diagram.passes`.
"""

from __future__ import annotations

from collections.abc import Iterator

from armblocks.diagram.comments import check_connected, commented_paths
from armblocks.diagram.diagram import Diagram
from armblocks.diagram.flat_form import FlatForm, flat_form
from armblocks.diagram.levels import joined, levels_of
from armblocks.diagram.passes.netlist import KnownSignals, netlist
from armblocks.diagram.port import View, ViewKind
from armblocks.diagram.shape_inference import signals_without_comments
from armblocks.diagram.structure import DiagramBlock


def flatten_hierarchy(diagram: Diagram) -> FlatForm:
    """The flat form of a diagram, cached for each diagram object.

    Raises ``DiagramError`` for unconnected inputs, unmatched tags and bus elements, connections in a cycle
    without a block, and too deeply nested subsystems; ``where`` names the path.
    """
    return diagram.cached("flat form", lambda: _flat_form(diagram))


def flat_diagram(diagram: Diagram) -> Diagram:
    """The flat diagram; a diagram without virtual blocks is returned unchanged."""
    return flatten_hierarchy(diagram).diagram


def diagram_views(diagram: Diagram) -> tuple[tuple[str, View], ...]:
    """All views of a diagram and its subsystems, with the path of the block that defines each.

    Logged outputs come last: each is a view with traces, named after the signal or the output.
    """
    form = flatten_hierarchy(diagram)
    views = form.views
    if form.diagram is diagram:
        views = tuple((name, view) for name, block in diagram.blocks.items() for view in block.views())
    return (*views, *_logged_views(diagram))


def _logged_views(diagram: Diagram, path: str = "") -> Iterator[tuple[str, View]]:
    for ref in diagram.logged:
        if diagram.commented.get(ref.block) == "out":
            continue
        block_path = joined(path, ref.block)
        signal_name = diagram.signal_names.get(ref)
        title = joined(path, signal_name) if signal_name else f"{block_path}/{ref.port}"
        yield block_path, View(kind=ViewKind.TRACES, signals=(ref.port,), title=title)
    for name, block in diagram.blocks.items():
        if isinstance(block, DiagramBlock) and name not in diagram.commented:
            yield from _logged_views(block.diagram, joined(path, name))


def _flat_form(diagram: Diagram) -> FlatForm:
    if not diagram.commented and not any(block.virtual for block in diagram.blocks.values()):
        check_connected({"": diagram})
        return FlatForm(diagram=diagram, levels={"": diagram})
    levels = levels_of(diagram)
    check_connected(levels)
    commented = commented_paths(levels)
    signals = signals_without_comments(levels) if commented else KnownSignals()
    return flat_form(netlist(levels, commented, signals))
