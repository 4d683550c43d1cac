"""Routed lines: the connections can be inferred from the drawing for any layout of blocks."""

from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import pytest
from wire_reader import AmbiguousError, Block, Drawing, Port, read

from armblocks.drawing.wire_routing import Routing, route
from armblocks.drawing.wires import Net, Obstacle, RoutedNet, WireEnd, drawn_path

Path = tuple[tuple[float, float], ...]
MIN_DISTANCE = 4.0
"""Minimum distance of parallel segments of different nets, px."""
SIDES = {"left": (-1, 0), "right": (1, 0), "top": (0, -1), "bottom": (0, 1)}


@dataclass(frozen=True)
class Placed:
    """A block with its inputs on one side and its outputs on another."""

    x: float
    y: float
    width: float
    height: float
    inputs: int
    outputs: int
    input_side: str
    output_side: str

    def port_position(self, side: str, k: int, count: int) -> tuple[float, float]:
        """The position of port ``k`` of ``count`` on a side."""
        share = (k + 0.5) / count
        if side in ("left", "right"):
            return self.x + (self.width if side == "right" else 0.0), self.y + self.height * share
        return self.x + self.width * share, self.y + (self.height if side == "bottom" else 0.0)


@dataclass(frozen=True)
class SheetModel:
    """Blocks by name, the output that drives each input, and user-drawn routes by input."""

    blocks: Mapping[str, Placed]
    drivers: Mapping[tuple[str, int], tuple[str, int]]
    bends: Mapping[tuple[str, int], tuple[float, ...]]

    def ports(self) -> dict[str, Port]:
        """All ports, also those without wires."""
        ports: dict[str, Port] = {}
        for name, block in self.blocks.items():
            for k in range(block.inputs):
                place = block.port_position(block.input_side, k, block.inputs)
                ports[f"{name}/u{k}"] = Port(name, *place, SIDES[block.input_side], False)
            for k in range(block.outputs):
                place = block.port_position(block.output_side, k, block.outputs)
                ports[f"{name}/y{k}"] = Port(name, *place, SIDES[block.output_side], True)
        return ports

    def nets(self) -> tuple[dict[str, Net], dict[str, list[str]]]:
        """The nets by source, and their targets."""
        ports, targets = self.ports(), dict[str, list[str]]()
        bends: dict[str, list[tuple[float, ...]]] = {}
        for (block, k), (driver, j) in self.drivers.items():
            targets.setdefault(f"{driver}/y{j}", []).append(f"{block}/u{k}")
            bends.setdefault(f"{driver}/y{j}", []).append(self.bends.get((block, k), ()))

        def end(port: Port) -> WireEnd:
            sign = 1 if port.is_output else -1
            return WireEnd(port.x, port.y, sign * port.out[0], sign * port.out[1])

        nets = {
            source: Net(end(ports[source]), tuple(end(ports[t]) for t in driven), tuple(bends[source]))
            for source, driven in targets.items()
        }
        return nets, targets

    def obstacles(self) -> dict[str, Obstacle]:
        """The blocks as obstacles of the router."""
        return {
            name: Obstacle(b.x, b.y, b.width, b.height, (b.x - 5, b.y + b.height + 2, b.width + 10, 16))
            for name, b in self.blocks.items()
        }


def drawing(model: SheetModel, routed: Mapping[str, RoutedNet]) -> Drawing:
    """The visible elements of a routed sheet."""
    _, targets = model.nets()
    labels: dict[str, str] = {}
    for source, net in routed.items():
        for target, path in zip(targets[source], net.paths):
            if not path:
                labels[source] = labels[target] = source
    return Drawing(
        blocks={name: Block(b.x, b.y, b.width, b.height) for name, b in model.blocks.items()},
        ports=model.ports(),
        lines=[path for net in routed.values() for path in net.paths if path],
        dots=[dot for net in routed.values() for dot in net.dots],
        labels=labels,
    )


def check_connections(model: SheetModel, routed: Mapping[str, RoutedNet]) -> None:
    expected = {f"{b}/u{k}": f"{d}/y{j}" for (b, k), (d, j) in model.drivers.items()}
    assert read(drawing(model, routed)) == expected
    check_distances(routed)


