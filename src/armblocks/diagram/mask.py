"""Parameters of a diagram, its *mask*, and formulas of them as parameter values of its blocks.

A diagram declares parameters as a block does: name, default, unit, meaning, bounds. Inside it, a block's
parameter may be a formula over these names, ``2*pi*f`` or ``[1 2; 3 4]*gain``. Only these
names are in scope: neither parameters of outer diagrams nor signals. In the enclosing diagram, the mask
parameters are parameters of the subsystem block, ``servo.stiffness``. Their values may be formulas of the
parameters of the enclosing diagram.

A diagram evaluates the formulas of its blocks and stores the values beside the texts. All other code reads
the values only. A diagram with masks therefore gives exactly the same results as a diagram with numbers.
"""

from __future__ import annotations

import dataclasses
import keyword
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, cast

import numpy as np
from casadi import SX, evalf

from armblocks.diagram.parameter import Parameter, ParameterKind, Value, kind_of
from armblocks.errors import InputError, UnknownNameError
from armblocks.matlab.formula import Formula
from armblocks.matlab.functions import RESERVED, TABLE

Scope = Mapping[str, Value]
"""The scope of a formula: the values of a mask by name."""

_NUMBERS = (ParameterKind.NUMBER, ParameterKind.ARRAY, ParameterKind.INTEGER, ParameterKind.BOOLEAN)
_KINDS = (*_NUMBERS, ParameterKind.CHOICE, ParameterKind.STRING, ParameterKind.ROBOT)
MAX_FORMULA_LENGTH = 100_000
"""Maximum number of characters of a formula as a parameter value, which may be a table."""


@dataclass(frozen=True)
class ParameterFormula:
    """A formula as a parameter value; :func:`formula` creates one."""

    text: str

    def __str__(self) -> str:
        return self.text


def formula(text: str) -> Any:
    """A formula of mask parameters as the value of a block parameter: ``Gain(gain=formula("2*k"))``.

    It may use the parameters that the enclosing diagram declares, ``pi``, ``e``, ``deg``, arrays ``[1 2; 3
    4]``, and the functions of :mod:`armblocks.matlab.functions`. Raises ``InputError`` where the
    text is not a formula.
    """
    _parsed(text, "")
    return ParameterFormula(text)


def mask_parameter(name: str, default: Any, *, doc: str = "", unit: str = "", **rules: Any) -> Parameter:
    """A parameter that a diagram declares, with the rules of :func:`armblocks.diagram.parameter`.

    ``kind`` follows from the default; for a robot it is ``"robot"``.

    Raises ``InputError`` for a name that is not valid in formulas, for an unsupported kind, and for a default
    that violates the rules.
    """
    stated_kind = rules.pop("kind", None)
    kind = kind_of(default, rules) if stated_kind is None else ParameterKind(stated_kind)
    rule = Parameter(name=name, kind=kind, doc=doc, default=default, unit=unit, tunable=False, **rules)
    return checked_mask((rule,), "mask")[0]


