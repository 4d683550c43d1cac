"""Input signals of worked examples."""

from __future__ import annotations

from math import pi

from armblocks.diagram import Driver, ExampleBlock, driver

THREE_PHASES = driver("SineWave", phase=(0.0, 2 * pi / 3, 4 * pi / 3)).named("three phases")
"""Three sines, 120 degrees apart."""
CIRCLING = driver("SineWave", phase=(pi / 2, 0.0)).named("circling")
"""The vector (cos t, sin t)."""
HALF_ANGLE = driver(
    "SineWave", frequency=0.5, amplitude=(1.0, 0.0, 0.0, 1.0), phase=(pi / 2, 0.0, 0.0, 0.0)
).named("quaternion")
"""The quaternion (cos t/2, 0, 0, sin t/2): a rotation by t about z."""
ZERO = driver("Ground").named("zero")
"""The constant 0."""
SPINNING_POSE = driver("AngleAxis2T").by(
    angle=driver("Ramp", slope=0.6).named("angle"),
    axis=driver("Constant", value=(0.0, 0.0, 1.0)).named("axis"),
)
"""A pose that rotates about z."""
HELIX_POSE = driver("Xyz2T").by(
    x=driver("SineWave", phase=pi / 2).named("x"),
    y=driver("SineWave").named("y"),
    z=driver("Ramp", slope=0.1).named("z"),
)
"""A pose that moves along a helix without rotation."""


def pose_along_x(x: Driver) -> ExampleBlock:
    """A pose that moves along the x axis without rotation."""
    return driver("Xyz2T").by(x=x, y=ZERO, z=ZERO)


def corner_of(T: Driver) -> ExampleBlock:
    """The entries of a pose that a rotation about z changes: [cos -sin; sin cos]."""
    return driver("SubMatrix", last_row=2, last_column=2).named("corner").by(u=T)


def last_column_of(T: Driver) -> ExampleBlock:
    """The last column of a pose: the position and a 1."""
    return driver("SubMatrix", first_column=4).named("last column").by(u=T)


def position_of(T: Driver) -> tuple[ExampleBlock, ExampleBlock, ExampleBlock]:
    """The coordinates x, y and z of the position of a pose."""
    position = driver("T2xyz").named("position").by(T=T)
    return position.at("x"), position.at("y"), position.at("z")
