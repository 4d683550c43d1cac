"""Checks for inertias that no rigid body can have, for each link."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from armblocks.errors import InertiaWarning
from armblocks.robot.robot import Robot
from armblocks.spatial import Vector3

TOLERANCE = 1e-9
"""Relative to the greatest principal moment: thin rods and flat plates lie on the border and are bodies."""


@dataclass(frozen=True, kw_only=True)
class InertiaFinding:
    """One reason why a link's inertia belongs to no body; ``moments`` are its principal moments, kg m2."""

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


def inertia_findings(robot: Robot) -> tuple[InertiaFinding, ...]:
    """Every link whose inertia about its centre of mass is impossible, with the reason.

    A body's principal moments are not negative, none exceeds the sum of the other two, and a body without
    mass has none. Source: Wensing, Kim, Slotine, *Linear matrix inequalities for physically-consistent
    inertial parameter identification*, RA-L 2018, section II.
    """
    findings: list[InertiaFinding] = []
    for link in robot.links:
        low, middle, high = (float(moment) + 0.0 for moment in np.linalg.eigvalsh(link.I))
        slack = TOLERANCE * max(abs(low), abs(high))
        reason = ""
        if low < -slack:
            reason = "a principal moment of inertia is negative"
        elif link.mass == 0 and high > slack:
            reason = "it has inertia but no mass"
        elif high > low + middle + slack:
            reason = "its greatest principal moment of inertia exceeds the sum of the other two"
        if reason:
            findings.append(
                InertiaFinding(robot=robot.name, link=link.name, moments=(low, middle, high), reason=reason)
            )
    return tuple(findings)


def warn_of_inertias(robot: Robot) -> None:
    """Warn (InertiaWarning) once for every finding: what loading a robot does."""
    for finding in inertia_findings(robot):
        warnings.warn(str(finding), InertiaWarning, stacklevel=3)
