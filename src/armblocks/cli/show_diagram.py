"""``armblocks show`` for a diagram: its hierarchy as a tree, or all its blocks."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from rich.console import Console
from rich.text import Text
from rich.tree import Tree

from armblocks.cli.diff import value_text
from armblocks.cli.terminal import ACCENT, STRONG, table
from armblocks.errors import counted

if TYPE_CHECKING:
    from armblocks.diagram import Diagram, DiagramBlock


def print_hierarchy(diagram: Diagram, console: Console) -> None:
    """Print the tree of subsystems: type, library, number of blocks and wires, mask parameters of each."""
    tree = Tree(_heading(diagram, diagram.name), guide_style=ACCENT)
    if diagram.description:
        tree.add(Text(diagram.description, "italic"))
    for line in _mask_lines(diagram):
        tree.add(line)
    for set_name, values in diagram.parameter_sets.items():
        branch = tree.add(Text.assemble("parameter set ", (set_name, STRONG)))
        for path, value in values.items():
            branch.add(Text(f"{path} = {value_text(value)}"))
    _add_subsystems(tree, diagram)
    console.print(tree)


def print_flat(diagram: Diagram, console: Console) -> None:
    """Print all blocks of the flat diagram, by path, with the parameters that differ from their defaults."""
    from armblocks.cli.diff import non_default_values
    from armblocks.diagram import flat_diagram

    flat = flat_diagram(diagram)
    console.print(_heading(flat, diagram.name))
    blocks = table(("block", "left"), ("type", "left"), ("parameters", "left"))
    for path, block in flat.blocks.items():
        words = (f"{name}={value_text(value)}" for name, value in non_default_values(block).items())
        blocks.add_row(path, block.type_name(), "  ".join(words))
    console.print(blocks)


def _add_subsystems(tree: Tree, diagram: Diagram) -> None:
    for name, block in _subsystems(diagram):
        inner = block.diagram
        label = Text.assemble((name, STRONG), "  ", block.title.lower())
        if inner.link:
            label.append_text(Text.assemble("  from ", (_link_name(inner.link), ACCENT)))
        branch = tree.add(Text.assemble(label, "  ", _count(inner)))
        if values := _values(block):
            branch.add(Text(values))
        if not inner.link:  # the library has the content
            _add_subsystems(branch, inner)


def _subsystems(diagram: Diagram) -> Iterator[tuple[str, DiagramBlock]]:
    from armblocks.diagram import DiagramBlock

    for name, block in diagram.blocks.items():
        if isinstance(block, DiagramBlock):
            yield name, block


def _heading(diagram: Diagram, name: str) -> Text:
    return Text.assemble((name, STRONG), "  ", _count(diagram))


def _count(diagram: Diagram) -> str:
    """The counts of blocks and wires: ``"12 blocks (80 including inner blocks), 14 wires"``."""
    from armblocks.diagram import block_count

    count, total = len(diagram.blocks), block_count(diagram)
    inside = f" ({total} including inner blocks)" if total > count else ""
    wires = len(diagram.connections)
    return f"{counted(count, 'block')}{inside}, {counted(wires, 'wire')}"


def _mask_lines(diagram: Diagram) -> Iterator[Text]:
    for rule in diagram.mask:
        value = value_text(diagram.mask_values[rule.name])
        unit = f" {rule.unit}" if rule.unit else ""
        doc = f"  {rule.doc}" if rule.doc else ""
        yield Text.assemble((rule.name, ACCENT), f" = {value}{unit}", doc)


def _values(block: DiagramBlock) -> str:
    """The values of the mask parameters and their formulas: ``"w = 20 rad/s (from w0), G = 107.8"``."""
    formulas = dict(block.formulas)
    texts: list[str] = []
    for rule in block.diagram.mask:
        value = value_text(block.parameter_value(rule.name)) + (f" {rule.unit}" if rule.unit else "")
        text = f" (from {formulas[rule.name]})" if rule.name in formulas else ""
        texts.append(f"{rule.name} = {value}{text}".replace(" ", "\u00a0"))
    return ", ".join(texts)


def _link_name(link: str) -> str:
    """A library link without the folders of its file."""
    return link.rpartition("/")[2]
