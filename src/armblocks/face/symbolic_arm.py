"""The class ``SymbolicArm``: kinematics and dynamics of an arm in symbols."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import cast

from casadi import SX

from armblocks.argument_errors import ArgumentErrors, with_argument_errors
from armblocks.errors import UnknownNameError, check_type
from armblocks.face.symbolic_equations import FIELDS, Entry, Row, SymbolicEquations
from armblocks.face.symbolic_expression import SymbolicExpression
from armblocks.robot import Robot, modified_dh, serial_chain, standard_dh
from armblocks.robot.dh_row import DhConvention
from armblocks.robot.link import Link


class SymbolicArm(metaclass=ArgumentErrors):
    """The kinematics and dynamics of a robot in symbols: ``arm.symbolic``.

    Symbols: ``q``, ``qd``, ``qdd`` (CasADi columns) with the names of the joints, for ``q1`` also ``qd1`` and
    ``qdd1``, for another name ``name_d`` and ``name_dd``; ``symbols`` (k,) of lengths, masses, inertias and
    gravity, which :meth:`with_symbols` and :func:`symbolic_dh` introduce. ``names`` lists all names.

    The methods return a :class:`SymbolicExpression`. Equations, frames, units, friction and springs are the
    same as in :class:`Arm`.
    """

    def __init__(
        self, robot: Robot, links: Mapping[str, Row] | None = None, gravity: Sequence[Entry] | None = None
    ) -> None:
        check_type(robot, Robot, "a Robot", where="SymbolicArm")
        self.robot = robot
        self._equations = SymbolicEquations(robot, links or {}, gravity)

    def __reduce__(self) -> tuple[type[SymbolicArm], tuple[object, ...]]:
        """Pickle and copy the description alone."""
        return SymbolicArm, (self.robot, self._equations.links, self._equations.gravity)

    def with_symbols(
        self, links: Mapping[str, Row] | None = None, *, gravity: Sequence[Entry] | None = None
    ) -> SymbolicArm:
        """The arm with symbols in the place of numbers.

        - ``links``: new entries by the name of a link: ``a`` and ``d`` of its D-H row (m), ``mass`` (kg),
          ``centre_of_mass`` (3) m, ``inertia`` (3 or 6: xx yy zz, xy yz xz about the centre of mass, kg m²).
        - ``gravity`` (3) m/s²: the acceleration of a falling body.

        Each entry is a number or a formula such as ``"l1"``, ``"-l1/2"``. Raises InputError or
        UnknownNameError.
        """
        before = self._equations
        merged = {name: {**row, **(links or {}).get(name, {})} for name, row in before.links.items()}
        added = {name: row for name, row in (links or {}).items() if name not in merged}
        return SymbolicArm(self.robot, {**merged, **added}, before.gravity if gravity is None else gravity)

    # ---- functions ---------------------------------------------------------------------------------------
    def fkine(self, frame: str | None = None) -> SymbolicExpression:
        """T (4, 4): pose of the tool in the world; ``frame``: as for ``Arm.fkine``."""
        return self._expression("fkine", frame)

    def jacob0(self, frame: str | None = None) -> SymbolicExpression:
        """J (6, n): velocity of the tool in world axes, linear rows first."""
        return self._expression("jacob0", frame)

    def jacobe(self, frame: str | None = None) -> SymbolicExpression:
        """J (6, n): velocity of the tool in tool axes, linear rows first."""
        return self._expression("jacobe", frame)

    def inertia(self) -> SymbolicExpression:
        """M (n, n): joint-space inertia, with rotors."""
        return self._expression("inertia")

    def coriolis(self) -> SymbolicExpression:
        """C (n, n): ``C qd`` are the velocity torques, in Christoffel symbols."""
        return self._expression("coriolis")

    def gravload(self) -> SymbolicExpression:
        """tau (n,): torques that hold the arm at rest. Raises RobotError for robots with closed loops."""
        return self._expression("gravload")

    def rne(self) -> SymbolicExpression:
        """tau (n,): torques of a motion, with friction. Raises RobotError for robots with closed loops."""
        return self._expression("rne")

    def kinetic_energy(self) -> SymbolicExpression:
        """The kinetic energy, J, with rotors."""
        return self._expression("kinetic_energy")

    def potential_energy(self) -> SymbolicExpression:
        """The potential energy, J."""
        return self._expression("potential_energy")

    # ---- symbols -----------------------------------------------------------------------------------------
    @property
    def names(self) -> tuple[str, ...]:
        """The names of all symbols: q, qd, qdd, then the symbols of the user."""
        return self._equations.names

    @property
    def inputs(self) -> tuple[SX, ...]:
        """The columns ``q``, ``qd``, ``qdd`` and ``symbols``: the inputs of CasADi functions."""
        return self._equations.inputs

    @property
    def q(self) -> SX:
        """The symbols of the coordinates, a column (nq, 1)."""
        return self.inputs[0]

    @property
    def qd(self) -> SX:
        """The symbols of the speeds, a column (n, 1)."""
        return self.inputs[1]

    @property
    def qdd(self) -> SX:
        """The symbols of the accelerations, a column (n, 1)."""
        return self.inputs[2]

    @property
    def symbols(self) -> SX:
        """The symbols of the user, a column (k, 1) in the order of their names."""
        return self.inputs[3]

    def _expression(self, method: str, frame: str | None = None) -> SymbolicExpression:
        if frame is not None:
            self.robot.frame(frame)
        self._equations.flat(method, frame)  # an error of the description occurs here
        return SymbolicExpression(self._equations, method, frame)

    def __repr__(self) -> str:
        user = ", ".join(self._equations.names_of_inputs[3])
        symbols = f", symbols {user}" if user else ""
        return f"<SymbolicArm {self.robot.name}: {self.robot.joint_letters}{symbols}>"


@with_argument_errors
def symbolic_dh(
    rows: Sequence[Row],
    *,
    convention: DhConvention | str = DhConvention.STANDARD,
    name: str = "arm",
    gravity: Sequence[Entry] | None = None,
) -> SymbolicArm:
    """A chain from rows of a D-H table, whose entries are numbers or formulas with symbols.

    - ``rows``: for each joint the keywords of :func:`standard_dh` or :func:`modified_dh` (``alpha``, ``a``,
      ``d``, ``theta``, ``sigma``, ``offset``, ``mass`` …) and ``name``, the name of its coordinate, by
      default q1, q2 …. ``a``, ``d``, ``mass``, ``centre_of_mass`` and ``inertia`` may have strings such as
      ``"l1"`` or ``"-l1/2"``; angles are numbers (rad).
    - ``convention``: ``"standard"`` or ``"modified"``.
    - ``name``: the name of the robot.
    - ``gravity`` (3) m/s²: for example ``(0, "-g", 0)``.
    """
    conventions = {known.value: known for known in DhConvention}
    if isinstance(convention, str):
        if convention not in conventions:
            raise UnknownNameError("D-H convention", convention, conventions, where="symbolic_dh")
        convention = conventions[convention]
    make = standard_dh if convention is DhConvention.STANDARD else modified_dh
    links: list[Link] = []
    symbols: dict[str, Row] = {}
    for number, row in enumerate(rows, start=1):
        entries = dict(row)
        link = str(entries.pop("name", f"q{number}"))
        symbols[link] = {key: entries.pop(key) for key in FIELDS if _has_text(entries.get(key))}
        links.append(make(link, **entries))
    robot = Robot(name=name, links=serial_chain(links))
    return SymbolicArm(robot, symbols, gravity)


def _has_text(value: object) -> bool:
    if isinstance(value, str):
        return True
    return isinstance(value, Sequence) and any(
        isinstance(entry, str) for entry in cast("Sequence[object]", value)
    )
