"""Automatic layout of diagrams, compared with manual layouts and with elkjs.

Twenty textbook diagrams (`textbook/`) and the shipped examples, each with its stored layout and with the
layout of armblocks. With `ARMBLOCKS_ELKJS`, a folder in which `npm install elkjs` was run, also with that
of elkjs. The router of armblocks draws the lines in all cases, so that the table compares positions of
blocks only.
"""

# pyright: basic
from __future__ import annotations

import dataclasses
import json
import os
import random
import subprocess
import sys
import time
from itertools import combinations, pairwise
from pathlib import Path

import armblocks as ab
from armblocks import blocks as kinds
from armblocks.diagram import Diagram, DiagramBuilder, Placement
from armblocks.drawing.block_boxes import box_at_placement
from armblocks.drawing.diagram_drawing import drawn_bends, obstacle, wire_nets
from armblocks.drawing.diagram_layout import arranged_layout, boxes
from armblocks.drawing.wire_routing import route

TEXTBOOK = Path(__file__).parent / "textbook"
COLUMNS = ("crossings", "bends", "length", "leftward", "straight", "area", "aspect", "labels", "overlaps")
ELK_OPTIONS = {
    "elk.algorithm": "layered",
    "elk.direction": "RIGHT",
    "elk.layered.feedbackEdges": "true",
    "elk.layered.nodePlacement.strategy": "NETWORK_SIMPLEX",
    "elk.layered.cycleBreaking.strategy": "DEPTH_FIRST",
    "elk.layered.thoroughness": "20",
    "elk.spacing.nodeNode": "44",
    "elk.layered.spacing.nodeNodeBetweenLayers": "50",
    "elk.spacing.edgeNode": "14",
    "elk.layered.spacing.edgeNodeBetweenLayers": "18",
}


def measured(diagram: Diagram) -> dict[str, float]:
    """Measures of the drawing of a diagram, by the names of ``COLUMNS``.

    crossings: between lines of different sources. bends: of all lines. length: of all lines (px). leftward:
    connections whose target is left of their source. straight: connections without a bend. area, aspect: of
    the bounding box of all blocks (1000 px squared; width to height). labels: connections drawn as labels,
    because there is no space for a line. overlaps: pairs of blocks.
    """
    placed = boxes(diagram)
    nets, _ = wire_nets(diagram.connections, drawn_bends(diagram), placed)
    routed = route([obstacle(box) for box in placed.values()], nets)
    segments = [
        (k, *segment) for k, net in enumerate(routed) for path in net.paths for segment in pairwise(path)
    ]
    paths = [path for net in routed for path in net.paths]
    left, top = min(box.x for box in placed.values()), min(box.y for box in placed.values())
    width = max(box.x + box.width for box in placed.values()) - left
    height = max(box.y + box.height for box in placed.values()) - top
    return {
        "crossings": sum(
            k != j and cross((a, b), (c, d)) for (k, a, b), (j, c, d) in combinations(segments, 2)
        ),
        "bends": sum(max(len(path) - 2, 0) for path in paths),
        "length": sum(abs(a[0] - b[0]) + abs(a[1] - b[1]) for _, a, b in segments),
        "leftward": sum(
            placed[connection.target.block].x <= placed[connection.source.block].x
            for connection in diagram.connections
        ),
        "straight": sum(len(path) == 2 for path in paths),
        "area": width * height / 1e3,
        "aspect": width / height,
        "labels": sum(not path for path in paths),
        "overlaps": sum(
            a.x < b.x + b.width and b.x < a.x + a.width and a.y < b.y + b.height and b.y < a.y + a.height
            for a, b in combinations(placed.values(), 2)
        ),
    }


def cross(one, other) -> bool:
    """Whether two straight segments cross."""
    (a, b), (c, d) = one, other
    if (a[0] == b[0]) == (c[0] == d[0]):
        return False
    (a, b), (c, d) = ((a, b), (c, d)) if a[0] == b[0] else ((c, d), (a, b))
    return min(c[0], d[0]) < a[0] < max(c[0], d[0]) and min(a[1], b[1]) < c[1] < max(a[1], b[1])


def arranged(diagram: Diagram) -> Diagram:
    """The diagram with the automatic layout of armblocks."""
    return dataclasses.replace(diagram, layout=arranged_layout(diagram), bends={})


