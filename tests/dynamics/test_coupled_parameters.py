"""Regrouped parameters of coupled mechanisms: the torques, inertias and energies of the whole tree."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armblocks.dynamics.base_parameters import base_parameter_tree, regrouped
from armblocks.robot import Link, Prismatic, Revolute, Robot, Spherical
from armblocks.robot.constraints import Coupling
from armblocks.robot.tree import KinematicTree
from armblocks.spatial import transl
from robots_for_tests import (
    build_mixed_tree,
    evaluate,
    random_inertia,
    random_states,
    random_transform,
    shipped_robot,
)

PALLETISERS = ("irb460", "kr40_pa", "m410ic_185")


def linkage(seed: int) -> Robot:
    """A random planar linkage with parallel axes on a turret; couplings determine half of its joints.

    The factors of the couplings are 1 and -1, as in parallelograms, or gear ratios.
    """
    random = np.random.default_rng(seed)
    count = int(random.integers(4, 9))
    links = [Link(name="turret", joint=Revolute(axis=(0, 0, 1)), before=random_transform(random), mass=5.0)]
    for k in range(count):
        beside = transl(*random.uniform(-0.5, 0.5, 2), 0.0) if random.random() < 0.5 else transl(0.4, 0, 0)
        slides = k > 1 and random.random() < 0.2
        links.append(
            Link(
                name=f"rod{k}",
                parent=links[random.integers(len(links))].name,
                joint=Prismatic(axis=(1, 0, 0)) if slides else Revolute(axis=(0, 1, 0)),
                before=beside,
                mass=random.uniform(0.5, 5.0),
                centre_of_mass=random.uniform(-0.4, 0.4, 3),
                inertia=random_inertia(random),
            )
        )
    joints = [link.name for link in links[1:] if isinstance(link.joint, Revolute)]
    dependent = joints[: len(joints) // 2]
    couplings = tuple(
        Coupling(
            name=f"coupling {name}",
            terms=(
                (name, 1.0),
                *((other, random.choice((1.0, -1.0, -1.0, 2.5))) for other in joints[len(joints) // 2 :][:2]),
            ),
            constant=random.choice((0.0, 0.3)),
        )
        for name in dependent
    )
    return Robot(
        name=f"linkage{seed}",
        links=tuple(links),
        base=random_transform(random),
        gravity=tuple(random.uniform(-10, 10, 3)),
        constraints=couplings,
    )


def with_ball_joints() -> Robot:
    kinds = (Spherical, Revolute, Prismatic, Revolute, Spherical, Revolute, Prismatic)
    tree = build_mixed_tree(8, kinds)
    a, b, *_ = (link.name for link in tree.moving_links if link.joint.nv == 1)
    return replace(tree, constraints=(Coupling(name="gear", terms=((a, 2.0), (b, -1.0))),))


ROBOTS = (
    *map(linkage, range(6)),
    with_ball_joints(),
    *(shipped_robot(name).nofriction(viscous=True) for name in PALLETISERS),
)


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_the_functions_are_those_of_the_tree_in_independent_coordinates(robot: Robot) -> None:
    tree, coordinates = robot.uncoupled, robot.coordinate_map
    P, S = coordinates.positions, coordinates.speeds
    for q, qd, qdd in random_states(robot, 2):
        of_tree = P @ q, S @ qd, S @ qdd
        torque = evaluate(robot, "rne", q, qd, qdd)
        expected = S.T @ evaluate(tree, "rne", *of_tree)
        close = 1e-13 * abs(evaluate(tree, "rne", *of_tree)).max()
        np.testing.assert_allclose(torque, expected, atol=close)
        inertia = S.T @ evaluate(tree, "inertia", of_tree[0]) @ S
        np.testing.assert_allclose(evaluate(robot, "inertia", q), inertia, atol=1e-13 * abs(inertia).max())
        energy = evaluate(tree, "kinetic_energy", *of_tree[:2])
        np.testing.assert_allclose(evaluate(robot, "kinetic_energy", q, qd), energy, rtol=1e-12)
        np.testing.assert_allclose(evaluate(robot, "accel", q, qd, torque), qdd, atol=1e-9 * abs(qdd).max())


def nonzero(tree: KinematicTree) -> int:
    """The number of parameters that are not 0."""
    parameters = [(body.inertia.mass, *body.inertia.first, *body.inertia.second) for body in tree.bodies]
    return int(np.count_nonzero(parameters))


@pytest.mark.parametrize("name", PALLETISERS)
def test_the_rods_of_a_palletiser_need_two_parameters(name: str) -> None:
    """The other effects of the five rods are those of the arm, whose parameters include them.

    The two parameters are first moments: the distances of the lever and of the rod from the main axes.
    """
    robot = shipped_robot(name)
    tree = base_parameter_tree(robot)
    arm = ("turret", "lower_arm", "upper_arm", "wrist", "flange")
    beside = [body.inertia for body in tree.bodies if body.link not in arm]
    assert [inertia.mass for inertia in beside] == [0.0] * 5
    assert [np.count_nonzero(inertia.second) for inertia in beside] == [0] * 5
    assert sum(np.count_nonzero(inertia.first) for inertia in beside) == 2
    assert nonzero(tree) == 11 < nonzero(regrouped(KinematicTree.of(robot)))
