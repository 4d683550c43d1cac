"""``armblocks show``: prints the tables of a robot, or the hierarchy of a diagram."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from armblocks.cli.completion import complete_anything
from armblocks.cli.robot_options import PackageFolders, TipName, XacroArguments, named_values
from armblocks.cli.terminal import STRONG, results_console, table

if TYPE_CHECKING:
    from armblocks.robot import Link, Robot
    from armblocks.spatial import Transform

_DEGREE = math.pi / 180.0


def show(
    model: Annotated[
        str,
        typer.Argument(
            help="A shipped name or a file: robot, diagram or library.",
            autocompletion=complete_anything,
        ),
    ],
    name: Annotated[
        str | None, typer.Option(help="Robot to select from a script with several robots.")
    ] = None,
    tip: TipName = None,
    package: PackageFolders = None,
    argument: XacroArguments = None,
    flat: Annotated[
        bool, typer.Option("--flat", help="List all blocks of a diagram without hierarchy.")
    ] = False,
    trust: Annotated[
        bool, typer.Option("--trust", help="Run the Python files that the diagram names.")
    ] = False,
) -> None:
    """Print a robot's D-H table, dynamics, limits, gravity, base and tool, or a diagram's hierarchy."""
    import armblocks as ab
    from armblocks.cli.show_diagram import print_flat, print_hierarchy
    from armblocks.formats import DocumentKind, kind_of_document
    from armblocks.robot import warn_of_implausible_values, warn_of_inertias

    console = results_console()
    match kind_of_document(model):
        case DocumentKind.DIAGRAM:
            (print_flat if flat else print_hierarchy)(ab.load_diagram(model, trust=trust), console)
            return
        case DocumentKind.LIBRARY:
            for block in ab.load_library(model, trust=trust).values():
                (print_flat if flat else print_hierarchy)(block.diagram, console)
            return
        case DocumentKind.ROBOT:
            pass
    robot = ab.load_robot(
        model,
        name=name,
        tip=tip,
        packages=named_values(package, "--package"),
        arguments=named_values(argument, "--argument"),
    ).robot
    # Loading a shipped robot gives no warnings about impossible inertias; this command prints them. Tests
    # compare its other values with their sources, so ranges beyond a full turn are correct.
    warn_of_inertias(robot)
    if robot.source in ab.list_robots():
        print_robot(robot, console)
        print_facts(robot.source, console)
    else:
        warn_of_implausible_values(robot)
        print_robot(robot, console)


def print_robot(robot: Robot, console: Console) -> None:
    """Print all tables of one robot."""
    _print_heading(robot, console)
    _print_kinematics(robot, console)
    _print_links(robot, console, "Dynamics, link side (about the centre of mass, link axes)", _DYNAMICS)
    if any(link.motor is not None for link in robot.links):
        note = f"Motors, before the gear (friction model: {robot.friction_model.value})"
        _print_links(robot, console, note, _MOTORS)
    _print_limits(robot, console)
    _print_configurations(robot, console)
    _print_constraints(robot, console)
    _print_springs(robot, console)
    _print_named_frames(robot, console)
    _print_frames(robot, console)


def print_facts(name: str, console: Console) -> None:
    """Print payload, reach, the origin of the masses, sources, licence and notes of a shipped robot."""
    from armblocks.formats.robot_facts import shipped_facts

    facts = shipped_facts(name)
    console.print()
    console.print("Facts", style=STRONG)
    lines = [
        ("payload", f"{facts.payload:g} kg" if facts.payload is not None else ""),
        ("reach", f"{facts.reach:g} m" if facts.reach is not None else ""),
        ("masses", facts.masses.value if facts.masses is not None else ""),
        *(("source", source) for source in facts.sources),
        ("licence", facts.licence),
        ("compared with", facts.checked),
    ]
    for label, text in lines:
        if text:
            console.print(f"{label}: {text}", highlight=False, markup=False)
    console.print(facts.notes, highlight=False, markup=False)


def _print_heading(robot: Robot, console: Console) -> None:
    conventions = {link.dh.convention.value for link in robot.links if link.dh is not None}
    short = {"standard": ", stdDH", "modified": ", modDH"}
    rows = short[conventions.pop()] if len(conventions) == 1 else ""
    heading = f"{robot.name} ({robot.n} axis, {robot.joint_letters}{rows})"
    console.print(heading, style=STRONG)
    notes = [text for text in (robot.manufacturer, robot.comment) if text]
    if notes:
        console.print(f" {'; '.join(notes)};")


def _print_kinematics(robot: Robot, console: Console) -> None:
    """Print the D-H table if every moving link has a D-H row, else parents, axes and poses."""
    from armblocks.robot.dh_table import dh_table, kinematics_text

    if dh_table(robot):
        console.print(kinematics_text(robot), soft_wrap=True)
    else:
        _print_tree(robot, console)


def _print_constraints(robot: Robot, console: Console) -> None:
    """Print couplings as equations, closures with their links, and the degrees of freedom."""
    if not robot.constraints:
        return
    console.print()
    console.print("Constraints", style=STRONG)
    for coupling in robot.couplings:
        (joint, own), *others = coupling.terms
        sum_ = " ".join(f"{-factor / own:+g} {name}" for name, factor in others)
        offset = f" {coupling.constant / own:+g}" if coupling.constant or not others else ""
        console.print(f"{joint} = {sum_}{offset}", highlight=False, markup=False)
    for closure in robot.closures:
        first, second = (name or "(base)" for name in closure.links)
        text = f"{closure.name}: {closure.title} between {first} and {second}"
        console.print(text, highlight=False, markup=False)
    for joint in robot.prescribed_joints:
        console.print(f"{joint}: prescribed motion", highlight=False, markup=False)
    if robot.closures:
        from armblocks.face.assembly import assemble

        console.print(str(assemble(robot, None, None, ())), highlight=False, markup=False)


def _print_springs(robot: Robot, console: Console) -> None:
    """Print the springs with their joints or links and their constants."""
    if not robot.springs:
        return
    from armblocks.robot import JointSpring, LineSpring

    console.print()
    console.print("Springs", style=STRONG)
    for spring in robot.springs:
        text = f"{spring.name}: {spring.title}"
        if isinstance(spring, JointSpring):
            unit = robot.link(spring.joint).joint.speeds[0].unit
            constant = "N m/rad" if unit == "rad" else "N/m"
            text += f" at {spring.joint}, {spring.stiffness:g} {constant}, rest at {spring.rest:g} {unit}"
        elif isinstance(spring, LineSpring):
            first, second = (end.link or "(base)" for end in (spring.first, spring.second))
            text += f" between {first} and {second}, {spring.stiffness:g} N/m, {spring.preload:g} N"
            text += f" at {spring.length:g} m"
        console.print(text, highlight=False, markup=False)


def _print_named_frames(robot: Robot, console: Console) -> None:
    """Print the named frames with their links and positions."""
    if not robot.frames:
        return
    console.print()
    console.print("Named frames", style=STRONG)
    for frame in robot.frames:
        x, y, z = frame.pose.translation
        text = f"{frame.name}: on {frame.link or '(base)'} at {x:.6g}, {y:.6g}, {z:.6g} m"
        console.print(text, highlight=False, markup=False)


def _print_tree(robot: Robot, console: Console) -> None:
    from armblocks.robot.dh_table import axis_text

    columns = [
        ("link", "left"),
        ("parent", "left"),
        ("joint", "left"),
        ("axis", "left"),
        ("at q = 0: x, y, z m", "left"),
    ]
    poses = table(*columns)
    for link in robot.links:
        x, y, z = link.pose().translation
        kind = type(link.joint).__name__.lower()
        poses.add_row(
            link.name, link.parent or "(base)", kind, axis_text(link.joint), f"{x:.5g}, {y:.5g}, {z:.5g}"
        )
    console.print(poses)


Row = tuple[str, str, Callable[["Link"], float]]


def _motor(attribute: str) -> Callable[[Link], float]:
    return lambda link: float("nan") if link.motor is None else float(getattr(link.motor, attribute))


_DYNAMICS: Sequence[Row] = (
    ("m", "kg", lambda link: link.mass),
    *((f"r {axis}", "m", lambda link, i=i: link.centre_of_mass[i]) for i, axis in enumerate("xyz")),
    *(
        (f"I {name}", "kg m²", lambda link, i=i, j=j: link.inertia[i][j])
        for name, (i, j) in zip(
            ("xx", "yy", "zz", "xy", "yz", "xz"), ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
        )
    ),
)

_MOTORS: Sequence[Row] = (
    ("Jm", "kg m²", _motor("inertia")),
    ("G", "", _motor("gear_ratio")),
    ("B", "N m s/rad", _motor("viscous_friction")),
    ("Tc+", "N m", lambda link: float("nan") if link.motor is None else link.motor.coulomb_friction[0]),
    ("Tc-", "N m", lambda link: float("nan") if link.motor is None else link.motor.coulomb_friction[1]),
)


def _print_links(robot: Robot, console: Console, title: str, rows: Sequence[Row]) -> None:
    """Print tables with one column per link, as many columns as fit into the terminal."""
    width = max([10, *(len(link.name) + 2 for link in robot.links)])
    column_count = max(1, (console.width - 16) // width)
    for start in range(0, len(robot.links), column_count):
        links = robot.links[start : start + column_count]
        numbers = table(("", "left"), ("", "left"), *((link.name, "right") for link in links))
        for name, unit, read in rows:
            numbers.add_row(name, unit, *(_number(read(link)) for link in links))
        console.print()
        console.print(title, style=STRONG)
        console.print(numbers)


def _print_limits(robot: Robot, console: Console) -> None:
    if all(limits == type(limits)() for limits in robot.limits):
        return
    speeds = any(limits.speed is not None for limits in robot.limits)
    torques = any(limits.torque is not None for limits in robot.limits)
    shown = table(
        ("joint", "left"),
        ("lowest", "right"),
        ("highest", "right"),
        *((("speed", "right"),) if speeds else ()),
        *((("torque", "right"),) if torques else ()),
    )
    for coordinate, limits in zip(robot.speeds, robot.limits):
        is_revolute = coordinate.unit == "rad"
        scale, unit = (_DEGREE, "deg") if is_revolute else (1.0, "m")
        low, high = limits.position or (float("nan"), float("nan"))
        cells = [_with_unit(low / scale, unit), _with_unit(high / scale, unit)]
        if speeds:
            cells.append(_with_unit(_or_nan(limits.speed) / scale, f"{unit}/s"))
        if torques:
            cells.append(_with_unit(_or_nan(limits.torque), "N m" if is_revolute else "N"))
        shown.add_row(coordinate.name, *cells)
    console.print()
    console.print("Limits", style=STRONG)
    console.print(shown)


def _print_configurations(robot: Robot, console: Console) -> None:
    """Print the named configurations, angles in degrees."""
    if not robot.configurations:
        return
    from armblocks.robot.dh_table import configuration_lines

    console.print()
    console.print("Configurations", style=STRONG)
    for line in configuration_lines(robot):
        console.print(line, highlight=False, markup=False)


def _print_frames(robot: Robot, console: Console) -> None:
    console.print()
    gravity = " ".join(f"{_number(part)}" for part in robot.gravity)
    console.print(f"grav = {gravity} m/s², acceleration of a falling body (toolbox: opposite sign)")
    for name, pose in (("base", robot.base), ("tool", robot.tool)):
        console.print(f"{name} ={_pose_text(pose)}")


def _pose_text(pose: Transform) -> str:
    if pose.is_identity:
        return " identity"
    matrix = pose.matrix
    return "\n" + "\n".join("  " + "".join(f"{_number(entry):>12}" for entry in row) for row in matrix)


def _or_nan(value: float | None) -> float:
    return float("nan") if value is None else value


def _number(value: float) -> str:
    """Six digits without trailing zeros; empty for a missing value."""
    return "" if math.isnan(value) else f"{value:.6g}"


def _with_unit(value: float, unit: str) -> str:
    return "" if math.isnan(value) else f"{value:.6g} {unit}"
