"""Blocks that compose, invert and split poses, and differential motions between poses."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from typing import ClassVar

import numpy as np
from casadi import SX, cross, dot, mtimes, norm_2, skew, vertcat
from numpy.typing import ArrayLike

from armblocks.blocks.example_signals import (
    HELIX_POSE,
    SPINNING_POSE,
    ZERO,
    corner_of,
    last_column_of,
    pose_along_x,
    position_of,
)
from armblocks.blocks.transforms.orientations import pose
from armblocks.diagram import Block, Port, Shapes, Signals, State, WorkedExample, driver, parameter, shape_of
from armblocks.diagram.signs import FaceSign, Words
from armblocks.errors import InputError, counted
from armblocks.spatial.orientation import from_quaternion, quaternion_product

_FRAMES = ("body", "world")


def inverse(T: SX) -> SX:
    """The inverse pose: frame a in frame b, from frame b in frame a."""
    R = T[:3, :3]
    return pose(R.T, -mtimes(R.T, T[:3, 3]))


@dataclass(frozen=True, kw_only=True)
class PoseProduct(Block):
    """The composition of poses: T = T1 T2 …, that is T_ac = T_ab T_bc."""

    title: ClassVar[str] = "Pose Product"
    sign: ClassVar[FaceSign] = Words("T₁ T₂")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A rotating frame, and a second frame 1 m along its x axis, whose origin moves on a circle.",
        inputs={"T1": SPINNING_POSE, "T2": pose_along_x(driver("Constant").named("one"))},
        x_axis=position_of("T")[0],
        y_axis=position_of("T")[1],
    )

    inputs: int = parameter(2, minimum=1, doc="number of poses")

    def input_ports(self) -> tuple[Port, ...]:
        return tuple(Port(f"T{k}", f"pose {k}", shape=(4, 4)) for k in range(1, self.inputs + 1))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("T", "their product", shape=(4, 4)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"T": reduce(mtimes, u.values())}


@dataclass(frozen=True, kw_only=True)
class PoseInverse(Block):
    """The inverse of a pose: T^-1 = [R' -R'p; 0 0 0 1]."""

    title: ClassVar[str] = "Pose Inverse"
    sign: ClassVar[FaceSign] = Words("T⁻¹")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A pose that moves along x; its inverse moves along -x.",
        inputs={
            "T": driver("Xyz2T").by(
                x=driver("Ramp").named("x"), y=driver("Constant").named("y"), z=driver("Ground").named("z")
            )
        },
        shown=position_of("Ti"),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("T", "pose of frame b in frame a", shape=(4, 4)),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("Ti", "pose of frame a in frame b", shape=(4, 4)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"Ti": inverse(u["T"])}


@dataclass(frozen=True, kw_only=True)
class Rp2T(Block):
    """A pose from a rotation and a position: T = [R p; 0 0 0 1]."""

    title: ClassVar[str] = "rt2tr"
    sign: ClassVar[FaceSign] = Words("R, p→T")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A pose from a constant rotation and an oscillating position; its upper rows are [R p].",
        inputs={
            "R": driver("Constant", value=((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))),
            "p": driver("SineWave", amplitude=(0.5, 1.0, 1.5)),
        },
        shown=(last_column_of("T"),),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("R", "the rotation", shape=(3, 3)), Port("p", "the position", "m", (3,)))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("T", "the pose", shape=(4, 4)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"T": pose(u["R"], u["p"])}


@dataclass(frozen=True, kw_only=True)
class T2Rp(Block):
    """Rotation and position of a pose: T = [R p; 0 0 0 1]."""

    title: ClassVar[str] = "tr2rt"
    sign: ClassVar[FaceSign] = Words("T→R, p")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The position of a pose as a vector; the rotation is the other output.",
        inputs={"T": HELIX_POSE},
        shown=("p",),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("T", "the pose", shape=(4, 4)),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("R", "the rotation", shape=(3, 3)), Port("p", "the position", "m", (3,)))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"R": u["T"][:3, :3], "p": u["T"][:3, 3]}


@dataclass(frozen=True, kw_only=True)
class TransformPoint(Block):
    """The coordinates of a point, transformed from frame b to frame a: p_a = R_ab p_b + p_ab."""

    title: ClassVar[str] = "Transform Point"
    sign: ClassVar[FaceSign] = Words("T p")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The point (1, 0, 0) of a frame that rotates about z, in world coordinates.",
        inputs={"T": SPINNING_POSE, "p": driver("Constant", value=(1.0, 0.0, 0.0)).named("point")},
        shown=("y",),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("T", "pose of frame b in frame a", shape=(4, 4)), Port("p", "point in b", "m", (3,)))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the point in a", "m", (3,)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": mtimes(u["T"][:3, :3], u["p"]) + u["T"][:3, 3]}


@dataclass(frozen=True, kw_only=True)
class TransformTwist(Block):
    """A twist (v; w), transformed from frame b to frame a: v_a = R v + p x R w, w_a = R w.

    This is the adjoint of the pose; the inverse pose gives the inverse transformation.
    """

    title: ClassVar[str] = "Transform Twist"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A velocity of 1 m/s along x of a frame that rotates about z, in world axes.",
        inputs={
            "T": SPINNING_POSE,
            "V": driver("Constant", value=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0)).named("twist"),
        },
        shown=("y",),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (
            Port("T", "pose of frame b in frame a", shape=(4, 4)),
            Port("V", "twist (v; w) in frame b", shape=(6,)),
        )

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "twist (v; w) in frame a", shape=(6,)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        R = u["T"][:3, :3]
        w = mtimes(R, u["V"][3:])
        return {"y": vertcat(mtimes(R, u["V"][:3]) + cross(u["T"][:3, 3], w), w)}


@dataclass(frozen=True, kw_only=True)
class Skew(Block):
    """The matrix of a vector product: S v = u x v for every v."""

    title: ClassVar[str] = "skew"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=(
            "The nine entries of the matrix: each element of the vector appears twice, with opposite signs."
        ),
        inputs={"u": driver("SineWave", amplitude=(1.0, 2.0, 3.0))},
        shown=("S",),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the vector", shape=(3,)),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("S", "its skew-symmetric matrix", shape=(3, 3)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"S": skew(u["u"])}


@dataclass(frozen=True, kw_only=True)
class Tr2Delta(Block):
    """The small motion (d; r) from pose T1 to pose T2: displacement d (m) and rotation vector r (rad).

    - ``body``, in the axes of T1, as in release 10 of the toolbox: d = p and r = vex(R - I), where R and p
      are rotation and position of T1^-1 T2. vex gives the vector of the skew-symmetric part of a matrix.
    - ``world``, in the reference frame of T1 and T2, as in the toolbox up to release 9: d = p2 - p1 and
      r = 1/2 (n1 x n2 + o1 x o2 + a1 x a2), where n, o, a are the axes of T1 and T2.

    Both formulas for r are accurate for small rotations only.
    """

    title: ClassVar[str] = "tr2delta"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The differential motion from a constant pose to one that moves along x and rotates about z "
        "by t / 10.",
        inputs={
            "T1": pose_along_x(ZERO).named("start"),
            "T2": driver("AngleAxis2T").by(
                angle=driver("Ramp", slope=0.1).named("angle"),
                axis=driver("Constant", value=(0.0, 0.0, 1.0)).named("axis"),
            ),
        },
        shown=("dx",),
    )

    frame: str = parameter("body", choices=_FRAMES, doc="body (release 10) or world (up to release 9)")

    def input_ports(self) -> tuple[Port, ...]:
        return (
            Port("T1", "first pose", shape=(4, 4)),
            Port("T2", "second pose", shape=(4, 4)),
        )

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("dx", "differential motion (dx, dy, dz, rx, ry, rz)", shape=(6,)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        T1, T2 = u["T1"], u["T2"]
        if self.frame == "body":
            step = mtimes(inverse(T1), T2)
            rotation = vertcat(step[2, 1] - step[1, 2], step[0, 2] - step[2, 0], step[1, 0] - step[0, 1])
            return {"dx": vertcat(step[:3, 3], 0.5 * rotation)}
        crosses = [cross(T1[:3, k], T2[:3, k]) for k in range(3)]
        return {"dx": vertcat(T2[:3, 3] - T1[:3, 3], 0.5 * (crosses[0] + crosses[1] + crosses[2]))}


@dataclass(frozen=True, kw_only=True)
class Delta2Tr(Block):
    """The pose of a differential motion: T = [I + skew(r), d; 0 0 0 1], as in the toolbox.

    Its rotation part is a rotation to first order only. A motion in body axes transforms T1 to T1 T. A motion
    in world axes transforms R1 to (I + skew(r)) R1 and p1 to p1 + d.
    """

    title: ClassVar[str] = "delta2tr"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A linearly growing differential motion as a pose: the upper left entries are [1 -rz; rz 1].",
        inputs={"dx": driver("Ramp", slope=(0.1, 0.0, 0.0, 0.0, 0.0, 0.02))},
        shown=(corner_of("T"),),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("dx", "differential motion (dx, dy, dz, rx, ry, rz)", shape=(6,)),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("T", "the pose of the differential motion", shape=(4, 4)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"T": pose(SX.eye(3) + skew(u["dx"][3:]), u["dx"][:3])}


@dataclass(frozen=True, kw_only=True)
class PoseIntegration(Block):
    """The pose of a frame from its twist: p' = v, Q' = 1/2 w Q (world axes), or p' = R v, Q' = 1/2 Q w.

    V is the twist (v; w) at the frame's origin, in world axes (as for ``jacob0``) or in body axes (as for
    ``jacobe``). The states are the position and a quaternion Q. The rotation matrix is computed from Q / |Q|,
    so that it is always orthonormal. |Q| returns to 1 at the rate ``restoring``, without effect on the pose.
    """

    title: ClassVar[str] = "Pose Integration"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A frame with constant twist in body axes performs a screw motion.",
        inputs={"V": driver("Constant", value=(1.0, 0.0, 0.2, 0.0, 0.0, 1.0))},
        shown=(driver("T2xyz").by(T="T").at("x"), driver("T2xyz").by(T="T").at("z")),
    )

    axes: str = parameter("body", choices=_FRAMES, doc="the axes of the velocity")
    position: ArrayLike = parameter((0.0, 0.0, 0.0), dimensions=(1,), doc="position at t = 0 (3,)", unit="m")
    quaternion: ArrayLike = parameter(
        (1.0, 0.0, 0.0, 0.0), dimensions=(1,), doc="orientation at t = 0, scalar first (4,), of any length"
    )
    restoring: float = parameter(1.0, minimum=0.0, doc="rate at which |Q| returns to 1", unit="1/s")

    def check(self) -> None:
        for name, count in (("position", 3), ("quaternion", 4)):
            shape = shape_of(self.parameter_value(name))
            if shape != (count,):
                raise InputError(
                    f"the {name} has {counted(shape[0], 'number')}",
                    where="PoseIntegration",
                    allowed=f"{count}",
                    fix="give a position as (x, y, z), a quaternion with the scalar first",
                )
        if not any(np.asarray(self.quaternion)):
            raise InputError(
                "the quaternion is zero",
                where="PoseIntegration",
                allowed="a quaternion that is not zero",
                fix="give (1, 0, 0, 0) for no rotation",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("V", "velocity of the origin (m/s), then angular velocity (rad/s)", shape=(6,)),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("T", "the pose", shape=(4, 4)),)

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        return State("p", (3,), "the position", "m"), State("Q", (4,), "the quaternion, scalar first")

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"T": pose(from_quaternion(x["Q"]), x["p"])}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        v, w, Q = u["V"][:3], vertcat(0.0, u["V"][3:]), x["Q"]
        body = self.axes == "body"
        rotation_rate = 0.5 * quaternion_product(*((Q, w) if body else (w, Q)))
        return {
            "p": mtimes(from_quaternion(Q), v) if body else v,
            "Q": rotation_rate + 0.5 * p["restoring"] * (1.0 - dot(Q, Q)) * Q,
        }

    def initial_states(self, p: Signals) -> Signals:
        Q = p["quaternion"]
        return {"p": p["position"], "Q": Q / norm_2(Q)}
