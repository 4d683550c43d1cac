"""Findings are marked at the blocks of the sheet, also where a message names a block that flattening adds."""

from armblocks.blocks import BusCreator, Constant, Switch
from armblocks.diagram import Diagram, DiagramBuilder
from armblocks.studio.sheet.check import check


def marked(diagram: Diagram) -> dict[str, str]:
    return {finding.block: finding.what for finding in check(diagram)[0]}


def test_a_copy_for_a_bus_marks_its_switch() -> None:
    builder = DiagramBuilder("shapes")
    three = builder.add("three", BusCreator(names="a"), builder.add("x", Constant(value=(1.0, 2.0, 3.0))))
    two = builder.add("two", BusCreator(names="a"), builder.add("y", Constant(value=(1.0, 2.0))))
    builder.add("switch", Switch(), three, builder.add("which", Constant()), two)
    found = marked(builder.draft())
    assert list(found) == ["switch"]
    assert "'u1' has shape (3,) and 'u3' has shape (2,)" in found["switch"]