def with_elk(diagrams: list[Diagram], elkjs: str) -> list[Diagram]:
    """The diagrams with the layout of elkjs."""
    script = Path(__file__).with_name("elk.mjs")
    completed = subprocess.run(
        ["node", script],
        input=json.dumps([elk_graph(diagram) for diagram in diagrams]),
        env={**os.environ, "ARMBLOCKS_ELKJS": elkjs},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return [
        dataclasses.replace(
            diagram,
            layout={
                node["id"]: Placement(x=round(node["x"]), y=round(node["y"])) for node in graph["children"]
            },
            bends={},
        )
        for diagram, graph in zip(diagrams, json.loads(completed.stdout))
    ]


def elk_graph(diagram: Diagram) -> dict:
    """The graph of a diagram for elkjs, with ports at fixed positions."""
    upright = {name: Placement(x=0, y=0) for name in diagram.blocks}
    placed = boxes(dataclasses.replace(diagram, layout=upright, bends={}))
    children = []
    for name in diagram.blocks:
        box = box_at_placement(name, placed[name].block, upright[name])
        sides = {-1: "NORTH", 0: "WEST", 1: "SOUTH"}
        ports = [
            {"id": f"{name}/{spot.name}", "x": spot.x, "y": spot.y, "width": 0, "height": 0}
            | {"layoutOptions": {"elk.port.side": "EAST" if out else sides[-spot.dy]}}
            for out, spots in ((False, box.inputs), (True, box.outputs))
            for spot in spots
        ]
        children.append(
            {
                "id": name,
                "width": box.width,
                "height": box.height + 18,
                "ports": ports,
                "layoutOptions": {"elk.portConstraints": "FIXED_POS"},
            }
        )
    edges = [
        {"id": str(k), "sources": [str(connection.source)], "targets": [str(connection.target)]}
        for k, connection in enumerate(diagram.connections)
    ]
    return {"id": "root", "layoutOptions": ELK_OPTIONS, "children": children, "edges": edges}


def many_loops(count: int) -> Diagram:
    """A draft diagram of control loops in series, each with eight blocks."""
    draw = random.Random(0)
    builder = DiagramBuilder("many loops")
    before = None
    for k in range(count // 8):
        start = builder.add(f"r{k}", kinds.Step())
        first = before if before is not None and draw.random() < 0.7 else start
        if first is not start:
            builder.add(f"see r{k}", kinds.Scope(inputs=1), start)
        error = builder.add(f"e{k}", kinds.Sum(signs="+-"), first)
        control = builder.add(f"c{k}", kinds.PID(), error)
        load = builder.add(f"l{k}", kinds.Sum(signs="++"), control, builder.add(f"d{k}", kinds.Step()))
        plant = builder.add(f"p{k}", kinds.TransferFunction(), load)
        builder.connect(builder.add(f"h{k}", kinds.Gain(gain=2.0), plant), error["u2"])
        builder.add(f"s{k}", kinds.Scope(inputs=1), plant)
        before = plant
    return builder.draft()


def table(groups: dict[str, list[Diagram]]) -> None:
    print("| places | " + " | ".join(COLUMNS) + " |\n|" + "---|" * (len(COLUMNS) + 1))
    for name, diagrams in groups.items():
        rows = [measured(diagram) for diagram in diagrams]
        mean = [sum(row[column] for row in rows) for column in COLUMNS]
        mean[COLUMNS.index("aspect")] /= len(rows)
        print(f"| {name} | " + " | ".join(f"{v:.1f}" if 0 < v < 10 else f"{v:.0f}" for v in mean) + " |")
        if "-v" in sys.argv:
            for diagram, row in zip(diagrams, rows):
                print(f"|   {diagram.name} | " + " | ".join(f"{row[c]:.4g}" for c in COLUMNS) + " |")


def main() -> None:
    elkjs = os.environ.get("ARMBLOCKS_ELKJS", "")
    textbook = [ab.load_diagram(path) for path in sorted(TEXTBOOK.glob("*.json"))]
    examples = [ab.load_diagram(name) for name in ab.list_examples()]
    for title, diagrams in (("Twenty textbook diagrams", textbook), ("Shipped examples", examples)):
        groups = {"manual": diagrams, "arranged": [arranged(diagram) for diagram in diagrams]}
        if elkjs:
            groups["elkjs"] = with_elk(diagrams, elkjs)
        print(f"\n{title}, sums:\n")
        table(groups)
    print()
    for count in (100, 300, 1000):
        diagram = many_loops(count)
        start_time = time.perf_counter()
        boxes(diagram)
        print(f"{count} blocks arranged in {time.perf_counter() - start_time:.2f} s")


if __name__ == "__main__":
    main()
