"""Blocks that combine poses: one after the other, back, apart, and small steps between them."""

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
from armblocks.diagram import Block, Port, Shapes, Signals, State, WorkedExample, made, parameter, shape_of
from armblocks.diagram.signs import FaceSign, Words
from armblocks.errors import InputError
from armblocks.spatial.orientation import from_quaternion, quaternion_product

_FRAMES = ("body", "world")


def inverse(T: SX) -> SX:
    """The pose of frame a in frame b from that of b in a."""
    R = T[:3, :3]
    return pose(R.T, -mtimes(R.T, T[:3, 3]))


@dataclass(frozen=True, kw_only=True)
class PoseProduct(Block):
    """Poses one after the other: T = T1 T2 …, that is T_ac = T_ab T_bc."""

    title: ClassVar[str] = "Pose Product"
    sign: ClassVar[FaceSign] = Words("T₁ T₂")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A frame that turns, and 1 m along its x axis a second one: its origin runs around a circle.",
        inputs={"T1": SPINNING_POSE, "T2": pose_along_x(made("Constant").named("one"))},
        across=position_of("T")[0],
        up=position_of("T")[1],
    )

    inputs: int = parameter(2, minimum=1, doc="how many poses")

    def input_ports(self) -> tuple[Port, ...]:
        return tuple(Port(f"T{k}", f"pose {k}", shape=(4, 4)) for k in range(1, self.inputs + 1))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("T", "their product", shape=(4, 4)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"T": reduce(mtimes, u.values())}


