"""The description of an arm in symbols: names, CasADi symbols, and traced equations."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from casadi import SX, vertcat

from armblocks.errors import InputError, UnknownNameError
from armblocks.matlab.formula import Formula
from armblocks.robot import Robot
from armblocks.robot.link import Link

if TYPE_CHECKING:
    from armblocks.dynamics.symbolic import Formulas, Values

Entry = str | float
"""A number, or the text of a formula with names of symbols."""
Row = Mapping[str, Any]

FIELDS = ("a", "d", "mass", "centre_of_mass", "inertia")
"""The fields of links that may have symbols."""


class SymbolicEquations:
    """The equations of a robot in symbols; each function is traced once.

    ``links`` and ``gravity``: see :meth:`armblocks.SymbolicArm.with_symbols`. Raises InputError.
    """

    def __init__(self, robot: Robot, links: Mapping[str, Row], gravity: Sequence[Entry] | None) -> None:
        self.robot = robot
        self.links = {name: dict(row) for name, row in links.items()}
        self.gravity = None if gravity is None else tuple(gravity)
        self._flat: dict[tuple[str, str | None], SX] = {}
        self._formulas = {text: Formula(text, self._where) for text in self._values.texts()}
        self._check_names()

    def __reduce__(self) -> tuple[type[SymbolicEquations], tuple[object, ...]]:
        """Pickle and copy the description alone."""
        return SymbolicEquations, (self.robot, self.links, self.gravity)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all symbols: q, qd, qdd, then the symbols of the user."""
        return tuple(name for names in self.names_of_inputs for name in names)

    @cached_property
    def names_of_inputs(self) -> tuple[tuple[str, ...], ...]:
        """The names of the entries of q, qd and qdd, and of the symbols of the user."""
        speeds = self.names_of_speeds
        user = sorted({name for formula in self._formulas.values() for name in formula.names}, key=_natural)
        return (
            tuple(entry.name for entry in self.robot.positions),
            tuple(_rate_name(name, 1) for name in speeds),
            tuple(_rate_name(name, 2) for name in speeds),
            tuple(user),
        )

    @cached_property
    def names_of_speeds(self) -> tuple[str, ...]:
        """The names of the entries of qd without the mark of a derivative."""
        return tuple(entry.name for entry in self.robot.speeds)

    @cached_property
    def inputs(self) -> tuple[SX, ...]:
        """The symbols: the columns q, qd, qdd and the symbols of the user."""
        return tuple(
            SX(vertcat(*map(SX.sym, names))) if names else SX(0, 1) for names in self.names_of_inputs
        )

    def shape_of(self, method: str) -> tuple[int, ...]:
        """The shape of the result of a method."""
        from armblocks.dynamics.symbolic import FUNCTIONS

        return FUNCTIONS[method].shape(self.robot)

    def flat(self, method: str, frame: str | None) -> SX:
        """The result of a method as a column, row by row, in the symbols of this arm."""
        from armblocks.dynamics.symbolic import FUNCTIONS, trace_symbolic

        if (method, frame) not in self._flat:
            names = self.names_of_inputs[3]
            traced = trace_symbolic(method, self.robot, self._values, names, self._formula_values, frame)
            arguments = list(self.inputs[: len(FUNCTIONS[method].inputs)])
            arguments += [self.inputs[3]] if names else []
            (self._flat[method, frame],) = traced.casadi_function().call(arguments, True, False)
        return self._flat[method, frame]

    def _formula_values(self, symbols: SX) -> Formulas:
        named = {name: symbols[k] for k, name in enumerate(self.names_of_inputs[3])}

        def value(text: str) -> SX:
            result = self._formulas[text].trace(named)
            if result.numel() != 1:
                raise InputError(
                    f"the formula '{text}' has {result.numel()} values",
                    where=self._where,
                    allowed="formulas of one number",
                    fix="write one formula for each entry",
                )
            return result

        return value

    @property
    def _where(self) -> str:
        return f"symbols of robot '{self.robot.name}'"

    @cached_property
    def _values(self) -> Values:
        from armblocks.dynamics.symbolic import Values

        lengths: dict[tuple[str, str], str] = {}
        masses: dict[str, Entry] = {}
        centres: dict[str, tuple[Entry, ...]] = {}
        inertias: dict[str, tuple[Entry, ...]] = {}
        for name, row in self.links.items():
            link = self.robot.link(name)
            for field, value in row.items():
                where = f"{field} of link '{name}'"
                match field:
                    case "a" | "d":
                        self._check_length(link, field)
                        lengths[name, field] = str(_entry(value, where))
                    case "mass":
                        masses[name] = _entry(value, where)
                    case "centre_of_mass":
                        centres[name] = _entries(value, (3,), where)
                    case "inertia":
                        inertias[name] = (*_entries(value, (3, 6), where), 0.0, 0.0, 0.0)[:6]
                    case _:
                        raise UnknownNameError("field with symbols", field, FIELDS, where=f"link '{name}'")
        gravity = None if self.gravity is None else _entries(self.gravity, (3,), "gravity")
        return Values(lengths=lengths, masses=masses, centres=centres, inertias=inertias, gravity=gravity)

    def _check_length(self, link: Link, field: str) -> None:
        if link.dh is None or (field == "d" and link.dh.sigma == 1):
            what = "has no D-H row" if link.dh is None else "has a prismatic joint, whose d is its coordinate"
            raise InputError(
                f"link '{link.name}' {what}",
                where=f"{field} of link '{link.name}'",
                allowed="a and d of D-H rows, d of revolute joints only",
                fix="describe the robot with symbolic_dh, or omit this symbol",
            )

    def _check_names(self) -> None:
        names = self.names
        twice = next((name for k, name in enumerate(names) if name in names[:k]), None)
        if twice is not None:
            raise InputError(
                f"two symbols have the name '{twice}'",
                where=self._where,
                allowed="names that no joint, joint speed or acceleration has: " + ", ".join(names[:12]),
                fix="rename the symbol of the user",
            )


def _entry(value: object, where: str) -> Entry:
    if isinstance(value, str):
        return value
    try:
        return float(cast("float", value))
    except (TypeError, ValueError):
        raise InputError(
            f"{value!r} is neither a number nor a string",
            where=where,
            allowed="a number, or a formula such as 'l1' or '-l1/2'",
            fix="write the name of the symbol in quotes",
        ) from None


def _entries(value: object, counts: Sequence[int], where: str) -> tuple[Entry, ...]:
    entries = (
        [value]
        if isinstance(value, str)
        else list(cast("Sequence[object]", value))
        if np.iterable(value)
        else [value]
    )
    if len(entries) not in counts:
        allowed = " or ".join(map(str, counts))
        raise InputError(
            f"{len(entries)} values are given",
            where=where,
            allowed=f"{allowed} numbers or formulas",
            fix=f"give {allowed} values",
        )
    return tuple(_entry(entry, where) for entry in entries)


def _rate_name(name: str, derivatives: int) -> str:
    """The name of a speed or acceleration: qd1 for q1, name_d for other names."""
    match = re.fullmatch(r"q(\d*)", name)
    return f"q{'d' * derivatives}{match[1]}" if match else f"{name}_{'d' * derivatives}"


def _natural(name: str) -> tuple[str, float, str]:
    """Sorting key: l2 before l10."""
    match = re.fullmatch(r"(.*?)(\d+)", name)
    return (match[1], float(match[2]), name) if match else (name, -1.0, name)
