"""The report of a trajectory: cycle time, peaks against limits, and the binding limit at each time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike, fspath

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import InputError, check_type, counted
from armblocks.face.arm import Arm
from armblocks.face.collisions.check import collisions
from armblocks.face.collisions.obstacles import Obstacle
from armblocks.face.collisions.report import CollisionReport
from armblocks.face.least_time import MotionLimits, check_joint_space, motion_limits
from armblocks.face.payload import Payload, payload_numbers
from armblocks.face.pick_and_place import PickAndPlaceCycle
from armblocks.face.robots import given_arm
from armblocks.face.text_table import text_table
from armblocks.face.trajectory import JointTrajectory
from armblocks.files import write_atomically
from armblocks.pictures.numbers import table_number
from armblocks.pictures.picture import Picture
from armblocks.pictures.png import picture_png
from armblocks.pictures.style import FIGURE_WIDTH
from armblocks.pictures.svg import svg_file
from armblocks.report.charts.time_chart import Panel, Trace, time_chart
from armblocks.robot import Robot

Array = NDArray[np.float64]

BINDING = 0.95
"""Fraction of a limit from which it counts as binding."""
_SHORT = 0.01
"""Fraction of the cycle time below which intervals are omitted."""
_ROUNDING = 1e-14
"""Positions that are smaller, relative to the largest position of the joint, are rounding errors of 0."""
_SAMPLES = 1000
_INSTANT = 1e-9
"""Times that differ by less (s) are the two sides of a jump."""
_AT_REST = 1e-9
"""Speeds below this fraction of the largest speed of the joint are rounding errors, without friction."""
_STILL = 1e-12
"""All speeds of a joint that moves by less (rad or m) in the whole motion are rounding errors."""
_MAX_TEXT_INTERVALS = 12
_QUANTITIES = ("speed", "acceleration", "torque")


@dataclass(frozen=True, kw_only=True)
class BindingInterval(metaclass=ArgumentErrors):
    """A time from ``start`` to ``end`` (s) in which a ``quantity`` of a ``joint`` is nearest to its limit."""

    start: float
    end: float
    quantity: str
    joint: str


@dataclass(frozen=True, eq=False, kw_only=True)
class TrajectoryReport(metaclass=ArgumentErrors):
    """A trajectory against the limits of an arm. ``print`` shows it as a table.

    - ``joints``, ``units``: the names of the n joints, and rad or m.
    - ``time`` (N,) s; ``q``, ``qd``, ``qdd``, ``tau`` (N, n) at these times.
    - ``position_limits`` (n, 2).
    - ``speed_limits``, ``acceleration_limits``, ``torque_limits`` (n,): infinite without a limit.
    - ``collisions``: the check for collisions, if it was made.
    """

    name: str
    joints: tuple[str, ...]
    units: tuple[str, ...]
    time: Array
    q: Array
    qd: Array
    qdd: Array
    tau: Array
    position_limits: Array
    speed_limits: Array
    acceleration_limits: Array
    torque_limits: Array
    collisions: CollisionReport | None = None

    @property
    def cycle_time(self) -> float:
        """Duration of the motion, s."""
        return float(self.time[-1] - self.time[0])

    @property
    def ratios(self) -> Array:
        """Magnitudes (N, 3, n) of speeds, accelerations and torques divided by their limits."""
        limits = np.stack([self.speed_limits, self.acceleration_limits, self.torque_limits])
        return np.abs(np.stack([self.qd, self.qdd, self.tau], axis=1)) / limits

    @property
    def position_margin(self) -> Array:
        """Minimum distance (n,) of each joint to the nearer end of its range, negative beyond it."""
        low, high = self.position_limits.T
        return np.minimum(self.q - low, high - self.q).min(axis=0)

    @property
    def exceeded(self) -> tuple[str, ...]:
        """The exceeded limits as sentences, with the largest value and its time."""
        found = [
            f"{joint}: position outside its range by {table_number(-margin)} {unit}"
            for joint, margin, unit in zip(self.joints, self.position_margin.tolist(), self.units)
            if margin < -1e-9
        ]
        ratios = self.ratios
        for k, quantity in enumerate(_QUANTITIES):
            for j in np.flatnonzero(ratios[:, k].max(axis=0) > 1.001):
                at = int(ratios[:, k, j].argmax())
                share, when = 100 * float(ratios[at, k, j]), float(self.time[at])
                found.append(
                    f"{self.joints[j]}: {quantity} {table_number(share)} % of its limit "
                    f"at {table_number(when)} s"
                )
        return tuple(found)

    @property
    def binding(self) -> tuple[BindingInterval, ...]:
        """The times in which a limit binds: the quantity nearest to its limit, from 95 % of the limit.

        Interruptions and intervals of less than 1 % of the cycle time are omitted.
        """
        ratios = self.ratios.reshape(len(self.time), -1)
        nearest = np.where(ratios.max(axis=1) >= BINDING, ratios.argmax(axis=1), -1)
        ends = np.append(self.time[1:], self.time[-1])
        short = _SHORT * self.cycle_time
        found: list[list[float]] = []  # start, end, index of quantity and joint
        for start, end, index in zip(self.time.tolist(), ends.tolist(), nearest.tolist()):
            if index < 0:
                continue
            same = [part for part in found[-3:] if part[2] == index and start - part[1] <= short]
            if same:
                same[-1][1] = end
            else:
                found.append([start, end, index])
        shown: list[BindingInterval] = []
        for start, end, index in found:
            if end - start >= short:
                k, j = divmod(int(index), len(self.joints))
                shown.append(
                    BindingInterval(start=start, end=end, quantity=_QUANTITIES[k], joint=self.joints[j])
                )
        return tuple(shown)

    def table(self) -> list[dict[str, float | str]]:
        """One row for each joint: peaks in rad or m, s, N m or N, and in % of the limits; NaN without a
        limit."""
        peaks = {"speed": self.qd, "acceleration": self.qdd, "torque": self.tau}
        limits = np.stack([self.speed_limits, self.acceleration_limits, self.torque_limits])
        shares = np.where(np.isfinite(limits), 100.0 * self.ratios.max(axis=0), np.nan)
        rows: list[dict[str, float | str]] = []
        for j, joint in enumerate(self.joints):
            row: dict[str, float | str] = {"joint": joint, "unit": self.units[j]}
            ends = {"lowest": float(self.q[:, j].min()), "highest": float(self.q[:, j].max())}
            rounding = _ROUNDING * max(map(abs, ends.values()))
            row |= {name: value if abs(value) > rounding else 0.0 for name, value in ends.items()}
            row["margin"] = float(self.position_margin[j])
            for k, (name, values) in enumerate(peaks.items()):
                row[name] = float(np.abs(values[:, j]).max())
                row[f"{name} %"] = float(shares[k, j])
            rows.append(row)
        return rows

    def picture(self, width: float = FIGURE_WIDTH) -> Picture:
        """Speeds, accelerations and torques in % of their limits, or in their units without limits."""
        panels: list[Panel] = []
        limits = (self.speed_limits, self.acceleration_limits, self.torque_limits)
        for name, values, bounds, unit in zip(
            ("Speed", "Acceleration", "Torque"), (self.qd, self.qdd, self.tau), limits, ("/s", "/s²", "")
        ):
            shown = np.flatnonzero(np.isfinite(bounds))
            if shown.size:
                traces = [
                    Trace(
                        label=self.joints[j],
                        values=100.0 * values[:, j] / bounds[j],
                        index=j,
                        limits=(-100.1, 100.1),
                    )
                    for j in shown.tolist()
                ]
                panels.append(Panel(quantity=f"{name} of its limit", unit="%", traces=tuple(traces)))
            else:
                traces = [Trace(label=j, values=values[:, k], index=k) for k, j in enumerate(self.joints)]
                si = {("rad", "/s"): "rad/s", ("rad", "/s²"): "rad/s²", ("rad", ""): "N m"}
                units = {si.get((u, unit), f"m{unit}" if unit else "N") for u in self.units}
                panels.append(Panel(quantity=name, unit=" or ".join(sorted(units)), traces=tuple(traces)))
        return time_chart(
            self.time,
            panels,
            title=f"Motion of {self.name} against its limits",
            description=f"Cycle time {table_number(self.cycle_time)} s.",
            width=width,
        )

    def save(self, path: str | PathLike[str]) -> None:
        """Write the picture as a ``.svg`` or ``.png`` file."""
        save_picture(self.picture(), path, "TrajectoryReport.save")

    def __str__(self) -> str:
        rows = [
            [
                str(row["joint"]),
                *(_number(row[name]) for name in ("lowest", "highest", "margin", "speed", "speed %")),
                *(_number(row[name]) for name in ("acceleration", "acceleration %", "torque", "torque %")),
            ]
            for row in self.table()
        ]
        heads = ["joint", "lowest", "highest", "margin", "speed", "%", "accel.", "%", "torque", "%"]
        lines = [f"{self.name}: cycle time {table_number(self.cycle_time)} s", *text_table(heads, rows)]
        lines += [f"exceeded: {sentence}" for sentence in self.exceeded]
        if self.collisions is not None:
            lines.append(f"collisions: {self.collisions.summary}")
        intervals = self.binding
        for part in intervals[:_MAX_TEXT_INTERVALS]:
            lines.append(f"{part.start:8.3f} to {part.end:.3f} s: {part.quantity} of {part.joint}")
        if len(intervals) > _MAX_TEXT_INTERVALS:
            lines.append(f"and {counted(len(intervals) - _MAX_TEXT_INTERVALS, 'more interval')}")
        return "\n".join(lines)


def trajectory_report(
    arm: Arm | Robot | str | PathLike[str],
    trajectory: JointTrajectory | PickAndPlaceCycle,
    *,
    speed: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    torque: ArrayLike | None = None,
    payload: Payload | float | None = None,
    obstacles: Sequence[Obstacle] | None = None,
    margin: float = 0.0,
) -> TrajectoryReport:
    """The report of a trajectory of ``arm``: cycle time, peaks and limits, the binding limit at each time.

    - ``trajectory``: the motion. In a cycle of :func:`~armblocks.pick_and_place` the payload is at the tool
      only in the loaded phases.
    - ``speed``, ``acceleration``, ``torque``: limits, as for :func:`~armblocks.least_time`.
    - ``payload``: a :class:`Payload`, or a mass (kg) at the tool. Torques are computed by ``arm.rne`` with
      it.
    - ``obstacles``: with this argument (``()`` for none) the report names the first contact of the links with
      each other and with these bodies, as :func:`~armblocks.collisions`. The attribute ``collisions`` of the
      report has all distances. The body in the gripper is not included.
    - ``margin`` (m): bodies touch where their distance is at most this margin.

    Raises InputError for a trajectory with another number of joints.
    """
    arm = given_arm(arm, "trajectory_report")
    where = "trajectory_report"
    limits = motion_limits(arm, where, speed, acceleration, torque)
    time, q, qd, qdd, tau, _ = motion_with_torques(arm, trajectory, payload, where)
    path = trajectory.trajectory if isinstance(trajectory, PickAndPlaceCycle) else trajectory
    return TrajectoryReport(
        name=arm.name,
        joints=tuple(entry.name for entry in arm.robot.speeds),
        units=tuple(entry.unit for entry in arm.robot.speeds),
        time=time,
        q=q,
        qd=qd,
        qdd=qdd,
        tau=tau,
        position_limits=arm.robot.qlim,
        collisions=None if obstacles is None else collisions(arm, path, obstacles, margin=margin),
        **_named(limits),
    )


def motion_with_torques(
    arm: Arm, motion: JointTrajectory | PickAndPlaceCycle, payload: Payload | float | None, where: str
) -> tuple[Array, Array, Array, Array, Array, Array | None]:
    """Times (N,) with both sides of each jump, positions, speeds, accelerations and torques (N, n), and the
    payloads (N, 10) in the order of :attr:`Payload.numbers`, or None without a payload.

    The payload is at the tool of a cycle in its loaded phases.
    """
    check_joint_space(arm, where)
    trajectory = motion.trajectory if isinstance(motion, PickAndPlaceCycle) else motion
    check_type(trajectory, JointTrajectory, "a JointTrajectory or a PickAndPlaceCycle", where=where)
    if trajectory.n != arm.n:
        raise InputError(
            f"the trajectory has {counted(trajectory.n, 'joint')}",
            where=where,
            allowed=f"{arm.n}, the number of joints of robot '{arm.name}'",
            fix="use a trajectory of this robot",
        )
    rows = trajectory.rows()
    knots = rows[:, 0]
    samples = np.linspace(float(knots[0]), float(knots[-1]), _SAMPLES)
    gaps = np.abs(samples[:, None] - knots).min(axis=1)
    between: Array = samples[gaps > 1e-9 * max(trajectory.duration, 1e-9)]
    rows = np.vstack([rows, np.column_stack([between, *trajectory(between)])])
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    q, qd, qdd = (np.ascontiguousarray(part) for part in np.split(rows[:, 1:], 3, axis=1))
    time = rows[:, 0]
    # The sign of a rounding error would decide the direction of Coulomb friction at rest.
    fastest = np.where(np.ptp(q, axis=0) > _STILL, np.abs(qd).max(axis=0), np.inf)
    qd = np.where(np.abs(qd) > _AT_REST * fastest, qd, 0.0)
    if payload is None:
        return time, q, qd, qdd, arm.rne(q, qd, qdd), None
    numbers = payload.numbers if isinstance(payload, Payload) else payload_numbers(payload)
    loads = np.tile(np.asarray(numbers, dtype=np.float64), (len(q), 1))
    if isinstance(motion, PickAndPlaceCycle):
        loads *= _loaded(motion, time)[:, None]
    return time, q, qd, qdd, arm.rne(q, qd, qdd, payload=loads), loads


def _loaded(cycle: PickAndPlaceCycle, time: Array) -> Array:
    """1 where the payload is at the tool, else 0. The first of two equal times is the end of a phase."""
    before = np.append(np.diff(time) <= _INSTANT, False)
    inside = time + np.where(before, -_INSTANT, _INSTANT)
    loaded = np.zeros(len(time))
    for phase in cycle.phases:
        if phase.loaded:
            loaded[(inside > phase.start) & (inside < phase.end)] = 1.0
    return loaded


def save_picture(picture: Picture, path: str | PathLike[str], where: str) -> None:
    """Write a picture as an SVG or PNG file, by the suffix."""
    name = fspath(path)
    kind = name.rpartition(".")[2].lower()
    if kind not in ("svg", "png"):
        raise InputError(
            f"the file '{name}' is neither SVG nor PNG",
            where=where,
            allowed="a name that ends with .svg or .png",
            fix="change the suffix",
        )
    write_atomically(name, svg_file(picture).encode() if kind == "svg" else picture_png(picture))


def _number(value: float | str) -> str:
    return "" if isinstance(value, str) or not np.isfinite(value) else table_number(value, 4)


def _named(limits: MotionLimits) -> dict[str, Array]:
    return {f"{name}_limits": getattr(limits, name) for name in _QUANTITIES}
