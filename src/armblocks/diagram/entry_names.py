"""Names of vector entries: declared by ports, propagated through elementwise blocks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from armblocks.diagram.block import Block
from armblocks.diagram.diagram import Diagram
from armblocks.diagram.hierarchy import flat_diagram
from armblocks.diagram.parameter import ParameterKind
from armblocks.diagram.port import Port, PortRef
from armblocks.equations import Shape


def entry_names(diagram: Diagram, shapes: Mapping[str, Shape]) -> Mapping[str, tuple[str, ...]]:
    """Names of the entries of signals, by path; signals without known names are omitted.

    Ports of robot blocks and of tables declare names. They apply to the signal at the port, and to all
    vectors of the same length that elementwise blocks compute from it. A signal to which two different
    lists of names apply is omitted. ``shapes`` has the shapes of all signals, by path. Names are for display
    only.
    """
    flat = flat_diagram(diagram)
    if not any(_may_declare_names(block) for block in flat.blocks.values()):
        return {}
    groups = _Groups()
    declared: list[tuple[str, tuple[str, ...]]] = []
    for name, block in flat.blocks.items():
        inputs = {port: str(flat.drivers[PortRef(name, port.name)]) for port in block.input_ports()}
        outputs = {port: f"{name}/{port.name}" for port in block.output_ports()}
        for one, other in _signal_pairs(block, inputs, outputs):
            if shapes.get(one) == shapes.get(other) and len(shapes.get(one, ())) == 1:
                groups.join(one, other)
        declared += [(path, port.names) for port, path in {**inputs, **outputs}.items() if port.names]
    names_of: dict[str, set[tuple[str, ...]]] = {}
    for path, names in declared:
        if shapes.get(path) == (len(names),):
            names_of.setdefault(groups.representative(path), set()).add(names)
    names_by_path = {path: names_of.get(groups.representative(path), set()) for path in shapes}
    return {path: next(iter(rows)) for path, rows in names_by_path.items() if len(rows) == 1}


def _may_declare_names(block: Block) -> bool:
    return any(rule.kind in (ParameterKind.ROBOT, ParameterKind.TABLE) for rule in block.parameters())


def _signal_pairs(
    block: Block, inputs: Mapping[Port, str], outputs: Mapping[Port, str]
) -> Iterator[tuple[str, str]]:
    """Pairs of signals of a block that share their entry names, if their shapes agree."""
    by_name = {port.name: path for port, path in outputs.items()}
    yield from ((by_name[one], by_name[other]) for one, other in block.output_rates.items())
    yield from ((by_name[one], by_name.get(other, "")) for one, other in block.time_derivatives.items())
    if type(block).output_shapes is Block.output_shapes and not block.virtual:
        # A block without its own shape rule is elementwise.
        paths = [path for port, path in outputs.items() if port.shape is None]
        paths += [path for port, path in inputs.items() if port.shape is None]
        yield from ((paths[0], other) for other in paths[1:])


class _Groups:
    """Disjoint sets of signals (union-find)."""

    def __init__(self) -> None:
        self._parent: dict[str, str] = {}

    def representative(self, path: str) -> str:
        """The representative of the set of a signal."""
        root = path
        while root in self._parent:
            root = self._parent[root]
        while path != root:
            self._parent[path], path = root, self._parent[path]
        return root

    def join(self, one: str, other: str) -> None:
        """Merge the sets of two signals."""
        first, second = self.representative(one), self.representative(other)
        if first != second:
            self._parent[second] = first
