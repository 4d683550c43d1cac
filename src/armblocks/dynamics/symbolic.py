"""Readable functions of a robot, with symbols in the place of lengths, inertial parameters and gravity.

The equations of :mod:`armblocks.dynamics.traces`, but with the inertial parameters of the links instead of
base parameters, so that the symbols of the user remain.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from casadi import SX, jacobian, mtimes, substitute

from armblocks.dynamics.ball_joints import structure_matrix
from armblocks.dynamics.crba import crba
from armblocks.dynamics.energy import kinetic_energy, potential_energy
from armblocks.dynamics.friction import joint_friction, rotor_torques
from armblocks.dynamics.jacobian import jacobian_matrix, tool_columns, world_columns
from armblocks.dynamics.joint_motion import entries, joint_motions
from armblocks.dynamics.kinematics import body_poses, constant_pose, frame_pose
from armblocks.dynamics.rnea import rnea
from armblocks.dynamics.robot_trace import body_of_speed, column_sum, matrix_of_rows, robot_trace
from armblocks.dynamics.springs import spring_energy, spring_torques
from armblocks.equations import TracedFunction
from armblocks.equations.signatures import Slot
from armblocks.errors import RobotError
from armblocks.robot.link import Link
from armblocks.robot.robot import Robot
from armblocks.robot.tree import BASE, Frame, KinematicTree
from armblocks.spatial import Transform
from armblocks.spatial.inertia import RigidInertia
from armblocks.spatial.vectors import Scalar, Symmetric, Vector, add, rotate, rotate_back, scale

LENGTHS = ("a", "d")
INERTIAS = ("xx", "yy", "zz", "xy", "yz", "xz")


@dataclass(frozen=True, kw_only=True)
class Values:
    """The values that replace numbers of a robot: formulas as strings, and numbers.

    ``lengths``: by the name of a link and ``"a"`` or ``"d"`` of its D-H row, m. ``masses``, kg. ``centres``
    (3), m. ``inertias`` (6): xx yy zz xy yz xz about the centre of mass, kg m2. ``gravity`` (3), m/s2.
    """

    lengths: Mapping[tuple[str, str], str]
    masses: Mapping[str, str | float]
    centres: Mapping[str, tuple[str | float, ...]]
    inertias: Mapping[str, tuple[str | float, ...]]
    gravity: tuple[str | float, ...] | None

    def texts(self) -> list[str]:
        """All formulas."""
        values = [*self.lengths.values(), *self.masses.values(), *(self.gravity or ())]
        for rows in (*self.centres.values(), *self.inertias.values()):
            values += rows
        return [value for value in values if isinstance(value, str)]


Formulas = Callable[[str], Scalar]
"""The value of a formula's text, for the symbols of its names."""


class SymbolicTransform(Transform):
    """A pose with a constant rotation and a translation in symbols."""

    def __init__(self, T: Transform, translation: Vector) -> None:
        object.__setattr__(self, "rotation", T.rotation)
        object.__setattr__(self, "translation", translation)

    def __matmul__(self, other: Transform) -> SymbolicTransform:
        """Composition, see :class:`Transform`."""
        rotation = Transform(rotation=self.rotation) @ Transform(rotation=other.rotation)
        translation = add(self.translation, rotate(self.rotation, other.translation))
        return SymbolicTransform(rotation, translation)

    def inverse(self) -> SymbolicTransform:
        """The inverse, see :class:`Transform`."""
        translation = scale(-1.0, rotate_back(self.rotation, self.translation))
        return SymbolicTransform(Transform(rotation=self.rotation).inverse(), translation)


