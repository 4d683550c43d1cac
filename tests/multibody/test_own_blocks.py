"""A joint, a solid and a force element of mechanics are each one class: no other file names them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import pytest
from casadi import SX, dot, vertcat
from drawings import started

from armblocks.blocks import MechanismConfiguration, WorldFrame
from armblocks.blocks.mechanics.joint_block import JointBlock
from armblocks.blocks.mechanics.mechanics_block import MechanicsBlock
from armblocks.blocks.mechanics.solid_block import SolidBlock
from armblocks.diagram import DiagramBuilder, FramePort, Signals
from armblocks.multibody.parts import FOLLOWER, ForcePart, FrameMotion
from armblocks.robot.joints import AxisMotion, Motion
from armblocks.robot.shapes import Cylinder
from armblocks.spatial.vectors import Vector


@dataclass(frozen=True, kw_only=True)
class SideSlider(JointBlock):
    """F slides along the x axis of B, then turns about its x axis."""

    title: ClassVar[str] = "Side Slider"
    motions: ClassVar[tuple[Motion, ...]] = (
        AxisMotion(axis=(1.0, 0.0, 0.0), linear=1.0, name="px"),
        AxisMotion(axis=(1.0, 0.0, 0.0), angular=1.0, name="rx"),
    )


@dataclass(frozen=True, kw_only=True)
class Hoop(SolidBlock):
    """A thin hoop with a radius of 0.5 m about its z axis."""

    title: ClassVar[str] = "Hoop"

    def volume(self) -> float:
        return 1e-4 * math.pi

    def unit_inertia(self) -> tuple[float, float, float]:
        return 0.125, 0.125, 0.25

    def shape(self) -> Cylinder:
        return Cylinder(radius=0.5, length=0.01)


@dataclass(frozen=True, kw_only=True)
class QuadraticDrag(MechanicsBlock):
    """A force 3 |v| v against the motion of F."""

    title: ClassVar[str] = "Quadratic Drag"

    def frame_ports(self) -> tuple[FramePort, ...]:
        return (FramePort(FOLLOWER, "dragged frame"),)

    def part(self) -> ForcePart:
        return ForcePart(frames=(FOLLOWER,))

    def loads(
        self, frames: Mapping[str, FrameMotion], u: Signals, p: Signals
    ) -> Mapping[str, tuple[Vector, Vector]]:
        v = SX(vertcat(*frames[FOLLOWER].velocity))
        force = -3.0 * dot(v, v) ** 0.5 * v
        return {FOLLOWER: ((force[0], force[1], force[2]), (0.0, 0.0, 0.0))}

    def measured(self, frames: Mapping[str, FrameMotion], u: Signals, p: Signals) -> Mapping[str, SX]:
        return {}


def test_own_blocks_of_mechanics_move_together() -> None:
    builder = DiagramBuilder("own")
    world = builder.add("world", WorldFrame())
    builder.add("gravity", MechanismConfiguration(gravity=(2.0, 0.0, -9.0)), C=world)
    slider = builder.add(
        "slider",
        SideSlider(velocity_target=(2.0, 1.0), spring_stiffness=(0.0, 4.0), equilibrium_position=(0.0, 0.1)),
        B=world,
    )
    builder.add("hoop", Hoop(mass_from="mass", mass=2.0), R=slider["F"])
    builder.add("drag", QuadraticDrag(), F=slider["F"])
    _, rates = started(builder.build())
    assert rates["slider/qd"] == pytest.approx([2.0 - 3.0 * 4.0 / 2.0, 4.0 * 0.1 / (2.0 * 0.125)])
