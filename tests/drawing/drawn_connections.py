"""The routed lines of a diagram, and the connections that a reader infers from them."""

from __future__ import annotations

from collections.abc import Mapping

from wire_reader import Block, Drawing, Point, Port, read

from armblocks.diagram import Diagram, PortRef
from armblocks.drawing.diagram_drawing import drawn_bends, obstacle, wire_nets
from armblocks.drawing.diagram_layout import boxes
from armblocks.drawing.wire_routing import route
from armblocks.drawing.wires import Net, Obstacle, RoutedNet

Routing = tuple[dict[PortRef, list[PortRef]], list[Net], list[RoutedNet], list[Obstacle]]


def routing(diagram: Diagram) -> Routing:
    """Targets by source, nets, their lines, and the obstacles."""
    placed = boxes(diagram)
    nets, wires = wire_nets(diagram.connections, drawn_bends(diagram), placed)
    obstacles = [obstacle(box) for box in placed.values()]
    return wires, nets, route(obstacles, nets), obstacles


def drawn_lines(diagram: Diagram) -> dict[tuple[str, str, str], tuple[Point, ...]]:
    """The line of each connection from its source, or from where it branches: by blocks and input."""
    wires, _, nets, _ = routing(diagram)
    return {
        (source.block, target.block, target.port): path
        for (source, targets), net in zip(wires.items(), nets)
        for target, path in zip(targets, net.paths)
    }


def connections_in_the_drawing(diagram: Diagram) -> tuple[Mapping[str, str], Mapping[str, str]]:
    """The driver of each input that a reader infers, and that of the diagram."""
    wires, _, nets, _ = routing(diagram)
    placed = boxes(diagram)
    ports = {
        f"{name}/{spot.name}": Port(name, spot.x, spot.y, (sign * spot.dx, sign * spot.dy), sign == 1)
        for name, box in placed.items()
        for spots, sign in ((box.inputs, -1), (box.outputs, 1))
        for spot in spots
    }
    labels: dict[str, str] = {}
    for (source, targets), net in zip(wires.items(), nets):
        for target, path in zip(targets, net.paths):
            if not path:
                labels[str(source)] = labels[str(target)] = str(source)
    drawn = Drawing(
        blocks={name: Block(box.x, box.y, box.width, box.height) for name, box in placed.items()},
        ports=ports,
        lines=[path for net in nets for path in net.paths if path],
        dots=[dot for net in nets for dot in net.dots],
        labels=labels,
    )
    return read(drawn), {str(target): str(source) for source, targets in wires.items() for target in targets}
