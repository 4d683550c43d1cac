"""Torque over speed of a motor in a cycle, with its continuous and its peak curve."""

from __future__ import annotations

import math

import numpy as np

from armblocks.pictures.numbers import nice_ticks, table_number
from armblocks.pictures.picture import Disc, Picture, Polyline, Text
from armblocks.pictures.style import SMALL_SIZE, TEXT_SIZE, Tone, trace_tone
from armblocks.pictures.text_width import shorten
from armblocks.report.charts.axes import BOTTOM, LEFT, RIGHT, TOP, PlotArea, clip_line
from armblocks.report.charts.scale import Scale
from armblocks.report.drive_load import DriveLoad

_TO_RPM = 30.0 / math.pi
_CURVE_POINTS = 200


def torque_speed_picture(
    load: DriveLoad, *, index: int = 0, width: float = 470.0, height: float = 330.0
) -> Picture:
    """The points of a cycle in the torque-speed plane of the motor, and its limits.

    Magnitudes of torque (N m) over magnitudes of speed (rev/min). The disc is the RMS torque at the mean
    speed, which must be below the continuous curve.
    """
    drive = load.drive
    speed, torque = np.abs(load.speed) * _TO_RPM, np.abs(load.torque)
    most = max(float(speed.max()), drive.max_speed * _TO_RPM) * 1.05
    curve = np.linspace(0.0, drive.max_speed, _CURVE_POINTS)
    continuous, peak = drive.continuous_torque(curve), drive.peak_torque_at(curve)
    shown = peak if math.isfinite(drive.peak_torque) else continuous
    top = max(float(torque.max()), float(shown.max())) * 1.25
    box = (LEFT, TOP, width - RIGHT, height - BOTTOM)
    area = PlotArea(
        x_scale=Scale(0.0, most, box[0], box[2]),
        y_scale=Scale(0.0, top, box[3], box[1]),
        x_ticks=tuple(nice_ticks(0.0, most, 5)),
        y_ticks=tuple(nice_ticks(0.0, top, 5)),
    )
    verdict = "passes" if load.passes else "fails"
    picture = Picture(
        width=width,
        height=height,
        title=f"{drive.name} at {load.joint}",
        description=f"Torque over speed of the motor in a cycle; the drive {verdict}.",
    )
    name = shorten(load.joint, TEXT_SIZE, 0.4 * width)
    picture.extend(area.frame(x_label="Motor speed, rev/min", y_label=f"{name}: motor torque, N m"))
    rpm = curve * _TO_RPM
    end = np.array([rpm[-1], rpm[-1]])
    for values, dash in ((continuous, (7.0, 4.0)), (peak, ())):
        if np.isfinite(values).all():
            line = area.points(np.append(rpm, end[:1]), np.append(values, 0.0))
            picture.add(Polyline(line, Tone.INK, 1.4, dash))
    points = clip_line(area.points(speed, torque), area.box)
    picture.add(Polyline(points, trace_tone(index), 1.8))
    x, y = area.x_scale(load.mean_speed * _TO_RPM), area.y_scale(load.rms_torque)
    good = load.used("RMS torque") <= 1.0
    picture.add(Disc(x, y, 4.5, fill=trace_tone(index) if good else Tone.ERROR, stroke=Tone.SURFACE))
    tone = Tone.MUTED if load.passes else Tone.ERROR
    space = 0.9 * (box[2] - box[0])
    text = f"{verdict}: {table_number(100.0 * load.tightest.used, 3)} % of {load.tightest.name}"
    for line, (words, colour) in enumerate(((drive.name, Tone.INK), (text, tone)), 1):
        y = box[1] + 4.0 + 14.0 * line
        picture.add(Text(box[2] - 8.0, y, shorten(words, SMALL_SIZE, space), SMALL_SIZE, colour, "end"))
    return picture
