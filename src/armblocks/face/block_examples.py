"""The worked example of every block as an executable diagram.

A block describes its example in ``example``. Unspecified inputs are chosen here by the shapes of its ports:
sines for numbers and vectors, a rotating pose for poses, a joint trajectory for robots.
"""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

import numpy as np

from armblocks import formats
from armblocks.blocks import BLOCKS, Scope, XYGraph
from armblocks.diagram import (
    Block,
    BlockHandle,
    Diagram,
    DiagramBuilder,
    Fed,
    Feed,
    ParameterKind,
    Port,
    PortRef,
    Shapes,
    WorkedExample,
    made,
)
from armblocks.equations import Shape, SimulationOptions
from armblocks.errors import InertiaWarning, InputError, check_type
from armblocks.robot import Robot

ROBOT = "twolink"
"""The default robot of the examples."""
SAMPLE_TIME = 0.5
"""The default period of sampled blocks, s."""

_OPEN_SHAPES: tuple[Shape, ...] = ((), (3,), (2, 2), (3, 3), (4,), (4, 4))


def block_example(kind: str | type[Block]) -> Diagram:
    """The worked example of a block type (by class or type name), a small diagram.

    Raises UnknownNameError for an unknown name.
    """
    check_type(kind, (str, type), "a block class or its name", where="block_example")
    chosen = BLOCKS[kind] if isinstance(kind, str) else kind
    return _Assembly(chosen).diagram()


def example_block(kind: type[Block]) -> Block:
    """The block of the worked example, with its parameters."""
    return _block(kind, kind.example.parameters)


def caption(kind: type[Block]) -> str:
    """The caption of the worked example's plot."""
    if kind.example.shows:
        return kind.example.shows
    block = example_block(kind)
    if not block.input_ports():
        return f"The output of {kind.title}."
    return f"Inputs and outputs of {kind.title}." if block.output_ports() else kind.summary()


def block_name(kind: type[Block]) -> str:
    """The name of the block in its example: its title in lower case, except for abbreviations."""
    return " ".join(
        word.lower() if word.isalpha() and word[1:].islower() else word for word in kind.title.split()
    ).replace("/", "-")


class _Assembly:
    """Builds the diagram of one example: blocks first, then connections."""

    def __init__(self, kind: type[Block]) -> None:
        self._example: WorkedExample = kind.example
        self._name = block_name(kind)
        self._builder = DiagramBuilder(
            self._name,
            settings=SimulationOptions(
                stop_time=self._example.stop_time, sample_time=self._example.sample_time
            ),
            description=kind.summary(),
        )
        self._block = example_block(kind)
        self._handles: dict[str, BlockHandle] = {self._name: self._builder.add(self._name, self._block)}
        self._wires: list[tuple[Feed, PortRef]] = []
        self._feeds: dict[str, PortRef] = {}

    def diagram(self) -> Diagram:
        """The checked diagram."""
        feeds = fitting_feeds(self._block, self._example.inputs)
        for port, feed in feeds.items():
            self._feeds[port] = self._source(feed)
        for port, source in self._feeds.items():
            self._builder.connect(source, PortRef(self._name, port))
        for feed in self._example.besides:
            self._added(feed)
        self._show()
        for feed, target in self._wires:
            self._builder.connect(self._source(feed), target)
        return self._builder.build()

    def _show(self) -> None:
        """The sink: a scope of the shown signals, unless the block is a sink itself."""
        across, up = self._example.across, self._example.up
        if across is not None and up is not None:
            self._builder.add("XY graph", XYGraph(), self._source(across), self._source(up))
            return
        shown = [self._source(feed) for feed in self._example.shown]
        if not shown and not self._block.views():
            outputs = [PortRef(self._name, port.name) for port in self._block.output_ports()]
            shown = [*self._feeds.values(), *outputs]
        shown = list(dict.fromkeys(shown))
        if shown:
            self._builder.add("scope", Scope(inputs=len(shown)), *shown)

    def _source(self, feed: Feed) -> PortRef:
        """The output port of a driver; adds its block if necessary."""
        if isinstance(feed, str):
            block, slash, port = feed.rpartition("/")
            if slash:
                return PortRef(block, port)
            return self._feeds.get(feed) or PortRef(self._name, feed)
        name = self._added(feed)
        return PortRef(name, feed.port or self._handles[name].block.output_ports()[0].name)

    def _added(self, feed: Fed) -> str:
        """The block name of a driver, after adding the block and its drivers."""
        block = _block(BLOCKS[feed.type_name], feed.parameters)
        name = self._free_name(feed, block)
        if name not in self._handles:
            self._handles[name] = self._builder.add(name, block)
            for port, deeper in fitting_feeds(block, feed.inputs).items():
                self._wires.append((deeper, PortRef(name, port)))
            while self._wires:  # add its drivers now, so that names are assigned in reading order
                deeper, target = self._wires.pop(0)
                self._builder.connect(self._source(deeper), target)
        return name

    def _free_name(self, feed: Fed, block: Block) -> str:
        if feed.name:
            return feed.name
        stem = block_name(type(block))
        return next(name for name in _numbered(stem) if name not in self._handles)


