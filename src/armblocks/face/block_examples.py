"""The worked example of every block as an executable diagram.

A block describes its example in ``example``. Unspecified inputs are chosen here by the shapes of its ports:
sines for numbers and vectors, a rotating pose for poses, a joint trajectory for robots.
"""

from __future__ import annotations

import itertools
import re
import warnings
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

import numpy as np

from armblocks import formats
from armblocks.blocks import BLOCKS, Integrator, Scope, XYGraph
from armblocks.diagram import (
    Block,
    BlockHandle,
    Diagram,
    DiagramBuilder,
    Driver,
    ExampleBlock,
    ParameterKind,
    Port,
    PortRef,
    ResettableSubsystem,
    Shapes,
    WorkedExample,
    driver,
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
    """The worked example of a block type, a small diagram.

    ``kind``: the class of the block or its name.

    Raises UnknownNameError for an unknown name.
    """
    check_type(kind, (str, type), "a block class or its name", where="block_example")
    block_type = BLOCKS[kind] if isinstance(kind, str) else kind
    return _ExampleBuilder(block_type).diagram()


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
    words = re.compile(r"(?<![A-Za-z0-9])[A-Z][a-z]+(?![A-Za-z0-9])")
    return words.sub(lambda word: word[0].lower(), kind.title).replace("/", "-")


class _ExampleBuilder:
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
        self._wires: list[tuple[Driver, PortRef]] = []
        self._drivers: dict[str, PortRef] = {}

    def diagram(self) -> Diagram:
        """The checked diagram."""
        drivers = fitting_drivers(self._block, self._example.inputs)
        for port, signal in drivers.items():
            self._drivers[port] = self._source(signal)
        for port, source in self._drivers.items():
            self._builder.connect(source, PortRef(self._name, port))
        for signal in self._example.extra_blocks:
            self._block_of(signal)
        for ends in self._example.lines:
            self._builder.draw_line(*(self._frame(end) for end in ends))
        self._show()
        for signal, target in self._wires:
            self._builder.connect(self._source(signal), target)
        return self._builder.build()

    def _frame(self, end: str) -> PortRef:
        block, _, port = end.rpartition("/")
        return PortRef(block or self._name, port)

    def _show(self) -> None:
        """The sink: a scope of the shown signals, unless the block is a sink itself."""
        x_axis, y_axis = self._example.x_axis, self._example.y_axis
        if x_axis is not None and y_axis is not None:
            self._builder.add("XY graph", XYGraph(), self._source(x_axis), self._source(y_axis))
            return
        sources = [self._source(signal) for signal in self._example.shown]
        if not sources and not self._block.views():
            outputs = [PortRef(self._name, port.name) for port in self._block.output_ports()]
            sources = [*self._drivers.values(), *outputs]
        sources = list(dict.fromkeys(sources))
        if sources:
            self._builder.add("scope", Scope(inputs=len(sources)), *sources)

    def _source(self, signal: Driver) -> PortRef:
        """The output port of a driver; adds its block if necessary."""
        if isinstance(signal, str):
            block, slash, port = signal.rpartition("/")
            if slash:
                return PortRef(block, port)
            return self._drivers.get(signal) or PortRef(self._name, signal)
        name = self._block_of(signal)
        return PortRef(name, signal.port or self._handles[name].block.output_ports()[0].name)

    def _block_of(self, signal: ExampleBlock) -> str:
        """The block name of a driver, after adding the block and its drivers."""
        block = _block(BLOCKS[signal.type_name], signal.parameters)
        name = self._free_name(signal, block)
        if name not in self._handles:
            self._handles[name] = self._builder.add(name, block)
            for port, further_signal in fitting_drivers(block, signal.inputs).items():
                self._wires.append((further_signal, PortRef(name, port)))
            while self._wires:  # add its drivers now, so that names are assigned in reading order
                further_signal, target = self._wires.pop(0)
                self._builder.connect(self._source(further_signal), target)
        return name

    def _free_name(self, signal: ExampleBlock, block: Block) -> str:
        if signal.name:
            return signal.name
        stem = block_name(type(block))
        return next(name for name in _numbered(stem) if name not in self._handles)


def _numbered(stem: str) -> Iterator[str]:
    yield stem
    for number in itertools.count(2):
        yield f"{stem} {number}"


def _block(kind: type[Block], parameters: Mapping[str, Any]) -> Block:
    """A block with these parameters, and with the default robot and sample time if required."""
    values = dict(parameters)
    if kind is ResettableSubsystem:
        values.setdefault("diagram", _integrating_diagram())
    for rule in kind.parameters():
        if rule.kind is ParameterKind.ROBOT:
            values[rule.name] = shipped_robot(values.get(rule.name, ROBOT))
        elif rule.name == "sample_time" and rule.name not in values and kind.sampled and rule.default == -1:
            values[rule.name] = SAMPLE_TIME
    return kind(**values)


@cache
def _integrating_diagram() -> Diagram:
    """The content of a resettable subsystem: the default content has no state that a reset could change."""
    builder = DiagramBuilder("Subsystem")
    builder.output("Out1", builder.add("integrator", Integrator(), builder.input("In1")))
    return builder.build()


@cache
def shipped_robot(name: str) -> Robot:
    """A shipped robot, loaded without warnings about its inertias."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InertiaWarning)
        return formats.load_robot(name)


def fitting_drivers(block: Block, given_drivers: Mapping[str, Driver]) -> Mapping[str, Driver]:
    """The driver of each input: as given, else a signal with a shape that the block accepts."""
    shapes = _fitting_shapes(block)
    ports = block.input_ports()
    robot = next(
        (v for rule in block.parameters() if isinstance(v := block.parameter_value(rule.name), Robot)), None
    )
    drivers: dict[str, Driver] = {}
    for number, port in enumerate(ports):
        if port.name in given_drivers:
            drivers[port.name] = given_drivers[port.name]
            continue
        signal = _signal(port, shapes[port.name], number, robot)
        drivers[port.name] = signal if signal.name or len(ports) == 1 else signal.named(port.name)
    return drivers


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


def _signal(port: Port, shape: Shape, number: int, robot: Robot | None) -> ExampleBlock:
    """A signal that fits a port, the ``number``-th of its block."""
    if robot is not None and port.name in ("q", "qd", "qdd") and shape == (robot.n,):
        start, end = [0.0] * robot.n, [1.0 - 0.5 * j for j in range(robot.n)]
        return driver("JTraj", q0=start, qf=end, tmax=8.0).named("motion").at(port.name)
    if shape == (4, 4):
        return rotating_pose().named(port.name)
    if shape == (3, 3) and port.name == "R":
        return driver("T2Rp").by(T=rotating_pose()).at("R")
    entries = np.arange(int(np.prod(shape)), dtype=np.float64).reshape(shape)
    if len(shape) == 2 and shape[0] == shape[1]:
        # regular at all times: diagonally dominant
        return driver(
            "SineWave",
            amplitude=(0.5 + 0 * entries).tolist(),
            phase=entries.tolist(),
            bias=(3 * np.eye(len(entries))).tolist(),
        )
    return driver("SineWave", frequency=1.0 + 0.5 * number, phase=entries.tolist() if shape else 0.0)


def rotating_pose() -> ExampleBlock:
    """A pose that rotates about z with a period of ten seconds."""
    zero = driver("Ground").named("zero")
    return driver("Rpy2T").by(roll=zero, pitch=zero, yaw=driver("Ramp", slope=0.6).named("yaw"))
