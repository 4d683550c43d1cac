"""Blocks that split and compose poses. A pose is one signal of shape (4, 4)."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import ClassVar

from casadi import SX, horzcat, vertcat

from armblocks.blocks.example_signals import HELIX_POSE, last_column_of
from armblocks.diagram import Block, Port, Signals, WorkedExample, driver
from armblocks.diagram.signs import FaceSign, Words


@dataclass(frozen=True, kw_only=True)
class T2xyz(Block):
    """The position of a pose: x, y, z = T[0, 3], T[1, 3], T[2, 3]."""

    title: ClassVar[str] = "T2xyz"
    sign: ClassVar[FaceSign] = Words("T→xyz")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The position of a pose that moves along a helix.",
        inputs={"T": HELIX_POSE},
        shown=("x", "y", "z"),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("T", "the pose", shape=(4, 4)),)

    def output_ports(self) -> tuple[Port, ...]:
        return tuple(Port(axis, f"position along {axis}", "m", shape=()) for axis in "xyz")

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {axis: u["T"][row, 3] for row, axis in enumerate("xyz")}


@dataclass(frozen=True, kw_only=True)
class Xyz2T(Block):
    """A pose with a given position and no rotation: T = [I, (x, y, z); 0 0 0 1]."""

    title: ClassVar[str] = "xyz2T"
    sign: ClassVar[FaceSign] = Words("xyz→T")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The last column of the pose is the position.",
        inputs={
            "x": driver("SineWave", phase=pi / 2),
            "y": driver("SineWave"),
            "z": driver("Ramp", slope=0.1),
        },
        shown=(last_column_of("T"),),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return tuple(Port(axis, f"position along {axis}", "m", shape=()) for axis in "xyz")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("T", "the pose", shape=(4, 4)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"T": horzcat(SX.eye(4)[:, :3], vertcat(u["x"], u["y"], u["z"], 1.0))}
