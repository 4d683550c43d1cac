"""The columns of the two tables with one row for each link."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from armblocks.errors import RobotError
from armblocks.robot import JointLimits, Link, Motor, link_from_dh
from armblocks.robot.link import inertia_matrix
from armblocks.studio.robots.columns import Column, Quantity, Value, number_of

JOINT_WORDS = ("revolute", "prismatic")

# -- kinematics ---------------------------------------------------------------------------------------------

_NO_ROW = "the pose of this link is given by transforms in its file, not by a D-H row"
_FIXED = "this joint is fixed"


def _no_row_reason(link: Link) -> str:
    return "" if link.dh is not None else _NO_ROW


def _fixed_joint_reason(link: Link) -> str:
    return "" if link.joint.moves else _FIXED


def _several_coordinates_reason(link: Link) -> str:
    """Why a number that belongs to one coordinate cannot be edited in the table."""
    if link.joint.nv > 1:
        return f"a {type(link.joint).__name__.lower()} joint has several coordinates; edit its file"
    return _fixed_joint_reason(link)


def limits_of(link: Link) -> JointLimits:
    """The limits of the joint's coordinate; of a joint with several coordinates, none."""
    return link.joint.coordinate_limits[0] if link.joint.nv == 1 else JointLimits()


def variable_of(link: Link) -> str:
    """The D-H parameter that is the joint coordinate: ``"theta"`` or ``"d"``; ``""`` without a D-H row."""
    return "" if link.dh is None else "d" if link.dh.sigma else "theta"


def with_row(link: Link, limits: JointLimits | None = None, **changes: object) -> Link:
    """Return the link with changed D-H parameters; ``limits``: by default the limits of the link."""
    if link.dh is None:
        raise RobotError(
            _NO_ROW,
            where=f"link '{link.name}'",
            allowed="links with a D-H row",
            fix="edit its transforms instead",
        )
    row = replace(link.dh, **changes)  # pyright: ignore[reportArgumentType] - fields by name
    return link_from_dh(
        link.name,
        row,
        parent=link.parent,
        limits=limits_of(link) if limits is None else limits,
        mass=link.mass,
        centre_of_mass=link.centre_of_mass,
        inertia=link.inertia,
        motor=link.motor,
        geometry=link.geometry,
    )


def _dh_column(name: str, title: str, doc: str, quantity: Quantity, unit: str) -> Column[Link]:
    def locked(link: Link) -> str:
        if name == variable_of(link):
            return "this parameter is the joint coordinate; its constant part is the offset"
        return _no_row_reason(link)

    def read(link: Link) -> Value:
        return None if link.dh is None else float(getattr(link.dh, name))

    return Column(
        name=name,
        title=title,
        doc=doc,
        quantity=quantity,
        unit=unit,
        group="D-H row",
        read=read,
        write=lambda link, value: with_row(link, None, **{name: value}),
        locked=locked,
    )


def _with_joint_type(link: Link, value: Value) -> Link:
    sigma = JOINT_WORDS.index(str(value))
    if link.dh is not None and sigma == link.dh.sigma:
        return link
    # Range and speed limits change their unit between angle and length, so they are removed.
    return with_row(link, JointLimits(torque=None), sigma=sigma)


def _with_offset(link: Link, value: Value) -> Link:
    if link.dh is not None:
        return with_row(link, offset=value)
    return replace(link, joint=replace(link.joint, offset=number_of(value)))


def _with_limits(link: Link, **changes: object) -> Link:
    limits = replace(limits_of(link), **changes)  # pyright: ignore[reportArgumentType] - fields by name
    return replace(link, joint=replace(link.joint, limits=limits))


def _range_end(index: int, name: str, title: str, doc: str) -> Column[Link]:
    def read(link: Link) -> Value:
        position = limits_of(link).position
        return None if position is None else position[index]

    def write(link: Link, value: Value) -> Link:
        if value is None:
            return _with_limits(link, position=None)
        ends = list(limits_of(link).position or (-abs(number_of(value)), abs(number_of(value))))
        ends[index] = number_of(value)
        return _with_limits(link, position=tuple(ends))

    return Column(
        name=name,
        title=title,
        doc=doc,
        quantity=Quantity.COORDINATE,
        unit="rad, m",
        optional=True,
        group="Range",
        read=read,
        write=write,
        locked=_several_coordinates_reason,
    )


