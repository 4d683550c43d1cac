"""Parameters of a whole diagram, its *mask*, and formulas over them in the places of its blocks' values.

A diagram declares parameters as a block does: name, default, unit, meaning, bounds. Inside it, a block's
parameter may be a formula over these names, ``2*pi*f`` or ``[1 2; 3 4]*gain``. Nothing else is in scope: not
the parameters of diagrams further out, and no signal. Of a subsystem the mask is what one sees from outside:
its parameters are the block's own, ``servo.stiffness``, and may themselves be formulas over the names of the
diagram around it.

The blocks of a diagram always have the values that their formulas give: the text is kept beside the value. So
all that looks at blocks finds numbers, and a diagram with masks is the same, to the last bit, as one in which
somebody has put in the numbers.
"""

from __future__ import annotations

import dataclasses
import keyword
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, cast

import numpy as np
from casadi import SX, evalf

from armblocks.diagram.expression_language import Formula
from armblocks.diagram.formula_functions import CONSTANTS, FUNCTIONS, MAKERS, MATRIX_FUNCTIONS
from armblocks.diagram.parameter import Parameter, ParameterKind, Value, kind_of
from armblocks.errors import InputError, UnknownNameError

Scope = Mapping[str, Value]
"""What the names in a formula are: the values of a mask."""

_NUMBERS = (ParameterKind.NUMBER, ParameterKind.ARRAY, ParameterKind.INTEGER, ParameterKind.BOOLEAN)
_KINDS = (*_NUMBERS, ParameterKind.CHOICE, ParameterKind.STRING, ParameterKind.ROBOT)
_RESERVED = frozenset((*CONSTANTS, *FUNCTIONS, *MATRIX_FUNCTIONS, *MAKERS))
LONGEST = 100_000
"""Characters of a formula that stands for a value: it may be a table."""


@dataclass(frozen=True)
class ParameterFormula:
    """A formula in the place of a parameter's value; :func:`formula` makes one."""

    text: str

    def __str__(self) -> str:
        return self.text


def formula(text: str) -> Any:
    """A formula over the mask's parameters in the place of a block's value: ``Gain(gain=formula("2*k"))``.

    It may use the names of the parameters that the diagram around the block declares, ``pi``, ``e``,
    ``deg``, arrays ``[1 2; 3 4]``, and the functions of :mod:`armblocks.diagram.formula_functions`. Raises
    ``InputError`` where the text is no formula.
    """
    _parsed(text, "")
    return ParameterFormula(text)


def mask_parameter(name: str, default: Any, *, doc: str = "", unit: str = "", **rules: Any) -> Parameter:
    """A parameter that a diagram declares, with the rules of :func:`armblocks.diagram.parameter`.

    ``kind`` is told by the default; for a robot it is ``"robot"``.

    Raises ``InputError`` for a name that is no name in formulas, for a kind that no mask has, and for a
    default that breaks its own rules.
    """
    given = rules.pop("kind", None)
    kind = kind_of(default, rules) if given is None else ParameterKind(given)
    rule = Parameter(name=name, kind=kind, doc=doc, default=default, unit=unit, tunable=False, **rules)
    return checked_mask((rule,), "mask")[0]


def checked_mask(mask: Sequence[Parameter], where: str) -> tuple[Parameter, ...]:
    """The parameters of a mask, their defaults in canonical form; raises ``InputError``."""
    found: list[Parameter] = []
    for rule in mask:
        name = rule.name
        if not name.isidentifier() or keyword.iskeyword(name) or name in _RESERVED:
            raise InputError(
                f"'{name}' cannot be the name of a mask parameter",
                where=where,
                allowed="names made of letters, digits and _ that mean nothing else in formulas",
                fix="choose another name",
            )
        if any(name == other.name for other in found):
            raise InputError(
                f"the mask parameter '{name}' is declared twice",
                where=where,
                allowed="every name once",
                fix="remove one of the two",
            )
        if rule.kind not in _KINDS or rule.required:
            raise InputError(
                f"the mask parameter '{name}' is of kind {rule.kind.value}"
                + (" and has no default" if rule.required else ""),
                where=where,
                allowed="a default, and one of the kinds " + ", ".join(kind.value for kind in _KINDS),
                fix="give it a default of another kind",
            )
        place = f"{where}, mask parameter '{name}'"
        # Whether a value may change during a run follows from what depends on it: see the module mask_tuning.
        lists = {"choices": tuple(rule.choices), "dimensions": tuple(rule.dimensions)}
        default = rule.check(rule.default, place)
        found.append(dataclasses.replace(rule, tunable=False, default=default, **lists))
    return tuple(found)