@dataclass(frozen=True, kw_only=True)
class PoseInverse(Block):
    """The pose seen from the other frame: T^-1 = [R' -R'p; 0 0 0 1]."""

    title: ClassVar[str] = "Pose Inverse"
    sign: ClassVar[FaceSign] = Words("T⁻¹")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A pose that moves along x, and how the old frame is seen from it: it moves along -x.",
        inputs={
            "T": made("Xyz2T").by(
                x=made("Ramp").named("x"), y=made("Constant").named("y"), z=made("Ground").named("z")
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
        shows="A fixed rotation and a position that swings make a pose; its upper rows are [R p].",
        inputs={
            "R": made("Constant", value=((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))),
            "p": made("SineWave", amplitude=(0.5, 1.0, 1.5)),
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
    """A point of frame b told in frame a: p_a = R_ab p_b + p_ab."""

    title: ClassVar[str] = "Transform Point"
    sign: ClassVar[FaceSign] = Words("T p")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The point (1, 0, 0) of a frame that turns about z, seen from outside.",
        inputs={"T": SPINNING_POSE, "p": made("Constant", value=(1.0, 0.0, 0.0)).named("point")},
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
    """A velocity (v; w) of frame b's origin and axes told in frame a's: v_a = R v + p x R w, w_a = R w.

    This is the adjoint of the pose; its inverse pose goes back.
    """

    title: ClassVar[str] = "Transform Twist"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A speed of 1 m/s along x of a frame that turns about z, told in the axes outside.",
        inputs={
            "T": SPINNING_POSE,
            "V": made("Constant", value=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0)).named("twist"),
        },
        shown=("y",),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("T", "pose of frame b in frame a", shape=(4, 4)), Port("V", "(v; w) in b", shape=(6,)))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "(v; w) in a", shape=(6,)),)

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
            "The nine entries of the matrix: each element of the vector stands there twice, with both signs."
        ),
        inputs={"u": made("SineWave", amplitude=(1.0, 2.0, 3.0))},
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
    """The small step from one pose to another, (d; r): body is (p; vex(R - I)) of T1^-1 T2, as in release 10.

    ``world`` is that of the toolbox up to release 9: d = p2 - p1 and r = 1/2 (n1 x n2 + o1 x o2 + a1 x a2) of
    the axes of both, in the axes of the frame in which the poses are told. Both are steps for small turns
    only. vex is half the difference of the opposite entries.
    """

    title: ClassVar[str] = "tr2delta"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The step from a fixed pose to one that moves along x and turns about z by t / 10: (d; r).",
        inputs={
            "T1": pose_along_x(ZERO).named("start"),
            "T2": made("AngleAxis2T").by(
                angle=made("Ramp", slope=0.1).named("angle"),
                axis=made("Constant", value=(0.0, 0.0, 1.0)).named("axis"),
            ),
        },
        shown=("dx",),
    )

    frame: str = parameter("body", choices=_FRAMES, doc="body (release 10) or world (up to release 9)")

    def input_ports(self) -> tuple[Port, ...]:
        return (
            Port("T1", "pose at the beginning", shape=(4, 4)),
            Port("T2", "pose at the end", shape=(4, 4)),
        )

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("dx", "step (dx, dy, dz, rx, ry, rz)", shape=(6,)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        T1, T2 = u["T1"], u["T2"]
        if self.frame == "body":
            step = mtimes(inverse(T1), T2)
            turn = vertcat(step[2, 1] - step[1, 2], step[0, 2] - step[2, 0], step[1, 0] - step[0, 1])
            return {"dx": vertcat(step[:3, 3], 0.5 * turn)}
        crosses = [cross(T1[:3, k], T2[:3, k]) for k in range(3)]
        return {"dx": vertcat(T2[:3, 3] - T1[:3, 3], 0.5 * (crosses[0] + crosses[1] + crosses[2]))}


@dataclass(frozen=True, kw_only=True)
class Delta2Tr(Block):
    """The pose of a small step: T = [I + skew(r), d; 0 0 0 1], as in the toolbox.

    Its rotation is one to the first order of the step only. A step in body axes leads from T1 to T1 T, one in
    world axes from R1 to (I + skew(r)) R1 and from p1 to p1 + d.
    """

    title: ClassVar[str] = "delta2tr"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A step that grows evenly, as a pose: its corner is [1 -rz; rz 1].",
        inputs={"dx": made("Ramp", slope=(0.1, 0.0, 0.0, 0.0, 0.0, 0.02))},
        shown=(corner_of("T"),),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("dx", "step (dx, dy, dz, rx, ry, rz)", shape=(6,)),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("T", "the pose of the step", shape=(4, 4)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"T": pose(SX.eye(3) + skew(u["dx"][3:]), u["dx"][:3])}


@dataclass(frozen=True, kw_only=True)
class PoseIntegration(Block):
    """The pose that a velocity leads to: p' = v and Q' = 1/2 w Q (world axes), or p' = R v and Q' = 1/2 Q w.

    V is (v; w), of the frame's origin: in world axes what ``jacob0`` gives, in the frame's own (body) axes
    what ``jacobe`` does. The state is the position and a quaternion Q. The pose is that of Q / |Q|, so that
    its rotation is exact at any step; |Q| is led back to 1 at the rate ``restoring``, which changes no pose.
    """

    title: ClassVar[str] = "Pose Integration"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A frame that goes forward and turns at constant rates, in its own axes, moves on a screw.",
        inputs={"V": made("Constant", value=(1.0, 0.0, 0.2, 0.0, 0.0, 1.0))},
        shown=(made("T2xyz").by(T="T").at("x"), made("T2xyz").by(T="T").at("z")),
    )

    axes: str = parameter("body", choices=_FRAMES, doc="the axes of the velocity")
    position: ArrayLike = parameter((0.0, 0.0, 0.0), dimensions=(1,), doc="at t = 0 (3,)", unit="m")
    quaternion: ArrayLike = parameter(
        (1.0, 0.0, 0.0, 0.0), dimensions=(1,), doc="orientation at t = 0, scalar first (4,), of any length"
    )
    restoring: float = parameter(1.0, minimum=0.0, doc="rate at which |Q| returns to 1", unit="1/s")

    def check(self) -> None:
        for name, count in (("position", 3), ("quaternion", 4)):
            shape = shape_of(self.parameter_value(name))
            if shape != (count,):
                raise InputError(
                    f"the {name} has {shape[0]} numbers",
                    where="PoseIntegration",
                    allowed=f"{count}",
                    fix="give a position as (x, y, z), a quaternion with the scalar first",
                )
        if not any(np.asarray(self.quaternion)):
            raise InputError(
                "the quaternion is zero",
                where="PoseIntegration",
                allowed="one that is not",
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
        turning = 0.5 * quaternion_product(*((Q, w) if body else (w, Q)))
        return {
            "p": mtimes(from_quaternion(Q), v) if body else v,
            "Q": turning + 0.5 * p["restoring"] * (1.0 - dot(Q, Q)) * Q,
        }

    def initial_states(self, p: Signals) -> Signals:
        Q = p["quaternion"]
        return {"p": p["position"], "Q": Q / norm_2(Q)}
