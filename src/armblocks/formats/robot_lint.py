"""All findings about a robot file: those of its reader, impossible inertias, implausible values, warnings."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from os import PathLike, fspath

from armblocks.errors import ArmblocksWarning
from armblocks.formats.file_findings import FileContext, FileFinding, Rule
from armblocks.formats.robot_files import file_context, load_robot_in
from armblocks.robot import Robot, inertia_findings, plausibility_findings
from armblocks.robot.tree import BASE, KinematicTree

INERTIA = Rule(
    code="robot-inertia",
    allowed="moments of inertia that are not negative, none above the sum of the other two",
    remedy="check the unit and the axes of the inertia, and whether it is about the centre of mass",
)
IMPLAUSIBLE = Rule(
    code="robot-units",
    allowed="angles in rad, lengths in m, inertias in kg m2, gravity of a falling body",
    remedy="convert the value, or ignore this finding if it is right",
)
NO_MASS = Rule(
    code="robot-mass-missing",
    allowed="mass or inertia that each joint moves, or motor inertia",
    remedy="add the mass and the inertia of the links; kinematics do not depend on them",
)
WARNED = Rule(code="robot-warning", allowed="files that are read without warnings", remedy="see the message")

LINT_RULES = (INERTIA, IMPLAUSIBLE, NO_MASS, WARNED)
"""The rules of all formats."""


def lint_robot(
    name_or_path: str | PathLike[str],
    *,
    name: str | None = None,
    packages: Mapping[str, str | PathLike[str]] | None = None,
    arguments: Mapping[str, object] | None = None,
) -> tuple[FileFinding, ...]:
    """All findings about a robot, in the order of the lines of its file; the arguments are those of
    ``load_robot``.

    Raises the errors of ``load_robot`` for files that cannot be read.
    """
    context = file_context(packages, arguments)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ArmblocksWarning)
        robot = load_robot_in(name_or_path, context, name=name)
    file = fspath(name_or_path)
    found = [*context.findings, *_robot_findings(robot, file, context)]
    texts = [str(warning.message) for warning in caught if issubclass(warning.category, ArmblocksWarning)]
    found += [FileFinding(rule=WARNED, file=file, what=text) for text in dict.fromkeys(texts)]
    return tuple(sorted(found, key=lambda finding: finding.line or 10**9))


def _robot_findings(robot: Robot, file: str, context: FileContext) -> Iterator[FileFinding]:
    def finding(rule: Rule, link: str, what: str) -> FileFinding:
        element = f"link '{link}'" if link else f"robot '{robot.name}'"
        return FileFinding(rule=rule, file=file, line=context.lines.get(link, 0), element=element, what=what)

    for inertia in inertia_findings(robot):
        moments = ", ".join(f"{moment:.6g}" for moment in inertia.moments)
        what = f"{inertia.reason} (principal moments {moments} kg m2); it is used as given"
        yield finding(INERTIA, inertia.link, what)
    for implausible in plausibility_findings(robot):
        yield finding(IMPLAUSIBLE, implausible.link, f"{implausible.what}. {implausible.question}")
    light = _weightless_joints(robot)
    if light and len(light) == robot.n:
        yield finding(NO_MASS, "", "no link that moves has a mass or an inertia: joint torques are zero")
    else:
        for link in light:
            what = "the joint moves no mass and no inertia: its acceleration is undefined"
            yield finding(NO_MASS, link, what)


def _weightless_joints(robot: Robot) -> list[str]:
    """The links whose joints move neither mass nor inertia."""
    bodies = KinematicTree.of(robot).bodies
    heavy = [
        bool(body.inertia.mass) or any(body.inertia.second) or body.reflected_inertia > 0 for body in bodies
    ]
    for k in reversed(range(len(bodies))):
        if heavy[k] and bodies[k].parent != BASE:
            heavy[bodies[k].parent] = True
    return [body.link for body, has_inertia in zip(bodies, heavy) if not has_inertia]
