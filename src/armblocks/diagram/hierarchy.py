"""Flattening of diagrams with subsystems, tags and buses: blocks named by paths, direct connections only.

Flattening changes no signal. A block ``pid`` inside the subsystem ``controller`` becomes the block
``controller/pid``; each input is traced back through virtual blocks to the output of a real block. A diagram
without virtual blocks is its own flat form.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from armblocks.diagram.block import Block
from armblocks.diagram.bus import Bus, Carried
from armblocks.diagram.bus_spreading import SpreadBlock, spread_blocks
from armblocks.diagram.conditional import (
    ActionSubsystem,
    EnabledSubsystem,
    EnabledTriggeredSubsystem,
    Merge,
    ResettableSubsystem,
    TriggeredSubsystem,
)
from armblocks.diagram.conditional_equations import ELAPSED, FIRE, ON, RESTART
from armblocks.diagram.controls import EnableControl, HeldOutput, MergedOutput, TriggerControl
from armblocks.diagram.diagram import Connection, Diagram, Gate
from armblocks.diagram.port import PortRef, View, ViewKind
from armblocks.diagram.structure import DiagramBlock, Inport, Outport, Subsystem, stated_shape
from armblocks.diagram.virtual_wiring import (
    BusAssignment,
    BusCreator,
    BusSelector,
    From,
    Goto,
    listed,
    port_names,
)
from armblocks.equations import Shape
from armblocks.errors import DiagramError, UnknownNameError

CONDITIONAL = (
    EnabledSubsystem,
    TriggeredSubsystem,
    EnabledTriggeredSubsystem,
    ResettableSubsystem,
    ActionSubsystem,
)
DEEPEST = 100
"""Maximum nesting depth of subsystems."""
MOST_LISTED = 20
"""Maximum number of inputs that one message lists."""


@dataclass(frozen=True, kw_only=True)
class FlatForm:
    """A flat diagram, and its relation to the hierarchy. Names are paths from the top level.

    ``levels``: the diagram of every subsystem by its path, with ``""`` for the top. ``carried``: the signal
    or bus at output ports of the hierarchy, where it is not their own signal. ``aliases``: other names of
    signals, such as a subsystem's ports. ``views``: the views, by block. ``stated``: ports with a declared
    shape. All except ``levels`` are empty for a diagram that is already flat.
    """

    diagram: Diagram
    levels: Mapping[str, Diagram]
    carried: Mapping[PortRef, Carried] = field(default_factory=dict[PortRef, Carried])
    views: tuple[tuple[str, View], ...] = ()
    aliases: Mapping[str, PortRef] = field(default_factory=dict[str, PortRef])
    stated: Mapping[PortRef, tuple[PortRef, Shape]] = field(
        default_factory=dict[PortRef, tuple[PortRef, Shape]]
    )


def flatten_hierarchy(diagram: Diagram) -> FlatForm:
    """The flat form of a diagram, cached for each diagram object.

    Raises ``DiagramError`` for unconnected inputs, unmatched tags and bus elements, connections in a cycle
    without a block, and too deeply nested subsystems; ``where`` names the path.
    """
    return diagram.keep("flat form", lambda: _flat_form(diagram))


def flat_diagram(diagram: Diagram) -> Diagram:
    """The flat diagram alone; a diagram without virtual blocks itself."""
    return flatten_hierarchy(diagram).diagram


def diagram_views(diagram: Diagram) -> tuple[tuple[str, View], ...]:
    """All views of a diagram and its subsystems, with the path of the block that defines each.

    Logged outputs come last: each is a view with traces, named after the output.
    """
    form = flatten_hierarchy(diagram)
    views = form.views
    if form.diagram is diagram:
        views = tuple((name, view) for name, block in diagram.blocks.items() for view in block.views())
    return (*views, *_logged_views(diagram))


def _logged_views(diagram: Diagram, path: str = "") -> Iterator[tuple[str, View]]:
    for ref in diagram.logged:
        place = joined(path, ref.block)
        yield place, View(kind=ViewKind.TRACES, signals=(ref.port,), title=f"{place}/{ref.port}")
    for name, block in diagram.blocks.items():
        if isinstance(block, Subsystem):
            yield from _logged_views(block.diagram, joined(path, name))


def _flat_form(diagram: Diagram) -> FlatForm:
    if not any(block.virtual for block in diagram.blocks.values()):
        check_connected({"": diagram})
        return FlatForm(diagram=diagram, levels={"": diagram})
    levels = levels_of(diagram)
    check_connected(levels)
    return _Flattening(diagram, levels).form()


def joined(level: str, name: str) -> str:
    """The path of a block of a level."""
    return f"{level}/{name}" if level else name


def levels_of(diagram: Diagram) -> dict[str, Diagram]:
    """All diagrams of a hierarchy by path, outer ones first.

    Raises ``DiagramError`` for too deeply nested subsystems.
    """
    levels: dict[str, Diagram] = {}
    pending = [("", diagram, 0)]
    while pending:
        path, level, depth = pending.pop()
        if depth > DEEPEST:
            raise DiagramError(
                f"subsystems are nested more than {DEEPEST} levels deep",
                where=f"block '{'/'.join(path.split('/')[:3])}/…'",
                allowed=f"at most {DEEPEST}",
                fix="reduce the nesting",
            )
        levels[path] = level
        for name, block in level.blocks.items():
            if isinstance(block, DiagramBlock):
                pending.append((joined(path, name), block.diagram, depth + 1))
    return levels


def check_connected(levels: Mapping[str, Diagram]) -> None:
    """Raise ``DiagramError`` that lists the inputs that nothing drives, of all diagrams of a hierarchy."""
    open_inputs = [
        f"{joined(level, name)}/{port.name}"
        for level, diagram in levels.items()
        for name, block in diagram.blocks.items()
        for port in block.input_ports()
        if PortRef(name, port.name) not in diagram.drivers
    ]
    if open_inputs:
        shown = ", ".join(open_inputs[:MOST_LISTED])
        rest = len(open_inputs) - MOST_LISTED
        raise DiagramError(
            f"{len(open_inputs)} unconnected input{'s' * (len(open_inputs) > 1)}: {shown}"
            + (f" and {rest} more" if rest > 0 else ""),
            where=f"diagram '{next(iter(levels.values())).name}'",
            allowed="each input has a driver",
            fix="connect an output or a Constant to each",
        )


def _plain(block: Block) -> Block:
    return dataclasses.replace(block, formulas=()) if block.formulas else block


class _Flattening:
    """Traces the connections of one hierarchy back to real blocks; used during flattening only."""

    def __init__(self, top: Diagram, levels: Mapping[str, Diagram]) -> None:
        self.top = top
        self.levels = levels
        self.where = f"diagram '{top.name}'"
        self.blocks: dict[str, Block] = {}
        self.level_of: dict[str, str] = {}
        self.drivers: dict[PortRef, PortRef] = {}
        self.carried: dict[PortRef, Carried] = {}
        for level, diagram in levels.items():
            for name, block in diagram.blocks.items():
                path = joined(level, name)
                self.blocks[path] = block
                self.level_of[path] = level
            for wire in diagram.connections:
                source = PortRef(joined(level, wire.source.block), wire.source.port)
                self.drivers[PortRef(joined(level, wire.target.block), wire.target.port)] = source
        self.tags = _Tags(self.blocks, self.level_of, self.where)
        self.gates: dict[str, Gate] = {"": {}}
        self.controls: set[str] = set()
        for level in levels:
            if level:
                self._control(level)
        for path, block in list(self.blocks.items()):
            if isinstance(block, Merge):
                outer = self.gates[self.level_of[path]]
                self.blocks[path] = MergedOutput(
                    anew=RESTART in outer, inputs=block.inputs, initial=block.initial
                )
                self._take_reset(path, outer)
                self.controls.add(path)
        self.spread: dict[str, SpreadBlock] = {}
        self.elements: dict[PortRef, tuple[SpreadBlock, str]] = {}
        if any(isinstance(block, BusCreator) for block in self.blocks.values()):
            spread_blocks(self.blocks, self.at, self._spread_over)

    def form(self) -> FlatForm:
        """The flat diagram and its relation to the hierarchy."""
        for path, block in self.blocks.items():
            for port in block.output_ports():
                self.carry(PortRef(path, port.name))
        for path, block in self.blocks.items():
            if isinstance(block, MergedOutput):
                self._merge(path, block)
        sinks = self._sinks_of_buses()
        real = {
            path: block
            for path, block in self.blocks.items()
            if path not in sinks and not self.vanishes(path)
        }
        connections = [
            Connection(self._one_signal(PortRef(path, port.name)), PortRef(path, port.name))
            for path, block in real.items()
            for port in block.input_ports()
        ]
        flat = dataclasses.replace(
            self.top,
            # Values without the masks from which they were computed.
            blocks={path: _plain(block) for path, block in real.items()},
            connections=tuple(connections),
            layout={},
            bends={},
            notes={},
            extras={},
            gates=self._gates(real),
            mask=(),
            mask_values={},
            shares={
                found.copy(element): path for path, found in self.spread.items() for element in found.elements
            },
        )
        return FlatForm(
            diagram=flat,
            levels=self.levels,
            carried=self.carried,
            views=self._views(sinks),
            aliases=self._aliases(),
            stated=self._stated(),
        )

    def vanishes(self, path: str) -> bool:
        """Whether a block is replaced by connections: virtual blocks, and the ends of subsystems."""
        block = self.blocks[path]
        return block.virtual or (bool(self.level_of[path]) and isinstance(block, Inport | Outport))

    # -- conditional subsystems ----------------------------------------------------------------------------

    def _control(self, level: str) -> None:
        """The gate of the blocks of a level, and the control blocks of a conditional level."""
        outer, block = self.gates[self.level_of[level]], self.blocks[level]
        self.gates[level] = outer
        if not isinstance(block, CONDITIONAL):
            return
        if FIRE in outer:
            raise DiagramError(
                "a conditional subsystem is inside a triggered one",
                where=f"block '{level}' ({block.title})",
                allowed="conditional subsystems inside plain, enabled, action and resettable ones",
                fix="put the condition outside, as the trigger or the enable signal",
            )
        match block:
            case EnabledSubsystem() | ActionSubsystem():
                port = "enable" if isinstance(block, EnabledSubsystem) else "action"
                enabled = isinstance(block, EnabledSubsystem)
                when = block.states_when_enabling if enabled else block.states_when_resuming
                control = self._enable(level, port, outer, restarts=when == "reset")
                works = PortRef(control, "works")
                gate = {ON: PortRef(control, "on")}
                if when == "reset" or RESTART in outer:
                    gate[RESTART] = PortRef(control, "restart")
            case TriggeredSubsystem() | EnabledTriggeredSubsystem():
                around = outer
                if isinstance(block, EnabledTriggeredSubsystem):
                    enable = self._enable(level, "enable", outer, restarts=False)
                    around = {ON: PortRef(enable, "on"), RESTART: PortRef(enable, "restart")}
                control = self._trigger(level, "trigger", around, block.edge)
                works = PortRef(control, "fire")
                gate = {FIRE: works, ELAPSED: PortRef(control, "elapsed")}
                if RESTART in outer:
                    gate[RESTART] = outer[RESTART]
            case ResettableSubsystem():
                control = self._trigger(level, "reset", outer, block.edge)
                self.gates[level] = {**outer, RESTART: PortRef(control, "restart")}
                return
        self.gates[level] = gate
        self._hold(level, works, outer, fires=FIRE in gate)

    def _enable(self, level: str, port: str, outer: Gate, *, restarts: bool) -> str:
        block = EnableControl(outer=ON in outer, anew=RESTART in outer, restarts=restarts)
        return self._add_control(level, port, block, outer)

    def _trigger(self, level: str, port: str, outer: Gate, edge: str) -> str:
        block = TriggerControl(outer=ON in outer, anew=RESTART in outer, edge=edge)
        return self._add_control(level, port, block, outer)

    def _add_control(self, level: str, port: str, block: Block, outer: Gate) -> str:
        path = joined(level, port)
        self.blocks[path] = block
        self.level_of[path] = level
        self.controls.add(path)
        self.drivers[PortRef(path, "u")] = self.drivers[PortRef(level, port)]
        if ON in outer:
            self.drivers[PortRef(path, "outer")] = outer[ON]
        self._take_reset(path, outer)
        return path

    def _take_reset(self, path: str, outer: Gate) -> None:
        """A control is told of the resets of the subsystem around it."""
        if RESTART in outer:
            self.drivers[PortRef(path, "anew")] = outer[RESTART]

    def _hold(self, level: str, works: PortRef, outer: Gate, *, fires: bool) -> None:
        """Outputs that hold their values while the subsystem is inactive."""
        for name, block in self.levels[level].blocks.items():
            if isinstance(block, Outport):
                path = joined(level, name)
                self.blocks[path] = HeldOutput(
                    anew=RESTART in outer, fires=fires, when_off=block.when_off, initial=block.initial
                )
                self.drivers[PortRef(path, "works")] = works
                self._take_reset(path, outer)
                self.controls.add(path)

    def _merge(self, path: str, block: MergedOutput) -> None:
        for number in range(1, block.inputs + 1):
            carried = self.at(path, f"u{number}")
            if not isinstance(carried, PortRef) or not isinstance(self.blocks[carried.block], HeldOutput):
                source = f"'{carried}'" if isinstance(carried, PortRef) else "a bus"
                raise DiagramError(
                    f"input 'u{number}' is {source}, which is not an output of a conditional subsystem",
                    where=f"block '{path}' (Merge)",
                    allowed="outputs of enabled, triggered and action subsystems",
                    fix="use a Switch, or put the signal's block into a conditional subsystem",
                )
            self.drivers[PortRef(path, f"works{number}")] = self.drivers[PortRef(carried.block, "works")]

    def _gates(self, real: Iterable[str]) -> dict[str, Gate]:
        return {
            path: gate
            for path in real
            if path not in self.controls and (gate := self.gates[self.level_of[path]])
        }

    # -- tracing connections
    # -----------------------------------------------------------------------------------

    def carry(self, ref: PortRef) -> Carried:
        """The signal or bus at an output port; uses an explicit stack, so that paths may be long."""
        way = {ref: None}
        while way:
            last = next(reversed(way))
            if last in self.carried:
                del way[last]
                continue
            needed = self._needed(last)
            missing = next((entry for entry in needed if entry not in self.carried), None)
            if missing is None:
                self.carried[last] = self._worked_out(last, [self.carried[entry] for entry in needed])
            elif missing in way:
                loop = [str(entry) for entry in way][list(way).index(missing) :][::-1]
                raise DiagramError(
                    f"connections form a cycle without a block that computes a signal: {' -> '.join(loop)}",
                    where=self.where,
                    allowed="each connection starts at a block that computes a signal",
                    fix="remove one of these connections",
                )
            else:
                way[missing] = None
        return self.carried[ref]

    def at(self, path: str, port: str) -> Carried:
        """The signal or bus at an input port."""
        target = PortRef(path, port)
        carried = self.carry(self.drivers[target])
        if target in self.elements:
            found, element = self.elements[target]
            return found.element(port, carried, element)
        return carried

    def _spread_over(self, found: SpreadBlock) -> None:
        """Replace a block by a copy for each signal of a bus."""
        path, block = found.path, self.blocks.pop(found.path)
        self.spread[path] = found
        alone = set(block.bus_inputs())
        drivers = {ref.port: source for ref, source in self.drivers.items() if ref.block == path}
        for element in found.elements:
            copy = found.copy(element)
            self.blocks[copy], self.level_of[copy] = block, self.level_of[path]
            if path in self.controls:
                self.controls.add(copy)
            for port, source in drivers.items():
                self.drivers[PortRef(copy, port)] = source
                if port in alone:
                    self.elements[PortRef(copy, port)] = (found, element)
        # Earlier results may refer to the original block.
        self.carried = {
            PortRef(entry.path, port.name): entry.carried(port.name)
            for entry in self.spread.values()
            for port in entry.block.output_ports()
        }

    def _needed(self, ref: PortRef) -> list[PortRef]:
        """The output ports that determine the signal of an output port of a virtual block."""
        path, block = ref.block, self.blocks[ref.block]
        if not self.vanishes(path):
            return []
        match block:
            case Inport():
                level = self.level_of[path]
                return [self.drivers[PortRef(level, path.rpartition("/")[2])]]
            case Subsystem() | ResettableSubsystem():
                return [self.drivers[PortRef(joined(path, ref.port), "u")]]
            case EnabledSubsystem() | TriggeredSubsystem() | EnabledTriggeredSubsystem() | ActionSubsystem():
                return [PortRef(joined(path, ref.port), "y")]
            case From():
                return [self.drivers[PortRef(self.tags.goto(path, block), "u")]]
            case _:
                return [self.drivers[PortRef(path, port.name)] for port in block.input_ports()]

    def _worked_out(self, ref: PortRef, given: list[Carried]) -> Carried:
        block = self.blocks[ref.block]
        if not self.vanishes(ref.block):
            return ref
        match block:
            case BusCreator():
                return Bus(dict(zip(listed(block.names), given)))
            case BusSelector():
                paths = listed(block.elements)
                wanted = paths[port_names(paths).index(ref.port)]
                return self._element(ref.block, self._bus(ref.block, given[0]), wanted)
            case BusAssignment():
                bus = self._bus(ref.block, given[0])
                for path, carried in zip(listed(block.elements), given[1:]):
                    self._element(ref.block, bus, path)
                    bus = bus.replaced(path, carried)
                return bus
            case _:
                return given[0]

    def _bus(self, path: str, carried: Carried) -> Bus:
        if isinstance(carried, Bus):
            return carried
        raise DiagramError(
            f"the input 'bus' is the single signal '{carried}'",
            where=f"block '{path}' ({self.blocks[path].title})",
            allowed="a bus",
            fix="connect a Bus Creator",
        )

    def _element(self, path: str, bus: Bus, element: str) -> Carried:
        found = bus.element(element)
        if found is None:
            where = f"block '{path}' ({self.blocks[path].title})"
            raise UnknownNameError("bus element", element, bus.paths(), where=where)
        return found

    def _one_signal(self, target: PortRef) -> PortRef:
        carried = self.at(target.block, target.port)
        if isinstance(carried, PortRef):
            return carried
        raise DiagramError(
            f"input '{target.port}' receives a bus with the elements {', '.join(carried.elements)}",
            where=f"block '{target.block}' ({self.blocks[target.block].title})",
            allowed="a single signal",
            fix="put a Bus Selector in between",
        )

    # -- views and aliases --------------------------------------------------------------------------

    def _sinks_of_buses(self) -> set[str]:
        """Display blocks with a bus input: they show all its signals."""
        return {
            path
            for path, block in self.blocks.items()
            if block.views()
            and not (block.virtual or block.output_ports() or block.record_ports())
            and any(isinstance(self.at(path, port.name), Bus) for port in block.input_ports())
        }

    def _views(self, sinks: Iterable[str]) -> tuple[tuple[str, View], ...]:
        chosen = set(sinks)
        return tuple(
            (path, self._spread(path, view) if path in chosen else view)
            for path, block in sorted(self.blocks.items())
            for view in block.views()
        )

    def _spread(self, path: str, view: View) -> View:
        """A view with a bus replaced by its signals."""
        signals: list[str] = []
        labels: list[str] = []
        given = view.labels or ("",) * len(view.signals)
        for signal, label in zip(view.signals, given):
            carried = self.at(path, signal)
            if isinstance(carried, Bus):
                signals += [f"{signal}.{element}" for element, _ in carried.leaves()]
                labels += [f"{label}.{element}" if label else element for element, _ in carried.leaves()]
            else:
                signals.append(signal)
                labels.append(label)
        return dataclasses.replace(view, signals=tuple(signals), labels=tuple(labels))

    def _aliases(self) -> dict[str, PortRef]:
        aliases: dict[str, PortRef] = {}

        def add(name: str, carried: Carried) -> None:
            if isinstance(carried, PortRef):
                aliases[name] = carried
            else:
                aliases.update({f"{name}.{path}": source for path, source in carried.leaves()})

        spread = {path: found.block for path, found in self.spread.items()}
        for path, block in (*self.blocks.items(), *spread.items()):
            for port in block.input_ports():
                if PortRef(path, port.name) in self.drivers:  # some ports exist on copies only
                    add(f"{path}/{port.name}", self.at(path, port.name))
            outputs = block.output_ports()
            if path not in spread and not self.vanishes(path):
                continue
            for port in outputs:
                add(f"{path}/{port.name}", self.carried[PortRef(path, port.name)])
            if len(outputs) == 1:
                add(path, self.carried[PortRef(path, outputs[0].name)])
        for path, block in self.blocks.items():
            if isinstance(block, Outport):
                add(path, self.at(path, "u"))
        return aliases

    def _stated(self) -> dict[PortRef, tuple[PortRef, Shape]]:
        stated: dict[PortRef, tuple[PortRef, Shape]] = {}
        for path, block in self.blocks.items():
            if not isinstance(block, Inport | Outport) or not self.vanishes(path):
                continue
            shape = stated_shape(block)
            if shape is not None:
                inside = isinstance(block, Inport)
                target = (
                    PortRef(self.level_of[path], path.rpartition("/")[2]) if inside else PortRef(path, "u")
                )
                stated[target] = (self._one_signal(target), shape)
        return stated


class _Tags:
    """Finds the Goto of a From."""

    def __init__(self, blocks: Mapping[str, Block], level_of: Mapping[str, str], where: str) -> None:
        self._known: dict[tuple[str, str, str], str] = {}
        self._level_of = level_of
        for path, block in blocks.items():
            if not isinstance(block, Goto):
                continue
            level = "" if block.visibility == "global" else level_of[path]
            # Local and scoped tags of one diagram look the same to a reader.
            places = [(level, block.tag, block.visibility)]
            if block.visibility != "global":
                places.append((level, block.tag, "scoped" if block.visibility == "local" else "local"))
            for place in places:
                other = self._known.get(place)
                if other is not None:
                    raise DiagramError(
                        f"the Goto blocks '{other}' and '{path}' both send '{block.tag}'",
                        where=where,
                        allowed="one Goto for each tag in its scope",
                        fix="rename the tag of one of them, or make its visibility local",
                    )
            self._known[places[0]] = path

    def goto(self, path: str, block: From) -> str:
        """The path of the Goto of a From: the nearest visible one."""
        level = self._level_of[path]
        found = self._known.get((level, block.tag, "local"))
        outer = level
        while found is None:
            found = self._known.get((outer, block.tag, "scoped"))
            if not outer:
                break
            outer = outer.rpartition("/")[0]
        found = found or self._known.get(("", block.tag, "global"))
        if found is None:
            visible = sorted({tag for place, tag, sight in self._known if self._sees(level, place, sight)})
            hidden = [goto for (_, tag, _), goto in self._known.items() if tag == block.tag]
            raise DiagramError(
                f"no visible Goto sends '{block.tag}'",
                where=f"block '{path}' (From)",
                allowed="one of " + ", ".join(visible) if visible else "a tag that a Goto sends",
                fix=f"make the visibility of '{hidden[0]}' scoped or global" if hidden else "add a Goto",
            )
        return found

    def _sees(self, level: str, place: str, visibility: str) -> bool:
        if visibility == "local":
            return level == place
        return visibility == "global" or not place or level == place or level.startswith(place + "/")
