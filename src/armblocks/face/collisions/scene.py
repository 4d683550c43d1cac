"""All pairs of bodies of a scene, and their distances at poses of the links."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import UnknownNameError
from armblocks.face.arm import Arm
from armblocks.face.collisions.bodies import Body, link_bodies, obstacle_body
from armblocks.face.collisions.obstacles import Obstacle, Plane
from armblocks.robot import Robot
from armblocks.spatial.convex_distance import hull_distances

Array = NDArray[np.float64]

CHUNK = 20_000
"""Number of pairs of hulls whose distances are computed at once."""
TESTED, ALWAYS = 60, 0.95
"""Configurations within the joint limits, and the share of them in which a pair must touch to be excluded."""


class Pair(NamedTuple):
    """Two bodies: their names, their rows in the poses (None: the world), and their hulls."""

    names: tuple[str, str]
    rows: tuple[int, int | None]
    first: Body
    second: Body | Plane


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene:
    """All compared pairs, and the excluded ones as text."""

    arm: Arm
    bodies: Sequence[Body | None]
    pairs: Sequence[Pair]
    excluded: tuple[str, ...]

    @classmethod
    def of(
        cls, arm: Arm, obstacles: Mapping[str, Obstacle], ignore: Sequence[tuple[str, str]], where: str
    ) -> Scene:
        """The pairs of an arm and obstacles. Raises UnknownNameError for an unknown name in ``ignore``."""
        names = ["base", *(link.name for link in arm.robot.links), "tool"]
        known = [*names, *obstacles]
        for name in (name for pair in ignore for name in pair):
            if name not in known:
                raise UnknownNameError("body", str(name), known, where=f"ignore of {where}")
        bodies = link_bodies(arm.robot)
        groups, near = _groups(arm.robot)
        solid = [(row, body) for row, body in enumerate(bodies) if body is not None]
        pairs: list[Pair] = []
        for k, (i, first) in enumerate(solid):
            for j, second in solid[k + 1 :]:
                if groups[i] != groups[j] and frozenset((groups[i], groups[j])) not in near:
                    pairs.append(Pair((names[i], names[j]), (i, j), first, second))
        near_base = {group for both in near if 0 in both for group in both}
        for i, first in solid:
            for name, obstacle in obstacles.items():
                if groups[i]:
                    pairs.append(Pair((names[i], name), (i, None), first, obstacle_body(obstacle)))
        scene = cls(arm=arm, bodies=bodies, pairs=pairs, excluded=())
        # The first link may turn on the floor; other contacts with obstacles count.
        of_structure = [
            pair
            for pair in pairs
            if pair.rows[1] is not None
            or (isinstance(pair.second, Plane) and groups[pair.rows[0]] in near_base)
        ]
        always = scene.always_touching(of_structure)
        ignored = {frozenset(pair) for pair in ignore}
        excluded: list[str] = []
        kept: list[Pair] = []
        for pair in pairs:
            text = " and ".join(pair.names)
            if frozenset(pair.names) in ignored:
                excluded.append(f"{text}: ignored")
            elif pair.names in always:
                excluded.append(f"{text}: they touch in almost all configurations")
            else:
                kept.append(pair)
        return replace(scene, pairs=kept, excluded=tuple(excluded))

    def always_touching(self, pairs: Sequence[Pair]) -> set[tuple[str, str]]:
        """The names of the pairs that touch in almost all configurations within the limits."""
        random = np.random.default_rng(0)
        low, high = self.arm.robot.qlim.T
        low = np.where(np.isfinite(low), low, np.where(np.isfinite(high), high - 2.0 * math.pi, -math.pi))
        high = np.where(np.isfinite(high), high, low + 2.0 * math.pi)
        poses = self.arm.link_poses(random.uniform(low, high, (TESTED, self.arm.nq)))
        touching = ((pair.names, self.distances(pair, poses, 0.0) <= 0.0) for pair in pairs)
        return {names for names, flags in touching if flags.mean() >= ALWAYS}

    def distances(self, pair: Pair, poses: Array, margin: float) -> Array:
        """Distances (N,) for poses (N, L+2, 4, 4), m.

        Where the bodies are farther apart than ``margin`` and not at their minimum distance, the values are
        lower bounds. They may be negative where the bodies touch.
        """
        first = poses[:, pair.rows[0]]
        if isinstance(pair.second, Plane):
            normal = np.array(pair.second.normal)
            directions = np.einsum("nij,i->nj", first[:, :3, :3], normal)
            heights = np.einsum("nj,hkj->nhk", directions, pair.first.points).min(axis=2) - pair.first.radii
            offset = first[:, :3, 3] @ normal - float(normal @ np.array(pair.second.point))
            return np.asarray(heights.min(axis=1) + offset)
        row = pair.rows[1]
        second = np.broadcast_to(np.eye(4), first.shape) if row is None else poses[:, row]
        a, b = pair.first, pair.second
        between = a.centres_at(first)[:, :, None] - b.centres_at(second)[:, None]
        bounds = np.linalg.norm(between, axis=3) - a.sizes[:, None] - b.sizes

        def evaluate(chosen: NDArray[np.bool_]) -> None:
            """Replace chosen bounds (N, n, m) by distances."""
            sample, i, j = np.nonzero(chosen)
            for start in range(0, len(sample), CHUNK):
                n, k, m = (index[start : start + CHUNK] for index in (sample, i, j))
                found = hull_distances(a.points_at(k, first[n]), b.points_at(m, second[n]))[0]
                bounds[n, k, m] = found - a.radii[k] - b.radii[m]

        nearest = np.zeros(bounds.shape, dtype=bool)
        nearest[bounds.min(axis=(1, 2)).argmin()] = True
        evaluate(nearest)
        evaluate((bounds <= max(float(bounds[nearest].min()), margin)) & ~nearest)
        return np.asarray(bounds.min(axis=(1, 2)))


def _groups(robot: Robot) -> tuple[list[int], set[frozenset[int]]]:
    """The rigid group of the base, every link and the tool (0: the base), and the connected groups."""
    group: dict[str | None, int] = {None: 0}
    near: set[frozenset[int]] = set()
    waiting = list(robot.links)
    while waiting:
        link = next(link for link in waiting if link.parent in group)
        waiting.remove(link)
        if link.joint.moves:
            group[link.name] = len(set(group.values()))
            near.add(frozenset((group[link.name], group[link.parent])))
        else:
            group[link.name] = group[link.parent]
    for closure in robot.closures:
        near.add(frozenset((group[closure.first.link], group[closure.second.link])))
    rows = [0, *(group[link.name] for link in robot.links)]
    return [*rows, rows[-1]], near
