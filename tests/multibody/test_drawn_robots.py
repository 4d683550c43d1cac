"""The mechanisms of incomplete diagrams as robots, for the 3-D view of the studio."""

from __future__ import annotations

import dataclasses

import numpy as np

import armblocks as ab
from armblocks.blocks import RevoluteJoint
from armblocks.multibody.drawn_robots import drawn_robots


def test_a_mechanism_is_available_with_open_inputs_and_without_commented_bodies() -> None:
    diagram = ab.block_example("RevoluteJoint")
    joint = RevoluteJoint(position_target=0.7, actuation="torque", sense_position=True)
    driven = dataclasses.replace(diagram, blocks={**diagram.blocks, "revolute joint": joint})
    ((world, (robot, start)),) = drawn_robots(driven).items()
    assert world == "world"
    assert [len(link.geometry or ()) for link in robot.links] == [1]
    np.testing.assert_allclose(start, [0.7])
    bare = dataclasses.replace(driven, commented={"brick": "out"})
    ((robot, _),) = drawn_robots(bare).values()
    assert not any(link.geometry for link in robot.links)
    alone = dataclasses.replace(driven, frame_lines=())
    assert not drawn_robots(alone)
