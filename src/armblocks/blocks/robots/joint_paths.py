"""Trajectories: trapezoidal and multi-segment joint motions, straight and circular tool motions.

Sources: Siciliano et al., Robotics, 2009, 4.2 (trapezoidal profile, blends at via points) and 4.3 (straight
path with the axis-angle rotation between two orientations); Corke, Robotics Toolbox (lspb, mstraj, ctraj).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, cos, fmax, fmin, if_else, logic_and, mtimes, sin, vertcat
from numpy.typing import ArrayLike

from armblocks.blocks.elementwise import parameters_shape
from armblocks.blocks.example_signals import ZERO, pose_along_x, position_of
from armblocks.blocks.transforms.orientations import pose
from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    WorkedExample,
    driver,
    parameter,
    shape_of,
)
from armblocks.diagram.signs import FaceSign, graph
from armblocks.errors import InputError, counted
from armblocks.spatial.orientation import fraction_of_rotation, from_quaternion, to_quaternion
from armblocks.trajectories import Quintic


@dataclass(frozen=True, kw_only=True)
class Trapezoidal(Block):
    """A joint motion from q0 to qf in the time tmax (s) with a trapezoidal profile of the speed.

    The speed rises linearly, is constant, and falls linearly. The constant speed is
    cruise (qf - q0) / tmax, so that ``cruise`` is the ratio of the greatest speed to the mean speed: 1.5 (the
    toolbox's default) gives three equal parts, 2 gives a triangle. Rise and fall take tmax (1 - 1 / cruise)
    each. Before 0 and after tmax the joints are at rest. This is the toolbox's ``lspb``.
    """

    title: ClassVar[str] = "lspb"
    sign: ClassVar[FaceSign] = graph((0, 0), (0.25, 0.12), (0.75, 0.88), (1, 1))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Linear ramps of the speed with constant speed between them.",
        parameters={"q0": (0.0, 0.0), "qf": (1.0, -0.5), "tmax": 8.0},
    )
    output_rates: ClassVar[Mapping[str, str]] = {"q": "qd"}

    q0: ArrayLike = parameter(
        0.0, kind=ParameterKind.ARRAY, dimensions=(0, 1), doc="coordinates at t = 0 (n,)", unit="rad"
    )
    qf: ArrayLike = parameter(
        1.0, kind=ParameterKind.ARRAY, dimensions=(0, 1), doc="coordinates at t = tmax (n,)", unit="rad"
    )
    tmax: float = parameter(10.0, above=0.0, doc="duration of the motion", unit="s")
    cruise: float = parameter(1.5, above=1.0, maximum=2.0, doc="ratio of greatest speed and mean speed")

    def check(self) -> None:
        parameters_shape(self, "q0", "qf")

    def output_ports(self) -> tuple[Port, ...]:
        return (
            Port("q", "coordinates", "rad"),
            Port("qd", "speeds", "rad/s"),
            Port("qdd", "accelerations", "rad/s2"),
        )

    def output_shapes(self, inputs: Shapes) -> Shapes:
        return dict.fromkeys(("q", "qd", "qdd"), parameters_shape(self, "q0", "qf"))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        ramp, end, T = self.breakpoints(p)
        time = fmin(fmax(t, 0.0), T)
        remaining = T - time
        speed = p["cruise"] / T
        acceleration, distance = speed / ramp, p["qf"] - p["q0"]
        first, last = time < ramp, time >= end
        fraction = if_else(first, acceleration * time * time / 2.0, speed * (time - ramp / 2.0))
        fraction = if_else(last, 1.0 - acceleration * remaining * remaining / 2.0, fraction)
        moving = logic_and(t >= 0.0, t < T)
        rate = if_else(moving, if_else(first, acceleration, 0.0) - if_else(last, acceleration, 0.0), 0.0)
        return {
            "q": p["q0"] + distance * fraction,
            "qd": distance * fmin(speed, acceleration * fmin(time, remaining)),
            "qdd": distance * rate,
        }

    def breakpoints(self, p: Signals) -> tuple[SX, ...]:
        end = p["tmax"] / p["cruise"]
        return p["tmax"] - end, end, p["tmax"]


@dataclass(frozen=True, kw_only=True)
class MultiSegment(Block):
    """A joint motion past given points: linear segments, which parabolic blends connect.

    q = p1 + sum of (p(k+1) - p(k)) g_k(t), where each g_k rises from 0 to 1. The toolbox's ``mstraj`` and
    ``ab.mstraj`` have quintic blends instead of parabolic ones.

    - Segment k takes durations(k), in s.
    - Each blend takes ``blend``, in s. The speed changes linearly in a blend and is constant between blends.
    - The blend at a point begins at the sum of the durations before this point; the first begins at t = 0.
    - The motion ends after the sum of all durations plus one blend.
    - The path passes exactly through the first and last point and close to the inner points.
    """

    title: ClassVar[str] = "mstraj"
    sign: ClassVar[FaceSign] = graph((0, 0), (0.35, 0.9), (0.45, 0.95), (0.55, 0.9), (1, 0.3))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Three corners: linear segments with blends of 0.6 s.",
        parameters={"points": ((0.0,), (1.0,), (0.5,), (1.5,)), "durations": (3.0, 3.0, 3.0), "blend": 0.6},
    )
    output_rates: ClassVar[Mapping[str, str]] = {"q": "qd"}

    points: ArrayLike = parameter(
        ((0.0,), (1.0,), (0.5,)),
        dimensions=(2,),
        doc="coordinates (k, n), one row for each point",
        unit="rad",
    )
    durations: ArrayLike = parameter(
        (1.0, 1.0), dimensions=(1,), above=0.0, doc="durations of the segments (k - 1,)", unit="s"
    )
    blend: float = parameter(0.2, above=0.0, doc="duration of a blend", unit="s")

    def check(self) -> None:
        segments, durations = shape_of(self.points)[0] - 1, shape_of(self.durations)[0]
        if segments != durations:
            raise InputError(
                f"there are {segments + 1} points and {counted(durations, 'duration')}",
                where="MultiSegment",
                allowed="one duration fewer than points",
                fix="correct the points or the durations",
            )
        shortest = min(self.durations)  # pyright: ignore[reportUnknownVariableType, reportArgumentType, reportCallIssue]
        if self.blend > shortest:
            raise InputError(
                f"blends of {self.blend:g} s do not fit into a segment of {shortest:g} s",
                where="MultiSegment",
                allowed="a blend no longer than any duration",
                fix="shorten the blend or lengthen the segment",
            )

    def output_ports(self) -> tuple[Port, ...]:
        shape = shape_of(self.points)[1:]
        return (
            Port("q", "coordinates", "rad", shape),
            Port("qd", "speeds", "rad/s", shape),
            Port("qdd", "accelerations", "rad/s2", shape),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        points, blend, instants = p["points"], p["blend"], self.breakpoints(p)
        time = fmin(t, instants[-1])
        ramps = [_rounded_ramp(time, begin, end, blend) for begin, end in zip(instants[::2], instants[1::2])]
        n = points.shape[1]
        q, qd, qdd = points[0, :].T, SX.zeros(n), SX.zeros(n)
        for k in range(points.shape[0] - 1):
            velocity = (points[k + 1, :] - points[k, :]).T / p["durations"][k]
            ends = zip(ramps[k], ramps[k + 1])
            position, speed, acceleration = (begin - end for begin, end in ends)
            q, qd, qdd = q + velocity * position, qd + velocity * speed, qdd + velocity * acceleration
        return {"q": q, "qd": qd, "qdd": qdd}

    def breakpoints(self, p: Signals) -> tuple[SX, ...]:
        starts = [SX(0.0)]
        for k in range(p["durations"].numel()):
            starts.append(starts[-1] + p["durations"][k])
        return tuple(instant for start in starts for instant in (start, start + p["blend"]))


@dataclass(frozen=True, kw_only=True)
class CTraj(Block):
    """A straight motion from pose T0 to T1 in tmax: p = p0 + s (p1 - p0), R = R0 rot(axis, s angle).

    R0' R1 determines axis and angle, so that the rotation is the shortest. s goes from 0 to 1 by the
    quintic of ``jtraj`` or the trapezoidal profile of ``lspb``.
    """

    title: ClassVar[str] = "ctraj"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A straight motion with a rotation by 90 degrees and a trapezoidal profile.",
        parameters={"tmax": 8.0},
        inputs={
            "T0": pose_along_x(ZERO).named("start"),
            "T1": driver("Rp2T")
            .named("end")
            .by(
                R=driver("Constant", value=((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))).named(
                    "turned"
                ),
                p=driver("Constant", value=(1.0, 0.5, 0.0)).named("p"),
            ),
        },
        shown=position_of("T"),
    )

    tmax: float = parameter(10.0, above=0.0, doc="duration of the motion", unit="s")
    profile: str = parameter("lspb", choices=("lspb", "quintic"), doc="profile of s")

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("T0", "pose at t = 0", shape=(4, 4)), Port("T1", "pose at t = tmax", shape=(4, 4)))

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("T", "pose of the tool", shape=(4, 4)), Port("s", "path parameter, 0 to 1", shape=()))

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        if self.profile == "lspb":
            s = Trapezoidal().outputs(t, {}, {}, self._profile(p))["q"]
        else:
            s = Quintic(q0=SX(0.0), qf=SX(1.0), tmax=p["tmax"]).at(t).q
        T0, T1 = u["T0"], u["T1"]
        rotation = to_quaternion(mtimes(T0[:3, :3].T, T1[:3, :3]))
        R = mtimes(T0[:3, :3], from_quaternion(fraction_of_rotation(rotation, s)))
        return {"T": pose(R, T0[:3, 3] + s * (T1[:3, 3] - T0[:3, 3])), "s": s}

    def breakpoints(self, p: Signals) -> tuple[SX, ...]:
        return Trapezoidal().breakpoints(self._profile(p)) if self.profile == "lspb" else (p["tmax"],)

    @staticmethod
    def _profile(p: Signals) -> Signals:
        """The parameters of the trapezoidal profile of s."""
        return {"q0": SX(0.0), "qf": SX(1.0), "tmax": p["tmax"], "cruise": SX(1.5)}


@dataclass(frozen=True, kw_only=True)
class CirclePath(Block):
    """A point on a circle: y = centre + radius (cos(a), sin(a), 0), a = 2 pi frequency t + phase."""

    title: ClassVar[str] = "Circle Path"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="A point that moves around a circle in ten seconds.",
        parameters={"frequency": 0.1},
    )

    radius: float = parameter(1.0, minimum=0.0, doc="radius", unit="m")
    centre: ArrayLike = parameter((0.0, 0.0, 0.0), dimensions=(1,), doc="centre (3,)", unit="m")
    frequency: float = parameter(1.0, doc="revolutions per second", unit="Hz")
    phase: float = parameter(0.0, doc="angle at t = 0", unit="rad")

    def check(self) -> None:
        if shape_of(self.centre) != (3,):
            raise InputError(
                f"the centre has {counted(shape_of(self.centre)[0], 'number')}",
                where="CirclePath.centre",
                allowed="3: x, y, z",
                fix="give the centre of the circle in m",
            )

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("y", "the point", "m", (3,)),)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        angle = 2.0 * math.pi * p["frequency"] * t + p["phase"]
        return {"y": p["centre"] + p["radius"] * vertcat(cos(angle), sin(angle), 0.0)}


def _rounded_ramp(t: SX, begin: SX, end: SX, blend: SX) -> tuple[SX, SX, SX]:
    """A ramp whose rate rises linearly from 0 to 1 within ``blend`` (s), and its first two derivatives."""
    rising = fmin(fmax(t - begin, 0.0), blend)
    within = logic_and(t >= begin, t < end)
    value = rising * rising / (2.0 * blend) + fmax(t - end, 0.0)
    return value, rising / blend, if_else(within, 1.0 / blend, 0.0)