def _numbered(stem: str) -> Iterator[str]:
    yield stem
    for number in itertools.count(2):
        yield f"{stem} {number}"


def _block(kind: type[Block], parameters: Mapping[str, Any]) -> Block:
    """A block with these parameters, and with the default robot and sample time if required."""
    values = dict(parameters)
    for rule in kind.parameters():
        if rule.kind is ParameterKind.ROBOT:
            values[rule.name] = shipped_robot(values.get(rule.name, ROBOT))
        elif rule.name == "sample_time" and rule.name not in values and kind.sampled and rule.default == -1:
            values[rule.name] = SAMPLE_TIME
    return kind(**values)


@cache
def shipped_robot(name: str) -> Robot:
    """A shipped robot, loaded without warnings about its inertias."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InertiaWarning)
        return formats.load_robot(name)


def fitting_feeds(block: Block, stated: Mapping[str, Feed]) -> Mapping[str, Feed]:
    """The driver of each input: the given one, else a signal with a shape that the block accepts."""
    shapes = _fitting_shapes(block)
    ports = block.input_ports()
    robot = next(
        (v for rule in block.parameters() if isinstance(v := block.parameter_value(rule.name), Robot)), None
    )
    feeds: dict[str, Feed] = {}
    for number, port in enumerate(ports):
        if port.name in stated:
            feeds[port.name] = stated[port.name]
            continue
        feed = _signal(port, shapes[port.name], number, robot)
        feeds[port.name] = feed if feed.name or len(ports) == 1 else feed.named(port.name)
    return feeds


def _fitting_shapes(block: Block) -> Shapes:
    """The first candidate shape that the block accepts for all inputs without a declared shape."""
    shapes: Shapes = {}
    for open_shape in _OPEN_SHAPES:
        shapes = {port.name: open_shape if port.shape is None else port.shape for port in block.input_ports()}
        try:
            block.output_shapes(shapes)
        except InputError:
            continue
        return shapes
    return shapes


def _signal(port: Port, shape: Shape, number: int, robot: Robot | None) -> Fed:
    """A signal that fits a port, the ``number``-th of its block."""
    if robot is not None and port.name in ("q", "qd", "qdd") and shape == (robot.n,):
        start, end = [0.0] * robot.n, [1.0 - 0.5 * j for j in range(robot.n)]
        return made("JTraj", q0=start, qf=end, tmax=8.0).named("motion").at(port.name)
    if shape == (4, 4):
        return turning_pose().named(port.name)
    if shape == (3, 3) and port.name == "R":
        return made("T2Rp").by(T=turning_pose()).at("R")
    spread = np.arange(int(np.prod(shape)), dtype=np.float64).reshape(shape)
    if len(shape) == 2 and shape[0] == shape[1]:
        # regular at all times: diagonally dominant
        return made(
            "SineWave",
            amplitude=(0.5 + 0 * spread).tolist(),
            phase=spread.tolist(),
            bias=(3 * np.eye(len(spread))).tolist(),
        )
    return made("SineWave", frequency=1.0 + 0.5 * number, phase=spread.tolist() if shape else 0.0)


def turning_pose() -> Fed:
    """A pose that rotates about z with a period of ten seconds."""
    still = made("Ground").named("zero")
    return made("Rpy2T").by(roll=still, pitch=still, yaw=made("Ramp", slope=0.6).named("yaw"))
