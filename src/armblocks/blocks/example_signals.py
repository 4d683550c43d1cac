"""Input signals of worked examples."""

from __future__ import annotations

from math import pi

from armblocks.diagram import Fed, Feed, made

THREE_PHASES = made("SineWave", phase=(0.0, 2 * pi / 3, 4 * pi / 3)).named("three phases")
"""Three sines, 120 degrees apart."""
CIRCLING = made("SineWave", phase=(pi / 2, 0.0)).named("circling")
"""The vector (cos t, sin t)."""
HALF_ANGLE = made(
    "SineWave", frequency=0.5, amplitude=(1.0, 0.0, 0.0, 1.0), phase=(pi / 2, 0.0, 0.0, 0.0)
).named("quaternion")
"""The quaternion (cos t/2, 0, 0, sin t/2): a rotation by t about z."""
ZERO = made("Ground").named("zero")
SPINNING_POSE = made("AngleAxis2T").by(
    angle=made("Ramp", slope=0.6).named("angle"),
    axis=made("Constant", value=(0.0, 0.0, 1.0)).named("axis"),
)
"""A pose that rotates about z."""
HELIX_POSE = made("Xyz2T").by(
    x=made("SineWave", phase=pi / 2).named("x"),
    y=made("SineWave").named("y"),
    z=made("Ramp", slope=0.1).named("z"),
)
"""A pose that moves along a helix without rotation."""


def pose_along_x(x: Feed) -> Fed:
    """A pose that moves along the x axis without rotation."""
    return made("Xyz2T").by(x=x, y=ZERO, z=ZERO)


def corner_of(T: Feed) -> Fed:
    """The entries of a pose that a rotation about z changes: [cos -sin; sin cos]."""
    return made("SubMatrix", last_row=2, last_column=2).named("corner").by(u=T)


def last_column_of(T: Feed) -> Fed:
    """The position in a pose, and the 1 below it."""
    return made("SubMatrix", first_column=4).named("last column").by(u=T)


def position_of(T: Feed) -> tuple[Fed, Fed, Fed]:
    """x, y and z of a pose."""
    position = made("T2xyz").named("position").by(T=T)
    return position.at("x"), position.at("y"), position.at("z")
