"""The lines of a displayed sheet equal those of the report, also after a drag, and avoid blocks."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

from client_requests import Events, run_scenario

import armblocks as ab
from armblocks.diagram import Connection, PortRef
from armblocks.drawing.diagram_drawing import drawn_bends, obstacle, wire_nets
from armblocks.drawing.diagram_layout import boxes
from armblocks.drawing.wire_routing import route
from armblocks.studio.server.hub import Hub
from armblocks.studio.sheet.lines import SheetLines, has_ports


def test_displayed_lines_equal_those_of_the_report_also_after_a_drag() -> None:
    sheet = ab.load_diagram("puma560_computed_torque")
    lines = SheetLines()
    before = lines.route(sheet)
    place = boxes(sheet)["rne"]
    moved = lines.route_dragged(sheet, {"rne": (place.x, place.y + 90)}, sheet.connections, sheet.bends, None)
    assert moved != before
    again = lines.route_dragged(sheet, {}, sheet.connections, sheet.bends, None)
    assert again == before == SheetLines().route(sheet)
    nets, wires = wire_nets(sheet.connections, drawn_bends(sheet), boxes(sheet))
    routed = route([obstacle(box) for box in boxes(sheet).values()], nets)
    for source, targets, net in zip(wires, wires.values(), routed):
        shown = before[str(source)]
        assert [tuple(shown.paths[str(target)]) for target in targets] == list(net.paths)
        assert tuple(shown.dots) == net.dots


def test_lines_do_not_avoid_a_block_that_may_be_inserted_into_them() -> None:
    sheet = ab.load_diagram("van_der_pol_pid")
    lines, ramp = SheetLines(), boxes(sheet)["x2"].outputs[0]
    moved = {"one": (ramp.x + 20, ramp.y - 25)}
    others = [wire for wire in sheet.connections if wire.source.block != "one"]

    def path(ignored: str | None) -> list[tuple[float, float]]:
        changed = lines.route_dragged(sheet, moved, others, sheet.bends, ignored)
        return changed["x2/y"].paths["x1/u"]

    assert path("one") == lines.route(sheet)["x2/y"].paths["x1/u"]
    assert path(None) != path("one")


def test_wires_with_ports_that_no_longer_exist_are_not_routed() -> None:
    sheet = ab.load_diagram("van_der_pol_pid")
    for source, target, possible in (
        (PortRef("PID", "y"), PortRef("u", "u1"), True),
        (PortRef("gone", "y"), PortRef("u", "u1"), False),
        (PortRef("PID", "y"), PortRef("u", "u9"), False),
    ):
        assert has_ports(Connection(source, target), sheet) == possible


def test_a_sheet_shows_a_name_that_is_given_on_another_sheet(tmp_path: Path) -> None:
    async def scenario(_: Hub, ask: Callable[..., Awaitable[Any]], events: Events) -> None:
        key = await ask("open_shipped", document_kind="diagram", name="van_der_pol_pid")
        await ask("change", document=key, edit={"kind": "group", "blocks": ["PID"], "name": "S"})
        await ask(
            "change", document=key, edit={"kind": "name_signal", "port": "error/y", "name": "deviation"}
        )
        await ask("show_sheet", document=key, inside=["S"])
        lines = [event for event in events if event["kind"] == "opened"][-1]["content"]["sheet"]["lines"]
        named = [source for source, net in lines.items() if net["propagated_name"] == "deviation"]
        assert len(named) == 1
        assert lines[named[0]]["name_at"] is not None
        await ask("undo", document=key)
        changed = [event for event in events if event["kind"] == "changed"][-1]
        assert changed["change"]["sheet"]["lines"][named[0]]["propagated_name"] == ""

    run_scenario(tmp_path, scenario)
