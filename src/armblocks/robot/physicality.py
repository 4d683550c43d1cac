"""Checks whether the inertia of each link is possible for a rigid body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armblocks.argument_errors import ArgumentErrors, with_argument_errors
from armblocks.errors import InertiaWarning, warn
from armblocks.robot.robot import Robot
from armblocks.spatial import Vector3

TOLERANCE = 1e-9
"""Tolerance relative to the largest principal moment, because thin rods and flat plates are at the limit."""


@dataclass(frozen=True, kw_only=True)
class InertiaFinding(metaclass=ArgumentErrors):
    """A reason why no rigid body has the inertia of a link; ``moments``: principal moments, kg m2."""

    robot: str
    link: str
    moments: Vector3
    reason: str

    def __str__(self) -> str:
        moments = ", ".join(f"{moment:.6g}" for moment in self.moments)
        return (
            f"robot '{self.robot}', link '{self.link}': {self.reason} (principal moments {moments} kg m2). "
            "No rigid body has this inertia; it is used as given."
        )


@with_argument_errors
def inertia_findings(robot: Robot) -> tuple[InertiaFinding, ...]:
    """A finding for every link whose inertia about the centre of mass is impossible.

    A body's principal moments are not negative, none exceeds the sum of the other two, and a body without
    mass has none. Source: Wensing, Kim, Slotine, *Linear matrix inequalities for physically-consistent
    inertial parameter identification*, RA-L 2018, section II.
    """
    findings: list[InertiaFinding] = []
    for link in robot.links:
        low, middle, high = (float(moment) + 0.0 for moment in np.linalg.eigvalsh(link.I))
        tolerance = TOLERANCE * max(abs(low), abs(high))
        reason = ""
        if low < -tolerance:
            reason = "a principal moment of inertia is negative"
        elif link.mass == 0 and high > tolerance:
            reason = "the link has inertia but no mass"
        elif high > low + middle + tolerance:
            reason = "the greatest principal moment of inertia exceeds the sum of the other two"
        if reason:
            findings.append(
                InertiaFinding(robot=robot.name, link=link.name, moments=(low, middle, high), reason=reason)
            )
    return tuple(findings)


def warn_of_inertias(robot: Robot) -> None:
    """Issue an InertiaWarning for every finding; called when a robot is loaded."""
    for finding in inertia_findings(robot):
        warn(str(finding), InertiaWarning)