def formula_names(text: str, where: str = "") -> frozenset[str]:
    """The parameters that a formula reads. Raises ``InputError`` where the text is no formula."""
    return _parsed(text, where).names


def formula_number(text: str, where: str) -> float | list[Any]:
    """The number, vector or matrix that a formula without parameters gives; a row or a column is a vector.

    Raises ``UnknownNameError`` for a name that is no constant, ``InputError`` where the text is no formula.
    """
    return _evaluated(text, (), where)


def formula_value(rule: Parameter, text: str, scope: Scope, where: str) -> Value:
    """The checked value of a parameter whose formula is ``text``.

    A formula that is the name of a parameter gives its value, of whatever kind; others give numbers. Raises
    ``UnknownNameError`` for a name that is not in scope and ``InputError`` for the rest.
    """
    place = f"{where}, parameter '{rule.name}'"
    found = _parsed(text, place)
    for name in sorted(found.names):
        if name not in scope:
            raise UnknownNameError("mask parameter", name, scope, where=place)
    bare = text.strip()
    if bare in scope:
        return rule.check(scope[bare], place)
    if rule.kind not in _NUMBERS:
        raise InputError(
            f"the formula '{text[:60]}' gives numbers",
            where=place,
            allowed="the name of a mask parameter, as the value is " + rule.describe(),
            fix="name a mask parameter that has such a value",
        )
    used = tuple((name, scope[name]) for name in sorted(found.names))
    return rule.check(_of_kind(rule.kind, _evaluated(text, used, place)), place)


def formula_symbols(text: str, names: Mapping[str, SX]) -> SX:
    """What a formula is for symbols: numbers, vectors as columns, matrices."""
    return _parsed(text, "").trace(names)


def as_symbols(value: Value) -> SX | None:
    """A value as constant symbols; ``None`` for one that is no number."""
    if isinstance(value, int | float | tuple):
        array = np.asarray(value, dtype=np.float64)
        return SX(array.reshape(-1, 1) if array.ndim < 2 else array)
    return None


@lru_cache(maxsize=1024)
def _parsed(text: str, where: str) -> Formula:
    return Formula(text, where, longest=LONGEST)


@lru_cache(maxsize=4096)
def _evaluated(text: str, used: tuple[tuple[str, Value], ...], where: str) -> float | list[Any]:
    names: dict[str, SX] = {}
    for name, value in used:
        symbols = as_symbols(value)
        if symbols is None:
            raise InputError(
                f"the mask parameter '{name}' is {type(value).__name__}, which is no number",
                where=where,
                allowed="numbers in formulas; such a value alone, as the whole formula",
                fix=f"write {name} alone",
            )
        names[name] = symbols
    array = evalf(_parsed(text, where).trace(names)).full()
    if array.size == 1:
        return float(array[0, 0])
    return array.reshape(-1).tolist() if 1 in array.shape else array.tolist()


def _of_kind(kind: ParameterKind, value: float | list[Any]) -> float | list[Any]:
    """Whole numbers and truth values are numbers in formulas."""
    if not isinstance(value, float):
        return value
    if kind is ParameterKind.INTEGER and value.is_integer():
        return int(value)
    if kind is ParameterKind.BOOLEAN and value in (0.0, 1.0):
        return bool(value)
    return value


def values_of(mask: Sequence[Parameter], given: Mapping[str, object], where: str) -> dict[str, Value]:
    """The checked value of every parameter of a mask: what is given, else its default.

    Raises ``UnknownNameError`` for a name that the mask has not, ``InputError`` for a value.
    """
    known = [rule.name for rule in mask]
    for name in given:
        if name not in known:
            raise UnknownNameError("mask parameter", name, known, where=where)
    return {
        rule.name: rule.check(given.get(rule.name, cast("object", rule.default)), f"{where}.{rule.name}")
        for rule in mask
    }