def checked_mask(mask: Sequence[Parameter], where: str) -> tuple[Parameter, ...]:
    """The parameters of a mask, their defaults in canonical form; raises ``InputError``."""
    parameters: list[Parameter] = []
    for rule in mask:
        name = rule.name
        if not name.isidentifier() or keyword.iskeyword(name) or name in RESERVED:
            raise InputError(
                f"'{name}' cannot be the name of a mask parameter",
                where=where,
                allowed="names of letters, digits and _ that have no other meaning in formulas",
                fix="choose another name",
            )
        if any(name == other.name for other in parameters):
            raise InputError(
                f"the mask parameter '{name}' is declared twice",
                where=where,
                allowed="unique names",
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
        location = f"{where}, mask parameter '{name}'"
        # Whether a value is tunable follows from the parameters that depend on it: see mask_tuning.
        lists = {"choices": tuple(rule.choices), "dimensions": tuple(rule.dimensions)}
        default = rule.check(rule.default, location)
        parameters.append(dataclasses.replace(rule, tunable=False, default=default, **lists))
    return tuple(parameters)


def formula_names(text: str, where: str = "") -> frozenset[str]:
    """The parameters that a formula needs. Raises ``InputError`` where the text is not a formula."""
    return _parsed(text, where).names


def parameters_read(text: str, known: Iterable[str], where: str = "") -> frozenset[str]:
    """The known parameters that a formula reads, including parameters that hide a function of the same name.

    Raises ``InputError`` where the text is not a formula.
    """
    return _parsed(text, where).readable_names.intersection(known)


def formula_number(text: str, where: str) -> float | list[Any]:
    """The value of a formula without parameters: a number, vector or matrix; a row or a column is a vector.

    Raises ``UnknownNameError`` for a name that is not a constant, ``InputError`` where the text is not a
    formula.
    """
    return _evaluated(text, (), where)


def formula_value(rule: Parameter, text: str, scope: Scope, where: str) -> Value:
    """The checked value of a parameter whose formula is ``text``.

    A formula that consists of a parameter name gives its value of any kind; other formulas give numbers.
    Raises ``UnknownNameError`` for a name that is not in scope and ``InputError`` for other errors.
    """
    location = f"{where}, parameter '{rule.name}'"
    parsed = _parsed(text, location)
    for name in sorted(parsed.names):
        if name in scope:
            continue
        if name in parsed.unknown_functions:
            raise UnknownNameError("function or mask parameter", name, {*scope, *TABLE}, where=location)
        raise UnknownNameError("mask parameter", name, scope, where=location)
    stripped = text.strip()
    if stripped in scope:
        return rule.check(scope[stripped], location)
    if rule.kind not in _NUMBERS:
        raise InputError(
            f"the formula '{text[:60]}' gives numbers",
            where=location,
            allowed="the name of a mask parameter, as the value is " + rule.describe(),
            fix="use the name of a mask parameter of this kind",
        )
    used = tuple((name, scope[name]) for name in sorted(parameters_read(text, scope, location)))
    return rule.check(_converted(rule.kind, _evaluated(text, used, location)), location)


def formula_symbols(text: str, names: Mapping[str, SX]) -> SX:
    """A formula evaluated for symbols: numbers, vectors as columns, matrices."""
    return _parsed(text, "").trace(names)


def as_symbols(value: Value) -> SX | None:
    """A value as a constant expression; ``None`` if it is not a number."""
    if isinstance(value, int | float | tuple):
        array = np.asarray(value, dtype=np.float64)
        return SX(array.reshape(-1, 1) if array.ndim < 2 else array)
    return None


@lru_cache(maxsize=1024)
def _parsed(text: str, where: str) -> Formula:
    return Formula(text, where, max_length=MAX_FORMULA_LENGTH)


@lru_cache(maxsize=4096)
def _evaluated(text: str, used: tuple[tuple[str, Value], ...], where: str) -> float | list[Any]:
    names: dict[str, SX] = {}
    for name, value in used:
        symbols = as_symbols(value)
        if symbols is None:
            raise InputError(
                f"the mask parameter '{name}' is {type(value).__name__}, which is not a number",
                where=where,
                allowed="numbers in formulas; for other values the name alone as the whole formula",
                fix=f"write {name} alone",
            )
        names[name] = symbols
    array = evalf(_parsed(text, where).trace(names)).full()
    if array.size == 1:
        return float(array[0, 0])
    return array.reshape(-1).tolist() if 1 in array.shape else array.tolist()


def _converted(kind: ParameterKind, value: float | list[Any]) -> float | list[Any]:
    """The value as an integer or boolean where the kind requires it; formulas compute with floats."""
    if not isinstance(value, float):
        return value
    if kind is ParameterKind.INTEGER and value.is_integer():
        return int(value)
    if kind is ParameterKind.BOOLEAN and value in (0.0, 1.0):
        return bool(value)
    return value


def values_of(mask: Sequence[Parameter], values: Mapping[str, object], where: str) -> dict[str, Value]:
    """The checked value of every parameter of a mask: the given value, else the default.

    Raises ``UnknownNameError`` for a name that is not in the mask, ``InputError`` for an invalid value.
    """
    parameter_names = [rule.name for rule in mask]
    for name in values:
        if name not in parameter_names:
            raise UnknownNameError("mask parameter", name, parameter_names, where=where)
    return {
        rule.name: rule.check(values.get(rule.name, cast("object", rule.default)), f"{where}.{rule.name}")
        for rule in mask
    }
