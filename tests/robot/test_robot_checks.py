"""Every inconsistency of a description is reported with robot, link and field."""

import re
import warnings
from dataclasses import replace

import numpy as np
import pytest

from armblocks.errors import ArmblocksWarning, RobotError
from armblocks.robot import DhRow, JointLimits, Link, Motor, Prismatic, Revolute, Robot, standard_dh
from armblocks.spatial import Transform


def make(*links: Link, **fields: object) -> Robot:
    return Robot(name="arm", links=links, **fields)


def refused(text: str):
    return pytest.raises(RobotError, match=re.escape(text))


def test_links_must_form_a_tree():
    with refused("robot 'arm': the robot has no links. Allowed: 1 link or more"):
        make()
    with refused("robot 'arm': the robot has 1001 links. Allowed: at most 1000"):
        make(*(Link(name=str(i)) for i in range(1001)))
    with refused("robot 'arm': a link has no name"):
        make(Link(name=""))
    with refused("robot 'arm': two links are named 'a'. Allowed: unique names. Fix: rename one"):
        make(Link(name="a"), Link(name="a"))
    with refused(
        "robot 'arm': link 'b' has the parent 'c', which does not exist. Allowed: a, b. Fix: name an"
    ):
        make(Link(name="a"), Link(name="b", parent="c"))
    with refused("robot 'arm': links are each other's parents: b -> c -> b"):
        make(Link(name="a"), Link(name="b", parent="c"), Link(name="c", parent="b"))
    with refused("robot 'arm': links are each other's parents: a -> a"):
        make(Link(name="a", parent="a"))


def test_a_thousand_links_are_accepted():
    links = [Link(name=str(i), parent=str(i - 1) if i else None) for i in range(1000)]
    assert make(*reversed(links)).n == 1000


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"mass": np.nan}, "mass is nan"),
        ({"centre_of_mass": (0, np.inf, 0)}, "centre_of_mass is inf"),
        ({"inertia": (1, 1, np.nan)}, "inertia is nan"),
        ({"before": Transform(translation=(0, 0, np.nan))}, "before is nan"),
        ({"after": Transform(rotation=np.full((3, 3), np.nan))}, "after is nan"),
        ({"joint": Revolute(offset=-np.inf)}, "joint offset is -inf"),
        ({"joint": Revolute(axis=(np.nan, 0, 1))}, "joint axis is nan"),
        ({"joint": Revolute(limits=JointLimits(position=(-np.inf, 1)))}, "position limit is -inf"),
        ({"joint": Revolute(limits=JointLimits(speed=np.inf))}, "speed limit is inf"),
        ({"joint": Revolute(limits=JointLimits(torque=np.nan))}, "torque limit is nan"),
        ({"motor": Motor(inertia=np.nan)}, "motor inertia is nan"),
        ({"motor": Motor(gear_ratio=np.inf)}, "gear ratio is inf"),
        ({"motor": Motor(viscous_friction=np.nan)}, "viscous friction is nan"),
        ({"motor": Motor(coulomb_friction=(np.nan, 0))}, "Coulomb friction is nan"),
        ({"dh": DhRow(d=np.nan)}, "D-H d is nan"),
    ],
)
def test_errors_for_non_finite_numbers_name_the_field(changes: dict[str, object], field: str):
    with refused(f"robot 'arm', link 'l': {field}. Allowed: a finite number"):
        make(replace(Link(name="l"), **changes))


def test_frames_and_gravity_must_be_finite():
    bad = Transform(translation=(np.nan, 0, 0))
    with refused("robot 'arm': base is nan"):
        make(Link(name="l"), base=bad)
    with refused("robot 'arm': tool is nan"):
        make(Link(name="l"), tool=bad)
    with refused("robot 'arm': gravity is inf"):
        make(Link(name="l"), gravity=(0, 0, np.inf))


@pytest.mark.parametrize(
    ("link", "text"),
    [
        (Link(name="l", mass=-1), "the mass is -1 kg. Allowed: zero or more"),
        (Link(name="l", joint=Prismatic(axis=(0, 0, 0))), "the joint's axis is zero. Allowed: a direction"),
        (
            Link(name="l", joint=Revolute(limits=JointLimits(position=(2, -1)))),
            "the position limits are reversed: from 2 to -1 rad. Allowed: the lower limit first",
        ),
        (
            Link(name="l", joint=Revolute(limits=JointLimits(speed=0))),
            "the speed limit is 0. Allowed: above zero, or None where unknown",
        ),
        (Link(name="l", joint=Revolute(limits=JointLimits(torque=-3))), "the torque limit is -3"),
        (
            Link(name="l", motor=Motor(gear_ratio=0)),
            "the gear ratio is 0, so the motor cannot move the joint",
        ),
        (Link(name="l", motor=Motor(inertia=-1)), "the motor inertia is -1 kg m2. Allowed: zero or more"),
        (
            replace(standard_dh("l", a=1.0), after=Transform()),
            "the D-H row disagrees with the link's transforms or joint",
        ),
        (replace(standard_dh("l", a=1.0), joint=Prismatic()), "the D-H row disagrees"),
    ],
)
def test_inconsistent_links_are_refused(link: Link, text: str):
    with refused(f"robot 'arm', link 'l': {text}"):
        make(link)


@pytest.mark.parametrize(
    "motor",
    [Motor(viscous_friction=-1e-3), Motor(coulomb_friction=(-0.1, -0.1)), Motor(coulomb_friction=(0.1, 0.1))],
)
def test_driving_friction_issues_a_warning(motor: Motor):
    with pytest.warns(
        ArmblocksWarning, match="robot 'arm', link 'l': friction accelerates the joint instead"
    ):
        make(Link(name="l", motor=motor))


def test_dissipative_friction_issues_no_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        make(Link(name="l", motor=Motor(viscous_friction=1e-3, coulomb_friction=(0.1, -0.2))))


def test_position_limits_are_a_pair():
    with refused("the position limits are 3 numbers. Allowed: a pair, or None where unknown"):
        JointLimits(position=(1, 2, 3))


def test_sigma_is_zero_or_one():
    with refused("sigma of a D-H row is 2. Allowed: 0 for a revolute, 1 for a prismatic joint"):
        DhRow(sigma=2)
