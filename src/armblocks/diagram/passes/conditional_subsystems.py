"""Pass: conditional subsystems become plain subsystems with gated blocks.

Input: subsystems that are enabled, triggered, resettable, or activated by an If or Switch Case block.

Result: control blocks (``diagram.controls``), named after the control ports, that compute when a subsystem is
active; gates for the blocks inside; blocks that hold the outputs, in place of the Out blocks.
"""

from __future__ import annotations

import dataclasses

from armblocks.diagram.block import Block
from armblocks.diagram.conditional import (
    ActionSubsystem,
    Conditional,
    EnabledSubsystem,
    EnabledTriggeredSubsystem,
    ResettableSubsystem,
    TriggeredSubsystem,
)
from armblocks.diagram.conditional_equations import ELAPSED, FIRE, ON, RESTART
from armblocks.diagram.controls import EnableControl, HeldOutput, TriggerControl
from armblocks.diagram.diagram import Gate
from armblocks.diagram.levels import joined, level_of
from armblocks.diagram.passes.netlist import Netlist
from armblocks.diagram.port import PortRef
from armblocks.diagram.structure import Outport
from armblocks.errors import DiagramError


def resolve_conditional_subsystems(net: Netlist) -> Netlist:
    """The netlist with control blocks, gates and held outputs.

    Raises ``DiagramError`` for a conditional subsystem inside a triggered subsystem.
    """
    if not any(isinstance(net.blocks[level], Conditional) for level in net.levels if level):
        return net
    controls = _Controls(net)
    for level in net.levels:
        if level:
            controls.resolve(level)
    return dataclasses.replace(
        net,
        blocks=controls.blocks,
        drivers=controls.drivers,
        gates={
            path: gate
            for path in net.blocks
            if path not in controls.held and (gate := controls.gate_of[level_of(path)])
        },
        origins={**net.origins, **controls.origins},
    )


class _Controls:
    """The control blocks and held outputs, and the gate of every level."""

    def __init__(self, net: Netlist) -> None:
        self.levels = net.levels
        self.blocks = dict(net.blocks)
        self.drivers = dict(net.drivers)
        self.origins: dict[str, str] = {}
        self.held: set[str] = set()
        self.gate_of: dict[str, Gate] = {"": {}}

    def resolve(self, level: str) -> None:
        """Add the gate of the blocks of a level, and the control blocks of a conditional level."""
        outer, block = self.gate_of[level_of(level)], self.blocks[level]
        if not isinstance(block, Conditional):
            self.gate_of[level] = outer
            return
        if FIRE in outer:
            raise DiagramError(
                "a conditional subsystem is inside a triggered one",
                where=f"block '{level}' ({block.title})",
                allowed="conditional subsystems inside plain, enabled, action and resettable subsystems",
                fix="put the condition outside, as the trigger or the enable signal",
            )
        match block:
            case EnabledSubsystem():
                gate = self._enabled(level, "enable", outer, restarts=block.states_when_enabling == "reset")
            case ActionSubsystem():
                gate = self._enabled(level, "action", outer, restarts=block.states_when_resuming == "reset")
            case TriggeredSubsystem():
                gate = self._triggered(level, outer, block.edge, outer)
            case EnabledTriggeredSubsystem():
                enable = self._enable(level, "enable", outer, restarts=False)
                trigger_gate = {ON: PortRef(enable, "on"), RESTART: PortRef(enable, "restart")}
                gate = self._triggered(level, outer, block.edge, trigger_gate)
            case ResettableSubsystem():
                control = self._trigger(level, "reset", outer, block.edge)
                gate = {**outer, RESTART: PortRef(control, "restart")}
        self.gate_of[level] = gate

    def _enabled(self, level: str, port: str, outer: Gate, *, restarts: bool) -> Gate:
        control = self._enable(level, port, outer, restarts=restarts)
        self._hold(level, PortRef(control, "running"), outer, pulsed=False)
        gate = {ON: PortRef(control, "on")}
        if restarts or RESTART in outer:
            gate[RESTART] = PortRef(control, "restart")
        return gate

    def _triggered(self, level: str, outer: Gate, edge: str, trigger_gate: Gate) -> Gate:
        control = self._trigger(level, "trigger", trigger_gate, edge)
        fire = PortRef(control, "fire")
        self._hold(level, fire, outer, pulsed=True)
        gate = {FIRE: fire, ELAPSED: PortRef(control, "elapsed")}
        if RESTART in outer:
            gate[RESTART] = outer[RESTART]
        return gate

    def _enable(self, level: str, port: str, outer: Gate, *, restarts: bool) -> str:
        block = EnableControl(outer=ON in outer, resettable=RESTART in outer, restarts=restarts)
        return self._add(level, port, block, outer)

    def _trigger(self, level: str, port: str, outer: Gate, edge: str) -> str:
        block = TriggerControl(outer=ON in outer, resettable=RESTART in outer, edge=edge)
        return self._add(level, port, block, outer)

    def _add(self, level: str, port: str, block: Block, outer: Gate) -> str:
        """Add the control block of a control port, and connect it."""
        path = joined(level, port)
        self.blocks[path], self.origins[path] = block, level
        self.drivers[PortRef(path, "u")] = self.drivers[PortRef(level, port)]
        if ON in outer:
            self.drivers[PortRef(path, "outer")] = outer[ON]
        self._connect_reset(path, outer)
        return path

    def _hold(self, level: str, active: PortRef, outer: Gate, *, pulsed: bool) -> None:
        """Replace the Out blocks by outputs that hold their values while the subsystem is inactive."""
        for name, block in self.levels[level].blocks.items():
            if isinstance(block, Outport):
                path = joined(level, name)
                self.blocks[path] = HeldOutput(
                    resettable=RESTART in outer, pulsed=pulsed, when_off=block.when_off, initial=block.initial
                )
                self.drivers[PortRef(path, "running")] = active
                self._connect_reset(path, outer)
                self.held.add(path)

    def _connect_reset(self, path: str, outer: Gate) -> None:
        """Connect the reset of the enclosing subsystem to a control or held output."""
        if RESTART in outer:
            self.drivers[PortRef(path, "outer_restart")] = outer[RESTART]
