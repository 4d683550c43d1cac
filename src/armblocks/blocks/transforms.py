"""Blocks that take poses apart and put them together. A pose is one 4x4 matrix on one wire."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, horzcat, vertcat

from armblocks.diagram import Block, Port, Signals


@dataclass(frozen=True, kw_only=True)
class T2xyz(Block):
    """The position of a pose: x, y, z = T[0, 3], T[1, 3], T[2, 3]."""

    family: ClassVar[str] = "transforms"
    title: ClassVar[str] = "T2xyz"

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("T", "the pose", shape=(4, 4)),)

    def output_ports(self) -> tuple[Port, ...]:
        return tuple(Port(axis, f"position along {axis}", "m", shape=()) for axis in "xyz")

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {axis: u["T"][row, 3] for row, axis in enumerate("xyz")}


@dataclass(frozen=True, kw_only=True)
class Xyz2T(Block):
    """The pose at a position, not turned: T = [I, (x, y, z); 0 0 0 1]."""

    family: ClassVar[str] = "transforms"
    title: ClassVar[str] = "xyz2T"

    def input_ports(self) -> tuple[Port, ...]:
        return tuple(Port(axis, f"position along {axis}", "m", shape=()) for axis in "xyz")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("T", "the pose", shape=(4, 4)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"T": horzcat(SX.eye(4)[:, :3], vertcat(u["x"], u["y"], u["z"], 1.0))}
