"""The diagram builder, the only mutable class of this layer: it collects blocks and connections."""

from __future__ import annotations

import dataclasses
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NoReturn

from armblocks.argument_errors import ArgumentErrors
from armblocks.diagram.block import Block
from armblocks.diagram.bookmarks import Bookmark, check_bookmark_name
from armblocks.diagram.check import check_diagram
from armblocks.diagram.comments import Comment, check_comment
from armblocks.diagram.diagram import Connection, Diagram, Note, Placement, block_in_scope
from armblocks.diagram.frames import FrameLine
from armblocks.diagram.mask import ParameterFormula, checked_mask, formula, mask_parameter, values_of
from armblocks.diagram.names import check_block_name, check_signal_names, folded
from armblocks.diagram.parameter import Parameter, Value
from armblocks.diagram.parameter_sets import check_set_name, checked_set, set_location
from armblocks.diagram.port import PortRef
from armblocks.diagram.scope_trigger import ScopeTrigger
from armblocks.diagram.structure import (
    DiagramBlock,
    Inport,
    Outport,
    Subsystem,
    block_count,
    check_block_count,
)
from armblocks.equations import SimulationOptions
from armblocks.errors import DiagramError, InputError, UnknownNameError, counted


class BlockHandle(metaclass=ArgumentErrors):
    """A block in a builder: ``handle["q"]`` is its port q, for use as a source or a target."""

    def __init__(self, name: str, block: Block) -> None:
        self.name = name
        self.block = block

    def __getitem__(self, port: str) -> PortRef:
        """The port of this name; raises ``UnknownNameError`` with the nearest name."""
        block = self.block
        ports = (*block.output_ports(), *block.input_ports(), *block.frame_ports())
        port_names = [entry.name for entry in ports]
        if port not in port_names:
            raise UnknownNameError("port", port, port_names, where=_where(self.name, self.block))
        return PortRef(self.name, port)

    def __repr__(self) -> str:
        return f"BlockHandle({self.name!r}, {type(self.block).__name__})"


Source = PortRef | BlockHandle
"""A signal source for an input: an output port, or a block with exactly one output.

Where a frame port is expected: a frame port, or a block with exactly one frame port."""


