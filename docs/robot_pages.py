"""The gallery of the shipped robots, and a page for each: picture, tables, sources, licence and notes."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from html import escape
from itertools import groupby

import numpy as np
from block_pages import prose, table
from numpy.typing import NDArray
from robot_poses import pose_of

import armblocks as ab
from armblocks.dynamics import trace_link_poses
from armblocks.formats.robot_facts import (
    MassOrigin,
    RobotFacts,
    shipped_facts,
    shipped_summary,
)
from armblocks.pictures.svg import svg_file
from armblocks.rendering import arm_picture
from armblocks.robot import Robot

SIZE = (270.0, 218.0)
"""Width and height of a picture, px."""
OTHER = "Exercises"
"""Heading of the robots without a manufacturer."""
MASSES = {
    MassOrigin.PUBLISHED: "published",
    MassOrigin.CAD: "from CAD models",
    MassOrigin.PACKAGE: "from a package that does not state their origin",
    MassOrigin.ESTIMATED: "estimated",
    MassOrigin.CHOSEN: "chosen",
}
INTRODUCTION = """
`ab.load_robot("panda")` loads a robot by its name. In a terminal, `armblocks show panda` prints all
parameters of this robot with its sources. The robot editor of `armblocks studio` shows robots and edits
copies.

Lengths and ranges are facts from publications; each page names the sources and their licence. If only facts
are used, no text, drawing or program of the source was copied. Most arms were compared with a
second source that shares no code with the first. The bodies are drawn from the kinematics and are not the
shapes of the real arms. Masses, centres of mass and inertias are those of a publication or of the
manufacturer, or computed from CAD models by the authors of a package. If no source states them, they are
*estimated*: from the drawn bodies (`scripts/estimated_masses.py`), or for palletising arms from payload and
lengths (`scripts/palletisers.py`). Estimates are suitable for tests of algorithms, but not for the sizing of
drives.

*Reach* is the greatest distance of the tool frame from axis 1, computed from the table and the ranges.
Data sheets often state the smaller reach of the wrist. Payloads are those of data sheets, or follow from the
name of the model.
"""


def robot_pages() -> Iterator[tuple[str, str]]:
    """Yield path and text of every page and picture: a page and a picture for each robot, the gallery."""
    reaches: dict[str, float] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ab.errors.InertiaWarning)
        for name in ab.list_robots():
            robot = ab.load_robot(name).robot
            reaches[name] = computed_reach(robot)
            picture = arm_picture(
                robot, pose_of(name, robot), width=SIZE[0], height=SIZE[1]
            )
            yield f"static/robots/{name}.svg", svg_file(picture)
            yield (
                f"robots/{name}.md",
                "\n".join(_robot_page(name, robot, reaches[name])),
            )
    yield "robots.md", "\n".join(_gallery(reaches))


def computed_reach(robot: Robot) -> float:
    """The greatest distance of the tool frame from axis 1 within the ranges, m, rounded to 10 mm.

    Random poses, then a search along one coordinate after the other from the best of them.
    """
    poses = trace_link_poses(robot).casadi_function()
    joint = next(link for link in robot.links if link.joint.moves)
    T = robot.base @ joint.before
    origin, axis = T.p, T.R @ np.array(joint.joint.axis)

    def distances(q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distance from axis 1 for each row of ``q`` (N, n), m."""
        rows = np.asarray(poses.map(len(q))(q.T)).T.reshape(len(q), -1, 4, 4)
        offset = rows[:, -1, :3, 3] - origin
        return np.linalg.norm(offset - (offset @ axis)[:, None] * axis, axis=1)

    low, high = np.clip(robot.qlim, -np.pi, np.pi).T
    q = np.random.default_rng(0).uniform(low, high, (500, robot.n))
    best = q[int(distances(q).argmax())]
    for k in [*range(robot.n)] * 3:
        line = np.repeat(best[None], 61, axis=0)
        line[:, k] = np.linspace(low[k], high[k], 61)
        best = line[int(distances(line).argmax())]
    return round(float(distances(best[None])[0]), 2)


def _gallery(reaches: dict[str, float]) -> Iterator[str]:
    yield from (
        "# Shipped robots",
        "",
        f"{len(reaches)} robots are shipped with armblocks.",
        INTRODUCTION,
    )
    makers = {name: shipped_summary(name).manufacturer or OTHER for name in reaches}
    names = sorted(
        reaches, key=lambda name: (makers[name] == OTHER, makers[name].casefold(), name)
    )
    for maker, group in groupby(names, key=lambda name: makers[name]):
        yield from (f"## {prose(maker)}", "", '<div class="robot-list">', "")
        for name in group:
            yield from _card(name, shipped_facts(name), reaches[name])
        yield from ("</div>", "")
    yield from ("## All robots", "")
    headings = (
        "robot",
        "joints",
        "payload, kg",
        "reach, m",
        "masses",
        "licence",
        "sources",
    )
    yield from table(headings, [_row(name, reaches[name]) for name in sorted(reaches)])


