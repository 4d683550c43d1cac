"""Worked examples of the blocks of mechanics: a body at the joint, or a pendulum that contains the block."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from armblocks.diagram import ExampleBlock, WorkedExample, driver

Vector = tuple[float, float, float]
DOWN: Vector = (0.0, 0.0, -9.80665)
ALONG_Y: Vector = (0.0, -9.80665, 0.0)


def joint_example(
    shows: str,
    *,
    gravity: Vector = DOWN,
    offset: Vector = (0.0, 0.0, 0.0),
    stop_time: float = 5.0,
    **parameters: Any,
) -> WorkedExample:
    """A brick with its centre at ``offset`` from the follower of the joint; the scope shows q."""
    return WorkedExample(
        shows=shows,
        parameters={"sense_position": True, **parameters},
        extra_blocks=(
            driver("WorldFrame").named("world"),
            driver("MechanismConfiguration", gravity=gravity).named("gravity"),
            driver("RigidTransform", translation=offset).named("offset"),
            driver("BrickSolid", dimensions=(0.1, 0.3, 0.2), mass_from="mass", mass=2.0).named("brick"),
        ),
        lines=(("world/W", "gravity/C"), ("world/W", "B"), ("F", "offset/B"), ("offset/F", "brick/R")),
        stop_time=stop_time,
    )


def pendulum_example(
    shows: str,
    lines: Sequence[tuple[str, str]],
    *,
    more: Sequence[ExampleBlock] = (),
    world: bool = True,
    body: bool = True,
    **parameters: Any,
) -> WorkedExample:
    """A pendulum that contains the block: world, gravity, hinge, rod and brick; the scope shows its angle.

    ``lines`` connect the block; ``world`` and ``body``: whether the pendulum has its own.
    """
    blocks = [
        *([driver("WorldFrame").named("world")] if world else []),
        driver("RevoluteJoint", sense_position=True, position_target=1.0).named("hinge"),
        driver("RigidTransform", translation=(0.0, -0.5, 0.0)).named("rod"),
        *(
            [driver("BrickSolid", mass_from="mass", dimensions=(0.1, 0.1, 0.1)).named("brick")]
            if body
            else []
        ),
        *more,
    ]
    return WorkedExample(
        shows=shows,
        parameters=parameters,
        extra_blocks=tuple(blocks),
        shown=("hinge/q",),
        lines=(
            *((("world/W", "hinge/B"),) if world else ()),
            ("hinge/F", "rod/B"),
            *((("rod/F", "brick/R"),) if body else ()),
            *lines,
        ),
        stop_time=5.0,
    )


def gravity_block() -> ExampleBlock:
    """A Mechanism Configuration with gravity along -y."""
    return driver("MechanismConfiguration", gravity=ALONG_Y).named("gravity")
