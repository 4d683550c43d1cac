"""The description of a robot: links by name, base, tool, gravity."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import UnknownNameError, check_arguments
from armblocks.lazy_exports import display_method
from armblocks.robot.checks import check_robot
from armblocks.robot.fields import pose
from armblocks.robot.friction_model import FrictionModel
from armblocks.robot.joints import Joint
from armblocks.robot.link import Link, Motor
from armblocks.spatial import Transform, Vector3, vector3

STANDARD_GRAVITY: Vector3 = (0.0, 0.0, -9.81)


@dataclass(frozen=True, kw_only=True)
class Robot:
    """Links that form a chain or a tree on one base.

    ``base`` pose of the base frame in the world; ``tool`` pose of the tool in the frame of the tip, which is
    the last link; both accept a (4, 4) matrix. ``gravity`` m/s2 in the world frame, the acceleration
    of a falling body (toolbox files have the opposite sign); ``friction_model`` see :class:`FrictionModel`.
    The joint coordinates q are in the order of the moving links. A joint has the name of its link.

    Robots are values: two robots are equal and have the same hash if all their numbers and names are equal.
    ``source`` (the origin of the numbers) is not compared.

    Raises RobotError that names robot, link and field for no or too many links, names that occur twice,
    unknown or circular parents, numbers that are not finite, zero axes, reversed limits, a gear ratio of
    zero, a negative mass, a D-H row that disagrees with the transforms. Warns if friction accelerates a
    joint. Physically impossible inertias are accepted, because some published models have them;
    :func:`armblocks.robot.inertia_findings` lists them.
    """

    name: str
    links: tuple[Link, ...]
    manufacturer: str = ""
    comment: str = ""
    base: Transform = field(default_factory=Transform)
    tool: Transform = field(default_factory=Transform)
    gravity: Vector3 = STANDARD_GRAVITY
    friction_model: FrictionModel = FrictionModel.SQUARED_GEAR
    source: str = field(default="", compare=False)

    def __new__(cls, *values: object, **named: object) -> Self:
        check_arguments(cls, values, named)
        return super().__new__(cls)

    def __post_init__(self) -> None:
        object.__setattr__(self, "links", tuple(self.links))
        for frame in ("base", "tool"):
            field_name = f"{frame} of robot '{self.name}'"
            object.__setattr__(self, frame, pose(getattr(self, frame), where=field_name))
        object.__setattr__(self, "gravity", vector3(self.gravity, where=f"gravity of robot '{self.name}'"))
        check_robot(
            self.name,
            self.links,
            {"base": self.base, "tool": self.tool},
            self.gravity,
        )

    _repr_html_ = display_method("armblocks.face.notebook_views", "robot_view")

    @cached_property
    def moving_links(self) -> tuple[Link, ...]:
        """The links whose joints have a coordinate, in the order of q."""
        return tuple(link for link in self.links if link.joint.moves)

    @property
    def n(self) -> int:
        """Number of joint coordinates."""
        return len(self.moving_links)

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The joints that move, in the order of q."""
        return tuple(link.joint for link in self.moving_links)

    @property
    def motors(self) -> tuple[Motor | None, ...]:
        """The motors of the joints that move, in the order of q."""
        return tuple(link.motor for link in self.moving_links)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in the order of q: those of the links that they carry."""
        return tuple(link.name for link in self.moving_links)

    @property
    def joint_units(self) -> tuple[str, ...]:
        """SI unit of each joint coordinate: rad or m."""
        return tuple(joint.unit for joint in self.joints)

    @property
    def joint_letters(self) -> str:
        """The letters R (revolute) and P (prismatic) in the order of q, as in ``RRRRRR``."""
        return "".join(joint.letter for joint in self.joints)

    @property
    def qlim(self) -> NDArray[np.float64]:
        """Lowest and highest joint coordinates, a new (n, 2) array, rad or m; infinite without a limit."""
        unlimited = (-np.inf, np.inf)
        return np.array([joint.limits.position or unlimited for joint in self.joints]).reshape(-1, 2)

    @property
    def speed_limits(self) -> NDArray[np.float64]:
        """Maximum joint speeds, a new (n,) array, rad/s or m/s; infinite without a limit."""
        return _or_infinite([joint.limits.speed for joint in self.joints])

    @property
    def torque_limits(self) -> NDArray[np.float64]:
        """Maximum joint torques, a new (n,) array, N m or N; infinite without a limit."""
        return _or_infinite([joint.limits.torque for joint in self.joints])

    @property
    def gear_ratios(self) -> NDArray[np.float64]:
        """G of each joint, a new (n,) array; 1 without a motor."""
        return np.array([motor.gear_ratio if motor else 1.0 for motor in self.motors])

    def link(self, name: str) -> Link:
        """The link of this name. Raises UnknownNameError for an unknown name."""
        for link in self.links:
            if link.name == name:
                return link
        raise UnknownNameError("link", name, [link.name for link in self.links], where=f"robot '{self.name}'")

    def with_link(self, name: str, **changes: object) -> Robot:
        """A copy with changed fields of the named link, given by name as for ``dataclasses.replace``."""
        changed = replace(self.link(name), **changes)  # pyright: ignore[reportArgumentType] - fields by name
        return replace(self, links=tuple(changed if link.name == name else link for link in self.links))

    def with_friction_model(self, model: FrictionModel) -> Robot:
        """A copy with another friction formula."""
        return replace(self, friction_model=model)

    def nofriction(self, *, coulomb: bool = True, viscous: bool = True) -> Robot:
        """A copy without Coulomb friction, viscous friction, or both; motor inertia is unchanged."""

        def without_friction(motor: Motor) -> Motor:
            return replace(
                motor,
                coulomb_friction=(0.0, 0.0) if coulomb else motor.coulomb_friction,
                viscous_friction=0.0 if viscous else motor.viscous_friction,
            )

        return replace(
            self,
            links=tuple(
                link if link.motor is None else replace(link, motor=without_friction(link.motor))
                for link in self.links
            ),
        )


def _or_infinite(values: list[float | None]) -> NDArray[np.float64]:
    return np.array([np.inf if value is None else value for value in values])
