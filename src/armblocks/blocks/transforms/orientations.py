"""Conversions between poses and angles, quaternions or axis and angle; a pose is one 4x4 matrix.

Names are the same as in the toolbox. :mod:`armblocks.spatial.orientation` describes the conventions and the
singularities, where an orientation has more than one set of angles.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, dot, horzcat, sqrt, vertcat

from armblocks.blocks.example_signals import HALF_ANGLE, SPINNING_POSE, ZERO, corner_of
from armblocks.diagram import Block, Port, Signals, WorkedExample, driver, parameter
from armblocks.diagram.signs import FaceSign, Words
from armblocks.spatial import orientation

_T = Port("T", "the pose", shape=(4, 4))
_QUATERNION = "scalar first: s, x, y, z"
_CONVENTIONS = tuple(orientation.RPY_CONVENTIONS)


def pose(R: SX, p: SX | None = None) -> SX:
    """The pose [R p; 0 0 0 1]; ``p`` defaults to the origin."""
    top = horzcat(R, SX.zeros(3) if p is None else p)
    return vertcat(top, horzcat(SX.zeros(1, 3), 1.0))


def _angles(*names: str) -> tuple[Port, ...]:
    return tuple(Port(name, f"the angle {name}", "rad", ()) for name in names)


@dataclass(frozen=True, kw_only=True)
class Rpy2T(Block):
    """The pose with the rotation by roll, pitch and yaw (rad): T = Rz(yaw) Ry(pitch) Rx(roll) for ``zyx``.

    ``convention`` selects the order of the rotations:

    - ``zyx``, as in release 10 of the toolbox: Rz(yaw) Ry(pitch) Rx(roll).
    - ``xyz``: Rx(yaw) Ry(pitch) Rz(roll).
    - ``yxz``: Ry(yaw) Rx(pitch) Rz(roll).
    - ``release 9``, also for release 8: Rx(roll) Ry(pitch) Rz(yaw).
    - ``release 7``: Rz(roll) Ry(pitch) Rx(yaw).
    """

    title: ClassVar[str] = "rpy2T"
    sign: ClassVar[FaceSign] = Words("rpy→T")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A pose with yaw only: the upper left entries are cosines and sines of the angle.",
        inputs={"roll": ZERO, "pitch": ZERO, "yaw": driver("Ramp").named("yaw")},
        shown=(corner_of("T"),),
    )

    convention: str = parameter("zyx", choices=_CONVENTIONS, doc="order of the axes, or toolbox release")

    def input_ports(self) -> tuple[Port, ...]:
        return _angles("roll", "pitch", "yaw")

    def output_ports(self) -> tuple[Port, ...]:
        return (_T,)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"T": pose(orientation.from_rpy(u["roll"], u["pitch"], u["yaw"], self.convention))}


@dataclass(frozen=True, kw_only=True)
class T2rpy(Block):
    """Roll, pitch and yaw of a pose, the inverse of rpy2T of the same convention, with abs(pitch) <= pi/2.

    At pitch = pi/2 or -pi/2 only the sum or the difference of roll and yaw is determined. The block then sets
    roll to 0.
    """

    title: ClassVar[str] = "T2rpy"
    sign: ClassVar[FaceSign] = Words("T→rpy")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The block returns the three angles from which the pose is computed; yaw wraps at pi.",
        inputs={
            "T": driver("Rpy2T").by(
                roll=driver("SineWave", amplitude=0.5).named("roll"),
                pitch=driver("SineWave", amplitude=0.8, frequency=2.0).named("pitch"),
                yaw=driver("Ramp").named("yaw"),
            )
        },
        shown=("roll", "pitch", "yaw"),
    )

    convention: str = parameter("zyx", choices=_CONVENTIONS, doc="order of the axes, or toolbox release")

    def input_ports(self) -> tuple[Port, ...]:
        return (_T,)

    def output_ports(self) -> tuple[Port, ...]:
        return _angles("roll", "pitch", "yaw")

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        angles = orientation.to_rpy(u["T"][:3, :3], self.convention)
        return dict(zip(("roll", "pitch", "yaw"), angles))


@dataclass(frozen=True, kw_only=True)
class Eul2T(Block):
    """The rotation by Euler angles ZYZ: T = Rz(phi) Ry(theta) Rz(psi)."""

    title: ClassVar[str] = "eul2T"
    sign: ClassVar[FaceSign] = Words("eul→T")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=("A pose that rotates about z: the upper left entries are cosines and sines of the angle."),
        inputs={"phi": driver("Ramp").named("phi"), "theta": ZERO, "psi": ZERO},
        shown=(corner_of("T"),),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return _angles("phi", "theta", "psi")

    def output_ports(self) -> tuple[Port, ...]:
        return (_T,)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"T": pose(orientation.from_euler(u["phi"], u["theta"], u["psi"]))}


@dataclass(frozen=True, kw_only=True)
class T2eul(Block):
    """Euler angles ZYZ of a pose, the inverse of eul2T, with 0 <= theta <= pi.

    At theta = 0 or pi only the sum or the difference of phi and psi is determined. The block then sets
    phi to 0.
    """

    title: ClassVar[str] = "T2eul"
    sign: ClassVar[FaceSign] = Words("T→eul")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The block returns the three angles from which the pose is computed; phi wraps at pi.",
        inputs={
            "T": driver("Eul2T").by(
                phi=driver("Ramp").named("phi"),
                theta=driver("SineWave", amplitude=0.5, bias=1.0).named("theta"),
                psi=driver("SineWave", frequency=2.0).named("psi"),
            )
        },
        shown=("phi", "theta", "psi"),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (_T,)

    def output_ports(self) -> tuple[Port, ...]:
        return _angles("phi", "theta", "psi")

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return dict(zip(("phi", "theta", "psi"), orientation.to_euler(u["T"][:3, :3])))


@dataclass(frozen=True, kw_only=True)
class Quaternion2T(Block):
    """The pose with the rotation of a quaternion (s, x, y, z), which need not be normalised."""

    title: ClassVar[str] = "Quaternion to Pose"
    sign: ClassVar[FaceSign] = Words("q→T")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A quaternion (cos t/2, 0, 0, sin t/2) is a rotation by t about z.",
        inputs={"u": HALF_ANGLE},
        shown=(corner_of("T"),),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", f"the quaternion, {_QUATERNION}", shape=(4,)),)

    def output_ports(self) -> tuple[Port, ...]:
        return (_T,)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"T": pose(orientation.from_quaternion(u["u"]))}


@dataclass(frozen=True, kw_only=True)
class T2Quaternion(Block):
    """The unit quaternion (s, x, y, z) of a pose with s >= 0: s = cos(angle / 2), (x, y, z) along the axis.

    When the rotation angle passes pi, the quaternion jumps to its negative, which is the same orientation.
    """

    title: ClassVar[str] = "Pose to Quaternion"
    sign: ClassVar[FaceSign] = Words("T→q")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The quaternion of a pose that rotates about z: cosine and sine of half the angle.",
        inputs={"T": SPINNING_POSE},
        shown=("y",),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (_T,)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", f"the quaternion, {_QUATERNION}", shape=(4,)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": orientation.to_quaternion(u["T"][:3, :3])}


@dataclass(frozen=True, kw_only=True)
class AngleAxis2T(Block):
    """The rotation about an axis of any length: R = I + sin(angle) [k] + (1 - cos(angle)) [k]^2.

    k is the unit vector along the axis, and [k] its cross-product matrix (Rodrigues' formula).
    """

    title: ClassVar[str] = "angvec2T"
    sign: ClassVar[FaceSign] = Words("θ, a→T")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A rotation about z: the upper left entries are cosines and sines of the angle.",
        inputs={
            "angle": driver("Ramp").named("angle"),
            "axis": driver("Constant", value=(0.0, 0.0, 1.0)).named("axis"),
        },
        shown=(corner_of("T"),),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("angle", "the angle", "rad", ()), Port("axis", "the axis, not zero", shape=(3,)))

    def output_ports(self) -> tuple[Port, ...]:
        return (_T,)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"T": pose(orientation.from_angle_axis(u["angle"], u["axis"]))}


@dataclass(frozen=True, kw_only=True)
class T2AngleAxis(Block):
    """Angle and unit axis of a pose, 0 <= angle <= pi; without rotation the axis is (0, 0, 0)."""

    title: ClassVar[str] = "T2angvec"
    sign: ClassVar[FaceSign] = Words("T→θ, a")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Angle and axis of a pose that rotates about z: beyond pi the shorter rotation is about -z.",
        inputs={"T": SPINNING_POSE},
        shown=("angle", "axis"),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (_T,)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("angle", "the angle", "rad", ()), Port("axis", "the unit axis", shape=(3,)))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        angle, axis = orientation.to_angle_axis(u["T"][:3, :3])
        return {"angle": angle, "axis": axis}


@dataclass(frozen=True, kw_only=True)
class QuaternionProduct(Block):
    """The Hamilton product, a composition of rotations: y = u v, R(y) = R(u) R(v)."""

    title: ClassVar[str] = "Quaternion Multiplication"
    sign: ClassVar[FaceSign] = Words("u v")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A rotation about z after a quarter turn about x.",
        inputs={
            "u": HALF_ANGLE,
            "v": driver("Constant", value=(0.7071067811865476, 0.7071067811865476, 0.0, 0.0)).named(
                "quarter turn"
            ),
        },
        shown=("y",),
    )

    def input_ports(self) -> tuple[Port, ...]:
        return tuple(Port(name, f"a quaternion, {_QUATERNION}", shape=(4,)) for name in "uv")

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", f"their product, {_QUATERNION}", shape=(4,)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": orientation.quaternion_product(u["u"], u["v"])}


@dataclass(frozen=True, kw_only=True)
class QuaternionInverse(Block):
    """The inverse of a quaternion: y = (s, -x, -y, -z) / |u|^2, so that u y = 1."""

    title: ClassVar[str] = "Quaternion Inverse"
    sign: ClassVar[FaceSign] = Words("q⁻¹")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The inverse of a unit quaternion: the vector part changes its sign.",
        inputs={"u": HALF_ANGLE},
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", f"a quaternion, {_QUATERNION}", shape=(4,)),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", f"its inverse, {_QUATERNION}", shape=(4,)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        value = u["u"]
        return {"y": vertcat(value[0], -value[1:]) / dot(value, value)}


@dataclass(frozen=True, kw_only=True)
class QuaternionNormalize(Block):
    """The quaternion of unit length with the same orientation: y = u / |u|."""

    title: ClassVar[str] = "Quaternion Normalize"
    sign: ClassVar[FaceSign] = Words("q / |q|")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A quaternion of growing length, normalised to length 1.",
        inputs={
            "u": driver("Ramp", slope=(0.1, 0.0, 0.0, 0.3), initial=(1.0, 0.0, 0.0, 0.0)).named("quaternion")
        },
    )

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", f"a quaternion, {_QUATERNION}", shape=(4,)),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", f"the quaternion of unit length, {_QUATERNION}", shape=(4,)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        return {"y": u["u"] / sqrt(dot(u["u"], u["u"]))}


@dataclass(frozen=True, kw_only=True)
class QuaternionRate(Block):
    """The derivative of a quaternion: y = 1/2 u w (body axes) or 1/2 w u (world axes)."""

    title: ClassVar[str] = "Quaternion Rate"
    sign: ClassVar[FaceSign] = Words("½ q ω")
    example: ClassVar[WorkedExample] = WorkedExample(
        shows=(
            "The integral at a constant angular velocity about z: the quaternion rotates by half the angle."
        ),
        inputs={
            "u": driver("Integrator", initial=(1.0, 0.0, 0.0, 0.0)).named("quaternion").by(u="y"),
            "w": driver("Constant", value=(0.0, 0.0, 1.0)).named("angular velocity"),
        },
        shown=("u",),
    )

    axes: str = parameter("body", choices=("body", "world"), doc="the axes of the angular velocity")

    def input_ports(self) -> tuple[Port, ...]:
        return (
            Port("u", f"the quaternion, {_QUATERNION}", shape=(4,)),
            Port("w", "the angular velocity", "rad/s", (3,)),
        )

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "derivative of the quaternion", "1/s", (4,)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        w = vertcat(0.0, u["w"])
        factors = (u["u"], w) if self.axes == "body" else (w, u["u"])
        return {"y": 0.5 * orientation.quaternion_product(*factors)}
