"""Functions for the writers of URDF, SDF and MJCF: names, joint friction, warnings of omitted data."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Sequence
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

from armblocks.errors import FormatError, counted, shortened_list, warn
from armblocks.robot import Closure, Coupling, Joint, JointLimits, Link, PrescribedMotion, Robot, with_tip
from armblocks.robot.shapes import Shape
from armblocks.spatial import Transform

_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


class JointFriction(NamedTuple):
    """Friction at the joint, ``tau = damping qd + friction sign(qd)``."""

    damping: float = 0.0
    friction: float = 0.0


def check_joint(robot: Robot, link: Link, kinds: Collection[type[Joint]], format: str) -> None:
    """Raise ``FormatError`` for a joint of a type that the format does not have; warn of omitted limits."""
    if type(link.joint) not in kinds:
        raise FormatError(
            f"the joint of link '{link.name}' is a {type(link.joint).__name__}, which {format} does not have",
            where=f"robot '{robot.name}'",
            allowed=", ".join(kind.__name__ for kind in kinds),
            fix="save the robot as .json",
        )
    if link.joint.nv > 1 and link.joint.limits != JointLimits():
        kind = type(link.joint).__name__.lower()
        what = f"the limits of its {kind} joint are not part of the {format} file"
        warn_of_loss(f"robot '{robot.name}', link '{link.name}'", what)


class Mimic(NamedTuple):
    """The joint of another link that a joint follows: ``q = multiplier q_leader + offset``."""

    leader: str
    multiplier: float
    offset: float


def mimics_of(robot: Robot, format: str, closures: Collection[type[Closure]] = ()) -> dict[str, Mimic]:
    """The joints that depend on another joint, by the name of their link; a warning for prescribed motions.

    Raises ``FormatError`` for closures of other types than ``closures``, and for couplings of one joint or of
    three or more.
    """
    mimics: dict[str, Mimic] = {}
    for constraint in robot.constraints:
        if type(constraint) in closures:
            continue
        if isinstance(constraint, PrescribedMotion):
            what = f"the prescribed motion of joint '{constraint.joint}' is not part of the {format} file"
            warn_of_loss(f"robot '{robot.name}', constraint '{constraint.name}'", what)
            continue
        if not (isinstance(constraint, Coupling) and len(constraint.terms) == 2):
            kind = "coupling" if isinstance(constraint, Coupling) else f"{constraint.title} closure"
            types = ", ".join(closure.title for closure in closures)
            raise FormatError(
                f"constraint '{constraint.name}', a {kind}, is not part of {format} files here",
                where=f"robot '{robot.name}'",
                allowed="joints that follow one other joint" + (f", closures: {types}" if types else ""),
                fix="save the robot as .json",
            )
        (follower, own), (leader, factor) = constraint.terms
        mimics[follower] = Mimic(leader, -factor / own, constraint.constant / own)
    return mimics


def limits_of(link: Link) -> JointLimits:
    """The limits of the coordinate of a joint; of a joint with several coordinates, none."""
    return link.joint.coordinate_limits[0] if link.joint.nv == 1 else JointLimits()


def joint_friction(robot: Robot, link: Link, format: str) -> JointFriction:
    """The friction of the link's motor at the joint, with warnings of properties that the format lacks."""
    if link.motor is None:
        return JointFriction()
    viscous, coulomb = robot.friction_model.factors(link.motor.gear_ratio)
    plus, minus = (coulomb * torque for torque in link.motor.coulomb_friction)
    damping, friction = viscous * link.motor.viscous_friction, (plus - minus) / 2
    place = f"robot '{robot.name}', link '{link.name}'"
    if not math.isclose(plus, -minus, rel_tol=1e-12, abs_tol=0.0):
        warn_of_loss(
            place, f"Coulomb friction {plus:g}, {minus:g} depends on the direction; the mean is written"
        )
    if damping < 0 or friction < 0:
        warn_of_loss(place, f"friction that accelerates the joint is not part of {format} files")
        damping, friction = max(damping, 0.0), max(friction, 0.0)
    return JointFriction(damping, friction)