def _card(name: str, facts: RobotFacts, reach: float) -> Iterator[str]:
    summary = shipped_summary(name)
    rest = [f"payload {facts.payload:g} kg"] if facts.payload is not None else []
    rest += [f"masses {MASSES[facts.masses]}"] if facts.masses is not None else []
    yield from (
        '<div class="robot-entry">',
        f'<a href="robots/{name}.html"><img loading="lazy" src="../_static/robots/{name}.svg" '
        f'width="{SIZE[0]:g}" height="{SIZE[1]:g}" alt="{escape(summary.title)}"></a><div>',
        "",
        f"[{name}](robots/{name}.md): {prose(summary.title)}<br>",
        f"{len(summary.joint_letters)} joints, reach {reach:g} m<br>{', '.join(rest)}",
        "",
        "</div></div>",
        "",
    )


def _row(name: str, reach: float) -> tuple[str, ...]:
    facts, summary = shipped_facts(name), shipped_summary(name)
    return (
        f"[{name}](robots/{name}.md)",
        f"{len(summary.joint_letters)}",
        f"{facts.payload:g}" if facts.payload is not None else "",
        f"{reach:g}",
        facts.masses.value if facts.masses is not None else "",
        prose(facts.licence),
        _breakable(prose("; ".join(facts.sources))),
    )


def _breakable(text: str) -> str:
    """Markdown whose paths and identifiers may continue on the next line after a slash or underscore."""
    return re.sub(r"(/|\\_)(?=\w)", r"\1<wbr>", text)


def _robot_page(name: str, robot: Robot, reach: float) -> Iterator[str]:
    facts = shipped_facts(name)
    maker = f", {robot.manufacturer}" if robot.manufacturer else ""
    title = prose(
        f"{robot.name}{maker}: {robot.comment}"
        if robot.comment
        else f"{robot.name}{maker}"
    )
    yield from ("---", "orphan: true", "---", "", f"# {name}", "", f"{title}.", "")
    yield from (
        f'<figure class="robot"><img src="../../_static/robots/{name}.svg" width="{SIZE[0]:g}" '
        f'height="{SIZE[1]:g}" alt="{escape(robot.name)}"></figure>',
        "",
    )
    yield from (
        f"{robot.n} joints: {robot.joint_letters} (R revolute, P prismatic).",
        "",
    )
    lines = [f"- Reach of the tool frame from axis 1, computed: {reach:g} m"]
    if facts.payload is not None:
        lines.append(f"- Payload: {facts.payload:g} kg")
    if facts.reach is not None:
        lines.append(f"- Reach of the data sheet: {facts.reach:g} m")
    if facts.masses is not None:
        lines.append(f"- Masses, centres of mass and inertias: {MASSES[facts.masses]}")
    lines += [f"- Source: {prose(source)}" for source in facts.sources]
    if facts.licence:
        lines.append(f"- Licence: {prose(facts.licence)}")
    if facts.checked:
        lines.append(f"- Compared with: {prose(facts.checked)}")
    yield from (*lines, "", prose(facts.notes), "")
    yield from _dh_table(robot)
    yield from _limits(robot)
    yield from ("[All robots](../robots.md).", "")


def _dh_table(robot: Robot) -> Iterator[str]:
    """The D-H table with its convention; nothing for a robot with a link that has no D-H row."""
    rows = [(link.name, link.dh) for link in robot.moving_links if link.dh is not None]
    if len(rows) < len(robot.links):
        return
    conventions = " and ".join(dict.fromkeys(row.convention.value for _, row in rows))
    yield from (f"D-H table ({conventions}); `q` is the joint coordinate:", "")
    cells = [
        (
            f"`{name}`",
            f"{row.theta:.4g}" if row.sigma else "`q`",
            "`q`" if row.sigma else f"{row.d:.6g}",
            f"{row.a:.6g}",
            f"{row.alpha * 180 / np.pi:g}°",
            f"{row.offset:.4g} {'m' if row.sigma else 'rad'}" if row.offset else "0",
        )
        for name, row in rows
    ]
    yield from table(("joint", "theta, rad", "d, m", "a, m", "alpha", "offset"), cells)


def _limits(robot: Robot) -> Iterator[str]:
    unit_symbols = {"rad": "°", "m": " m"}
    rows: list[tuple[str, ...]] = []
    for k, (joint, unit) in enumerate(robot.speeds):
        scale = 180 / np.pi if unit == "rad" else 1.0
        low, high = np.array(robot.limits[k].position or (-np.inf, np.inf)) * scale
        speed, torque = robot.speed_limits[k] * scale, robot.torque_limits[k]
        rows.append(
            (
                f"`{joint}`",
                f"{low:g} … {high:g}{unit_symbols[unit]}"
                if np.isfinite([low, high]).all()
                else "",
                f"{speed:.4g}{unit_symbols[unit]}/s" if np.isfinite(speed) else "",
                f"{torque:g} {'N m' if unit == 'rad' else 'N'}"
                if np.isfinite(torque)
                else "",
            )
        )
    if any(any(row[1:]) for row in rows):
        yield from table(("joint", "range", "maximum speed", "maximum torque"), rows)
