"""The description of a robot: links by name, base, tool, gravity."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import UnknownNameError
from armblocks.lazy_exports import display_method
from armblocks.robot.checks import check_robot
from armblocks.robot.configurations import Configurations, configurations_of, of_tree
from armblocks.robot.constraint_checks import check_constraints
from armblocks.robot.constraints import Closure, Constraint, Coupling, PrescribedMotion
from armblocks.robot.coordinate_map import CoordinateMap, coordinate_map, dependent_joints
from armblocks.robot.coupled_limits import DependentJoint, dependent_joints_of, limits_with_couplings
from armblocks.robot.fields import pose
from armblocks.robot.friction_model import FrictionModel
from armblocks.robot.joints import Coordinate, Joint, JointLimits
from armblocks.robot.link import Link, Motor
from armblocks.robot.named_frame import NamedFrame, check_frames
from armblocks.robot.springs import Spring, check_springs
from armblocks.spatial import Transform, Vector3, vector3

STANDARD_GRAVITY: Vector3 = (0.0, 0.0, -9.81)


@dataclass(frozen=True, kw_only=True)
class Robot(metaclass=ArgumentErrors):
    """Links that form a chain or a tree on one base.

    The joint coordinates q (nq,) and speeds qd (nv,) are in the order of the moving links. A joint has the
    name of its link.

    - ``base``: pose of the base frame in the world. ``tool``: pose of the tool in the frame of the tip, which
      is the last link. Both accept a (4, 4) matrix.
    - ``gravity``: m/s2 in the world frame, the acceleration of a falling body (toolbox files have the
      opposite sign).
    - ``friction_model``: see :class:`FrictionModel`.
    - ``constraints``: equations in addition to the joints of the tree, such as the closures of loops and the
      couplings of joints.
    - ``frames``: named frames on the links, such as end effectors; each link's own frame has the name of the
      link.
    - ``springs``: at joints and between two points.
    - ``configurations``: named coordinates, rad or m; also a mapping such as ``{"ready": (0.0, 1.5)}``. In a
      copy with other links (``dataclasses.replace``), each joint keeps its coordinates by name.

    Robots are values: two robots are equal and have the same hash if all their numbers and names are equal.
    ``source`` (the origin of the numbers) is not compared.

    Raises RobotError that names robot, link and field:

    - for no or too many links, names that occur twice, unknown or circular parents,
    - for numbers that are not finite, axes of length zero, reversed limits, a gear ratio of zero, a negative
      mass,
    - for a D-H row that disagrees with the transforms, and configurations of another length than q.

    Warns if friction accelerates a joint. Physically impossible inertias are accepted,
    because some published models have them; :func:`armblocks.robot.inertia_findings` lists them.
    """

    name: str
    links: tuple[Link, ...]
    manufacturer: str = ""
    comment: str = ""
    base: Transform = field(default_factory=Transform)
    tool: Transform = field(default_factory=Transform)
    gravity: Vector3 = STANDARD_GRAVITY
    friction_model: FrictionModel = FrictionModel.SQUARED_GEAR
    constraints: tuple[Constraint, ...] = ()
    frames: tuple[NamedFrame, ...] = ()
    springs: tuple[Spring, ...] = ()
    configurations: Configurations = field(default_factory=Configurations, repr=False)
    source: str = field(default="", compare=False)

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
        object.__setattr__(self, "constraints", tuple(self.constraints))
        check_constraints(self.name, self.links, self.constraints)
        object.__setattr__(self, "frames", tuple(self.frames))
        check_frames(self.name, self.links, self.frames)
        object.__setattr__(self, "springs", tuple(self.springs))
        check_springs(self.name, self.links, self.springs)
        if self.couplings:
            _ = self.coordinate_map  # raises RobotError for couplings that contradict each other
        joints = {link.name: link.joint for link in self.moving_links}
        named = configurations_of(self.configurations, joints, f"robot '{self.name}'")
        object.__setattr__(self, "configurations", named)

    _repr_html_ = display_method("armblocks.face.notebook_views", "robot_view")

    @cached_property
    def tree_links(self) -> tuple[Link, ...]:
        """The links whose joints move, including joints that couplings determine."""
        return tuple(link for link in self.links if link.joint.moves)

    @cached_property
    def moving_links(self) -> tuple[Link, ...]:
        """The links whose joints have a coordinate in q, in the order of q."""
        dependent = dependent_joints(self.couplings)
        return tuple(link for link in self.tree_links if link.name not in dependent)

    @cached_property
    def couplings(self) -> tuple[Coupling, ...]:
        """The constraints that make a joint depend on others. This joint is not an entry of q."""
        return tuple(entry for entry in self.constraints if isinstance(entry, Coupling))

    @cached_property
    def closures(self) -> tuple[Closure, ...]:
        """The constraints that close loops."""
        return tuple(entry for entry in self.constraints if isinstance(entry, Closure))

    @cached_property
    def prescribed_joints(self) -> tuple[str, ...]:
        """The joints whose motions are given, in the order of q."""
        names = {entry.joint for entry in self.constraints if isinstance(entry, PrescribedMotion)}
        return tuple(name for name in self.joint_names if name in names)

    @cached_property
    def uncoupled(self) -> Robot:
        """The robot without its couplings: q has all joints of the tree.

        The constants of the couplings are in the offsets of the dependent joints.
        """
        if not self.couplings:
            return self
        offsets = self.coordinate_map.offsets
        links = tuple(
            replace(link, joint=link.joint.with_offset(offsets[link.name]), dh=None)
            if link.name in offsets
            else link
            for link in self.links
        )
        springs = tuple(spring.with_offsets(offsets) for spring in self.springs)
        named = of_tree(self.configurations, self.coordinate_map)
        return replace(self, links=links, constraints=self.closures, springs=springs, configurations=named)

    @cached_property
    def coordinate_map(self) -> CoordinateMap:
        """The coordinates of ``uncoupled`` as functions of the coordinates of this robot."""
        return coordinate_map(self.tree_links, self.couplings, f"robot '{self.name}'")

    @property
    def n(self) -> int:
        """Number of degrees of freedom: ``nv``, the length of qd, qdd and tau."""
        return self.nv

    @cached_property
    def nq(self) -> int:
        """Number of joint coordinates: the length of q. A ball joint has four coordinates and three
        speeds."""
        return sum(joint.nq for joint in self.joints)

    @cached_property
    def nv(self) -> int:
        """Number of joint speeds: the length of qd, qdd and tau."""
        return sum(joint.nv for joint in self.joints)

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The joints that move, in the order of q."""
        return tuple(link.joint for link in self.moving_links)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in the order of q; a joint has the name of the link that it carries."""
        return tuple(link.name for link in self.moving_links)

    @property
    def joint_letters(self) -> str:
        """The letters of the joint types in the order of q, as in ``RRRRRR``."""
        return "".join(joint.letter for joint in self.joints)

    @cached_property
    def positions(self) -> tuple[Coordinate, ...]:
        """The entries of q: ``arm`` for the only coordinate of joint arm, ``ball.qw`` for one of several."""
        return tuple(_of_link(link, entry) for link in self.moving_links for entry in link.joint.positions)

    @cached_property
    def speeds(self) -> tuple[Coordinate, ...]:
        """The entries of qd, qdd and tau with the names of their joints and the units of their integrals."""
        return tuple(_of_link(link, entry) for link in self.moving_links for entry in link.joint.speeds)

    @cached_property
    def position_of_speed(self) -> tuple[int | None, ...]:
        """For each entry of qd the index in q of the coordinate whose rate it is; None for ball joints."""
        indices: list[int | None] = []
        position = 0
        for joint in self.joints:
            for motion in joint.motions:
                is_rate = motion.speeds == motion.positions
                indices += [position + k if is_rate else None for k in range(len(motion.speeds))]
                position += len(motion.positions)
        return tuple(indices)

    @cached_property
    def limits(self) -> tuple[JointLimits, ...]:
        """The limits of each entry of qd, including the limits of joints that depend on this entry alone.

        Limits of joints that depend on several entries are not included; a finding of
        :func:`armblocks.robot.plausibility_findings` names these joints. A torque limit is the limit of the
        entry's own joint. If this joint has neither motor nor torque limit, and only one dependent joint has
        a motor, it is the limit of this motor, converted to the entry of qd.
        """
        own = tuple(limits for joint in self.joints for limits in joint.coordinate_limits)
        return limits_with_couplings(own, self.motors, self.coupled_joints) if self.couplings else own

    @property
    def coupled_joints(self) -> tuple[DependentJoint, ...]:
        """The joints that couplings determine, as functions of the coordinates."""
        return tuple(dependent_joints_of(self.tree_links, self.coordinate_map)) if self.couplings else ()

    @property
    def motors(self) -> tuple[Motor | None, ...]:
        """The motor of each entry of qd, at its own joint; motors of dependent joints are not included."""
        return tuple(link.motor for link in self.moving_links for _ in link.joint.speeds)

    @property
    def neutral(self) -> NDArray[np.float64]:
        """The coordinates without joint motion, a new (nq,) array: 0, and 1 0 0 0 for quaternions.

        Offsets are added to them, as to all coordinates.
        """
        return np.array([value for joint in self.joints for value in joint.neutral])

    @property
    def qlim(self) -> NDArray[np.float64]:
        """Lowest and highest coordinates, a new (nq, 2) array, rad or m; infinite without a limit.

        The limits of coupled joints that depend on one coordinate are included; see :attr:`limits`.
        """
        rows: list[tuple[float, float]] = []
        limits = iter(self.limits)
        for joint in self.joints:
            for motion in joint.motions:
                positions = [next(limits).position for _ in motion.speeds]
                # A quaternion has more coordinates than speeds, and no limits.
                positions += [None] * (len(motion.positions) - len(positions))
                rows += [(-np.inf, np.inf) if entry is None else entry for entry in positions]
        return np.array(rows).reshape(-1, 2)

    @property
    def speed_limits(self) -> NDArray[np.float64]:
        """Maximum joint speeds, a new (nv,) array, rad/s or m/s; infinite if unknown; see :attr:`limits`."""
        return _or_infinite([limits.speed for limits in self.limits])

    @property
    def torque_limits(self) -> NDArray[np.float64]:
        """Maximum joint torques, a new (nv,) array, N m or N; infinite if unknown; see :attr:`limits`."""
        return _or_infinite([limits.torque for limits in self.limits])

    @property
    def gear_ratios(self) -> NDArray[np.float64]:
        """G of each entry of qd, a new (nv,) array; 1 without a motor at its own joint."""
        return np.array([motor.gear_ratio if motor else 1.0 for motor in self.motors])

    def link(self, name: str) -> Link:
        """The link of this name. Raises UnknownNameError for an unknown name."""
        for link in self.links:
            if link.name == name:
                return link
        raise UnknownNameError("link", name, [link.name for link in self.links], where=f"robot '{self.name}'")

    @property
    def frame_names(self) -> tuple[str, ...]:
        """The names that :meth:`frame` accepts: the named frames, then the links."""
        return (*(frame.name for frame in self.frames), *(link.name for link in self.links))

    def frame(self, name: str) -> NamedFrame:
        """The frame of this name; the frame of a link has its name. Raises UnknownNameError."""
        for frame in self.frames:
            if frame.name == name:
                return frame
        if name in self.frame_names:
            return NamedFrame(name=name, link=name)
        raise UnknownNameError("frame", name, self.frame_names, where=f"robot '{self.name}'")

    def with_link(self, name: str, **changes: object) -> Robot:
        """A copy with changed fields of the named link, given by name as for ``dataclasses.replace``."""
        changed = replace(self.link(name), **changes)  # pyright: ignore[reportArgumentType] - fields by name
        return replace(self, links=tuple(changed if link.name == name else link for link in self.links))

    def with_configuration(self, name: str, q: ArrayLike) -> Robot:
        """A copy with the named configuration ``q`` (nq,), rad or m, which replaces one of this name."""
        return replace(self, configurations=self.configurations.with_entry(name, q))

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


def _of_link(link: Link, coordinate: Coordinate) -> Coordinate:
    name = f"{link.name}.{coordinate.name}" if coordinate.name else link.name
    return coordinate._replace(name=name)


def _or_infinite(values: list[float | None]) -> NDArray[np.float64]:
    return np.array([np.inf if value is None else value for value in values])