def inertial_in(link: Link, frame: Transform) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
    """The centre of mass and the inertia xx yy zz xy yz xz of a link in a frame, ``frame`` its pose there.

    ``None`` for a link without mass and inertia.
    """
    if not link.mass and not any(map(any, link.inertia)):
        return None
    R = frame.R
    moment = link.I if frame.rotation == Transform().rotation else R @ link.I @ R.T
    places = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
    return frame.apply(link.centre_of_mass), tuple(float(moment[place]) for place in places)


def warn_of_shapes(robot: Robot, kinds: Sequence[type[Shape]], format: str) -> None:
    """Warn of shapes that the file does not contain: shapes of other kinds, and bevelled edges."""
    others = [shape for link in robot.links for shape in link.geometry or () if type(shape) not in kinds]
    if others:
        names = ", ".join(sorted({type(shape).__name__ for shape in others}))
        count = counted(len(others), "shape is", "shapes are")
        warn_of_loss(f"robot '{robot.name}'", f"{count} not part of the {format} file: {names}")


def warn_of_order(robot: Robot, tip: str, copy: Robot, format: str) -> None:
    """Warn if the robot that the file gives has another tip, or its coordinates in another order.

    The formats have no element for either; the readers choose the end of the chain with the most joints.
    """
    where = f"robot '{robot.name}'"
    if copy.links[-1].name != tip:
        warn_of_loss(where, f"the tip is not part of the {format} file; load the file with tip={tip!r}")
        copy = with_tip(copy, tip)
    if copy.joint_names != robot.joint_names and sorted(copy.joint_names) == sorted(robot.joint_names):
        order = ", ".join(copy.joint_names)
        warn_of_loss(where, f"the coordinates of the file are in another order: {order}")


def file_names(robot: Robot, is_reserved: Callable[[str], bool], format: str) -> dict[str | None, str]:
    """The names of the links in the file; a warning names links whose names the format reserves."""
    used = {link.name for link in robot.links}
    names: dict[str | None, str] = {}
    for link in robot.links:
        names[link.name] = _allowed_name(
            robot, f"link '{link.name[:60]}'", link.name, is_reserved, format, used
        )
    return names


def frame_names(
    robot: Robot, is_reserved: Callable[[str], bool], format: str, used: set[str]
) -> dict[str, str]:
    """Reserve and return the names of the named frames in the file; a warning lists frames whose names the
    format reserves. Names that a writer adds come after them, so that no frame loses its name."""
    used |= {frame.name for frame in robot.frames}
    return {
        frame.name: _allowed_name(robot, f"frame '{frame.name[:60]}'", frame.name, is_reserved, format, used)
        for frame in robot.frames
    }


def _allowed_name(
    robot: Robot, subject: str, name: str, is_reserved: Callable[[str], bool], format: str, used: set[str]
) -> str:
    """The name, or a similar one with a warning if the format reserves it."""
    if not is_reserved(name):
        return name
    new = free_name(name.strip()[:100].replace("::", "_").strip("_") + "_", used)
    warn_of_loss(f"robot '{robot.name}'", f"the name of {subject} becomes '{new[:60]}', as {format} requires")
    return new


def free_name(name: str, used: set[str]) -> str:
    """A name that is not used, from now on used."""
    while name in used:
        name += "_"
    used.add(name)
    return name


def numbers(values: Sequence[float]) -> str:
    """Numbers with all digits, separated by spaces."""
    return " ".join(repr(float(value) + 0.0) for value in values)


def quoted(name: str, robot: Robot) -> str:
    """A name as an XML attribute, with its quotes. Raises ``FormatError`` for control characters."""
    if _NOT_XML.search(name):
        raise FormatError(
            f"the name {name!r} has characters that XML cannot contain",
            where=f"robot '{robot.name}'",
            allowed="printable characters",
            fix="rename the link",
        )
    return quoteattr(name)


def warn_of_configurations(robot: Robot, format: str) -> None:
    """Warn that a format has no element for named configurations."""
    if robot.configurations:
        count = counted(len(robot.configurations), "named configuration is", "named configurations are")
        names = shortened_list(list(robot.configurations))
        warn_of_loss(f"robot '{robot.name}'", f"{count} not part of the {format} file: {names}")


def warn_of_loss(where: str, what: str) -> None:
    """Warn of data that the file does not contain."""
    warn(f"{where}: {what}.")
