"""Frames of a mechanism: the world, reference frames, rigid transforms, and the settings of a mechanism."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from armblocks.blocks.mechanics.examples import ALONG_Y, gravity_block, pendulum_example
from armblocks.blocks.mechanics.mechanics_block import MechanicsBlock
from armblocks.diagram import FramePort, WorkedExample, driver, parameter, shape_of
from armblocks.diagram.signs import FaceSign, Words
from armblocks.errors import InputError
from armblocks.multibody.parts import (
    BASE,
    FOLLOWER,
    REFERENCE,
    SETTINGS,
    WORLD,
    NodePart,
    RigidPart,
    SettingsPart,
    WorldPart,
)
from armblocks.rounded_functions import hypot
from armblocks.spatial import Transform, rotation_about, rotation_x, rotation_y, rotation_z

_ROTATIONS = {"x": rotation_x, "y": rotation_y, "z": rotation_z}


@dataclass(frozen=True, kw_only=True)
class WorldFrame(MechanicsBlock):
    """The inertial frame of a mechanism: all motion is relative to it. Its z axis usually points upwards."""

    title: ClassVar[str] = "World Frame"
    sign: ClassVar[FaceSign] = Words("World")
    example: ClassVar[WorkedExample] = pendulum_example(
        "A pendulum hangs at a hinge in the World Frame.",
        (("W", "hinge/B"), ("gravity/C", "W")),
        more=(gravity_block(),),
        world=False,
    )

    def frame_ports(self) -> tuple[FramePort, ...]:
        return (FramePort(WORLD, "the inertial frame", "right"),)

    def part(self) -> WorldPart:
        return WorldPart()


@dataclass(frozen=True, kw_only=True)
class MechanismConfiguration(MechanicsBlock):
    """The settings of the mechanism to which it is connected: gravity, and whether a run is animated.

    A mechanism without this block has no gravity.
    """

    title: ClassVar[str] = "Mechanism Configuration"
    sign: ClassVar[FaceSign] = Words("g ↓")
    example: ClassVar[WorkedExample] = pendulum_example(
        "Gravity acts on the pendulum.", (("C", "world/W"),), gravity=ALONG_Y
    )

    gravity: ArrayLike = parameter(
        (0.0, 0.0, -9.80665),
        dimensions=(1,),
        tunable=False,
        doc="acceleration of a falling body, x y z in the World Frame",
        unit="m/s2",
    )
    animation: bool = parameter(True, doc="whether a run records the poses of all bodies and shows them")

    def check(self) -> None:
        _check_size(self, "gravity", 3)

    def frame_ports(self) -> tuple[FramePort, ...]:
        return (FramePort(SETTINGS, "any frame of the mechanism"),)

    def part(self) -> SettingsPart:
        x, y, z = np.asarray(self.gravity, dtype=float).tolist()
        return SettingsPart(gravity=(x, y, z), animated=self.animation)


@dataclass(frozen=True, kw_only=True)
class ReferenceFrame(MechanicsBlock):
    """A name for a frame at which the lines of several blocks meet, without effect on the motion."""

    title: ClassVar[str] = "Reference Frame"
    sign: ClassVar[FaceSign] = Words("Frame")
    example: ClassVar[WorkedExample] = pendulum_example(
        "Lines of several blocks meet at one frame.",
        (("gravity/C", "world/W"), ("R", "rod/F"), ("R", "second/R")),
        more=(gravity_block(), driver("BrickSolid", dimensions=(0.3, 0.1, 0.1)).named("second")),
    )

    def frame_ports(self) -> tuple[FramePort, ...]:
        return (FramePort(REFERENCE, "the frame"),)

    def part(self) -> NodePart:
        return NodePart()


@dataclass(frozen=True, kw_only=True)
class RigidTransform(MechanicsBlock):
    """A rigid connection: the constant pose of F in B, a translation and then a rotation.

    ``translation`` is the origin of F in the axes of B. ``rotation`` selects how the rotation of F relative
    to B is given:

    - ``none``: F has the axes of B.
    - ``standard_axis``: a rotation by ``angle`` about the axis x, y or z named in ``axis``.
    - ``arbitrary_axis``: a rotation by ``angle`` about ``rotation_axis``, which need not have the length 1.
    - ``sequence``: three rotations by ``angles`` about the axes named in ``sequence``, in this order. Each
      axis is an axis of the frame that results from the rotations before it.
    - ``matrix``: the columns of ``matrix`` are the axes of F in the axes of B.
    """

    title: ClassVar[str] = "Rigid Transform"
    sign: ClassVar[FaceSign] = Words("T")
    example: ClassVar[WorkedExample] = pendulum_example(
        "A second brick is rotated, and beside the first one.",
        (("gravity/C", "world/W"), ("B", "rod/F"), ("F", "second/R")),
        more=(gravity_block(), driver("BrickSolid", dimensions=(0.3, 0.1, 0.1)).named("second")),
        translation=(0.2, 0.0, 0.0),
        rotation="standard_axis",
        angle=0.5,
    )

    translation: ArrayLike = parameter(
        (0.0, 0.0, 0.0), dimensions=(1,), tunable=False, doc="origin of F in B, x y z", unit="m"
    )
    rotation: str = parameter(
        "none",
        choices=("none", "standard_axis", "arbitrary_axis", "sequence", "matrix"),
        doc="method of the rotation",
    )
    axis: str = parameter("z", choices=("x", "y", "z"), doc="axis of the rotation standard_axis")
    angle: float = parameter(0.0, tunable=False, doc="angle of the rotation about an axis", unit="rad")
    rotation_axis: ArrayLike = parameter(
        (0.0, 0.0, 1.0), dimensions=(1,), tunable=False, doc="axis of the rotation arbitrary_axis, in B"
    )
    sequence: str = parameter(
        "xyz",
        choices=("xyz", "xzy", "yxz", "yzx", "zxy", "zyx", "xyx", "xzx", "yxy", "yzy", "zxz", "zyz"),
        doc="axes of the rotation sequence",
    )
    angles: ArrayLike = parameter(
        (0.0, 0.0, 0.0), dimensions=(1,), tunable=False, doc="angles of the rotation sequence", unit="rad"
    )
    matrix: ArrayLike = parameter(
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
        dimensions=(2,),
        tunable=False,
        doc="rotation matrix (3, 3): the axes of F in B",
    )

    def check(self) -> None:
        for name in ("translation", "rotation_axis", "angles"):
            _check_size(self, name, 3)
        if self.rotation == "arbitrary_axis" and not any(np.asarray(self.rotation_axis)):
            raise InputError(
                "the rotation axis is 0 0 0",
                where="RigidTransform.rotation_axis",
                allowed="a direction such as 0 0 1",
                fix="give the axis, in the axes of B",
            )
        if shape_of(self.matrix) != (3, 3):
            raise InputError(
                f"the matrix has shape {shape_of(self.matrix)}",
                where="RigidTransform.matrix",
                allowed="shape (3, 3)",
                fix="give three rows of three numbers",
            )
        _ = self.pose()

    def frame_ports(self) -> tuple[FramePort, ...]:
        return (FramePort(BASE, "base frame"), FramePort(FOLLOWER, "follower frame", "right"))

    def pose(self) -> Transform:
        """The pose of F in B."""
        return Transform(rotation=self._axes().rotation, translation=self.translation)

    def _axes(self) -> Transform:
        """The rotation of F in B."""
        match self.rotation:
            case "standard_axis":
                return Transform(rotation=_ROTATIONS[self.axis](self.angle))
            case "arbitrary_axis":
                x, y, z = np.asarray(self.rotation_axis, dtype=float).tolist()
                length = hypot(x, y, z)
                return Transform(rotation=rotation_about((x / length, y / length, z / length), self.angle))
            case "sequence":
                turned = Transform()
                for letter, angle in zip(self.sequence, np.asarray(self.angles, dtype=float).tolist()):
                    turned = turned @ Transform(rotation=_ROTATIONS[letter](angle))
                return turned
            case "matrix":
                return Transform(rotation=self.matrix)
            case _:
                return Transform()

    def part(self) -> RigidPart:
        return RigidPart(pose=self.pose())


def _check_size(block: MechanicsBlock, name: str, size: int) -> None:
    shape = shape_of(block.parameter_value(name))
    if math.prod(shape) != size:
        raise InputError(
            f"{name} has shape {shape}",
            where=f"{block.type_name()}.{name}",
            allowed=f"{size} numbers",
            fix="give x, y and z",
        )