def symbolic_tree(robot: Robot, values: Values, formula: Formulas, frame: str | None = None) -> KinematicTree:
    """The tree of a robot with symbols in the place of numbers."""
    numbers = replace(
        robot,
        links=tuple(_with_lengths(link, dict.fromkeys(_named(values, link), 0.0)) for link in robot.links),
    )
    tree = KinematicTree.of(numbers).with_tool_at(frame)
    parts = _LengthParts(robot, values, formula, frame)
    bodies = [
        replace(body, placement=parts.moved(body.placement, lambda t, k=k: t.bodies[k].placement))
        for k, body in enumerate(tree.bodies)
    ]
    links = tuple(
        replace(link, pose=parts.moved(link.pose, lambda t, k=k: t.links[k].pose))
        for k, link in enumerate(tree.links)
    )
    tool = Frame(body=tree.tool.body, pose=parts.moved(tree.tool.pose, lambda t: t.tool.pose))
    grounded = RigidInertia()
    bodies = [replace(body, inertia=RigidInertia()) for body in bodies]
    for link, place in zip(robot.links, links):
        load = _inertia(link, values, formula).moved(place.pose)
        if place.body == BASE:
            grounded = grounded.plus(load)
        else:
            carrier = bodies[place.body]
            bodies[place.body] = replace(carrier, inertia=carrier.inertia.plus(load))
    gravity: Vector = tree.gravity
    if values.gravity is not None:
        gravity = rotate(robot.base.inverse().rotation, _vector(values.gravity, formula))
    return replace(
        tree,
        bodies=tuple(bodies),
        links=links,
        end=tool,
        grounded=grounded,
        gravity=gravity,  # pyright: ignore[reportArgumentType] - the algorithms take symbols as well
    )


class _LengthParts:
    """The translations that depend on named lengths: poses are linear in them, because rotations are not."""

    def __init__(self, robot: Robot, values: Values, formula: Formulas, frame: str | None) -> None:
        self._parts: list[tuple[Scalar, KinematicTree]] = []
        for (name, length), text in values.lengths.items():
            links = tuple(_only(link, length if link.name == name else None) for link in robot.links)
            frames = tuple(replace(f, pose=_rotation(f.pose)) for f in robot.frames)
            unit = replace(
                robot,
                links=links,
                tool=_rotation(robot.tool),
                base=_rotation(robot.base),
                frames=frames,
                springs=(),
            )
            self._parts.append((formula(text), KinematicTree.of(unit).with_tool_at(frame)))

    def moved(self, pose: Transform, of_tree: Callable[[KinematicTree], Transform]) -> Transform:
        """The pose with the named lengths, from the ``pose`` without them."""
        translation: Vector = pose.translation
        for length, tree in self._parts:
            translation = add(translation, scale(length, of_tree(tree).translation))
        return SymbolicTransform(pose, translation)


def _named(values: Values, link: Link) -> list[str]:
    return [length for name, length in values.lengths if name == link.name]


def _with_lengths(link: Link, lengths: Mapping[str, float]) -> Link:
    """A link with other lengths in its D-H row."""
    if not lengths or link.dh is None:
        return link
    row = replace(link.dh, **lengths)
    return replace(link, dh=row, before=row.before, after=row.after)


def _only(link: Link, length: str | None) -> Link:
    """A link without lengths, or with the length 1 for ``a`` or ``d``."""
    if length is None or link.dh is None:
        return replace(link, dh=None, before=_rotation(link.before), after=_rotation(link.after))
    row = replace(link.dh, **{name: 1.0 if name == length else 0.0 for name in LENGTHS})
    return replace(link, dh=None, before=row.before, after=row.after)


def _rotation(T: Transform) -> Transform:
    return Transform(rotation=T.rotation)


def _inertia(link: Link, values: Values, formula: Formulas) -> RigidInertia:
    """The inertia of a link in its frame."""
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = link.inertia
    mass = values.masses.get(link.name, link.mass)
    centre = _vector(values.centres.get(link.name, link.centre_of_mass), formula)
    second = (_value(entry, formula) for entry in values.inertias.get(link.name, (xx, yy, zz, xy, yz, xz)))
    return RigidInertia.at_centre(_value(mass, formula), Symmetric(*second)).shifted(centre)


def _vector(values: Sequence[str | float], formula: Formulas) -> Vector:
    x, y, z = (_value(value, formula) for value in values)
    return x, y, z


def _value(value: str | float, formula: Formulas) -> Scalar:
    return formula(value) if isinstance(value, str) else value


class SymbolicFunction(NamedTuple):
    """A function of a tree: its inputs, the name of its output, and its equations."""

    inputs: tuple[str, ...]
    output: str
    equations: Callable[..., SX]

    def shape(self, robot: Robot) -> tuple[int, ...]:
        """The shape of the output for a robot."""
        n = robot.n
        shapes = {"T": (4, 4), "J": (6, n), "M": (n, n), "C": (n, n), "tau": (n,), "energy": ()}
        return shapes[self.output]


def _fkine(tree: KinematicTree, q: SX) -> SX:
    ground = constant_pose(tree.base)
    return frame_pose(tree.tool, body_poses(tree, entries(q), ground), ground).matrix()


