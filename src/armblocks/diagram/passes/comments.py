"""Pass: commented blocks are replaced by zeros or by connections.

Input: the outermost commented blocks (``Netlist.commented``), and the signals of the model without comments.

Result: zeros replace a block that is commented out, with the shapes that its outputs have without comments.
For a block that is commented through, the signals at its inputs replace its outputs. The blocks inside a
commented subsystem are removed."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

from armblocks.diagram.block import Block
from armblocks.diagram.bus import Bus, PortContent
from armblocks.diagram.comments import is_inside, passed_ports
from armblocks.diagram.frames import lines_without
from armblocks.diagram.grounded import Bypass, Grounded
from armblocks.diagram.passes.netlist import KnownSignals, Netlist, Replacement, Replacements
from armblocks.diagram.port import Port, PortRef
from armblocks.diagram.shape_rules import shapes_agree
from armblocks.equations import Shape
from armblocks.errors import DiagramError


def resolve_comments(net: Netlist) -> Netlist:
    """The netlist without commented blocks.

    Raises ``DiagramError`` for a block that is commented through whose input and output differ in shape.
    """
    if not net.commented:
        return net
    comments = _Comments(net)
    for path, comment in net.commented.items():
        if comment == "through":
            comments.pass_through(path)
        else:
            comments.ground(path)
    blocks = comments.blocks
    return dataclasses.replace(
        net,
        levels={path: level for path, level in net.levels.items() if not is_inside(path, net.commented)},
        blocks=blocks,
        drivers={ref: source for ref, source in net.drivers.items() if _is_port(ref, blocks)},
        frame_lines=lines_without(net.frame_lines, lambda end: not _is_frame(end, blocks)),
        replaced={**net.replaced, **comments.replaced},
        origins={**net.origins, **comments.origins},
        commented={},
        without_comments=KnownSignals(),
    )


def _is_port(ref: PortRef, blocks: dict[str, Block]) -> bool:
    block = blocks.get(ref.block)
    if not isinstance(block, Bypass | Grounded):
        return block is not None
    return any(port.name == ref.port for port in block.input_ports())


def _is_frame(ref: PortRef, blocks: dict[str, Block]) -> bool:
    block = blocks.get(ref.block)
    return block is not None and any(port.name == ref.port for port in block.frame_ports())


class _Comments:
    """The blocks and replacements in place of commented blocks."""

    def __init__(self, net: Netlist) -> None:
        self.net = net
        self.known = net.without_comments
        self.blocks = {
            path: block for path, block in net.blocks.items() if not is_inside(path, net.commented)
        }
        self.replaced: dict[str, Replacements] = {}
        self.origins: dict[str, str] = {}

    def ground(self, path: str) -> None:
        """Replace a block by zeros."""
        ports = self.net.blocks[path].output_ports()
        contents = {port.name: self.known.at(PortRef(path, port.name)) for port in ports}
        if not ports:
            return
        if not any(isinstance(content, Bus) for content in contents.values()):
            self.blocks[path] = Grounded.of({port.name: self._shape(path, port) for port in ports})
            return
        self.blocks[path] = Bypass.of((), tuple(contents))
        self.replaced[path] = {
            port.name: Replacement((), _constant_content(self._zeros(path, port, contents[port.name])))
            for port in ports
        }

    def _zeros(self, path: str, port: Port, content: PortContent) -> PortContent:
        """Zeros with the structure of a signal or bus."""
        if isinstance(content, PortRef):
            return self._zero(path, port.name, self._shape(path, port))
        zeros = content
        for element, source in content.leaves():
            shape = self.known.shapes.get(source, ())
            zeros = zeros.replaced(element, self._zero(path, f"{port.name}.{element}", shape))
        return zeros

    def _zero(self, path: str, signal: str, shape: Shape) -> PortRef:
        zero = f"{path}.{signal}"
        self.blocks[zero], self.origins[zero] = Grounded.of({"y": shape}), path
        return PortRef(zero, "y")

    def _shape(self, path: str, port: Port) -> Shape:
        """The shape of an output without comments.

        If the model without comments has an error, this is the shape of an input that the output drives, or a
        scalar.
        """
        ref = PortRef(path, port.name)
        declared = port.shape if port.shape is not None else self.known.shape(ref)
        if declared is not None:
            return declared
        input_shapes = (
            entry.shape
            for target, source in self.net.drivers.items()
            if source == ref and target.block in self.blocks
            for entry in self.blocks[target.block].input_ports()
            if entry.name == target.port and entry.shape is not None
        )
        return next(input_shapes, ())

    def pass_through(self, path: str) -> None:
        """Replace a block by connections from its inputs to its outputs."""
        block, net = self.net.blocks[path], self.net
        pairs = passed_ports(block)
        for into, out in pairs:
            self._check_equal(path, into, out)
        self.blocks[path] = Bypass.of([into for into, _ in pairs], [out for _, out in pairs])
        self.replaced[path] = {out: Replacement((net.drivers[PortRef(path, into)],)) for into, out in pairs}

    def _check_equal(self, path: str, into: str, out: str) -> None:
        driver = self.net.drivers[PortRef(path, into)]
        before = _description_of(self.known, self.known.at(driver))
        after = _description_of(self.known, self.known.at(PortRef(path, out)))
        if before is not None and after is not None and not _shapes_fit(before, after):
            raise DiagramError(
                f"the block is commented through, but its input '{into}' is {_text(before)} "
                f"and its output '{out}' is {_text(after)}",
                where=self.net.label(path),
                allowed="an input and an output of the same shape",
                fix="comment the block out, or remove the comment",
            )


_Description = Shape | dict[str, Shape | None]
"""The shape of a signal, or the shapes of the elements of a bus."""


def _description_of(known: KnownSignals, content: PortContent) -> _Description | None:
    if isinstance(content, PortRef):
        return known.shapes.get(content)
    return {element: known.shapes.get(source) for element, source in content.leaves()}


def _shapes_fit(one: _Description, other: _Description) -> bool:
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(
            first is None or second is None or shapes_agree(first, second)
            for first, second in zip(one.values(), (other[element] for element in one))
        )
    return not isinstance(one, dict) and not isinstance(other, dict) and shapes_agree(one, other)


def _text(description: _Description) -> str:
    return (
        f"a bus with {', '.join(description)}" if isinstance(description, dict) else f"of shape {description}"
    )


def _constant_content(content: PortContent) -> Callable[[Sequence[PortContent]], PortContent]:
    return lambda _: content