class DiagramBuilder(metaclass=ArgumentErrors):
    """Builds a diagram step by step::

        builder = DiagramBuilder("falling")
        fall = builder.add("fall", Constant(value=-9.81))
        speed = builder.add("speed", Integrator(), fall)
        height = builder.add("height", Integrator(initial=10.0), speed)
        diagram = builder.build()

    The names of blocks become the paths of signals, ``"height/y"``. A diagram inside a block is built in
    place, and its signals are ``"controller/error/y"``::

        with builder.subsystem("controller", reference, position) as inner:
            inputs = inner.input("reference"), inner.input("position")
            error = inner.add("error", Sum(signs="+-"), *inputs)
            inner.output("force", inner.add("gain", Gain(gain=5.0), error))
        builder.connect(builder["controller"], motor["force"])

    The inner diagram may declare parameters, its *mask*. In the outer diagram they have the paths
    ``"controller.kp"``. Parameters of the inner blocks can be formulas of the mask parameters::

        with builder.subsystem("controller", …) as inner:
            kp = inner.parameter("kp", 5.0, unit="N/m", doc="stiffness")
            inner.add("gain", Gain(gain=kp), …)
            inner.add("filter", FirstOrderLag(time_constant=formula("1 / (10*kp)")), …)

    Errors are ``DiagramError``, ``InputError`` or ``UnknownNameError``, raised at the line that causes them.
    """

    def __init__(
        self,
        name: str,
        *,
        settings: SimulationOptions | None = None,
        extras: Mapping[str, object] | None = None,
        description: str = "",
    ) -> None:
        self.name = name
        self.description = description
        self.settings = settings or SimulationOptions()
        self._extras = dict(extras or {})
        self._blocks: dict[str, Block] = {}
        self._count = 0  # number of blocks, including blocks in subsystems
        self._ports: dict[str, tuple[dict[str, None], dict[str, None]]] = {}  # names of inputs, of outputs
        self._used_names: dict[str, str] = {}
        self._wires: dict[PortRef, PortRef] = {}
        self._frames: dict[str, dict[str, None]] = {}  # names of frame ports
        self._lines: dict[FrameLine, None] = {}
        self._layout: dict[str, Placement] = {}
        self._bends: dict[Connection, tuple[float, ...]] = {}
        self._notes: dict[str, Note] = {}
        self._bookmarks: dict[str, Bookmark] = {}
        self._scope_trigger: ScopeTrigger | None = None
        self._logged: dict[PortRef, None] = {}
        self._commented: dict[str, Comment] = {}
        self._signal_names: dict[PortRef, str] = {}
        self._parameter_sets: dict[str, dict[str, Any]] = {}
        self._mask: list[Parameter] = []
        self._mask_values: dict[str, Value] = {}
        self._outer: dict[str, ParameterFormula] = {}

    def parameter(
        self, name: str, default: Any, *, value: Any = None, doc: str = "", unit: str = "", **rules: Any
    ) -> Any:
        """Declare a parameter of this diagram, and return the formula that is its name.

        ``rules`` are the rules for a block's parameter: ``minimum``, ``above``, ``maximum``, ``choices``, …
        ``value`` is the present value, by default ``default``. Inside a ``with builder.subsystem(…)`` it
        may be a formula of the parameters of the enclosing diagram. Raises ``InputError``.
        """
        return self.declare(mask_parameter(name, default, doc=doc, unit=unit, **rules), value)

    def declare(self, rule: Parameter, value: Any = None) -> Any:
        """Declare a parameter of this diagram by its rule object; see :meth:`parameter`."""
        checked_mask((*self._mask, rule), f"diagram '{self.name}'")
        if isinstance(value, ParameterFormula):
            self._outer[rule.name] = value
            value = None
        values = {} if value is None else {rule.name: value}
        self._mask_values |= values_of((rule,), values, f"diagram '{self.name}'")
        self._mask.append(rule)
        return formula(rule.name)

    def add(self, name: str, block: Block, *inputs: Source, **inputs_by_port: Source) -> BlockHandle:
        """Add a block under a new name and connect its inputs, in order or by port name.

        The name of a frame port draws a frame line: ``builder.add("hinge", RevoluteJoint(), B=world)``.
        In and Out blocks without a number get the next number.
        """
        where = f"diagram '{self.name}'"
        _check_block(block, where)
        if isinstance(block, Inport | Outport) and block.port == 0:
            block = dataclasses.replace(block, port=self._next_port(type(block)))
        check_block_name(name, where)
        other = self._used_names.get(folded(name))
        if other is not None:
            same = f"a block is named '{other}', which differs only in case or Unicode encoding"
            raise DiagramError(
                f"two blocks are named '{name}'" if other == name else f"'{name}': {same}",
                where=where,
                allowed="unique names",
                fix="rename one of them",
            )
        self._count += 1 + (block_count(block.diagram) if isinstance(block, DiagramBlock) else 0)
        check_block_count(self._count, where)
        block = block_in_scope(name, block, self._mask_values)
        ports = block.input_ports()
        if len(inputs) > len(ports):
            raise DiagramError(
                f"{counted(len(inputs), 'input is', 'inputs are')} given",
                where=_where(name, block),
                allowed=f"{len(ports)}: {', '.join(port.name for port in ports)}" if ports else "no inputs",
                fix="remove the last inputs",
            )
        self._used_names[folded(name)] = name
        self._blocks[name] = block
        self._ports[name] = (
            dict.fromkeys(port.name for port in ports),
            dict.fromkeys(port.name for port in block.output_ports()),
        )
        self._frames[name] = dict.fromkeys(port.name for port in block.frame_ports())
        handle = BlockHandle(name, block)
        for port, source in zip(ports, inputs):
            self.connect(source, PortRef(name, port.name))
        for port_name, source in inputs_by_port.items():
            self.connect(source, PortRef(name, port_name))
        return handle

    def __getitem__(self, name: str) -> BlockHandle:
        """The block of this name; raises ``UnknownNameError`` with the nearest name."""
        return BlockHandle(name, self._known(name))

    def input(self, name: str, **parameters: Any) -> BlockHandle:
        """Add an In block: the next input port of the enclosing subsystem."""
        return self.add(name, Inport(**parameters))

    def output(self, name: str, source: Source, **parameters: Any) -> BlockHandle:
        """Add an Out block: the next output port of the enclosing subsystem."""
        return self.add(name, Outport(**parameters), source)

    @contextmanager
    def subsystem(self, name: str, *inputs: Source, **inputs_by_port: Source) -> Generator[DiagramBuilder]:
        """Build a diagram inside a block of this diagram; the block is added when the ``with`` ends."""
        inner = DiagramBuilder(name)
        yield inner
        block = Subsystem(diagram=inner.build()).with_parameters(**inner._outer)
        self.add(name, block, *inputs, **inputs_by_port)

    def connect(self, source: Source, target: Source) -> None:
        """Connect an output port to an input port; a block means its only output or only input.

        Between two frame ports, this draws a frame line, which has no direction: both are then the same
        frame. A block with frame ports then means its only frame port.
        """
        if self._frame(source) is not None or self._frame(target) is not None:
            self.draw_line(source, target)
            return
        driver = self._resolve(source, output=True)
        driven = self._resolve(target, output=False)
        other = self._wires.get(driven)
        if other is not None:
            raise DiagramError(
                f"input '{driven}' has two drivers, '{other}' and '{driver}'",
                where=f"diagram '{self.name}'",
                allowed="one driver for each input",
                fix="remove one of the connections, or join the signals with a Sum or a Mux",
            )
        self._wires[driven] = driver

    def draw_line(self, first: Source, second: Source) -> None:
        """Draw a frame line between two frame ports, which are then the same frame.

        A block means its only frame port. Raises ``DiagramError`` if an end is not a frame port.
        """
        self._lines[FrameLine(self._frame_end(first, second), self._frame_end(second, first))] = None

    def _frame_end(self, end: Source, other: Source) -> PortRef:
        """The frame port at one end of a line to ``other``. Raises ``DiagramError`` for a signal port."""
        frame = self._frame(end) or self._only_frame(end)
        if frame is None:
            self._refuse_line(end, other)
        return frame

    def _refuse_line(self, end: Source, other: Source) -> NoReturn:
        """Raise ``DiagramError`` for an end of a line that is not one frame port."""
        name = end.block if isinstance(end, PortRef) else end.name
        self._known(name)
        frames = ", ".join(f"'{name}/{port}'" for port in self._frames[name])
        raise DiagramError(
            f"'{_end_text(other)}' is connected to '{_end_text(end)}', which is not a frame port"
            if isinstance(end, PortRef) or not frames
            else f"'{_end_text(other)}' is connected to '{name}', which has several frame ports",
            where=_where(name, self._blocks[name]),
            allowed=f"frame lines between frame ports: {frames}"
            if frames
            else "frame lines between frame ports; the block has none",
            fix="name a frame port at both ends of the line, or signal ports at both ends of a connection",
        )

    def place(
        self,
        block: BlockHandle | str,
        x: float,
        y: float,
        *,
        width: float | None = None,
        height: float | None = None,
        flipped: bool = False,
        rotation: int = 0,
        name_side: str = "auto",
        colour: str = "none",
    ) -> None:
        """Set the position and appearance of a block, see :class:`~armblocks.diagram.Placement`."""
        name = block if isinstance(block, str) else block.name
        self._known(name)
        self._layout[name] = Placement(
            x=x,
            y=y,
            width=width,
            height=height,
            flipped=flipped,
            rotation=rotation,
            name_side=name_side,
            colour=colour,
        )

    def bend(self, wire: Connection, bends: Sequence[float]) -> None:
        """Set the route of a connection: alternating x and y of its segments (pixels), from its source on.

        The route is ignored if the connection does not exist.
        """
        self._bends[wire] = tuple(bends)

    def note(self, name: str, note: Note) -> None:
        """Add an annotation to the sheet under a unique ``name``."""
        self._notes[name] = note

    def bookmark(self, name: str, part: Bookmark) -> None:
        """Store a part of the sheet under a name, to which the studio can return.

        Raises ``DiagramError`` for an invalid name.
        """
        check_bookmark_name(name, self._bookmarks, f"diagram '{self.name}'")
        self._bookmarks[name] = part

    def trigger_scopes(self, trigger: ScopeTrigger) -> None:
        """Set the trigger of the scopes: the studio shows the times about a crossing of a level."""
        self._scope_trigger = trigger

    def log(self, source: Source) -> None:
        """Log an output without a Scope: reports and the studio show its traces.

        Raises ``UnknownNameError`` and ``DiagramError``.
        """
        ref = self._resolve(source, output=True)
        self._logged[ref] = None

    def name_signal(self, source: Source, name: str) -> None:
        """Name the signal at an output: ``result["name"]``, data files, legends and drawings show the name.

        Raises ``UnknownNameError``, and ``DiagramError`` for a name that another signal or a block has.
        """
        ref = self._resolve(source, output=True)
        check_signal_names(self._blocks, {**self._signal_names, ref: name}, f"diagram '{self.name}'")
        self._signal_names[ref] = name

    def parameter_set(self, name: str, values: Mapping[str, Any]) -> None:
        """Store values of parameters under a name: ``builder.parameter_set("stiff", {"pid.kp": 40.0})``.

        The paths have the form of ``simulate(parameters=…)``. The values of the diagram do not change;
        ``ab.with_parameter_set(diagram, "stiff")`` returns the diagram with the values of the set. ``build``
        checks the values. Raises ``DiagramError`` for an invalid name.
        """
        check_set_name(name, self._parameter_sets, f"diagram '{self.name}'")
        self._parameter_sets[name] = dict(values)

    def comment_out(self, block: BlockHandle | str) -> None:
        """Comment a block out: it is excluded from the model, and its outputs are zeros of the same shapes.

        Raises ``UnknownNameError``, and ``DiagramError`` for In and Out blocks.
        """
        self.comment(self._commentable(block, "out"), "out")

    def comment_through(self, block: BlockHandle | str) -> None:
        """Comment a block through: each output equals the input of the same index.

        ``build`` checks that their shapes agree. Raises ``UnknownNameError``, and ``DiagramError`` for blocks
        with fewer inputs than outputs, blocks without outputs, and In and Out blocks.
        """
        self.comment(self._commentable(block, "through"), "through")

    def comment(self, name: str, comment: Comment) -> None:
        """Comment a block out or through without a check, for file readers; ``build`` checks the comments."""
        self._known(name)
        self._commented[name] = comment

    def _commentable(self, block: BlockHandle | str, comment: Comment) -> str:
        name = block if isinstance(block, str) else block.name
        check_comment(name, self._known(name), comment)
        return name

    def build(self) -> Diagram:
        """The frozen diagram, after all checks of :func:`armblocks.diagram.check.check_diagram`."""
        diagram = self.draft()
        if diagram.parameter_sets:
            sets = {
                name: checked_set(diagram, values, set_location(diagram, name))
                for name, values in diagram.parameter_sets.items()
            }
            diagram = dataclasses.replace(diagram, parameter_sets=sets)
        check_diagram(diagram)
        return diagram

    def draft(self) -> Diagram:
        """The frozen diagram without checks: an unfinished drawing."""
        return Diagram(
            name=self.name,
            blocks=self._blocks,
            connections=tuple(Connection(source, target) for target, source in self._wires.items()),
            layout=self._layout,
            bends=self._bends,
            notes=self._notes,
            bookmarks=self._bookmarks,
            scope_trigger=self._scope_trigger,
            settings=self.settings,
            extras=self._extras,
            description=self.description,
            logged=tuple(self._logged),
            commented=self._commented,
            signal_names=self._signal_names,
            mask=tuple(self._mask),
            mask_values=self._mask_values,
            parameter_sets=self._parameter_sets,
            frame_lines=tuple(self._lines),
        )

    def _frame(self, end: object) -> PortRef | None:
        """The frame port that an end means; ``None`` for a signal port."""
        if isinstance(end, PortRef) and end.block in self._blocks:
            signals = self._ports[end.block]
            known = end.port in self._frames[end.block]
            return end if known and not any(end.port in names for names in signals) else None
        if isinstance(end, BlockHandle) and not any(self._ports.get(end.name, ())):
            return self._only_frame(end)
        return None

    def _only_frame(self, end: object) -> PortRef | None:
        """The frame port of a block with exactly one."""
        frames = self._frames.get(end.name, {}) if isinstance(end, BlockHandle) else {}
        return (
            PortRef(end.name, next(iter(frames)))
            if isinstance(end, BlockHandle) and len(frames) == 1
            else None
        )

    def _next_port(self, kind: type[Inport | Outport]) -> int:
        numbers = [block.port for block in self._blocks.values() if isinstance(block, kind)]
        return max(numbers, default=0) + 1

    def _known(self, name: str) -> Block:
        if name not in self._blocks:
            raise UnknownNameError("block", name, self._blocks, where=f"diagram '{self.name}'")
        return self._blocks[name]

    def _resolve(self, end: object, *, output: bool) -> PortRef:
        """The port, checked to be an input or output of its block as required."""
        side = "output" if output else "input"
        if not isinstance(end, PortRef | BlockHandle):
            raise InputError(
                f"an {side} is a {type(end).__name__}",
                where=f"diagram '{self.name}'",
                allowed="a return value of builder.add, or a port of it",
                fix='give handle or handle["port"]; for a number, add a Constant block',
            )
        name = end.block if isinstance(end, PortRef) else end.name
        block = self._known(name)
        ports = self._ports[name][output]
        if isinstance(end, PortRef):
            if end.port not in ports:
                raise UnknownNameError(f"{side} port", end.port, ports, where=_where(name, block))
            return end
        if len(ports) != 1:
            raise DiagramError(
                f"the block has {len(ports)} {side}s, so its name alone is ambiguous",
                where=_where(name, block),
                allowed=", ".join(f'"{port}"' for port in ports) or "a block with one",
                fix='name the port: handle["port"]',
            )
        return PortRef(name, next(iter(ports)))


def _end_text(end: Source) -> str:
    return str(end) if isinstance(end, PortRef) else end.name


def _check_block(block: object, where: str) -> None:
    if not isinstance(block, Block):
        raise InputError(
            f"a value of type {type(block).__name__} is added instead of a block",
            where=where,
            allowed="blocks, such as Gain(gain=2.0)",
            fix="create a block first, with its parameters",
        )


def _where(name: str, block: Block) -> str:
    return f"block '{name}' ({block.title})"
