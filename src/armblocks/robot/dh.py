"""Links from Denavit-Hartenberg numbers, standard and modified."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from numpy.typing import ArrayLike

from armblocks.argument_errors import with_argument_errors
from armblocks.robot.dh_row import DhConvention, DhRow
from armblocks.robot.joints import JointLimits
from armblocks.robot.link import ZERO3, Link, Motor, inertia_matrix
from armblocks.robot.shapes import Shape
from armblocks.spatial import vector3

__all__ = ["DhConvention", "DhRow", "link_from_dh", "modified_dh", "serial_chain", "standard_dh"]


def link_from_dh(
    name: str,
    dh: DhRow,
    *,
    parent: str | None = None,
    limits: JointLimits | None = None,
    mass: float = 0.0,
    centre_of_mass: ArrayLike = (0.0, 0.0, 0.0),
    inertia: ArrayLike = ZERO3,
    motor: Motor | None = None,
    geometry: tuple[Shape, ...] | None = None,
) -> Link:
    """The link that a row describes; see :class:`DhRow` and :class:`armblocks.robot.Link` for the numbers."""
    return Link(
        name=name,
        parent=parent,
        joint=dh.joint(limits),
        before=dh.before,
        after=dh.after,
        dh=dh,
        mass=mass,
        centre_of_mass=vector3(centre_of_mass, where=f"centre_of_mass of link '{name}'"),
        inertia=inertia_matrix(inertia, link=name),
        motor=motor,
        geometry=geometry,
    )


def standard_dh(
    name: str,
    *,
    alpha: float = 0.0,
    a: float = 0.0,
    d: float = 0.0,
    theta: float = 0.0,
    sigma: int = 0,
    offset: float = 0.0,
    parent: str | None = None,
    limits: JointLimits | None = None,
    mass: float = 0.0,
    centre_of_mass: ArrayLike = (0.0, 0.0, 0.0),
    inertia: ArrayLike = ZERO3,
    motor: Motor | None = None,
    geometry: tuple[Shape, ...] | None = None,
) -> Link:
    """A link by standard D-H: ``T = Rz(theta) Tz(d) Tx(a) Rx(alpha)``, angles rad, lengths m.

    Mass properties are in the frame at the link's distal end (kg, m, kg m2).
    """
    dh = DhRow(alpha=alpha, a=a, d=d, theta=theta, sigma=sigma, offset=offset)
    return link_from_dh(
        name,
        dh,
        parent=parent,
        limits=limits,
        mass=mass,
        centre_of_mass=centre_of_mass,
        inertia=inertia,
        motor=motor,
        geometry=geometry,
    )


def modified_dh(
    name: str,
    *,
    alpha: float = 0.0,
    a: float = 0.0,
    d: float = 0.0,
    theta: float = 0.0,
    sigma: int = 0,
    offset: float = 0.0,
    parent: str | None = None,
    limits: JointLimits | None = None,
    mass: float = 0.0,
    centre_of_mass: ArrayLike = (0.0, 0.0, 0.0),
    inertia: ArrayLike = ZERO3,
    motor: Motor | None = None,
    geometry: tuple[Shape, ...] | None = None,
) -> Link:
    """A link by modified D-H: ``T = Rx(alpha) Tx(a) Rz(theta) Tz(d)``, angles rad, lengths m.

    Mass properties are in the frame on the link's joint axis (kg, m, kg m2).
    """
    dh = DhRow(
        alpha=alpha, a=a, d=d, theta=theta, sigma=sigma, offset=offset, convention=DhConvention.MODIFIED
    )
    return link_from_dh(
        name,
        dh,
        parent=parent,
        limits=limits,
        mass=mass,
        centre_of_mass=centre_of_mass,
        inertia=inertia,
        motor=motor,
        geometry=geometry,
    )


@with_argument_errors
def serial_chain(links: Sequence[Link]) -> tuple[Link, ...]:
    """The links as a chain: the parent of each link is the previous link, or the base for the first link."""
    parents = (None, *(link.name for link in links))
    return tuple(replace(link, parent=parent) for link, parent in zip(links, parents))