def _inertia_matrix(tree: KinematicTree, q: SX) -> SX:
    M, bodies = crba(tree, joint_motions(tree, q)), body_of_speed(tree)
    return matrix_of_rows([[M[i][j] for j in bodies] for i in bodies])


def _coriolis(tree: KinematicTree, q: SX, qd: SX) -> SX:
    # See trace_coriolis. The speeds of the tree are expressions if couplings determine them.
    speeds = SX.sym("speeds", tree.n)
    joints, rates = joint_motions(tree, q), entries(speeds)
    no_gravity = (0.0, 0.0, 0.0)
    twice = jacobian(column_sum(rnea(tree, joints, rates, [0.0] * tree.n, no_gravity)), speeds)
    W = structure_matrix(tree, rates)
    if W is not None:
        twice = twice + mtimes(_inertia_matrix(tree, q), W)
    return SX(substitute(SX(0.5 * twice), speeds, qd))


def _gravload(tree: KinematicTree, q: SX) -> SX:
    no_motion = [0.0] * tree.n
    return column_sum(
        rnea(tree, joint_motions(tree, q), no_motion, no_motion, tree.gravity), spring_torques(tree, q)
    )


def _rne(tree: KinematicTree, q: SX, qd: SX, qdd: SX) -> SX:
    rates, accelerations = entries(qd), entries(qdd)
    rigid = rnea(tree, joint_motions(tree, q), rates, accelerations, tree.gravity)
    of_motors = rotor_torques(tree.robot, accelerations), joint_friction(tree.robot, rates)
    return column_sum(rigid, *of_motors, spring_torques(tree, q))


def _jacob0(tree: KinematicTree, q: SX) -> SX:
    return jacobian_matrix(world_columns(tree, entries(q)))


def _jacobe(tree: KinematicTree, q: SX) -> SX:
    return jacobian_matrix(tool_columns(tree, q))


def _kinetic_energy(tree: KinematicTree, q: SX, qd: SX) -> SX:
    return SX(kinetic_energy(tree, joint_motions(tree, q), entries(qd)))


def _potential_energy(tree: KinematicTree, q: SX) -> SX:
    return SX(potential_energy(tree, joint_motions(tree, q)) + spring_energy(tree, q))


FUNCTIONS: Mapping[str, SymbolicFunction] = {
    "fkine": SymbolicFunction(("q",), "T", _fkine),
    "jacob0": SymbolicFunction(("q",), "J", _jacob0),
    "jacobe": SymbolicFunction(("q",), "J", _jacobe),
    "inertia": SymbolicFunction(("q",), "M", _inertia_matrix),
    "coriolis": SymbolicFunction(("q", "qd"), "C", _coriolis),
    "gravload": SymbolicFunction(("q",), "tau", _gravload),
    "rne": SymbolicFunction(("q", "qd", "qdd"), "tau", _rne),
    "kinetic_energy": SymbolicFunction(("q", "qd"), "energy", _kinetic_energy),
    "potential_energy": SymbolicFunction(("q",), "energy", _potential_energy),
}
"""The functions by name."""


def trace_symbolic(
    name: str,
    robot: Robot,
    values: Values,
    names: Sequence[str],
    formulas: Callable[[SX], Formulas],
    frame: str | None = None,
) -> TracedFunction:
    """A function of ``FUNCTIONS``; its last input are the symbols (k,) with these ``names``, if any.

    ``formulas``: from the column of symbols to the values of the formulas. Raises RobotError for torques of
    robots with closed loops.
    """
    function = FUNCTIONS[name]
    if robot.closures and function.output == "tau":
        raise RobotError(
            f"{name} of a robot with closed loops is the solution of equations, which has no symbolic form",
            where=f"symbolic form of robot '{robot.name}'",
            allowed="robots without closures, or the functions fkine, jacob0, jacobe, inertia, coriolis",
            fix="replace the robot by one without the closures, or compute numbers with arm." + name,
        )

    def equations(*arguments: SX) -> SX:
        *motion, symbols = arguments if names else (*arguments, SX(0, 1))
        return function.equations(symbolic_tree(robot, values, formulas(symbols), frame), *motion)

    more = (Slot("symbols", (len(names),), ""),) if names else ()
    output = (function.output, function.shape(robot), "")
    return robot_trace(name, robot, function.inputs, output, equations, more=more)
