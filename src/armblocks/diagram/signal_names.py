"""Names of signals: a name of an output port, unique among the blocks and signals of its sheet.

The name of a signal in a subsystem has the path of the subsystem, ``"controller/error"``. Results, data files
and legends show it in place of ``block/port``.
"""

from __future__ import annotations

from collections.abc import Iterator

from armblocks.diagram.bus import Bus
from armblocks.diagram.comments import active_levels
from armblocks.diagram.diagram import Diagram
from armblocks.diagram.flat_form import FlatForm
from armblocks.diagram.hierarchy import flatten_hierarchy
from armblocks.diagram.levels import joined
from armblocks.diagram.port import PortRef


def named_signals(form: FlatForm) -> Iterator[tuple[str, PortRef]]:
    """The names of all signals by path, outer sheets first, with the signals.

    The names of bus elements, ``name.element``, come last.
    """
    elements: list[tuple[str, PortRef]] = []
    for level, diagram in active_levels(form.levels).items():
        for ref, name in diagram.signal_names.items():
            port = PortRef(joined(level, ref.block), ref.port)
            path, content = joined(level, name), form.contents.get(port, port)
            if isinstance(content, Bus):
                elements += ((f"{path}.{element}", source) for element, source in content.leaves())
            else:
                yield path, content
    yield from elements


def signal_titles(diagram: Diagram) -> dict[str, str]:
    """The names of signals by ``block/port``; of several names, the name on the outermost sheet."""
    titles: dict[str, str] = {}
    for name, ref in named_signals(flatten_hierarchy(diagram)):
        titles.setdefault(str(ref), name)
    return titles