def check_distances(routed: Mapping[str, RoutedNet]) -> None:
    """Parallel segments of different nets are apart by more than the width of a line."""
    segments = [
        (key, int(a[0] != b[0]), *sorted((a, b)))
        for key, net in routed.items()
        for path in net.paths
        for a, b in pairwise(path)
    ]
    for (one, axis, a, b), (other, other_axis, c, d) in combinations(segments, 2):
        along = 1 - axis
        if one != other and axis == other_axis and max(a[along], c[along]) <= min(b[along], d[along]):
            assert abs(a[axis] - c[axis]) >= MIN_DISTANCE, (one, other, (a, b), (c, d))


def random_model(draw: random.Random) -> SheetModel:
    """A random sheet: dense, rotated or overlapping blocks, fan-out, user-drawn routes."""
    kind = draw.choice(["grid", "dense", "anywhere", "fan", "facing", "mirrored"])
    blocks: dict[str, Placed] = {}
    for k in range(draw.randint(2, 14)):
        width, height = draw.choice([30, 45, 60, 90]), draw.choice([30, 40, 60, 84])
        sides = draw.choice(
            [("left", "right")] * 5 + [("right", "left"), ("top", "bottom"), ("bottom", "top")]
        )
        if draw.random() < 0.1:
            sides = draw.choice(["left", "top", "bottom"]), "right"
        pitch, row = {"dense": (105, 75), "facing": (100, 60)}.get(kind, (170, 120))
        x, y = (k % 4) * pitch + draw.randint(0, 30), (k // 4) * row + draw.randint(0, 20)
        if kind == "anywhere":
            x, y = draw.randint(0, 450), draw.randint(0, 300)
        if kind == "facing":
            width, x = 90 + draw.randint(0, 9), (k % 4) * pitch
        if kind == "mirrored":
            (x, y), height, sides = ((k % 4) * pitch, (k // 4) * row), 40, ("right", "left")
        blocks[f"b{k}"] = Placed(x, y, width, height, draw.randint(0, 3), draw.randint(0, 2), *sides)
    if kind == "fan":
        count, height = 20, draw.choice([60, 130, 400])
        blocks["fan"] = Placed(700, 40, 60, height, count, 1, "left", "right")
        for k in range(count):
            blocks[f"s{k}"] = Placed(draw.randint(380, 560), 34 * k, 40, 22, 0, 1, "left", "right")
    outputs = [(name, k) for name, block in blocks.items() for k in range(block.outputs)]
    drivers = {
        (name, k): draw.choice(outputs)
        for name, block in blocks.items()
        for k in range(block.inputs)
        if outputs and draw.random() < 0.85
    }
    model = SheetModel(blocks, drivers, {})
    return replace(model, bends=random_bends(draw, model))


def random_bends(draw: random.Random, model: SheetModel) -> dict[tuple[str, int], tuple[float, ...]]:
    """Random user-drawn routes, on many sheets beside ports and beside each other."""
    share, is_close = draw.choice([(0.15, False), (0.15, False), (0.6, True)])
    ports = model.ports().values()
    near = [float(draw.choice([port.x, port.y])) for port in draw.sample(list(ports), min(len(ports), 3))]

    def bend() -> float:
        if is_close and near and draw.random() < 0.7:
            return draw.choice(near) + draw.randint(-6, 6)
        value = float(draw.randint(-50, 500))
        near.append(value)
        return value

    return {
        end: tuple(bend() for _ in range(draw.randint(1, 4)))
        for end in model.drivers
        if draw.random() < share
    }


@pytest.mark.parametrize("seed", range(12))
def test_the_connections_are_inferred_from_the_lines(seed: int) -> None:
    """For random layouts and drags. An updated routing equals a new one."""
    draw = random.Random(seed)
    model, routing = random_model(draw), Routing()
    for _ in range(3):
        nets, _ = model.nets()
        routed = routing.update(model.obstacles(), nets)
        check_connections(model, routed)
        moved = dict(model.blocks)
        dx, dy = draw.randint(-120, 120), draw.randint(-90, 90)
        for name in draw.sample(sorted(moved), min(len(moved), draw.choice([1, 1, 1, 2, 4]))):
            moved[name] = replace(moved[name], x=moved[name].x + dx, y=moved[name].y + dy)
        model = replace(model, blocks=moved)
    nets, _ = model.nets()
    assert routing.update(model.obstacles(), nets) == Routing().update(model.obstacles(), nets)


@pytest.mark.parametrize("side", SIDES)
def test_a_line_in_any_direction_does_not_run_under_a_block_on_its_straight_way(side: str) -> None:
    dx, dy = SIDES[side]
    source, target = WireEnd(0, 0, dx, dy), WireEnd(300 * dx, 300 * dy, dx, dy)
    between = Obstacle(150 * dx - 20, 150 * dy - 20, 40, 40, (150 * dx - 20, 150 * dy + 22, 40, 16))
    (alone,) = route([], [Net(source, (target,))])
    assert alone.paths == (((0, 0), (target.x, target.y)),)
    (around,) = route([between], [Net(source, (target,))])
    sheet_drawing = Drawing(
        {"between": Block(between.x, between.y, 40, 40)},
        {"a/y": Port("a", 0, 0, (dx, dy), True), "b/u": Port("b", target.x, target.y, (-dx, -dy), False)},
        around.paths,
        around.dots,
        {},
    )
    assert read(sheet_drawing) == {"b/u": "a/y"}


def test_the_branches_of_a_net_do_not_meet_its_other_lines_without_a_dot() -> None:
    """The straight way to the nearer port is the beginning of the line to the farther one, 6.5 px lower."""
    places = {"s1": (432, 34), "s2": (546, 68), "s3": (504, 102), "s4": (524, 136), "s5": (475, 170)}
    blocks = {name: Placed(x, y, 40, 22, 0, 1, "left", "right") for name, (x, y) in places.items()}
    blocks["s15"] = Placed(388, 510, 40, 22, 0, 1, "left", "right")
    blocks["b1"] = Placed(185, 6, 45, 84, 1, 2, "left", "right")
    blocks["fan"] = Placed(700, 40, 60, 130, 20, 1, "left", "right")
    sources = {4: ("s15", 0), 7: ("s4", 0), 8: ("s4", 0), 9: ("b1", 1), 16: ("s1", 0), 19: ("s2", 0)}
    drivers = {("fan", k): source for k, source in sources.items()}
    model = SheetModel(blocks, drivers, {("fan", 9): (305.0, 6.0, -3.0, -3.0)})
    check_connections(model, Routing().update(model.obstacles(), model.nets()[0]))


# -- user-drawn routes ----------------------------------------------------------------------------

SOURCE, NEAR, FAR = WireEnd(0, 0, 1, 0), WireEnd(200, 0, 1, 0), WireEnd(200, 100, 1, 0)


def test_a_user_drawn_route_is_used_and_other_targets_branch_from_it() -> None:
    bends = (60.0, 50.0, 120.0)
    path = drawn_path(SOURCE, bends, FAR)
    assert path == ((0, 0), (60, 0), (60, 50), (120, 50), (120, 100), (200, 100))
    (routed_net,) = route([], [Net(SOURCE, (NEAR, FAR), ((), bends))])
    assert routed_net.paths[1] == path
    assert routed_net.paths[0] == ((60, 0), (200, 0))
    assert routed_net.dots == ((60, 0),)
    # After a rotation of the block the route does not end at its port: the wire is routed automatically.
    assert drawn_path(SOURCE, bends, WireEnd(200, 100, 0, 1)) is None
    assert drawn_path(SOURCE, (), FAR) is None


@pytest.mark.parametrize(("source", "bend"), [(0.0, 60.0), (0.0, -40.0), (-60.0, 150.0)])
def test_an_illegal_user_drawn_route_is_replaced(source: float, bend: float) -> None:
    """A route under a block, one that leaves its port backwards, and one that overlaps a shorter net."""
    block = Obstacle(45.0, 20.0, 40.0, 60.0, (45.0, 82.0, 40.0, 16.0))
    start, end = WireEnd(0, source, 1, 0), WireEnd(200, 160 if source else 100, 1, 0)
    shorter = Net(WireEnd(120, 20, 1, 0), (WireEnd(200, 60, 1, 0),), ((150.0,),))
    unchanged, routed_net = route([block], [shorter, Net(start, (end,), ((bend,),))])
    assert unchanged.paths == (drawn_path(shorter.source, (150.0,), shorter.targets[0]),)
    (path,) = routed_net.paths
    assert path != drawn_path(start, (bend,), end)
    assert path[0] == (start.x, start.y) and path[-1] == (end.x, end.y)


def test_a_user_drawn_route_that_runs_beside_itself_or_its_net_is_replaced() -> None:
    """The two lines would look like one thick line."""
    source, target, other = WireEnd(61, 159, 1, 0), WireEnd(337, 42, 1, 0), WireEnd(337, 120, 1, 0)
    (beside_itself,) = route([], [Net(source, (target,), ((245.0, 43.0, 45.0),))])
    assert beside_itself.paths != (drawn_path(source, (245.0, 43.0, 45.0), target),)
    step = (245.0, 43.0, 300.0)  # both horizontal segments lead to the right
    assert route([], [Net(source, (target,), (step,))])[0].paths == (drawn_path(source, step, target),)
    for bend, is_kept in ((245.0, True), (246.0, False), (248.0, False), (255.0, True)):
        (net,) = route([], [Net(source, (target, other), ((245.0,), (bend,)))])
        assert net.paths[0] == drawn_path(source, (245.0,), target)
        assert (net.paths[1][-2][0] == bend) is is_kept


# -- the reader ----------------------------------------------------------------------------------------------

PORTS = {
    "a/y": Port("a", 0, 0, (1, 0), True),
    "b/u": Port("b", 100, 0, (-1, 0), False),
    "c/y": Port("c", 0, 40, (1, 0), True),
    "d/u": Port("d", 100, 40, (-1, 0), False),
}
AB, CD = ((0, 0), (100, 0)), ((0, 40), (100, 40))


@pytest.mark.parametrize(
    ("lines", "dots", "message"),
    [
        ([AB, ((0, 40), (20, 40), (20, 60), (80, 60), (80, 40), (100, 40))], [], "runs under e"),
        ([AB, ((0, 40), (20, 40), (20, 1), (80, 1), (80, 40), (100, 40))], [], "lines touch"),
        ([AB, ((0, 40), (50, 40), (50, 0), (60, 0), (60, 40), (100, 40))], [], "lines touch"),
        ([AB, CD], [(50, 0)], "a dot at"),
        ([AB, ((50, 0), (50, 40), (100, 40))], [], "begins nowhere|lines touch"),
        ([AB, ((0, 40), (90, 40))], [], "ends nowhere"),
        ([AB, ((0, 40), (-20, 40), (-20, 20), (80, 20), (80, 40), (100, 40))], [], "outwards"),
        ([((0, 0), (100, 40))], [], "neither horizontal nor vertical"),
        ([AB, ((0, 40), (50, 40), (50, -3), (98.5, -3), (98.5, 40), (100, 40))], [], "touches b/u|outwards"),
    ],
)
def test_the_reader_detects_ambiguous_drawings(
    lines: list[Path], dots: list[tuple[float, float]], message: str
) -> None:
    sheet_drawing = Drawing({"e": Block(40, 50, 20, 20)}, PORTS, lines, dots, {})
    with pytest.raises(AmbiguousError, match=message):
        read(sheet_drawing)


def test_the_reader_follows_crossings_branches_and_labels() -> None:
    crossing = ((0, 40), (50, 40), (50, -20), (80, -20), (80, 40), (100, 40))
    assert read(Drawing({}, PORTS, [AB, crossing], [], {})) == {"b/u": "a/y", "d/u": "c/y"}
    branch = ((50, 0), (50, 40), (100, 40))
    assert read(Drawing({}, PORTS, [AB, branch], [(50, 0)], {})) == {"b/u": "a/y", "d/u": "a/y"}
    assert read(Drawing({}, PORTS, [AB], [], {"c/y": "c", "d/u": "c"})) == {"b/u": "a/y", "d/u": "c/y"}
