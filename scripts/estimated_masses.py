"""Estimate the masses, centres of mass and inertias of a robot whose manufacturer publishes none.

``python3 scripts/estimated_masses.py robots/irb140/robot.json`` prints the estimate of each link.

Method: every link is the solid that armblocks draws for it (``armblocks.robot.geometry``), filled with the
uniform density. Overlapping parts of a link count twice. The sizes of the drawn bodies follow from the
kinematics alone. The densities are geometric means of those that give robots with known masses their moving
mass. All estimates have two significant digits.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from math import floor, log10
from pathlib import Path

import numpy as np

from armblocks.face.robots import load_robot
from armblocks.formats.mjcf.solids import Solid, solid_of_mesh
from armblocks.robot import Link, Robot
from armblocks.robot.geometry import robot_shapes
from armblocks.robot.shapes import Shape
from armblocks.robot.triangles import triangles

INDUSTRIAL_DENSITY = 1800.0
"""Density of the drawn bodies of industrial arms, kg/m³: from irb120, kr6_r900, rx160, tx60 and tx90."""
COLLABORATIVE_DENSITY = 1100.0
"""The same for lightweight arms, kg/m³: from fr3, iiwa7, ur3e, ur5e, ur10e and ur16e."""


EMPTY = Solid(0.0, np.zeros(3), np.zeros((3, 3)))


def estimated(robot: Robot, density: float = INDUSTRIAL_DENSITY) -> Robot:
    """The robot with estimated masses, centres of mass and inertias of all its links; motors are removed."""
    bare = replace(robot, links=tuple(replace(link, motor=None) for link in robot.links))
    shapes = robot_shapes(bare)[1:-1]  # the first row is the base, the last row the tool
    links = tuple(_with_mass(link, row, density) for link, row in zip(bare.links, shapes))
    return replace(bare, links=links)


def moving_volume(robot: Robot) -> float:
    """Volume of the drawn bodies of all links, m³."""
    return sum(_solid(row).volume for row in robot_shapes(robot)[1:-1])


def _solid(shapes: tuple[Shape, ...]) -> Solid:
    """The solid that consists of all shapes, in their common frame, for a density of 1 kg/m³."""
    corners = [triangles(shape).corners for shape in shapes]
    return solid_of_mesh(np.concatenate(corners), legacy=False) if corners else EMPTY


def _with_mass(link: Link, shapes: tuple[Shape, ...], density: float) -> Link:
    volume, centre, inertia = _solid(shapes)
    mass = _rounded(volume * density)
    scale = mass / volume if volume else 0.0
    threshold = 0.02 * float(np.abs(inertia).max())  # smaller products of inertia are omitted
    moments = [
        [_rounded(x * scale) if i == j or abs(x) > threshold else 0.0 for j, x in enumerate(row)]
        for i, row in enumerate(inertia)
    ]
    position = tuple(round(float(x), 3) + 0.0 for x in centre)
    return replace(link, mass=mass, centre_of_mass=position, inertia=np.array(moments))


def _rounded(value: float, digits: int = 2) -> float:
    return round(value, digits - 1 - floor(log10(abs(value)))) if value else 0.0


def main() -> int:
    """Print the estimates of the robot files in the arguments."""
    for name in sys.argv[1:]:
        robot = estimated(load_robot(Path(name)).robot)
        for link in robot.links:
            (xx, xy, xz), (_, yy, yz), (_, _, zz) = link.inertia
            print(
                f"{link.name}: {link.mass:g} kg at {link.centre_of_mass} m, inertia", xx, yy, zz, xy, yz, xz
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
