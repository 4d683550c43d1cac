"""All findings about a robot file: from its reader, impossible inertias, implausible values, warnings."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping
from os import PathLike, fspath

from armblocks.errors import ArmblocksWarning
from armblocks.formats.file_findings import FileContext, FileFinding, Rule
from armblocks.formats.robot_files import file_context, load_robot_in
from armblocks.formats.robot_rules import IMPLAUSIBLE, INERTIA, NO_MASS, WARNED
from armblocks.robot import Robot, inertia_findings, plausibility_findings
from armblocks.robot.tree import BASE, KinematicTree


def lint_robot(
    name_or_path: str | PathLike[str],
    *,
    name: str | None = None,
    packages: Mapping[str, str | PathLike[str]] | None = None,
    arguments: Mapping[str, object] | None = None,
) -> tuple[FileFinding, ...]:
    """All findings about a robot, in the order of the lines of its file; arguments as for ``load_robot``.

    Raises the errors of ``load_robot`` for files that cannot be read.
    """
    context = file_context(packages, arguments)
    return findings_of(lambda: load_robot_in(name_or_path, context, name=name), fspath(name_or_path), context)


def findings_of(load: Callable[[], Robot], file: str, context: FileContext) -> tuple[FileFinding, ...]:
    """The findings about the robot that ``load`` reads in a context; ``file`` is its name in messages."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ArmblocksWarning)
        robot = load()
    findings = [*context.findings, *_robot_findings(robot, file, context)]
    texts = [str(warning.message) for warning in caught if issubclass(warning.category, ArmblocksWarning)]
    findings += [FileFinding(rule=WARNED, file=file, what=text) for text in dict.fromkeys(texts)]
    return tuple(sorted(findings, key=lambda finding: finding.line or 10**9))


def _robot_findings(robot: Robot, file: str, context: FileContext) -> Iterator[FileFinding]:
    def finding(rule: Rule, link: str, what: str) -> FileFinding:
        element = f"link '{link}'" if link else f"robot '{robot.name}'"
        line = context.lines.get(link, 0)
        return FileFinding(rule=rule, file=file, line=line, element=element, what=what, link=link)

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
        for link in dict.fromkeys(light):
            what = "the joint moves no mass and no inertia: its acceleration is undefined"
            yield finding(NO_MASS, link, what)


def _weightless_joints(robot: Robot) -> list[str]:
    """The link of each degree of freedom that moves neither mass nor inertia."""
    bodies = KinematicTree.of(robot).bodies
    heavy = [
        bool(body.inertia.mass) or any(body.inertia.second) or body.reflected_inertia > 0 for body in bodies
    ]
    for k in reversed(range(len(bodies))):
        if heavy[k] and bodies[k].parent != BASE:
            heavy[bodies[k].parent] = True
    return [body.link for body, has_inertia in zip(bodies, heavy) if not has_inertia]
