"""The coordinates of all joints of the tree as functions of the independent coordinates q.

A coupling makes one joint depend linearly on others. The robot's q has the independent joints only:

    q_tree = positions q + offsets,    qd_tree = speeds qd,    tau = speeds' tau_tree.

:meth:`armblocks.robot.robot.Robot.uncoupled` has the offsets in its joints.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import RobotError
from armblocks.robot.constraints import Coupling
from armblocks.robot.link import Link

Array = NDArray[np.float64]
ROUNDING = 1e-9
"""Coefficients and constants below this fraction of the largest count as rounding errors."""


@dataclass(frozen=True, eq=False)
class CoordinateMap:
    """``positions`` (nq of the tree, nq), ``speeds`` (nv of the tree, nv).

    ``offsets``: the constant of each dependent joint, by name.
    """

    positions: Array
    offsets: Mapping[str, float]
    speeds: Array


def dependent_joints(couplings: Sequence[Coupling]) -> dict[str, Coupling]:
    """The joint that each coupling determines, by name: the joint of its first term."""
    return {coupling.terms[0][0]: coupling for coupling in couplings}


def coordinate_map(links: Sequence[Link], couplings: Sequence[Coupling], where: str) -> CoordinateMap:
    """The map for the moving ``links`` of a tree.

    Raises RobotError if a joint depends on two couplings or on itself.
    """
    dependent = dependent_joints(couplings)
    if len(dependent) < len(couplings):
        twice = next(c.terms[0][0] for c in couplings if dependent[c.terms[0][0]] is not c)
        raise RobotError(
            f"two couplings determine joint '{twice}'",
            where=where,
            allowed="each joint is the first term of one coupling at most",
            fix="put the joint first that depends on the others",
        )
    combinations = {link.name: _combination(link.name, dependent, (), where) for link in links}
    independent = [link for link in links if link.name not in dependent]
    nq, nv = sum(link.joint.nq for link in independent), sum(link.joint.nv for link in independent)
    columns: dict[str, tuple[int, int]] = {}
    position = speed = 0
    for link in independent:
        columns[link.name] = position, speed
        position, speed = position + link.joint.nq, speed + link.joint.nv
    positions, speeds = [np.zeros((0, nq))], [np.zeros((0, nv))]
    offsets: dict[str, float] = {}
    for link in links:
        factors, constant = combinations[link.name]
        if link.name in columns:
            column, speed = columns[link.name]
            positions.append(np.eye(nq)[column : column + link.joint.nq])
            speeds.append(np.eye(nv)[speed : speed + link.joint.nv])
        else:
            row, rate = np.zeros((1, nq)), np.zeros((1, nv))
            for name, factor in factors.items():
                row[0, columns[name][0]] = rate[0, columns[name][1]] = factor
            positions.append(row)
            speeds.append(rate)
            offsets[link.name] = constant
    return CoordinateMap(np.vstack(positions), offsets, np.vstack(speeds))


def remaining_coupling(
    links: Sequence[Link], couplings: Sequence[Coupling], added: Coupling
) -> Coupling | float | None:
    """The coupling that extends consistent ``couplings`` of ``links`` so that ``added`` is satisfied.

    The result is ``added``, with its first dependent joint chosen, or an equivalent coupling of independent
    coordinates if all its joints depend on others. None: ``added`` is redundant. A number: ``added``
    contradicts ``couplings``; the number is the value of its terms by ``couplings`` minus its constant.
    """
    terms = added.terms
    for k in range(len(terms)):
        candidate = replace(added, terms=(terms[k], *terms[:k], *terms[k + 1 :]))
        try:
            coordinate_map(links, [*couplings, candidate], "couplings")
        except RobotError:
            continue
        return candidate
    given = coordinate_map(links, couplings, "couplings")
    factors: dict[str, float] = {}
    excess = -added.constant
    dependent = dependent_joints(couplings)
    for joint, factor in terms:
        of_joint, _ = _combination(joint, dependent, (), "couplings")
        excess += factor * given.offsets.get(joint, 0.0)
        for name, value in of_joint.items():
            factors[name] = factors.get(name, 0.0) + factor * value
    size = sum(abs(factor) for _, factor in terms)
    left = tuple((name, value) for name, value in factors.items() if abs(value) > ROUNDING * size)
    if left:
        return replace(added, terms=left, constant=-excess)
    return None if abs(excess) <= ROUNDING * size * max(1.0, abs(added.constant)) else excess


def _combination(
    joint: str, dependent: Mapping[str, Coupling], path: tuple[str, ...], where: str
) -> tuple[dict[str, float], float]:
    """A coordinate as factors of independent joints and a constant."""
    if joint in path:
        raise RobotError(
            f"couplings make joint '{joint}' depend on itself: {' -> '.join((*path, joint))}",
            where=where,
            allowed="couplings whose first joints follow from joints that are not coupled",
            fix="put another joint first in one of these couplings",
        )
    if joint not in dependent:
        return {joint: 1.0}, 0.0
    (_, own), *others = dependent[joint].terms
    factors: dict[str, float] = {}
    constant = dependent[joint].constant / own
    for name, factor in others:
        inner, inner_constant = _combination(name, dependent, (*path, joint), where)
        constant -= factor / own * inner_constant
        for independent, value in inner.items():
            factors[independent] = factors.get(independent, 0.0) - factor / own * value
    return {name: value for name, value in factors.items() if value != 0.0}, constant