KINEMATICS: tuple[Column[Link], ...] = (
    Column(
        name="joint",
        title="joint",
        doc="revolute or prismatic; a change removes range and speed limits",
        quantity=Quantity.CHOICE,
        choices=JOINT_WORDS,
        read=lambda link: type(link.joint).__name__.lower(),
        write=_with_joint_type,
        locked=_no_row_reason,
    ),
    _dh_column("alpha", "α", "twist: angle about x between the two joint axes", Quantity.ANGLE, "rad"),
    _dh_column("a", "a", "length of the common normal of the two joint axes", Quantity.NUMBER, "m"),
    _dh_column("d", "d", "distance along the joint axis to the common normal", Quantity.NUMBER, "m"),
    _dh_column("theta", "θ", "angle about the joint axis", Quantity.ANGLE, "rad"),
    Column(
        name="offset",
        title="offset",
        doc="constant that is added to the joint coordinate in all kinematics",
        quantity=Quantity.COORDINATE,
        unit="rad, m",
        group="D-H row",
        read=lambda link: link.joint.offset,
        write=_with_offset,
        locked=_several_coordinates_reason,
    ),
    _range_end(0, "lowest", "from", "lowest joint coordinate; empty if unknown"),
    _range_end(1, "highest", "to", "highest joint coordinate; empty if unknown"),
    Column(
        name="speed",
        title="speed",
        doc="maximum joint speed; empty if unknown",
        quantity=Quantity.RATE,
        unit="rad/s, m/s",
        optional=True,
        group="Maximum",
        read=lambda link: limits_of(link).speed,
        write=lambda link, value: _with_limits(link, speed=value),
        locked=_several_coordinates_reason,
    ),
    Column(
        name="torque",
        title="torque",
        doc="maximum torque (force) at the joint, after the gear; empty if unknown",
        unit="N m",
        optional=True,
        group="Maximum",
        read=lambda link: limits_of(link).torque,
        write=lambda link, value: _with_limits(link, torque=value),
        locked=_several_coordinates_reason,
    ),
)


# -- dynamics -----------------------------------------------------------------------------------------------


def _centre(axis: int) -> Column[Link]:
    def write(link: Link, value: Value) -> Link:
        centre = list(link.centre_of_mass)
        centre[axis] = number_of(value)
        return replace(link, centre_of_mass=tuple(centre))

    return Column(
        name=f"r{'xyz'[axis]}",
        title="xyz"[axis],
        doc=f"{'xyz'[axis]} of the centre of mass in the link's frame",
        unit="m",
        group="Centre of mass r",
        read=lambda link: link.centre_of_mass[axis],
        write=write,
    )


INERTIA_INDICES: Mapping[str, tuple[int, int]] = {
    "Ixx": (0, 0),
    "Iyy": (1, 1),
    "Izz": (2, 2),
    "Ixy": (0, 1),
    "Iyz": (1, 2),
    "Ixz": (0, 2),
}
"""The six inertia entries in the toolbox's order, with their indices in the matrix."""


def _inertia(name: str, index: tuple[int, int]) -> Column[Link]:
    def write(link: Link, value: Value) -> Link:
        entries = [link.inertia[i][j] for i, j in INERTIA_INDICES.values()]
        entries[list(INERTIA_INDICES).index(name)] = number_of(value)
        return replace(link, inertia=inertia_matrix(entries, link=link.name))

    return Column(
        name=name,
        title=name[1:],
        doc=f"{name[1:]} of the inertia about the centre of mass, in the link's axes",
        unit="kg m²",
        group="Inertia I about the centre of mass",
        read=lambda link: link.inertia[index[0]][index[1]],
        write=write,
    )


def _motor(name: str, title: str, doc: str, unit: str, index: int | None = None) -> Column[Link]:
    """A column for a number of the motor; a typed number adds a motor to a link without one."""

    def read(link: Link) -> Value:
        if link.motor is None:
            return None
        value = getattr(link.motor, name)
        return float(value if index is None else value[index])

    def write(link: Link, value: Value) -> Link:
        if value is None:
            return replace(link, motor=None)
        motor = link.motor or Motor()
        if index is None:
            return replace(link, motor=replace(motor, **{name: number_of(value)}))  # pyright: ignore
        pair = list(motor.coulomb_friction)
        pair[index] = number_of(value)
        return replace(link, motor=replace(motor, coulomb_friction=(pair[0], pair[1])))

    return Column(
        name=title,
        title=title,
        doc=f"{doc}; empty: the joint has no motor",
        unit=unit,
        optional=True,
        group="Motor, before the gear",
        read=read,
        write=write,
        locked=_fixed_joint_reason,
    )


DYNAMICS: tuple[Column[Link], ...] = (
    Column(
        name="mass",
        title="m",
        doc="mass of the link",
        unit="kg",
        read=lambda link: link.mass,
        write=lambda link, value: replace(link, mass=number_of(value)),
    ),
    *(_centre(axis) for axis in range(3)),
    *(_inertia(name, index) for name, index in INERTIA_INDICES.items()),
    _motor("inertia", "Jm", "inertia of the rotor", "kg m²"),
    _motor("gear_ratio", "G", "motor turns per joint turn; negative if the directions are opposite", ""),
    _motor("viscous_friction", "B", "viscous friction", "N m s/rad"),
    _motor("coulomb_friction", "Tc+", "Coulomb friction of forward motion", "N m", 0),
    _motor("coulomb_friction", "Tc-", "Coulomb friction of backward motion, not above zero", "N m", 1),
)

LINK_COLUMNS: Mapping[str, Column[Link]] = {column.name: column for column in (*KINEMATICS, *DYNAMICS)}
