"""Inertias that no rigid body can have are reported."""

import numpy as np
import pytest

from armblocks.errors import InertiaWarning
from armblocks.robot import Link, Robot, inertia_findings, warn_of_inertias
from robots_for_tests import random_inertia


def reasons(**fields: object) -> list[str]:
    arm = Robot(name="arm", links=(Link(name="l", **fields),))
    return [finding.reason for finding in inertia_findings(arm)]


def test_physically_possible_inertias_are_accepted():
    for seed in range(10):
        assert not reasons(mass=1.0, inertia=random_inertia(np.random.default_rng(seed)))
    # Limit cases: a thin rod, a flat plate, a point mass, a massless link.
    assert not reasons(mass=1.0, inertia=(0, 1, 1))
    assert not reasons(mass=1.0, inertia=(1, 1, 2))
    assert not reasons(mass=1.0)
    assert not reasons()


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"mass": 1.0, "inertia": (-0.1, 1, 1)}, "a principal moment of inertia is negative"),
        ({"mass": 1.0, "inertia": (1, 1, 1, 2, 0, 0)}, "a principal moment of inertia is negative"),
        ({"inertia": (0, 0.35, 0)}, "the link has inertia but no mass"),
        (
            {"mass": 1.0, "inertia": (1, 1, 3)},
            "the greatest principal moment of inertia exceeds the sum of the other two",
        ),
    ],
)
def test_impossible_inertias_are_found(fields: dict[str, object], reason: str):
    assert reasons(**fields) == [reason]


def test_warning_names_robot_link_and_moments(kr180: Robot):
    with pytest.warns(InertiaWarning) as caught:
        warn_of_inertias(kr180)
    texts = [str(warning.message) for warning in caught]
    assert texts == [
        "robot 'KR180', link 'link1': the link has inertia but no mass (principal moments 0, 0, 0.35 kg m2). "
        "No rigid body has this inertia; it is used as given.",
        "robot 'KR180', link 'link3': the greatest principal moment of inertia exceeds the sum of the other "
        "two (principal moments 0.0125, 0.066, 0.086 kg m2). No rigid body has this inertia; it is used as "
        "given.",
    ]
