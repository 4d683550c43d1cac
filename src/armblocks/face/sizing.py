"""Sizing of motors and gears for a trajectory and a payload: loads of all candidates against their limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import InputError, RobotError, UnknownNameError, counted
from armblocks.face.arm import Arm
from armblocks.face.payload import Payload
from armblocks.face.pick_and_place import PickAndPlaceCycle
from armblocks.face.robots import given_arm
from armblocks.face.text_table import text_table
from armblocks.face.trajectory import JointTrajectory
from armblocks.face.trajectory_report import motion_with_torques, save_picture
from armblocks.files import write_atomically
from armblocks.pictures.numbers import table_number
from armblocks.pictures.picture import Picture
from armblocks.pictures.svg import escape, svg_inline
from armblocks.report.charts.torque_speed_chart import torque_speed_picture
from armblocks.report.drive_load import Drive, DriveLoad, motor_torque
from armblocks.report.page_style import page_css
from armblocks.report.page_tables import html_table
from armblocks.report.writing import make_folder
from armblocks.robot import Robot

Array = NDArray[np.float64]

_INERTIA_SAMPLES = 100
_COLUMNS = (
    *("joint", "drive", "result", "tightest", "margin %", "speed %", "peak torque %", "RMS torque %"),
    *("temperature %", "brake %", "gear peak torque %", "gear mean torque %", "gear speed %"),
    *("inertia ratio", "peak power W", "energy J", "regenerated J", "copper loss J"),
    *("cycles per hour", "most cycles per hour"),
)
_TEXT_COLUMNS = (
    *("joint", "drive", "result", "tightest", "margin %", "speed %", "peak torque %", "RMS torque %"),
    *("inertia ratio", "energy J", "regenerated J", "most cycles per hour"),
)


@dataclass(frozen=True, eq=False, kw_only=True)
class SizingReport(metaclass=ArgumentErrors):
    """The loads of all candidate drives of an arm over a cycle. ``print`` shows the comparison as a table.

    ``loads``: in the order of the joints, and of the candidates of each joint.
    """

    name: str
    loads: tuple[DriveLoad, ...]

    @property
    def cycle_time(self) -> float:
        """Duration of motion and pause, s."""
        return self.loads[0].cycle_time

    @property
    def suggested(self) -> dict[str, DriveLoad | None]:
        """For each joint the valid candidate with the smallest stall torque times speed, or ``None``."""
        found: dict[str, DriveLoad | None] = {}
        for load in self.loads:
            best = found.setdefault(load.joint, None)
            if load.passes and (best is None or _rating(load.drive) < _rating(best.drive)):
                found[load.joint] = load
        return found

    def table(self) -> list[dict[str, float | str]]:
        """One row for each joint and drive; utilisation of limits in %, NaN for limits that are not given."""
        return [_row(load) for load in self.loads]

    def csv(self) -> str:
        """The table as CSV text."""
        lines = [",".join(_COLUMNS)]
        lines += [",".join(_csv_cell(row[name]) for name in _COLUMNS) for row in self.table()]
        return "\n".join(lines) + "\n"

    def picture(self, joint: str, drive: str | None = None) -> Picture:
        """Torque over speed of a joint's drive against its curves.

        ``drive``: the name of the candidate, by default the suggested candidate, else the first candidate.
        Raises UnknownNameError for other names.
        """
        joints = list(dict.fromkeys(load.joint for load in self.loads))
        if joint not in joints:
            raise UnknownNameError("joint", joint, joints, where="SizingReport.picture")
        candidates = {load.drive.name: load for load in self.loads if load.joint == joint}
        if drive is not None and drive not in candidates:
            raise UnknownNameError("drive", drive, list(candidates), where="SizingReport.picture")
        best = self.suggested[joint] or next(iter(candidates.values()))
        return torque_speed_picture(best if drive is None else candidates[drive], index=joints.index(joint))

    def write(self, folder: str | PathLike[str]) -> tuple[Path, ...]:
        """Write ``sizing.html``, ``sizing.csv`` and one figure for each joint into a folder."""
        target = Path(folder)
        make_folder(target)
        figures = {joint: self.picture(joint) for joint in self.suggested}
        paths = [target / "sizing.html", target / "sizing.csv"]
        write_atomically(paths[0], _page(self, figures).encode())
        write_atomically(paths[1], self.csv().encode())
        for number, picture in enumerate(figures.values(), 1):
            paths.append(target / f"torque-speed-{number}.svg")
            save_picture(picture, paths[-1], "SizingReport.write")
        return tuple(paths)

    def __str__(self) -> str:
        rows = [[_text_cell(row[name]) for name in _TEXT_COLUMNS] for row in self.table()]
        lines = [self.heading, *text_table(_TEXT_COLUMNS, rows)]
        for joint, load in self.suggested.items():
            lines.append(f"{joint}: " + (load.drive.name if load else "no candidate passes"))
        return "\n".join(lines)

    @property
    def heading(self) -> str:
        """Robot, cycle time and number of candidates."""
        cycles = table_number(3600.0 / self.cycle_time)
        return (
            f"{self.name}: cycle time {table_number(self.cycle_time)} s, {cycles} cycles per hour, "
            f"{counted(len(self.loads), 'candidate')}"
        )


def size_drives(
    arm: Arm | Robot | str | PathLike[str],
    trajectory: JointTrajectory | PickAndPlaceCycle,
    drives: Sequence[Drive],
    *,
    payload: Payload | float | None = None,
    pause: float = 0.0,
    brakes_in_pause: bool = False,
) -> SizingReport:
    """Compare candidate motors and gears for a cycle: the trajectory and a ``pause`` (s) at its end.

    - ``trajectory``: the motion. In a cycle of :func:`~armblocks.pick_and_place` the payload is at the tool
      only in the loaded phases.
    - ``drives``: the candidates. They replace the motors of the robot's file.
    - ``payload``: a :class:`Payload`, or a mass (kg) at the tool.
    - ``pause`` (s): the time at rest after the motion. The motor holds the arm.
    - ``brakes_in_pause``: the brake holds the arm in the pause, and the motor torque is 0.

    The torque of a motor is the sum of two parts. The first part is the torque of gravity and of the rigid
    bodies with the payload, converted by the ratio and efficiency of the gear. The second part is the torque
    of inertia and friction of the drive itself. The brake must hold the largest gravity torque of the motion.

    Raises InputError without a drive for some joint, UnknownNameError for an unknown joint of a drive,
    RobotError for robots with closed loops, ball joints, or motors at joints that depend on others.
    """
    arm = given_arm(arm, "size_drives")
    where = "size_drives"
    if isinstance(pause, str) or not 0.0 <= pause < math.inf:  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError(
            f"pause = {pause!r}",
            where=where,
            allowed="a finite number, 0 or more, in s",
            fix="give the time between two motions in s",
        )
    joints = [entry.name for entry in arm.robot.speeds]
    _check_joints(arm.robot, joints, drives, where)
    rigid = Arm(without_motors(arm.robot))
    time, q, qd, qdd, tau, payloads = motion_with_torques(rigid, trajectory, payload, where)
    if not time[-1] > time[0]:
        raise InputError(
            "the trajectory has no duration",
            where=where,
            allowed="a motion",
            fix="use a trajectory of more than one point",
        )
    zero = np.zeros_like(q)
    gravity = rigid.rne(q, zero, zero, payload=payloads)
    inertia = _largest_inertia(rigid, q, payloads)
    loads: list[DriveLoad] = []
    for j, joint in enumerate(joints):
        direction = _directions(qd[:, j])
        for drive in drives:
            if drive.joints and joint not in drive.joints:
                continue
            ratio = drive.gear_ratio
            speed, acceleration = ratio * qd[:, j], ratio * qdd[:, j]
            holding = float(gravity[-1, j]) / ratio
            loads.append(
                DriveLoad(
                    joint=joint,
                    drive=drive,
                    time=time,
                    speed=speed,
                    torque=motor_torque(drive, tau[:, j], speed, acceleration, direction),
                    output_torque=tau[:, j],
                    pause=float(pause),
                    pause_torque=0.0 if brakes_in_pause else holding,
                    holding_torque=float(np.abs(gravity[:, j]).max()) / ratio,
                    load_inertia=float(inertia[j]) / ratio**2,
                )
            )
    return SizingReport(name=arm.name, loads=tuple(loads))


def without_motors(robot: Robot) -> Robot:
    """The robot with motors without inertia and friction."""
    links = tuple(
        link
        if link.motor is None
        else replace(
            link,
            motor=replace(link.motor, inertia=0.0, viscous_friction=0.0, coulomb_friction=(0.0, 0.0)),
        )
        for link in robot.links
    )
    return replace(robot, links=links)


def _check_joints(robot: Robot, joints: Sequence[str], drives: Sequence[Drive], where: str) -> None:
    own = {link.name for link in robot.moving_links}
    geared = [link.name for link in robot.tree_links if link.motor is not None and link.name not in own]
    if geared:
        raise RobotError(
            f"the joint '{geared[0]}' has a motor and depends on other joints",
            where=f"{where}, robot '{robot.name}'",
            allowed="motors at independent joints, so that each motor has the torque of one coordinate",
            fix="describe the robot by the joints that its motors drive",
        )
    for drive in drives:
        for joint in drive.joints:
            if joint not in joints:
                raise UnknownNameError("joint", joint, joints, where=f"drive '{drive.name}'")
    for joint in joints:
        if not any(not drive.joints or joint in drive.joints for drive in drives):
            raise InputError(
                f"there is no candidate for the joint '{joint}'",
                where=where,
                allowed="one or more drives for each joint",
                fix="add a drive, or leave the column 'joint' of a drive empty",
            )


def _directions(speed: Array) -> Array:
    """The sign of the speed; at rest, of the motion before or after the rest; 0 if a joint never moves."""
    still = np.abs(speed) <= 1e-12 * np.abs(speed).max(initial=0.0)
    signs = np.where(still, 0.0, np.sign(speed))
    moving = np.flatnonzero(signs)
    if not moving.size:
        return signs
    nearest = np.clip(np.searchsorted(moving, np.arange(len(signs))), 0, len(moving) - 1)
    return signs[moving[nearest]]


def _largest_inertia(rigid: Arm, q: Array, payloads: Array | None) -> Array:
    """The largest diagonal entries (n,) of the mass matrix along the motion, with the payloads (N, 10)."""
    samples = np.linspace(0, len(q) - 1, _INERTIA_SAMPLES).astype(int)
    rows, payload = q[samples], None if payloads is None else payloads[samples]
    zero = np.zeros_like(rows)
    at_rest = rigid.rne(rows, zero, zero, payload=payload)
    entries = np.empty(rigid.n)
    for j in range(rigid.n):
        unit = zero.copy()
        unit[:, j] = 1.0
        entries[j] = (rigid.rne(rows, zero, unit, payload=payload) - at_rest)[:, j].max()
    return entries


def _rating(drive: Drive) -> float:
    return drive.stall_torque * drive.max_speed


def _row(load: DriveLoad) -> dict[str, float | str]:
    tightest, loss = load.tightest, load.copper_loss
    parts = {f"{name} %": 100.0 * load.used(name) for name in ("speed", "peak torque", "RMS torque", "brake")}
    parts |= {f"{name} %": 100.0 * load.used(name) for name in ("temperature", "gear speed")}
    parts |= {f"{name} %": 100.0 * load.used(name) for name in ("gear peak torque", "gear mean torque")}
    return {
        "joint": load.joint,
        "drive": load.drive.name,
        "result": "pass" if load.passes else "FAIL",
        "tightest": tightest.name,
        "margin %": 100.0 * tightest.margin,
        **parts,
        "inertia ratio": load.inertia_ratio,
        "peak power W": load.peak_power,
        "energy J": load.energy,
        "regenerated J": load.regenerated_energy,
        "copper loss J": math.nan if loss is None else loss,
        "cycles per hour": load.cycles_per_hour,
        "most cycles per hour": load.most_cycles_per_hour,
    }


def _text_cell(value: float | str) -> str:
    if isinstance(value, str):
        return value
    return table_number(value if abs(value) > 1e-9 else 0.0, 4) if math.isfinite(value) else ""


def _csv_cell(value: float | str) -> str:
    if isinstance(value, str):
        return '"' + value.replace('"', '""') + '"' if any(mark in value for mark in ',"\n') else value
    return repr(value) if math.isfinite(value) else ""


def _page(report: SizingReport, figures: dict[str, Picture]) -> str:
    """The HTML page: the comparison, and the figure of each joint."""
    rows: list[str] = []
    for row in report.table():
        failed = ' class="bad"' if row["result"] == "FAIL" else ""
        cells = [
            f"<td{failed if name in ('result', 'margin %') else ''}>{escape(_text_cell(row[name]))}</td>"
            for name in _COLUMNS[1:]
        ]
        rows.append(f'<tr><th scope="row">{escape(str(row["joint"]))}</th>{"".join(cells)}</tr>')
    heads = [
        (name.removesuffix(f" {unit}") if unit else name, unit)
        for name in _COLUMNS
        for unit in [name.rsplit(" ", 1)[-1] if name.endswith((" %", " W", " J")) else ""]
    ]
    drawn = "".join(
        f"<figure>{svg_inline(picture, identifier=f'joint-{k}')}</figure>"
        for k, picture in enumerate(figures.values())
    )
    chosen = "".join(
        f"<li>{escape(joint)}: {escape(load.drive.name) if load else 'no candidate passes'}</li>"
        for joint, load in report.suggested.items()
    )
    title = escape(f"Drives of {report.name}")
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<style>{page_css()}</style></head><body><header class="top"><h1>{title}</h1>'
        f'<p class="lead">{escape(report.heading)}</p></header><main><section><h2>Suggested drives</h2>'
        f"<ul>{chosen}</ul></section><section><h2>All candidates</h2>"
        f"{html_table('Utilisation of the limits; a drive fails above 100 %', heads, rows)}</section>"
        f'<section><h2>Torque over speed</h2><div class="pair">{drawn}</div></section></main></body></html>\n'
    )
